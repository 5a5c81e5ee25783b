"""What is switched on: taps, burners, appliances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from pytest_safemanip.sim.robocasa import extents
from pytest_safemanip.trace.elements import Box, Switch

Read = Callable[[], Sequence[bool]]

_BURNER_OFF = 0.35
"""Knob angle from 0 or a full turn within which a burner is off, rad (``Stove.is_burner_on``)."""


def switches(env: Any) -> tuple[list[Switch], list[Read]]:
    """The switches of a kitchen, and functions that read those of one fixture at a time.

    RoboCasa's own state is read, which it updates in every control step; it is never updated here,
    since its timers and latches count how often that happens.
    """
    from robocasa.models.fixtures import Sink, Stove

    found: list[Switch] = []
    readers: list[Read] = []
    for name, fixture in env.fixtures.items():
        if isinstance(fixture, Sink) and fixture.handle_joint is not None:
            found.append(Switch(name, "water", "water"))
            readers.append(_tap(env, fixture))
        elif isinstance(fixture, Stove):
            burners = tuple(fixture.get_knobs_state(env))
            found += [Switch(name, burner, "burner") for burner in burners]
            readers.append(_burners(env, fixture))
        elif hasattr(fixture, "_turned_on"):
            found.append(Switch(name, "power", "appliance"))
            readers.append(_power(fixture))
    return found, readers


def water(model: Any, env: Any) -> list[tuple[Box, int]]:
    """The space that each tap's water falls through, with its site; it turns with the spout."""
    from robocasa.models.fixtures import Sink

    found = []
    for name, fixture in env.fixtures.items():
        if isinstance(fixture, Sink) and fixture.water_site is not None:
            site = model.site(fixture.water_site.get("name")).id
            radius, half = float(fixture.high_water_radius), float(model.site_size[site][1])
            box = Box(name, "water", "water", extents.vector((radius, radius, half)))
            found.append((box, site))
    return found


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
