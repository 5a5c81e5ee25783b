"""States of switches: taps, burners, appliances."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pytest_safemanip.sim.mujoco import extents
from pytest_safemanip.sim.mujoco.describing import local_name
from pytest_safemanip.sim.mujoco.description import Read
from pytest_safemanip.trace.elements import Box, Switch

_POURED = (0.04, 0.04, 0.0)
"""Half extents of the place on which RoboCasa wants a cup, m."""
_HEATED = (0.08, 0.08, 0.1)
"""Half extents of what a burner heats, m: RoboCasa counts a pan within 8 cm as on it."""

_OVEN, _TIMER, _SPEED = "temperature", "time", "knob_speed"
"""RoboCasa's names of the knobs that switch ovens, toaster ovens and stand mixers on."""
_SET = 0.1
"""From this share of its range on a knob is set, as RoboCasa's tasks have it of the toaster oven's
timer."""
_BURNER_OFF = 0.35
"""Knob angle from 0 or a full turn within which a burner is off, rad (``Stove.is_burner_on``)."""


def switches(model: Any, env: Any) -> tuple[list[Switch], list[Read]]:
    """The switches of a kitchen, and functions that read those of one fixture at a time.

    RoboCasa's own state is read, which it updates in every control step; it is never updated here,
    since its timers and latches count how often that happens.
    """
    from robocasa.models.fixtures import Oven, Sink, StandMixer, Stove, ToasterOven

    turned = {Oven: _OVEN, ToasterOven: _TIMER, StandMixer: _SPEED}
    found: list[Switch] = []
    readers: list[Read] = []
    for name, fixture in env.fixtures.items():
        if isinstance(fixture, Sink) and fixture.handle_joint is not None:
            found.append(Switch(name, "water", "water"))
            readers.append(_tap(env, fixture))
        elif isinstance(fixture, Stove):
            burners = tuple(fixture.get_knobs_state(env))
            found += [Switch(name, b, "burner", _knob(model, fixture, b)) for b in burners]
            readers.append(_burners(env, fixture))
        elif hasattr(fixture, "_turned_on"):
            found.append(Switch(name, "power", "appliance"))
            readers.append(_power(fixture))
        elif knob := turned.get(type(fixture)):
            joint = fixture._joint_names[knob]
            if joint in env.sim.model.joint_names:  # not every model has all knobs
                key = _joint_key(model, fixture, joint)
                found.append(Switch(name, "power", "appliance", key))
                readers.append(_dial(env, fixture, joint))
    return found, readers


def reached(model: Any, env: Any) -> list[tuple[Box, int]]:
    """The space that each tap's water falls through, which turns with the spout, the space that
    each burner heats, and the place that each coffee machine pours onto, with their sites.
    """
    from robocasa.models.fixtures import CoffeeMachine, Sink, Stove

    found = []
    for name, fixture in env.fixtures.items():
        if isinstance(fixture, Sink) and fixture.water_site is not None:
            site = model.site(fixture.water_site.get("name")).id
            radius, half = float(fixture.high_water_radius), float(model.site_size[site][1])
            box = Box(name, "water", "water", extents.vector((radius, radius, half)))
            found.append((box, site))
        elif isinstance(fixture, Stove):
            for burner in fixture.get_knobs_state(env):
                box = Box(name, burner, "burner", extents.vector(_HEATED))
                found.append((box, model.site(f"{fixture.naming_prefix}burner_on_{burner}").id))
        elif isinstance(fixture, CoffeeMachine):
            site = model.site(f"{fixture.naming_prefix}receptacle_place_site").id
            found.append((Box(name, "poured", "poured", _POURED), site))
    return found


def _knob(model: Any, stove: Any, burner: str) -> str:
    return _joint_key(model, stove, f"{stove.naming_prefix}knob_{burner}_joint")


def _joint_key(model: Any, fixture: Any, joint: str) -> str:
    return f"{fixture.name}/{local_name(model, model.joint(joint).id, fixture.name)}"


def _dial(env: Any, appliance: Any, joint: str) -> Read:
    """What is switched by a knob with a scale."""
    return lambda: (bool(appliance.get_joint_state(env, [joint])[joint] >= _SET),)


def _tap(env: Any, sink: Any) -> Read:
    return lambda: (bool(sink.get_handle_state(env)["water_on"]),)


def _burners(env: Any, stove: Any) -> Read:
    def read() -> Sequence[bool]:
        angles = stove.get_knobs_state(env).values()
        return [_BURNER_OFF <= angle <= 2 * np.pi - _BURNER_OFF for angle in angles]

    return read


def _power(appliance: Any) -> Read:
    """A toaster has one state per pair of slots; it is on if any of them is."""

    def read() -> Sequence[bool]:
        state = appliance._turned_on
        return (any(state.values()) if isinstance(state, dict) else bool(state),)

    return read
