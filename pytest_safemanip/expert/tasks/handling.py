"""Grasping and placing, as plans name them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType

import numpy as np

from pytest_safemanip.expert.motions import spots
from pytest_safemanip.expert.motions.attitudes import handle_first, laid
from pytest_safemanip.expert.motions.gripping import grasp
from pytest_safemanip.expert.motions.handholds import HOLLOW, handle_way
from pytest_safemanip.expert.motions.placing import SOFTLY, Spot, place
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.tasks.calls import Call
from pytest_safemanip.expert.world.things import Furniture, Thing

TOWARDS = 0.7
"""A handle that stands out so far towards the robot is on its side, as a cosine."""
Find = Callable[..., Sequence[Spot]]


def on(arm: Arm, role: str, target_role: str, *others: str) -> list[Spot]:
    """On another object or in it, on a burner, on what a machine pours onto, or on a counter."""
    thing, scene = Thing(arm, role), arm.scene
    entity = scene.roles[target_role]
    if entity in scene.object_index:
        target = Thing(arm, target_role)
        found = spots.on_thing(arm, target)
        if target.height > HOLLOW:
            found = spots.into_thing(arm, thing, target) + found
    elif scene.boxes_of(entity, "burner"):
        found = spots.on_burner(arm, thing, Furniture(arm, target_role))
    elif scene.boxes_of(entity, "poured"):
        found = spots.on_tray(arm, Furniture(arm, target_role))
    else:
        near = Thing(arm, others[0]) if others else None
        return spots.on_counter(arm, thing, Furniture(arm, target_role), near)
    return spots.beside(found, Thing(arm, others[0])) if others else found


def inside(arm: Arm, role: str, fixture_role: str, *others: str) -> list[Spot]:
    """In a fixture."""
    onto = [
        Thing(arm, call.roles[0])
        for call in arm.upcoming
        if call.skill == "place on" and call.roles[1] == role
    ]
    found = spots.inside(arm, Thing(arm, role), Furniture(arm, fixture_role), onto=onto)
    return spots.beside(found, Thing(arm, others[0])) if others else found


def into(arm: Arm, role: str, vessel_role: str) -> list[Spot]:
    """Into a vessel."""
    return spots.into_thing(arm, Thing(arm, role), Thing(arm, vessel_role))


def under_tap(arm: Arm, role: str, sink_role: str) -> list[Spot]:
    """Where the water of a tap falls."""
    return spots.under_tap(arm, Thing(arm, role), Furniture(arm, sink_role))


def on_part(end: str, arm: Arm, role: str, target_role: str) -> list[Spot]:
    """On an end or a half of another object."""
    return spots.on_thing(arm, Thing(arm, target_role), end)


def on_rack(number: int, arm: Arm, role: str, fixture_role: str) -> list[Spot]:
    """On one of a fixture's shelves, 0 for the lowest, -1 for the uppermost."""
    return spots.inside(arm, Thing(arm, role), Furniture(arm, fixture_role), (number,))


GOALS: Mapping[str, Find] = MappingProxyType(
    {
        "place on": on,
        "place on beside": on,
        "place in": inside,
        "place in beside": inside,
        "place into": into,
        "place on end of": partial(on_part, "end"),
        "place on near-half of": partial(on_part, "near"),
        "place on far-half of": partial(on_part, "far"),
        "place on top-rack of": partial(on_rack, -1),
        "place on second-rack of": partial(on_rack, -2),
        "place under tap of": under_tap,
    }
)
"""Finds the spots of each skill that places something."""


def placing(name: str) -> Callable[..., Motion]:
    """The skill of a name that places something."""
    find = GOALS[name]

    def skill(arm: Arm, role: str, target_role: str) -> Motion:
        return place(arm, role, lambda: find(arm, role, target_role))

    def beside(arm: Arm, role: str, target_role: str, other_role: str) -> Motion:
        return place(arm, role, lambda: find(arm, role, target_role, other_role))

    return beside if name.endswith("beside") else skill


def place_alike(
    arm: Arm, role: str, target_role: str, other_role: str, another_role: str
) -> Motion:
    """Put a held object down beside one of its kind of two others, or beside the second."""
    roles = arm.scene.roles
    kinds = {role: arm.scene.entity[entity].category for role, entity in roles.items()}
    there = [other for other in (other_role, another_role) if other in roles]
    beside = next((other for other in there if kinds[other] == kinds[role]), there[-1])
    yield from place(arm, role, lambda: on(arm, role, target_role, beside))


def lay(arm: Arm, role: str, target_role: str) -> Motion:
    """Lay a held slice flat onto another object: tip it over, away from the robot, and let go."""
    return place(arm, role, lambda: on(arm, role, target_role), laid, SOFTLY)


def turn_by_handle(arm: Arm, role: str) -> Motion:
    """Turn a vessel on the spot until its handle is towards the robot, if it is not."""
    thing = Thing(arm, role)
    way = handle_way(thing)
    if way is not None and -arm.ahead(way) > TOWARDS:
        return
    here = np.append(thing.middle[:2], thing.bottom)
    near = spots.around(arm, here)
    yield from grasp(arm, role, "handle", back=False)
    yield from place(arm, role, lambda: near, handle_first)


def goal_after(arm: Arm, role: str, calls: Sequence[Call]) -> Callable[[], Sequence[Spot]] | None:
    """Finds where an object is to be put by the first of some calls that does it."""
    for call in calls:
        if call.skill in GOALS and call.roles[0] == role:
            return lambda: GOALS[call.skill](arm, *call.roles)
    return None


def grasping(part: str = "") -> Callable[..., Motion]:
    """The skill that grasps something by a part of it."""

    def skill(arm: Arm, role: str) -> Motion:
        return grasp(arm, role, part, goal_after(arm, role, arm.upcoming))

    return skill
