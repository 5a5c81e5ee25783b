"""A cup under a coffee machine: gripped by its body, carried in below the machine's head."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.cup_grasps import OFF_HANDLE, around
from pytest_safemanip.expert.motions.grasping import grasp_and_lift
from pytest_safemanip.expert.motions.putting import set_down
from pytest_safemanip.expert.robot.arm import GENTLY, Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array, upright
from pytest_safemanip.expert.world.standing import stand, stand_before
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.geometry import matrix

CUP_PITCH = 40.0
"""Degrees from straight down: in below a coffee machine's head, 2 to 3 cm stay free above the
hand. Tipped further, the arm comes near a singular posture, and swings by a centimetre."""
CUP_REACH = 0.52
"""Base to hand, m."""
CLEAR_OF_FRONT = 0.05
"""From a cup to a machine in front of it, m, while it is moved sideways."""
OVER_TRAY = 0.015
"""Free space below a cup on its way in, m."""
OFF_CUP = 0.08
"""How far the hand draws back along its own direction, m: then its fingers are off the cup."""
MOST_LEVEL = 60.0
"""Pitch with which a hand comes down to a tray, degrees: beyond, it stops up to 3 cm above."""
RIGHTED = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1)
"""Shares of a cup's lean that the hand makes up for, if it can."""


def grasp_cup(arm: Arm, role: str) -> Motion:
    """Pinch a cup that stands on a counter, the hand tipped as far as a coffee machine needs it.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    thing = Thing(arm, role)
    yield from stand_before(arm, thing.middle, CUP_REACH)
    grasp = around(arm, thing, CUP_PITCH, handle=OFF_HANDLE)
    yield from grasp_and_lift(arm, thing, grasp, rise=0.06)


def place_on_tray(arm: Arm, role: str, machine_role: str) -> Motion:
    """Put a held cup on the tray of a machine, in below what hangs over it, and draw back straight.

    Raises:
        SkillFailed: if the hand or the base does not arrive.
    """
    yield from bring_under(arm, Thing(arm, role), *Furniture(arm, machine_role).tray())
    yield from set_down(arm, role, 0.05)
    level = arm.rotation[:, 2] * (1.0, 1.0, 0.0)
    away = arm.position - OFF_CUP * level / np.linalg.norm(level)
    yield from arm.move(away, tolerance=0.02, speed=GENTLY, steps=40, required=False)
    yield from stand(arm, arm.ahead(arm.base) - 0.25, arm.aside(arm.base))


def righting(arm: Arm, cup: Thing) -> Array:
    """The hand (3, 3) with a held cup upright, as nearly as it can be low above a counter: a cup
    that leans in the fingers turns in them when it comes to stand.
    """
    axis = matrix(cup.pose[3:])[:, 2]
    for share in RIGHTED:
        part = share * axis + (1.0 - share) * np.array((0.0, 0.0, 1.0))
        hand = upright(part / np.linalg.norm(part)) @ arm.rotation
        if arm.pitch_of(hand) <= MOST_LEVEL:
            return hand
    return arm.rotation


def bring_under(arm: Arm, cup: Thing, tray: Array, front: float) -> Motion:
    """Carry a held cup round in front of a machine and in over its tray.

    The base brings it in: an arm that is stretched out with a tipped hand swings.

    Args:
        arm: the arm.
        cup: what it holds.
        tray: middle of the tray's upper side (3,).
        front: where the tray begins along the base's forward direction, m.

    Raises:
        SkillFailed: if the hand or the base does not arrive.
    """
    inside = arm.ahead(tray)

    def outside() -> float:
        """Where the base stands with the cup clear of the machine, m."""
        far = cup.extent_ahead()[1] - arm.ahead(arm.base)
        return front - CLEAR_OF_FRONT - far

    def above() -> float:
        """Height of the hand with the cup just above the tray, m."""
        return float(arm.position[2] + tray[2] + OVER_TRAY - cup.bottom)

    def tucked() -> Array:
        return arm.before(CUP_REACH, above())

    def over() -> Array:
        way = arm.floor_point(inside, arm.aside(tray)) - cup.middle[:2]
        return np.append(arm.position[:2] + way, above())

    yield from stand(arm, outside(), arm.aside(arm.base), GENTLY)
    hand = righting(arm, cup)
    yield from arm.move(tucked, hand, tolerance=0.025, turn_tolerance=0.15, speed=GENTLY)
    aside = arm.aside(arm.base) + arm.aside(tray) - arm.aside(cup.middle)
    yield from stand(arm, min(outside(), arm.ahead(arm.base)), aside, GENTLY)
    ahead = arm.ahead(arm.base) + inside - arm.ahead(cup.middle)
    yield from stand(arm, ahead, arm.aside(arm.base), GENTLY)
    yield from arm.move(over, hand, tolerance=0.008, speed=GENTLY, steps=60, required=False)
