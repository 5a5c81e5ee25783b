"""Sharing out what lies in a wide bowl onto two plates."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.grasping import come_in, lift
from pytest_safemanip.expert.motions.putting import BRAKE, carry_over, set_upon
from pytest_safemanip.expert.places.bowl import best_bowl_grasp
from pytest_safemanip.expert.robot.arm import Arm, Motion, raised, unless_lost
from pytest_safemanip.expert.robot.base import CAREFUL
from pytest_safemanip.expert.robot.hand import OPENING, Grasp, reach_at
from pytest_safemanip.expert.robot.torso import lift_torso
from pytest_safemanip.expert.world.standing import nearest, stand_before
from pytest_safemanip.expert.world.things import Thing, other_things

STRAIGHT_FROM = 0.15
"""From where the hand comes straight down to the grip point, m."""
BLOCKED = 0.012
"""A hand that stays so far above a grip point has its fingers on something, m."""
STOPS = ((0.08, 0.006, 0.8), (0.02, 0.004, 0.4), (0.0, 0.002, 0.2))
"""On the way down: before the grip point, m, with tolerance, m, and speed."""
TORSO = 0.22
"""How far the torso is raised, m: the shoulder is then as high as the wrist over a table, and the
arm reaches 80 cm far; from lower it would be straight over the far half of a bowl."""
OUT_RISE = 0.14
"""How far a thing is lifted, m: over the rim, and over what leans on that."""
OFF_PLATE_MIDDLE = (0.035, 0.042)
"""From the middle of a plate to that of the first and of the second thing on it, m."""
ACROSS = 90.0
"""Roll of the hand over a plate, degrees: things lie side by side, as most do in the bowl."""
OPENED_BESIDE = 0.010
"""From either finger to a thing that is let go, m: what lies beside it is not pushed far."""
PITCHED = ((0.74, 0.86), (0.0, 30.0))
"""Base to the place on a plate, m, and how far the hand is pitched there, degrees: pointing down it
reaches 80 cm far."""
LOST = 0.09
"""A thing whose middle is so far from the grip point is not in the fingers, m: half of what is
shared out is 6 cm long."""
STRETCHED, FINGERS_CLEAR = 0.72, 0.05
"""Base to a hand that is far off, and how far up its fingers are clear of what they let go, m."""
SERVED_RISE, LAST_BACK = 0.14, 0.45
"""How far the hand then rises and, at the end, the base draws back, m."""


def move_to_plates(
    arm: Arm,
    role: str,
    like_role: str,
    other_role: str,
    other_like_role: str,
    bowl_role: str,
    plate_role: str,
    plate_like_role: str,
) -> Motion:
    """Put one of either kind of thing from a bowl onto each of two plates.

    Args:
        arm: the arm.
        role: one of the first kind.
        like_role: the other one of it.
        other_role: one of the second kind.
        other_like_role: the other one of it.
        bowl_role: where they are.
        plate_role: one plate.
        plate_like_role: the other one.

    Raises:
        SkillFailed: if one was not lifted, or hand or base does not get there.
    """
    kinds = {role: 0, like_role: 0, other_role: 1, other_like_role: 1}
    bowl = Thing(arm, bowl_role)
    yield from lift_torso(arm, TORSO)
    free = {kind: [plate_role, plate_like_role] for kind in (0, 1)}
    shut: set[str] = set()
    while kinds:
        best = best_bowl_grasp(arm, bowl, list(kinds), shut)
        yield from come_down(arm, best.grasp)
        if arm.position[2] > best.grasp.point[2] + BLOCKED:
            yield from arm.move(raised(arm.position, STRAIGHT_FROM), tolerance=0.03, steps=60)
            shut.add(best.role)
            continue
        yield from lift(arm, Thing(arm, best.role), best.grasp.hand, OUT_RISE)
        yield from serve(arm, best.role, Thing(arm, free[kinds.pop(best.role)].pop()))
        shut.clear()
    yield from arm.drive(arm.base - LAST_BACK * arm.forward)


def come_down(arm: Arm, grasp: Grasp) -> Motion:
    """Come down to a grip point in a bowl, or to where the fingers meet something.

    Raises:
        SkillFailed: if the hand does not get over it.
    """
    yield from stand_before(arm, grasp.point, reach_at(0.0))
    yield from arm.open_to(grasp.opening)
    start = raised(grasp.point, STRAIGHT_FROM)
    yield from arm.move(start, grasp.hand, tolerance=0.02, turn_tolerance=0.08, steps=140)
    yield from come_in(arm, grasp, STOPS, 0.04)


def serve(arm: Arm, role: str, plate: Thing) -> Motion:
    """Put a held thing on a plate, beside what lies there.

    Raises:
        SkillFailed: if it is lost on the way, or hand or base does not get there.
    """
    thing = Thing(arm, role)
    ahead = np.append(arm.forward, 0.0)
    on = [
        o
        for o in other_things(arm, thing, plate)
        if np.linalg.norm((o.centre - plate.middle)[:2]) < plate.sides()[0][1] / 2.0
    ]
    spot = plate.middle - OFF_PLATE_MIDDLE[0] * ahead
    if on:
        side = -np.sign((on[0].centre - plate.middle) @ ahead)
        spot = plate.middle + side * OFF_PLATE_MIDDLE[1] * ahead
    aside = arm.aside(spot)
    far = arm.ahead(spot) - nearest(arm, aside, aside)
    hand = arm.hand(float(np.interp(far, *PITCHED)), ACROSS)
    yield from arm.move(arm.position, hand, tolerance=0.03, turn_tolerance=0.08, speed=0.6)
    carried = carry_over(arm, role, spot, plate.highest + BRAKE, speed=CAREFUL)
    yield from unless_lost(carried, role, lambda: not in_fingers(arm, thing))
    yield from set_upon(arm, role)
    (_, width), _ = thing.sides()
    yield from arm.open_to(min(1.0, (width + 2.0 * OPENED_BESIDE) / OPENING))
    yield from rise(arm)


def in_fingers(arm: Arm, thing: Thing) -> bool:
    """Whether a thing is still where the fingers are; what is not is not to be followed."""
    return bool(np.linalg.norm(thing.centre - arm.position) < LOST)


def rise(arm: Arm) -> Motion:
    """Raise the hand from a plate; over a far one it is drawn in meanwhile: at its full length the
    arm would be straight, and stay so.
    """
    away = arm.ahead(arm.position) - arm.ahead(arm.base) - STRETCHED
    up = SERVED_RISE
    if away > 0.0:
        yield from arm.move(
            raised(arm.position, FINGERS_CLEAR), tolerance=0.01, speed=0.6, steps=40
        )
        up -= FINGERS_CLEAR
    back = np.append(-max(0.0, away) * arm.forward, up)
    yield from arm.move(arm.position + back, tolerance=0.03, speed=0.6, steps=60)
