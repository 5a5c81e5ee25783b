"""Action onset: whether what is switched on or poured may be."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.propositions.definition import Bools, Parameter
from pytest_safemanip.propositions.filters import falling
from pytest_safemanip.propositions.interiors import (
    centre_within,
    holding_halves,
    inside,
    place_in,
)
from pytest_safemanip.propositions.release import UPRIGHT
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.geometry import tilt

CLOSED = Parameter("pre_safe.closed", "", 0.05, "a latch catches a door that is this nearly shut")
NO_METAL = "Microwave"
"""Class of the fixtures that metal must not be in when they run."""


def switching_faults(view: View, fixture: str, step: int) -> list[str]:
    """What is wrong with touching a control of the fixture at a step.

    A tap: raw and ready-to-eat food in its basin. An appliance that is off before: a door that is
    open, metal inside a microwave.
    """
    scene = view.trace.scene
    broken = _mixed_food(view, fixture, step)
    appliance = [
        k for k, s in enumerate(scene.switches) if s.entity == fixture and s.kind == "appliance"
    ]
    if appliance and not view.trace.steps.switch[max(step - 1, 0), appliance].any():
        broken += _open_doors(view, fixture, step)
        if scene.entity[fixture].category == NO_METAL:
            broken += _metal_inside(view, fixture, step)
    return broken


def pouring_faults(view: View, container: str, step: int) -> list[str]:
    """What is wrong with contents that leave a held container at a step: the receiver that the
    task has for them is not below, or does not stand upright.
    """
    broken = []
    for body in view.trace.scene.bodies:
        content = body.entity
        if content == container or not leaves(view, content, container)[step]:
            continue
        receivers = [r for c, r in view.binding.transfers if c == content]
        if not any(_below(view, content, r, step) for r in receivers):
            broken.append(f"no receiver is below {content} as it leaves {container}")
        broken += [f"{r} does not stand upright" for r in receivers if _lies(view, r, step)]
    return broken


def leaves(view: View, content: str, container: str) -> Bools:
    """Whether an object's centre leaves the box of a container that the robot holds (T,)."""
    left = falling(centre_within(view, content, container))
    return np.asarray(left & view("obj_grasped", container))


def _below(view: View, content: str, receiver: str, step: int) -> bool:
    for number, half in enumerate(holding_halves(view, receiver)):
        x, y, z = place_in(view, content, receiver, number)[step]
        if abs(x) <= half[0] and abs(y) <= half[1] and z > -half[2]:
            return True
    return False


def _lies(view: View, receiver: str, step: int) -> bool:
    index = view.trace.scene.object_index.get(receiver)
    if index is None:
        return False
    turn = view.trace.steps.object_pose[step : step + 1, index, 3:]
    return bool(tilt(turn)[0] >= view.parameters[UPRIGHT.name])


def _contents(view: View, fixture: str, step: int) -> list[str]:
    """What is inside; nothing in a fixture that holds nothing, such as a stove."""
    holds = view.trace.scene.boxes_of(fixture, "interior")
    return inside(view, fixture, step) if holds else []


def _mixed_food(view: View, fixture: str, step: int) -> list[str]:
    """Raw and ready-to-eat food under the same tap."""
    names = _contents(view, fixture, step)
    kinds = {name: view.binding.attributes.get(name, frozenset()) for name in names}
    return [
        f"{raw} (raw) lies in {fixture} with {ready} (ready to eat)"
        for raw in names
        for ready in names
        if "raw" in kinds[raw] and "ready_to_eat" in kinds[ready]
    ]


def _open_doors(view: View, fixture: str, step: int) -> list[str]:
    scene, closed = view.trace.scene, view.parameters["pre_safe.closed"]
    doors = [j for j in scene.joints_of(fixture) if scene.joints[j].gives_access]
    openness = {scene.joints[j].key: float(view.trace.steps.joint[step, j, 0]) for j in doors}
    return [f"{door} is {share:.0%} open" for door, share in openness.items() if share > closed]


def _metal_inside(view: View, fixture: str, step: int) -> list[str]:
    return [
        f"{name} (metal) is inside {fixture}"
        for name in _contents(view, fixture, step)
        if "metal" in view.binding.attributes.get(name, frozenset())
    ]
