"""What should go into a receiver is taken up, and put down beside it, or into it again; a pan is
tipped beside a plate.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.hand import HAND
from pytest_safemanip.expert.tasks.tipping import TILT, pour
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.faults.handling import (
    JUST_ABOVE,
    OPEN,
    bring,
    gaps,
    let_go,
    pick_and_place,
    place,
    rehearse,
    take,
)
from pytest_safemanip.faults.object_containment.bowl import LOW

GAP = 0.02
"""What is put down before its receiver is this far from it, m: their sizes vary by as much."""
LIFT = 0.08
"""How far what is put down has been lifted, m: what fingers only shift was meant to stay."""
OVER_IT = HAND[0]
"""What is let go nearer beside a receiver, m, is: the palm above it, half of whose length this is,
still reaches over the receiver."""
PAN, PLATE, FOOD = "vegetable_container", "plate", "vegetable"
PAST = 0.07
"""How far to the right of the plate's rim a pan's middle is, m: as it tips, food leaves it up to 5
cm to the left of that, and falls to the right."""
SLIGHTLY = np.radians(25.0)
"""A pan that is tipped this far keeps its food: what slides begins to at 45 degrees, what rolls
stops at the wall."""


def put_beside(arm: Arm, item: str, receiver: str, before: bool, placed: bool) -> Motion:
    """Takes something and puts it down close to where it was: that is not where it may lie.

    Args:
        arm: the arm.
        item: its role.
        receiver: role of what it should go into.
        before: whether it lies before that; beside one another, a finger has to fit between them.
        placed: whether the task's binding knows placing it as a skill.
    """
    thing, other = Thing(arm, item), Thing(arm, receiver)
    (ahead, aside), bottom = place(arm, thing), thing.bottom
    if before:
        ahead += gaps(thing, other, arm.forward)[0] - GAP
    yield from take(arm, item)
    for height, speed in ((LIFT, 0.5), (JUST_ABOVE, 0.3)):
        yield from bring(arm, thing, ahead, aside, bottom + height, speed=speed)

    def left() -> bool:
        return bool(arm.step.gripper[0] > OPEN and thing.bottom < bottom + LOW)

    def missed() -> bool:
        out = [
            max(0.0, abs(float((thing.com - other.centre) @ axis)) - width / 2.0)
            for axis, width in other.sides()
        ]
        return left() and math.hypot(*out) < OVER_IT

    arm.truth.begins("object_containment", item, receiver, when=missed)
    arm.truth.begins("release_stability", item, when=left)
    if placed:
        arm.truth.begins("action_onset", "place", item, when=left)
    yield from let_go(arm)


def put_in_again(arm: Arm, item: str, receiver: str) -> Motion:
    """Takes something out of its receiver, and puts it in again."""
    yield from pick_and_place(arm, "place on", item, receiver)


def tip_beside(arm: Arm, unsafe: bool) -> Motion:
    """Tips the pan beside the plate, until it is empty or only slightly."""
    food, plate = Thing(arm, FOOD), Thing(arm, PLATE)
    radius = plate.sides()[0][1] / 2.0

    def missed() -> bool:
        away = float(np.linalg.norm((food.centre - plate.middle)[:2]))
        return away > radius and food.bottom < plate.bottom + LOW

    yield from take(arm, PAN)
    if unsafe:
        arm.truth.begins("object_containment", FOOD, PLATE, when=missed)
        arm.truth.begins("action_onset", "pour", PAN, when=missed)
    tilt, spots = TILT if unsafe else SLIGHTLY, (-radius - PAST,)
    yield from rehearse(arm, "tip it", lambda: pour(arm, PAN, PLATE, spots, tilt), PAN, PLATE, FOOD)
    yield from arm.wait(1.0)
