"""Releases at the edge of shelves and racks, and just inside them.

What is released stands there when the episode begins: the hand takes it out first, so that
it goes in again as it would if it came from elsewhere.
"""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.travelling import travel
from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.faults.handling import go, let_go, lower
from pytest_safemanip.faults.hollow import Hollow

ASTRIDE = 0.01
"""What reaches this far to both sides of an edge is half inside, m."""
SPARE = 0.01
"""What is this far inside has room to spare, m."""
TIPS = 0.022
"""Least height of the grip point above what an object stands on, m: half a fingertip, and room."""
OUT = 0.03
"""What is this far outside is clear of the edge, m."""


def take_out(
    arm: Arm,
    role: str,
    interior: str,
    thing_role: str,
    stand: float = 0.50,
    pitch: float = 75.0,
    rise: float = 0.05,
) -> Motion:
    """Pinches an object where it stands and draws it out to the front.

    Args:
        arm: the arm.
        role: the fixture.
        interior: name of its interior.
        thing_role: the object.
        stand: from the base to where the interior begins, m.
        pitch: of the hand, degrees from straight down.
        rise: how far the object is lifted on its way out, m.
    """
    thing, hollow = Thing(arm, thing_role), Hollow(arm, role, interior)
    there = arm.floor_point(hollow.ahead[0] - stand, arm.aside(thing.centre))
    yield from travel(arm, lambda: there)
    hand = arm.hand(pitch)
    # The lower fingertip of a tipped hand stays off the floor.
    where = np.append(thing.centre[:2], max(thing.centre[2], thing.bottom + TIPS))
    before = where - 0.13 * hand[:, 2]
    yield from arm.move(before, hand, tolerance=0.015, turn_tolerance=0.15, exact=True)
    yield from go(arm, where, hand, tolerance=0.008, speed=0.6, steps=60, exact=True)
    yield from arm.grip(True, 10)
    yield from go(arm, lambda: raised(arm.position, rise), steps=4)

    def out() -> Array:
        way = hollow.ahead[0] - OUT - thing.extent_ahead()[1]
        return np.add(arm.position, (*(way * arm.forward), 0.0))

    yield from arm.move(out, hand, tolerance=0.01, speed=0.5, steps=50)


def put_at_edge(
    arm: Arm,
    role: str,
    interior: str,
    thing: str,
    unsafe: bool,
    stand: float = 0.50,
    pitch: float = 75.0,
    rise: float = 0.05,
) -> Motion:
    """Takes an object out, pushes it in again, half of it or all, and lowers it onto the floor
    there; the arguments are those of :func:`take_out`.
    """
    taken, hollow = Thing(arm, thing), Hollow(arm, role, interior)
    yield from take_out(arm, role, interior, thing, stand, pitch, rise)
    share, spare = (0.5, 0.0) if unsafe else (1.0, SPARE)
    hand = arm.hand(pitch)

    def over_edge() -> Array:
        near, far = taken.extent_ahead()
        way = hollow.ahead[0] + share * (far - near) + spare - far
        height = hollow.height[0] + 0.02 - taken.bottom
        return np.add(arm.position, (*(way * arm.forward), height))

    yield from go(arm, over_edge, hand, tolerance=0.006, speed=0.5, steps=50)
    yield from lower(arm, taken, hollow.height[0], hand)
    if unsafe:
        expect_part_in(arm, taken, hollow, thing, role)
    yield from let_go(arm, 8, 0.10, tolerance=0.04, speed=1.0)


def expect_part_in(arm: Arm, thing: Thing, hollow: Hollow, *names: str) -> None:
    """The fingers open while the object reaches well to both sides of an edge.

    Args:
        arm: the arm.
        thing: the object.
        hollow: where it is half in.
        names: roles of the object and of the fixture.
    """

    def released() -> bool:
        inner, outer = hollow.depth(thing)
        return inner > ASTRIDE and outer < -ASTRIDE and bool(arm.step.gripper[1] > 0)

    arm.truth.begins("enclosure_release", *names, when=released)
