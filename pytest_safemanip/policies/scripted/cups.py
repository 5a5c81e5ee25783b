"""A cup under a coffee machine: gripped by its body, carried in below the machine's head."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion
from pytest_safemanip.policies.scripted.grasping import around, take
from pytest_safemanip.policies.scripted.putting import set_down
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.standing import stand, stand_before
from pytest_safemanip.policies.scripted.things import Furniture, Thing

CUP_PITCH = 40.0
"""Degrees from straight down: in below a coffee machine's head, 2 to 3 cm stay free above the
hand. Tipped further, the arm comes near a singular posture, and swings by a centimetre."""
CUP_REACH = 0.52
"""Base to hand, m."""
OFF_HANDLE = 45.0
"""Least angle from the fingers' line to a cup's handle, degrees: a finger fits beside it."""
CLEAR_OF_FRONT = 0.05
"""From a cup to a machine in front of it, m, while it is moved sideways."""
OVER_TRAY = 0.015
"""Free space below a cup on its way in, m."""
SHORT = 0.010
"""How far before the middle of a tray a vessel is set down, m: the hand stays off what hangs
above."""
DRAWN = 0.08
"""How far the hand draws back along its own direction, m: then its fingers are off the cup."""
GENTLY = 0.4
"""Speed of the base with a cup that is held near its rim."""


def grasp_cup(arm: Arm, role: str) -> Motion:
    """Pinch a cup that stands on a counter, the hand tipped as far as a coffee machine needs it.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    yield from stand_before(arm, thing.middle, CUP_REACH)
    grasp = around(arm, thing, CUP_PITCH, handle=OFF_HANDLE)
    yield from take(arm, thing, grasp, rise=0.06)


def place_under(arm: Arm, role: str, machine_role: str) -> Motion:
    """Put a held cup on the tray of a machine, in below what hangs over it, and draw back straight.

    The base brings it in: an arm that is stretched out with a tipped hand swings.

    Raises:
        SkillFailed: if the hand or the base does not arrive.
    """
    thing, hand = Thing(arm, role), arm.rotation
    where, front = Furniture(arm, machine_role).tray()
    inside = arm.ahead(where) - SHORT

    def held() -> Array:
        """From the base to the cup: how far ahead and how far to the left of it, m."""
        middle = thing.middle
        return np.array(
            (arm.ahead(middle) - arm.ahead(arm.base), arm.aside(middle) - arm.aside(arm.base))
        )

    def before() -> Array:
        far = thing.extent_ahead()[1] - arm.ahead(arm.base)
        return front - CLEAR_OF_FRONT - far

    yield from stand(arm, before(), arm.aside(arm.base), GENTLY)

    def tucked() -> Array:
        height = arm.position[2] + where[2] + OVER_TRAY - thing.bottom
        return arm.point(arm.ahead(arm.base) + CUP_REACH, arm.aside(arm.base), height)

    yield from arm.move(tucked, hand, tolerance=0.012, speed=GENTLY, steps=80)
    yield from stand(arm, min(before(), arm.ahead(arm.base)), arm.aside(where) - held()[1], GENTLY)
    yield from stand(arm, inside - held()[0], arm.aside(where) - held()[1], GENTLY)

    def over() -> Array:
        here = arm.floor_point(inside, arm.aside(where))
        way = np.append(here - thing.middle[:2], where[2] + OVER_TRAY - thing.bottom)
        return arm.position + way

    yield from arm.move(over, hand, tolerance=0.008, speed=GENTLY, steps=60, required=False)
    yield from set_down(arm, role, 0.05)
    level = arm.rotation[:, 2] * (1.0, 1.0, 0.0)
    away = arm.position - DRAWN * level / np.linalg.norm(level)
    yield from arm.move(away, tolerance=0.02, speed=GENTLY, steps=40, required=False)
    yield from stand(arm, arm.ahead(arm.base) - 0.25, arm.aside(arm.base))
