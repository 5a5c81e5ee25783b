"""Two things on one board or tray: each is put onto one of its ends."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.putting import (
    CARRIED_OVER,
    LEAST_TIP,
    bring_onto,
    put_onto,
    straighten,
)
from pytest_safemanip.expert.robot.arm import Arm, Motion, fold_arm
from pytest_safemanip.expert.robot.base import CAREFUL
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.free_spots import gap, outline
from pytest_safemanip.expert.world.standing import before_open, elbow_room, wrist_room
from pytest_safemanip.expert.world.things import Thing

BOARD_END = 0.27
"""From a target's middle to where one of two things goes, share of its length: on a board of 30 cm
their middles are 16 cm apart, room for a croissant, a jar, and the fingers that let go of it."""
APART_ON_BOARD, OUTMOST = 0.045, 0.12
"""Between two things on one board, m: the hand sets one down within 2 cm; and from the middle of a
board to that of what goes onto it at most, m: RoboCasa takes what is farther out for beside it."""
RIM = 0.028
"""From a tray's edge to what is to stand inside its rim, a cup's handle too, m: 13 mm, and as much
as the hand errs by."""
OUTWARDS, TOWARDS = (0.0, 0.01, 0.02, 0.03), (0.0, 0.02, 0.04, 0.06)
"""How much farther out and nearer to the robot than on its end the second may go for that, m."""
SAME = 1e-6
"""Lengths that differ by less are the same, m."""
KETTLE_END = 0.24
"""From a tray's middle to a kettle's, share of its length: on 34 cm, a kettle of 17 cm stands
inside the rim."""
OFF_BOW = (0.12, 0.04)
"""How far open fingers draw back along a bow, and up from one that lies across, m: they are off it
then, and the wrist stays below a wall cabinet."""
FOLD_BACK = 0.33
"""How far the base draws back at least before the arm is folded, m: off what hangs above."""
UNBENT = (0.45, 1.12, 40.0)
"""Base to hand, m, its height, m, below the doors of a wall cabinet, and its pitch, degrees."""


def place_on_end_beside(arm: Arm, role: str, target_role: str, other_role: str) -> Motion:
    """Put a held object onto one end of another one, of which a third gets the other end."""
    target = Thing(arm, target_role)
    yield from straighten(arm)
    other = Thing(arm, other_role)
    spot = apart(arm, Thing(arm, role), target, free_end(arm, target, other), other)
    # Off a machine that is beside the other end only, too.
    shift = elbow_room(arm, spot) or elbow_room(arm, target.middle)
    yield from put_onto(arm, role, target, spot, wrist_room(arm, shift))
    yield from unbend(arm)


def free_end(arm: Arm, target: Thing, other: Thing) -> Array:
    """The end of a target that another object leaves free (3,); of both, the one that is farther
    from the robot: what comes second need not be carried over what stands there.
    """
    axis, width = target.sides()[1]
    ends = [target.middle + k * width * axis for k in (-BOARD_END, BOARD_END)]
    away = float(np.linalg.norm((other.centre - target.middle)[:2]))
    # On a board, or inside the rim of a tray.
    if away < width / 2.0 and abs(other.bottom - target.highest) < target.height + CARRIED_OVER:
        return max(ends, key=lambda end: float(np.linalg.norm((end - other.centre)[:2])))
    return max(ends, key=arm.ahead)


def apart(arm: Arm, thing: Thing, target: Thing, end: Array, other: Thing) -> Array:
    """Where near an end (3,) of a target a held thing does not meet another one there (3,)."""
    out = (end - target.middle) / np.linalg.norm(end - target.middle)
    towards = np.cross(out, (0.0, 0.0, 1.0))
    towards *= -np.sign(arm.ahead(towards))
    shifts = sorted(((o, t) for o in OUTWARDS for t in TOWARDS), key=lambda s: math.hypot(*s))
    spots = [end + o * out + t * towards for o, t in shifts]
    most = _reach(thing, end, target)
    for k, (_, width) in enumerate(target.sides()):
        most[k] = max(most[k], width / 2.0 - RIM)
    inside = [s for s in spots if (_reach(thing, s, target) <= most + SAME).all()]
    return max(inside, key=lambda spot: min(gap(thing, spot, other), APART_ON_BOARD))


def _reach(thing: Thing, spot: Array, target: Thing) -> Array:
    """How far a thing with its middle on a spot (3,) reaches from a target's middle, along the
    narrow and the long side of that (2,), m; without end beyond ``OUTMOST``.
    """
    axes = np.array([axis[:2] for axis, _ in target.sides()])
    if float(np.linalg.norm((spot - target.middle)[:2])) > OUTMOST:
        return np.full(2, math.inf)
    found: Array = np.abs((outline(thing, spot) - target.centre[:2]) @ axes.T).max(axis=0)
    return found


def unbend(arm: Arm) -> Motion:
    """Bring a hand that reached out to one side back before the base: bent as it was, the arm would
    come to the end of a joint on its next way.
    """
    ahead, height, pitch = UNBENT
    before = arm.before(ahead, height)
    yield from arm.move(
        before, arm.hand(pitch), tolerance=0.05, turn_tolerance=0.3, speed=0.6, required=False
    )


def place_kettle_on_end(arm: Arm, role: str, target_role: str) -> Motion:
    """Put a held kettle onto one end of a tray."""
    target = Thing(arm, target_role)
    yield from straighten(arm, CAREFUL)
    shift = elbow_room(arm, target.middle)
    yield from bring_onto(arm, role, target, kettle_end(arm, target), shift, CAREFUL)
    yield from leave_bow(arm)


def kettle_end(arm: Arm, target: Thing) -> Array:
    """Where a kettle goes on a tray (3,): the end beside a machine, for it stands nearer to the
    middle than what may come onto the other end, and leaves the hand more room; without a machine,
    the end that is farther from the robot.
    """
    axis, width = target.sides()[1]
    ends = [target.middle + share * width * axis for share in (-KETTLE_END, KETTLE_END)]
    away = elbow_room(arm, target.middle)
    return max(ends, key=lambda end: -away * arm.aside(end) if away else arm.ahead(end))


def leave_bow(arm: Arm) -> Motion:
    """Draw open fingers off a bow, along it or up, and the base back, and fold the arm."""
    approach = arm.rotation[:, 2] * (1.0, 1.0, 0.0)
    along, up = OFF_BOW
    tipped = np.linalg.norm(approach) > LEAST_TIP
    away = -along * approach / np.linalg.norm(approach) if tipped else np.array((0.0, 0.0, up))
    yield from arm.move(arm.position + away, tolerance=0.02, speed=0.6, steps=40, required=False)
    back = max(FOLD_BACK, arm.ahead(arm.position) - before_open(arm, arm.aside(arm.position)))
    yield from arm.drive(arm.base - back * arm.forward)
    yield from fold_arm(arm, required=False)
