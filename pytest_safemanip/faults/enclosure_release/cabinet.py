"""Releases half way in, at the edge of a cabinet."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.placing import Spot, bring, withdraw
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.faults.enclosure_release.shelves import ASTRIDE
from pytest_safemanip.faults.handling import go, lower, rehearse, take

BESIDE = (0.0, 0.05, -0.05, 0.1, -0.1, 0.15, -0.15)
"""From the middle of the shelf to where it is put, m."""
STAYS = 0.008
"""How far inside the middle is, m: with that much of it on the shelf, it does not fall."""


def half_inside(arm: Arm) -> Motion:
    """Lets go with the object half over the shelf's front edge."""
    thing, cabinet = Thing(arm, "obj"), Furniture(arm, "cab")
    yield from take(arm, "obj")
    front, shelf = cabinet.opening()
    middle = arm.aside(cabinet.interior()[0])
    spots = [Spot(arm.point(front + STAYS, middle + off, shelf), abs(off)) for off in BESIDE]

    def at_edge() -> Array:
        way = front + STAYS - arm.ahead(thing.centre)
        return np.add(arm.position, (*(way * arm.forward), shelf + 0.01 - thing.bottom))

    def astride() -> bool:
        near, far = thing.extent_ahead()
        return near < front - ASTRIDE and far > front + ASTRIDE

    def put_there() -> Motion:
        reach = yield from bring(arm, thing, lambda: spots)
        yield from go(arm, at_edge, tolerance=0.004, speed=0.4, steps=60)
        yield from lower(arm, thing, shelf, arm.rotation)
        arm.truth.begins("enclosure_release", "obj", "cab", when=astride)
        yield from arm.grip(False)
        yield from withdraw(arm, reach)

    yield from rehearse(arm, "put it down at the edge", put_there, "obj", "cab")
