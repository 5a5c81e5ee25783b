"""Bread in a basket: let into it, and served with it on a table behind the robot."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pytest_safemanip.expert.motions.driving import CARRY_REACH, CARRY_SPEED, turn_round
from pytest_safemanip.expert.motions.handles import (
    HANDLE_OVER,
    LEAVE_BACK,
    LET_GO_BACK,
    LET_GO_RISE,
    STEADY,
    level,
    lug_length,
)
from pytest_safemanip.expert.motions.putting import BRAKE, held_over, leave, set_down
from pytest_safemanip.expert.places.cabinet.nested_bowls import grasp_lug
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import finger_angle
from pytest_safemanip.expert.robot.rotations import Array, fold
from pytest_safemanip.expert.world.contacts import touched
from pytest_safemanip.expert.world.standing import nearest, stand, stand_before
from pytest_safemanip.expert.world.things import Furniture, Thing, other_things

PITCH, REACH = 35.0, 0.63
"""Degrees from straight down, and base to hand, with which a hand fits between a basket's walls and
stays below the cabinet over it."""
PALM_BEHIND = 0.065
"""How far the palm reaches behind the grip point at the height of the rim, m."""
FALL = 0.035
"""Above a basket's underside, m: nothing is let go higher."""
HEIGHT_WITHIN = 0.003
"""That height is met so well, m."""
SLOWLY = 0.1
"""Share of the hand's top speed at which it is lowered."""
BASKET_BACK = 0.30
"""How far the base draws back with a basket, m: it is off what stands beside it."""
BASKET_HEIGHT = 1.20
"""Height of the hand on the way, m."""
LUG_FROM_EDGE = 0.03
"""From the edge of a table to a basket's lug, m: the hand stays outside."""
APART_ON_TABLE = 0.04
"""From a basket to what else stands on the table, m."""
STEP = 0.02
"""From one place along a table that is looked at to the next, m."""
ROUND = 0.05
"""Kept free around a load while the base turns, m."""


def place_between_walls(arm: Arm, role: str, basket_role: str) -> Motion:
    """Put a held thing into a basket with a hand between its walls, the fingers along the long
    ones.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    thing, basket = Thing(arm, role), Thing(arm, basket_role)
    yaw = fold(finger_angle(arm, basket.sides()[1][0]), 90.0)
    hand = arm.hand(PITCH, yaw=yaw)
    yield from arm.move(arm.position, hand, tolerance=0.03, turn_tolerance=0.1, speed=STEADY)
    yield from stand_before(arm, basket.middle, REACH, speed=STEADY)
    over = between_walls(arm, thing, basket, basket.highest + BRAKE)
    yield from arm.move(
        over, hand, tolerance=0.008, speed=STEADY, steps=120, required=False, exact=True
    )
    low = basket.bottom + FALL
    yield from arm.move(
        between_walls(arm, thing, basket, low),
        hand,
        speed=SLOWLY,
        steps=150,
        until=lambda: touched(arm, thing) or thing.bottom < low + HEIGHT_WITHIN,
        required=False,
    )
    yield from arm.grip(False)
    yield from arm.move(raised(arm.position, LET_GO_RISE), tolerance=0.03, speed=0.5, steps=60)
    yield from arm.drive(arm.base - LET_GO_BACK * arm.forward)


def between_walls(arm: Arm, thing: Thing, basket: Thing, bottom: float) -> Callable[[], Array]:
    """Where the hand is when a thing that it holds hangs with its underside at a height, m, and
    has as much room before it, to a basket's long wall, as the palm has behind.
    """

    def there() -> Array:
        (across, _), (along, _) = basket.sides()
        across = across * math.copysign(1.0, arm.ahead(across))
        far = float(((thing.corners - basket.middle) @ across).max())
        hand = arm.position - basket.middle
        near = float(hand @ across) - PALM_BEHIND
        way = -(far + near) / 2.0 * across - hand @ along * along
        return np.append((arm.position + way)[:2], arm.position[2] + bottom - thing.bottom)

    return there


def move_to_edge(arm: Arm, role: str, table_role: str) -> Motion:
    """Take a basket by its lug, turn round, and put it near the edge of a table, its lug towards
    the robot.

    Raises:
        SkillFailed: if it was not lifted, or there is no room on the table.
    """
    thing, table = Thing(arm, role), Furniture(arm, table_role)
    yield from grasp_lug(arm, thing)
    yield from arm.drive(arm.base - BASKET_BACK * arm.forward, speed=STEADY)
    yield from tuck_level(arm, thing)
    radius = float(np.linalg.norm(thing.corners[:, :2] - arm.base, axis=1).max())
    yield from turn_round(arm, radius + ROUND)
    yield from tuck_level(arm, thing)
    spot = free_edge(arm, thing, table)
    base = arm.ahead(spot) - (arm.ahead(thing.middle) - arm.ahead(arm.base))
    aside = arm.aside(arm.base) + arm.aside(spot) - arm.aside(thing.middle)
    yield from arm.drive(arm.floor_point(arm.ahead(arm.base), aside), speed=CARRY_SPEED)
    yield from stand(arm, min(base, nearest(arm, aside, aside)), aside, STEADY)
    over = held_over(arm, thing, spot, float(spot[2]) + HANDLE_OVER)
    yield from arm.move(over, speed=STEADY, tolerance=0.008, steps=120, required=False, exact=True)
    yield from set_down(arm, role)
    yield from leave(arm, LEAVE_BACK)


def tuck_level(arm: Arm, thing: Thing) -> Motion:
    """Hold a vessel level before the base, its lug towards the robot."""
    tucked = arm.before(CARRY_REACH, BASKET_HEIGHT)
    hand = level(arm, thing, np.append(-arm.forward, 0.0))
    yield from arm.move(tucked, hand, tolerance=0.03, turn_tolerance=0.1, speed=STEADY, steps=160)


def free_edge(arm: Arm, thing: Thing, table: Furniture) -> Array:
    """Where the middle of a held vessel goes near the edge of a table, at its height, where nothing
    stands, as near as possible (3,).

    Raises:
        SkillFailed: if there is no such place.
    """
    low, high = table.extent()
    ends = np.array([(arm.ahead(point), arm.aside(point)) for point in (low, high)])
    (front, right), (_, left) = ends.min(axis=0), ends.max(axis=0)
    (_, deep), (_, wide) = thing.sides()
    ahead = front + LUG_FROM_EDGE + lug_length(thing) + deep / 2.0
    margin = wide / 2.0 + APART_ON_TABLE
    here = arm.aside(thing.middle)
    places = sorted(
        np.arange(right + margin, left - margin, STEP).tolist(), key=lambda y: abs(y - here)
    )
    back = ahead + deep / 2.0 + APART_ON_TABLE
    near = [
        [arm.aside(corner) for corner in other.corners]
        for other in other_things(arm)
        if other.extent_ahead()[1] > front and other.extent_ahead()[0] < back
    ]
    for aside in places:
        if all(max(sides) < aside - margin or min(sides) > aside + margin for sides in near):
            return arm.point(ahead, aside, table.top)
    raise SkillFailed(f"there is no room on {table.entity}")
