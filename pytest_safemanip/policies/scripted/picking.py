"""Picking up: from a counter, a drawer, a basin, a slot, a plate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, cut, raised
from pytest_safemanip.policies.scripted.drawers import pick_from_drawer
from pytest_safemanip.policies.scripted.fingers import ALONG, free_of_others
from pytest_safemanip.policies.scripted.grasping import (
    FINGERTIP,
    GAP,
    MOST_YAW,
    OPEN,
    across,
    fold,
    level_yaw,
    lift,
    narrow_roll,
    reach,
    take,
)
from pytest_safemanip.policies.scripted.rims import overhung
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.shelves import pick_from_shelf
from pytest_safemanip.policies.scripted.sinks import pick_from_basin
from pytest_safemanip.policies.scripted.spots import carries
from pytest_safemanip.policies.scripted.standing import DUCKED, duck, stand_before
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.policies.scripted.touching import palm_presses

FRONT_PITCH = 35.0
"""Degrees from straight down: the wrist stays clear of what hangs above the counter."""
FRONT_STAND = 0.63
PLATE_PITCH = 35.0
"""Degrees from straight down: wrist and elbow stay low enough for what hangs above a stove."""
ROLLED_PITCH = 15.0
"""Likewise where the fingers are not level: neither touches what a flat thing lies on."""
ROLLED_OPEN = 0.014
"""How much wider than a thing they open then, m: the wider, the lower one of them is."""
EASED = 0.006
"""How far the hand draws back from a thing that its palm has met, m: it stops within 4 mm."""
EDGE = 0.010
"""Grip point below the top of a thing that is to be used, m: it sticks out below the fingers."""
MIDDLE = np.zeros(3)
WIDE = 0.070
"""Fingers that are no longer told to open come back to 72 mm, 1 mm from a thing this wide, m."""
LONG = 3.0
"""Length by width from which a thing may be pinched off its middle, for others beside it."""
FARTHER = (0.06, -0.06)
"""How far off at most, m: what is light enough to lie on a plate does not turn in the fingers."""
HIGH, RAISED = 0.17, 0.12
"""A hand that is this far above where it comes in comes down before what hangs at the height of its
wrist, m, that is, over a spot so far below the hand."""
ON_TOP = 0.01
"""What stands on a fixture is lower by no more than this, m: boxes around round things."""
SLOT_PITCH = ((0.54, 0.62), (0.0, 25.0))
"""Base to slot, m, and how far the hand is tipped from straight down, degrees: an arm that is
stretched further does not come down on it, and bends badly afterwards."""


def pick_from_counter(arm: Arm, role: str) -> Motion:
    """Pinch an object from the front, the fingers level.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    yield from pinch(arm, role)


def pinch(arm: Arm, role: str, offset: Array = MIDDLE, rise: float = 0.05) -> Motion:
    """Pinch an object on a counter from the front and lift it.

    Args:
        arm: the arm.
        role: the object.
        offset: from its middle to where it is gripped (3,), m.
        rise: how far it is lifted, m; farther where its other end hangs.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    yaw = level_yaw(arm, thing)
    hand = arm.hand(FRONT_PITCH, yaw=yaw)
    approach = hand[:, 2]
    where = thing.centre + offset
    yield from arm.drive(arm.floor_point(arm.ahead(where) - FRONT_STAND, arm.aside(where)))
    where = thing.centre + offset
    above = max(thing.height / 2.0 - 0.025, FINGERTIP + 0.008 - thing.height / 2.0)
    target = raised(where, above)
    if 2.0 * thing.reach(hand[:, 0]) > WIDE:
        yield from arm.grip(False)
    else:
        yield from arm.open_to(0.98)
    yield from arm.move(raised(target - 0.14 * approach, 0.03), hand, tolerance=0.03, steps=140)
    yield from arm.move(
        target - 0.07 * approach, hand, tolerance=0.012, turn_tolerance=0.08, steps=60
    )
    yield from cut(
        arm.move(
            target, hand, tolerance=0.008, turn_tolerance=0.08, speed=0.4, steps=45, required=False
        ),
        lambda: palm_presses(arm, thing),
    )
    if palm_presses(arm, thing):
        # What lies under the palm while the fingers close is pressed on the counter.
        eased = arm.position - EASED * approach
        yield from arm.move(eased, hand, tolerance=0.002, speed=0.2, steps=8, required=False)
    yield from lift(arm, thing, hand, rise)


def pick_from(arm: Arm, role: str, holder_role: str) -> Motion:
    """Pick up what lies in an open drawer, in a basin, on another object or on a counter, stands in
    a cabinet, or sticks out of a slot.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    if arm.scene.roles[holder_role] in arm.scene.object_index:
        yield from pick_from_above(arm, role, PLATE_PITCH)
    elif any(door.kind == "hinge" for door in Furniture(arm, holder_role).doors()):
        yield from pick_from_shelf(arm, role, holder_role)
    elif Furniture(arm, holder_role).doors():
        yield from pick_from_drawer(arm, role, holder_role)
    elif Thing(arm, role).bottom > Furniture(arm, holder_role).top - ON_TOP:
        yield from pick_from_top(arm, role)
    elif Thing(arm, role).highest > Furniture(arm, holder_role).top:
        yield from pick_from_slot(arm, role, holder_role)
    else:
        yield from pick_from_basin(arm, role, holder_role)


