"""Skills on burners' knobs: turn one off, turn one on, with a fingertip that goes round it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import about, rotate

KNOB_PITCH = 45.0
"""Degrees from straight down: steeper is out of reach at the height of a stove's panel."""
KNOB_STAND = 0.66
BEYOND = 0.0085
"""From a fin's end to the circle on which the fingertip goes round, m: it passes just beyond."""
INWARD = 0.001
"""Grip point behind the knob's front, m: the fingertips overlap the fin by 1 cm, and the palm, the
upper edge of which is farther ahead, stays 5 mm off it."""
TRAIL = math.radians(42.0)
"""Angle by which the fingertip follows the fin's end when finger and fin touch."""
BESIDE = 0.3
"""How much farther round the fingertip then is before it touches, rad."""
FINGERS, PAST = 0.0145, 0.006
"""Half the width of both closed fingertips, m, and how far beside the fin they come in, m: the hand
errs by 3 mm, and on the fin's front they would press with 90 N."""
PRESS = 0.03
"""How far along its circle's tangent the finger aims ahead of touching, m: knobs yield to that."""
TOUCH, YIELDED = 0.2, 0.02
"""Speed at which the finger meets the fin, and the angle from which the knob yields, rad: met
twice as fast, it is hit with 60 to 90 N."""
TRIES = 2
"""A fingertip that slid along the fin towards its axis is set to its end once more."""
OFF = 0.12
"""Knob angle that is off for certain, rad: RoboCasa's limit is 0.35."""
ON = 1.2
"""Knob angle of a medium flame, rad."""


def turn_off(arm: Arm, role: str) -> Motion:
    """Turn off each burner of a stove that is on.

    Raises:
        SkillFailed: if a knob did not turn.
    """
    stove = Furniture(arm, role)
    for joint in stove.burning():
        yield from turn_knob(arm, stove, joint, OFF)


def turn_on_under(arm: Arm, role: str, thing_role: str) -> Motion:
    """Turn on the burner that an object stands on.

    Raises:
        SkillFailed: if the knob did not turn.
    """
    stove = Furniture(arm, role)
    yield from turn_knob(arm, stove, stove.knob_under(Thing(arm, thing_role).centre), ON)


def turn_knob(arm: Arm, stove: Furniture, joint: Joint, angle: float) -> Motion:
    """Push a knob's fin round to an angle: the upper end to turn it up, the lower one down.

    Args:
        arm: the arm.
        stove: whose knob it is.
        joint: the knob.
        angle: where to, rad.

    Raises:
        SkillFailed: if it did not turn.
    """
    centre, (thick, out, high) = np.asarray(joint.pose[:3]), joint.half
    orbit, outward = high + BEYOND, out - INWARD
    aside = math.asin(min(1.0, (thick + FINGERS + PAST) / orbit)) - TRAIL
    down = stove.openness(joint) * joint.travel > angle
    way = -1.0 if down else 1.0
    end = np.array((0.0, 0.0, way))
    ahead = np.append(arm.forward, 0.0)
    hand = arm.hand(KNOB_PITCH)

    def turned() -> float:
        return stove.openness(joint) * joint.travel

    def beside(lead: float, gap: float) -> Array:
        at = about(np.asarray(joint.axis), turned() + way * (lead - TRAIL))
        return np.asarray(centre + orbit * rotate(at, end) - (gap + outward) * ahead)

    def pressing() -> Array:
        touching = beside(0.0, 0.0)
        tangent = beside(0.01, 0.0) - touching
        return touching + PRESS / float(np.linalg.norm(tangent)) * tangent

    def there() -> bool:
        return (turned() - angle) * way >= 0.0

    yield from arm.grip(True)
    stand = min(arm.ahead(centre) - KNOB_STAND, arm.ahead(arm.base))
    yield from arm.drive(arm.floor_point(stand, arm.aside(centre)))
    for _ in range(TRIES):
        yield from arm.move(beside(-aside, 0.10), hand, tolerance=0.02, steps=160)
        yield from arm.move(beside(-aside, 0.03), hand, tolerance=0.012, speed=0.5, steps=60)
        yield from arm.move(
            beside(-aside, 0.0), hand, tolerance=0.01, speed=TOUCH, steps=60, required=False
        )
        yield from arm.move(
            beside(-BESIDE, 0.0), hand, tolerance=0.004, speed=TOUCH, steps=60, required=False
        )
        yield from arm.move(
            pressing, hand, speed=TOUCH, steps=40, until=_moves(turned), required=False
        )
        yield from arm.move(pressing, hand, speed=0.3, steps=80, until=there, required=False)
        yield from arm.move(arm.position - 0.12 * ahead, hand, tolerance=0.03, required=False)
        if there():
            return
    if (turned() - angle) * way < -0.2:
        raise SkillFailed(f"{joint.key} stopped at {turned():.2f} rad")


def _moves(turned: Callable[[], float]) -> Callable[[], bool]:
    """Whether a knob yields, compared with now."""
    start = turned()
    return lambda: abs(turned() - start) > YIELDED
