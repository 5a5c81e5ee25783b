"""Room for the fingers beside what lies near."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.policies.scripted.touching import pressed_by
from pytest_safemanip.trace.planar import footprints_overlap

ALONG = (0.0, 0.015, -0.015, 0.03, -0.03, 0.045, -0.045)
"""How far from its middle a thing may be pinched for the sake of what lies beside it, m: farther,
it would hang."""
FINGER_SIZE = (0.016, 0.022)
"""Thickness of a finger along its travel, and its width, m, with 2 mm kept free."""

BLOCKED = 10.0
"""Force that shows that a finger stands on something and does not slide past it, N."""


def free_of_others(
    arm: Arm, thing: Thing, width: float, along: Iterable[float] = ALONG, under: Iterable[str] = ()
) -> Array:
    """From a lying thing's middle to where along it the open fingers meet nothing else (3,), m; its
    middle if there is no such place: boxes say more than there is of a tool.

    Args:
        arm: the arm.
        thing: what is pinched from above, across its narrow side.
        width: between the fingers, m.
        along: how far from its middle it may be pinched, m, the best first.
        under: entities that it lies on, which the fingers stay above.
    """
    (across, _), (axis, _) = thing.sides()
    own = {thing.entity, *under}
    others = [Thing(arm, body.entity) for body in arm.scene.bodies if body.entity not in own]
    beside = [o.corners for o in others if o.bottom < thing.highest and o.highest > thing.bottom]
    thick, wide = FINGER_SIZE
    for off in along:
        middle = thing.com + off * axis
        ends = [
            _rectangle(middle + side * (width + thick) / 2.0 * across, thick * across, wide * axis)
            for side in (-1.0, 1.0)
        ]
        if not any(footprints_overlap(end, other, 0.0) for end in ends for other in beside):
            return np.asarray(off * axis, np.float64)
    return np.zeros(3)


def fingers_meet(arm: Arm, thing: Thing) -> bool:
    """Whether a finger comes down on an object that it is not to take."""
    others = pressed_by(arm, "finger", BLOCKED) - {thing.entity}
    return bool(others & set(arm.scene.object_index))


def _rectangle(middle: Array, side: Array, other: Array) -> Array:
    return np.array([middle + i * side + j * other for i in (-0.5, 0.5) for j in (-0.5, 0.5)])
