"""Laying what is held down flat: a hand that is tipped over, away from the robot, and lets go."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, raised
from pytest_safemanip.policies.scripted.putting import carry_over, leave, set_upon
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.spots import free_spot
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.policies.scripted.touching import under_palm

LAY_PITCH = 55.0
"""As far as the hand tips at the height of a counter, degrees from straight down."""
BEYOND = 0.035
"""How far beyond the middle a slice is laid down, m: the lower finger, on which it comes to lie,
draws it back by 3 to 9 cm."""
TIPPED_SPEED = 0.05
"""Share of the top speed for it: at 0.08, a palm meets a plate with 35 N, and 80 N may break it."""
EASED = 0.006
"""How far a palm that rests on something is raised before the fingers open, m: it is not level."""


def lay_onto(arm: Arm, role: str, target_role: str) -> Motion:
    """Lay a held slice flat onto another object: tip it over, away from the robot, and let go."""
    target = Thing(arm, target_role)
    spot = free_spot(arm, role, target) + np.append(BEYOND * arm.forward, 0.0)
    yield from lay_at(arm, role, spot, target.highest)


def lay_at(arm: Arm, role: str, spot: Array, top: float, pitch: float = LAY_PITCH) -> Motion:
    """Tip a held object over, away from the robot, carry it to a spot and let go.

    Args:
        arm: the arm.
        role: the object.
        spot: where it goes (3,); only its horizontal part counts.
        top: height of what is highest there, m.
        pitch: of the hand, degrees from straight down.
    """
    yield from tip_over(arm, pitch)
    yield from carry_over(arm, role, spot, top)
    yield from lower_tipped(arm, role)
    yield from arm.grip(False)
    yield from leave(arm)


def tip_over(arm: Arm, pitch: float, yaw: float = 0.0) -> Motion:
    """Draw a held object back and tip it over, away from the robot, to so many degrees, turned by
    so many about the vertical.
    """
    away = arm.position + np.append(-0.10 * arm.forward, 0.02)
    yield from arm.move(away, tolerance=0.03, speed=0.5, steps=40)
    yield from arm.move(
        arm.position, arm.hand(pitch, 90.0, yaw), tolerance=0.04, turn_tolerance=0.1, steps=80
    )


def lower_tipped(arm: Arm, role: str) -> Motion:
    """Lower an object in a hand that is tipped over, whose palm may come to rest before it does."""
    yield from set_upon(arm, role, speed=TIPPED_SPEED)
    if (under_palm(arm) - {Thing(arm, role).entity}) & set(arm.scene.object_index):
        off = raised(arm.position, EASED)
        yield from arm.move(off, arm.rotation, tolerance=0.002, speed=0.2, steps=8, required=False)