def pick_from_slot(arm: Arm, role: str, holder_role: str) -> Motion:
    """Pinch what sticks out of a slot, above it, and pull it out.

    Raises:
        SkillFailed: if it was not lifted.
    """
    thing = Thing(arm, role)
    where = thing.centre
    yield from stand_before(arm, where, reach(0.0))
    far = arm.ahead(where) - arm.ahead(arm.base)
    grasp = across(arm, thing, float(np.interp(far, *SLOT_PITCH)))
    height = Furniture(arm, holder_role).top + FINGERTIP + 0.002
    point = np.append(grasp.point[:2], max(grasp.point[2], height))
    yield from take(arm, thing, replace(grasp, point=point), rise=thing.height + 0.03)


def pick_from_above(
    arm: Arm, role: str, pitch: float = 0.0, back: float = 0.12, rise: float = 0.08
) -> Motion:
    """Pinch an object across its narrow side.

    Args:
        arm: the arm.
        role: the object.
        pitch: of the hand, degrees from straight down.
        back: length of the straight approach, m.
        rise: how far it is lifted, m.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    where = thing.centre
    yield from duck(arm, arm.aside(where))
    yield from stand_before(arm, where, reach(pitch))
    grasp = across(arm, thing, pitch)
    (_, width), (axis, length) = thing.sides()
    if length > LONG * width:
        off = off_others(arm, thing, grasp.opening)
        grasp = across(arm, thing, pitch, off)
        # On a plate's rim it slopes, and is lower at one end than in its middle.
        grasp = replace(grasp, point=raised(grasp.point, min(0.0, off * float(axis[2]))))
        # Fingers that come from closed open farther than they are told, onto what lies beside it.
        yield from arm.open_to(1.0)
    low, height = grasp.point[2] + back, arm.position[2]
    if height > low + HIGH and overhung(arm, np.append(where[:2], height - RAISED)):
        front = arm.point(arm.ahead(arm.base) + DUCKED[0], arm.aside(arm.base), low)
        yield from arm.move(front, grasp.hand, tolerance=0.04, turn_tolerance=0.3, steps=80)
    yield from take(arm, thing, grasp, rise, back)


def off_others(arm: Arm, thing: Thing, opening: float) -> float:
    """How far from its middle, along its long side, something long is pinched for the fingers to
    come down beside what lies next to it on the same plate, m.

    Args:
        arm: the arm.
        thing: what is pinched.
        opening: of the fingers, share of the full opening.
    """
    axis = thing.sides()[1][0]
    others = [Thing(arm, body.entity) for body in arm.scene.bodies]
    under = [other.entity for other in others if carries(other, thing)]
    return float(free_of_others(arm, thing, opening * OPEN, (*ALONG, *FARTHER), under) @ axis)


def pick_from_top(arm: Arm, role: str) -> Motion:
    """Pinch a thing that lies on a counter near its top, so that it can be pressed on another one.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    level = abs(fold(narrow_roll(arm, thing), 90.0)) <= MOST_YAW
    pitch = PLATE_PITCH if level else ROLLED_PITCH
    yield from stand_before(arm, thing.centre, reach(pitch))
    grasp = across(arm, thing, pitch)
    # With 7 mm of it between the pads, a sponge slips out: the lower finger may touch the counter.
    height = max(thing.bottom + FINGERTIP, thing.highest - EDGE)
    point = np.append(grasp.point[:2], height)
    grasp = replace(grasp, point=point)
    if not level:
        grasp = replace(grasp, opening=min(1.0, (thing.sides()[0][1] + ROLLED_OPEN) / GAP))
    yield from take(arm, thing, grasp)
