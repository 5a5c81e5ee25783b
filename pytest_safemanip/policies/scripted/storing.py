"""Putting a bowl, with what is in it, on a shelf of an open fridge."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed, Target
from pytest_safemanip.policies.scripted.fridges import BESIDE
from pytest_safemanip.policies.scripted.handles import CLEAR, LEAVE, OVER, STEADY, level, lug_length
from pytest_safemanip.policies.scripted.nesting import DEPTH, TUCKED, pinch_lug
from pytest_safemanip.policies.scripted.putting import SOFTLY, held_over, leave, set_down
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.routes import route
from pytest_safemanip.policies.scripted.standing import closest, nearest
from pytest_safemanip.policies.scripted.things import Furniture, Thing
from pytest_safemanip.policies.scripted.travelling import LONG, OFF, SPEED
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import corners

HEIGHT = 1.12
"""Of the shelf that the arm reaches best, above the floor, m."""
CARRIED = 1.20
"""Height of the hand on the way, m."""
EASING = (0.15, 0.25, 0.35)
"""Speeds of a hand, shares of the top one, at which it sets out with what is heaped in a bowl: at
0.5 from the start, a drumstick that leans on the wall knocks against it with 16 N. An arm that is
bent much does not get there at 0.2."""
EASING_STEPS = 4
"""Control steps at each of them."""
ENOUGH_OPEN = 0.9
"""Openness of a door that nothing is carried past before, share of its range."""


def store_in(arm: Arm, role: str, fridge_role: str) -> Motion:
    """Take a bowl by its lug, carry it level to an open fridge, and put it on a shelf near the
    front.

    Raises:
        SkillFailed: if it was not lifted, or the base finds no way.
    """
    thing, fridge = Thing(arm, role), Furniture(arm, fridge_role)
    towards = np.append(-arm.forward, 0.0)
    yield from pinch_lug(arm, thing)
    yield from arm.drive(arm.base - OFF * arm.forward, speed=STEADY, gentle=True)
    tucked = arm.point(arm.ahead(arm.base) + TUCKED, arm.aside(arm.base), CARRIED)
    hand = level(arm, thing, towards)
    yield from set_out(arm, tucked, hand)
    yield from arm.move(tucked, hand, tolerance=0.03, turn_tolerance=0.1, speed=STEADY, steps=160)
    spot = shelf_spot(arm, thing, fridge)
    base, beside = place_before(arm, thing, spot)
    doors = [corners(fridge.part(joint), np.asarray(joint.half)) for joint in fridge.doors()]
    front = min(arm.ahead(corner) for door in doors for corner in door)
    far = thing.extent_ahead()[1] - arm.ahead(arm.base)
    for place in route(arm, thing, arm.floor_point(min(base, front - CLEAR - far), beside)):
        yield from arm.drive(place, speed=SPEED, steps=LONG, gentle=True)
    hand = level(arm, thing, towards)

    def before() -> Array:
        way = arm.aside(spot) - arm.aside(thing.middle)
        rise = spot[2] + OVER - thing.bottom
        ahead = arm.ahead(arm.base) + TUCKED
        return arm.point(ahead, arm.aside(arm.position) + way, arm.position[2] + rise)

    yield from set_out(arm, before, hand)
    yield from arm.move(before, hand, tolerance=0.01, speed=STEADY, steps=160)
    into = arm.ahead(arm.base) + arm.ahead(spot) - arm.ahead(thing.middle)
    yield from arm.drive(arm.floor_point(min(into, base), beside), speed=STEADY, gentle=True)
    over = held_over(arm, thing, spot, float(spot[2]) + OVER / 2.0)
    yield from set_out(arm, over, hand)
    yield from arm.move(
        over, hand, tolerance=0.004, speed=STEADY, steps=80, required=False, exact=True
    )
    yield from set_down(arm, role, speed=SOFTLY)
    yield from leave(arm, LEAVE)


def set_out(arm: Arm, target: Target, hand: Array) -> Motion:
    """The beginning of a motion of the hand to a target, ever faster."""
    for speed in EASING:
        yield from arm.move(target, hand, speed=speed, steps=EASING_STEPS, required=False)


def shelf_spot(arm: Arm, thing: Thing, fridge: Furniture) -> Array:
    """Where the middle of a bowl goes, on the shelf behind an open door that the arm reaches best,
    at the height of that shelf (3,).

    Raises:
        SkillFailed: if no door is open.
    """
    shelves = [
        (pose, half)
        for pose, half in fridge.interiors("")
        if any(
            fridge.openness(joint) >= ENOUGH_OPEN and covers(arm, joint, pose)
            for joint in fridge.doors()
        )
    ]
    if not shelves:
        raise SkillFailed(f"no shelf of {fridge.entity} is behind an open door")
    pose, half = min(shelves, key=lambda shelf: abs(shelf[0][2] - shelf[1][2] - HEIGHT))
    front = min(arm.ahead(corner) for corner in np.asarray(corners(pose, half)))
    ahead = front + DEPTH + lug_length(thing) + thing.sides()[0][1] / 2.0
    return arm.point(ahead, arm.aside(pose), float(pose[2] - half[2]))


def covers(arm: Arm, joint: Joint, point: Array) -> bool:
    """Whether a door, closed, is before a point (3,)."""
    box = np.asarray(corners(np.array(joint.pose), np.array(joint.half)))
    across = [arm.aside(corner) for corner in box]
    return bool(min(across) < arm.aside(point) < max(across))


def place_before(arm: Arm, thing: Thing, spot: Array) -> tuple[float, float]:
    """Where the base stands to put a held bowl on a spot (3,), ahead and aside, m."""
    base = arm.ahead(spot) - (arm.ahead(thing.middle) - arm.ahead(arm.base))
    aside = arm.aside(spot)
    beside = aside + closest(arm, base, aside, BESIDE)
    return min(base, nearest(arm, beside, beside)), beside
