"""Ways of hand and base that the simulator is asked about before they are gone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array, quaternion
from pytest_safemanip.sim.clearance import STAYS, Clearance, Path

MARGIN = 0.003
"""What comes nearer than this counts as touched, m: the hand arrives within 3 mm."""
FORESEEN = 1000
"""Answers that are remembered: the simulator is not asked twice about the same."""
Permits = Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Leg:
    """A straight stretch of a way: of the hand, or of the base, which takes the hand along.

    Attributes:
        point: of the hand (3,), or of the base on the floor (2,).
        hand: orientation (3, 3); None keeps that of the leg before.
        tolerance: distance that counts as there, m.
        speed: share of the top speed.
        steps: control steps at most.
        exact: arrive at rest.
        touches: what may be touched may be from here on.
    """

    point: Array
    hand: Array | None = None
    tolerance: float = 0.015
    speed: float = 1.0
    steps: int = 160
    exact: bool = False
    touches: bool = False


def foresee(
    arm: Arm,
    legs: Sequence[Leg],
    permits: Permits = (),
    opening: float = STAYS,
    margin: float = MARGIN,
    raised: float = 0.0,
    begins: int = 0,
) -> Clearance:
    """What would be touched on a way from here.

    Args:
        arm: the arm.
        legs: the way.
        permits: touches that do not count from the first leg that touches, or on the last one, see
            :class:`~pytest_safemanip.sim.clearance.Path`.
        opening: of the fingers, share of the full opening.
        margin: what comes nearer than this counts as touched, m.
        raised: how much farther the torso is raised before, m.
        begins: the leg from which on touches count.
    """
    hand, base = np.full((len(legs), 7), STAYS), np.full((len(legs), 3), STAYS)
    rotation, heading = arm.rotation, float(np.arctan2(arm.forward[1], arm.forward[0]))
    for row, leg in enumerate(legs):
        rotation = rotation if leg.hand is None else leg.hand
        if len(leg.point) == 2:
            base[row] = *leg.point, heading
        else:
            hand[row] = *leg.point, *quaternion(rotation)
    speed = np.array([leg.speed for leg in legs])
    since = next((n for n, leg in enumerate(legs) if leg.touches), len(legs) - 1)
    tolerance = np.array([leg.tolerance for leg in legs])
    permits = tuple(permits)
    path = Path(
        hand,
        base,
        speed,
        tolerance,
        opening,
        held(arm),
        permits,
        since,
        margin,
        steps=160,
        raised=raised,
        begins=begins,
    )
    arrays = arm.step.qpos, hand, base, speed, tolerance
    numbers = opening, permits, since, margin, raised, begins
    state = *(array.tobytes() for array in arrays), *numbers
    return arm.latest("what would be touched", state, lambda: arm.foresee([path])[0], FORESEEN)


def go(arm: Arm, legs: Sequence[Leg], required: bool = True) -> Motion:
    """Go a way.

    Args:
        arm: the arm.
        legs: the way.
        required: whether the hand has to arrive.

    Raises:
        SkillFailed: if hand or base do not arrive.
    """
    for leg in legs:
        if len(leg.point) == 2:
            yield from arm.drive(leg.point, tolerance=leg.tolerance)
        else:
            yield from arm.move(
                leg.point,
                leg.hand,
                tolerance=leg.tolerance,
                speed=leg.speed,
                steps=leg.steps,
                exact=leg.exact,
                required=required,
            )


def held(arm: Arm) -> tuple[str, ...]:
    """The objects that go where the hand goes: what both fingers press on, and what lies in it."""
    contacts, parts = arm.step.contacts, arm.scene.parts
    objects = arm.scene.object_index
    beside: dict[str, set[str]] = {}
    for row in np.flatnonzero(contacts.force > 0.0).tolist():
        a, b = parts[contacts.a[row]], parts[contacts.b[row]]
        for one, other in ((a, b), (b, a)):
            if one.entity in objects:
                name = other.name if other.name.startswith("finger") else other.entity
                beside.setdefault(one.entity, set()).add(name)
    fingers = {finger for group in arm.scene.grippers[0].fingers for finger in group}
    found = {entity for entity, by in beside.items() if fingers <= by}
    for _ in beside:
        # What touches nothing else than this lies in it.
        found |= {one for one, by in beside.items() if by & found and by <= found | fingers}
    return tuple(sorted(found))
