"""Putting a pan on the burner that the instruction names, and food into it there."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed, cut, raised
from pytest_safemanip.policies.scripted.grasping import hand_corners
from pytest_safemanip.policies.scripted.handles import handle
from pytest_safemanip.policies.scripted.kettles import bring_to_burner
from pytest_safemanip.policies.scripted.putting import (
    BRAKE,
    SOFTLY,
    carry_over,
    held_over,
    leave,
    set_down,
    straighten,
)
from pytest_safemanip.policies.scripted.rims import overhung
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import nearest
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.policies.scripted.touching import carried_by_something
from pytest_safemanip.policies.scripted.travelling import draw_in, pitched

TO_HANDLE = 0.035
"""How far before the middle of a burner, as its handle points, the middle of a pan goes, m: so the
handle's weight is over the burner too."""
ABOVE = 0.03
"""Free space below a pan before it is set down, m."""

LOW_PITCH = 40.0
"""Degrees from straight down of a hand below a microwave: wrist and elbow stay low enough."""
OFF_RIM = 0.006
"""Free space between a palm and the rim below it, m: a hand that held raw meat soils it."""


def let_into(arm: Arm, role: str, pan_role: str) -> Motion:
    """Let something into a pan on a stove, the palm above its rim, from the front.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    thing, pan = Thing(arm, role), Thing(arm, pan_role)
    yield from draw_in(arm)
    if overhung(arm, pan.middle):
        yield from straighten(arm)
    hand = pitched(arm, LOW_PITCH)
    yield from arm.move(arm.position, hand, tolerance=0.03, speed=0.5, required=False)
    yield from carry_over(arm, role, pan.middle, pan.highest + BRAKE)
    palm = float(hand_corners(arm.rotation)[:, 2].min())
    down = float(arm.position[2]) + palm - pan.highest - OFF_RIM
    yield from cut(
        arm.move(
            raised(arm.position, -max(0.0, down)),
            tolerance=0.003,
            speed=SOFTLY,
            steps=200,
            required=False,
        ),
        lambda: carried_by_something(arm, thing),
    )
    yield from arm.grip(False)
    yield from leave(arm)


def place_on_named(arm: Arm, role: str, stove_role: str) -> Motion:
    """Put a held pan on the burner that the instruction names.

    Raises:
        SkillFailed: if it names none, or hand or base does not get there.
    """
    pan = Thing(arm, role)
    spot = named_burner(arm, Furniture(arm, stove_role)) - TO_HANDLE * handle(pan)[1]
    aside = arm.aside(arm.base) + arm.aside(spot) - arm.aside(pan.middle)
    yield from bring_to_burner(arm, role, spot, nearest(arm, aside, aside))
    over = held_over(arm, pan, spot, float(spot[2]) + ABOVE)
    yield from arm.move(over, speed=0.3, tolerance=0.006, steps=80, required=False, exact=True)
    yield from set_down(arm, role)
    yield from leave(arm)


def named_burner(arm: Arm, stove: Furniture) -> Array:
    """The burner (3,) of a stove that the instruction names.

    Raises:
        SkillFailed: if it names none.
    """
    for index in arm.scene.boxes_of(stove.entity, "burner"):
        if arm.scene.boxes[index].name.replace("_", " ") in arm.instruction:
            return np.asarray(arm.step.box_pose[index][:3], np.float64)
    raise SkillFailed("the instruction names no burner")
