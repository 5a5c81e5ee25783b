"""Releases at the edge of shelves and racks, and just inside them."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.gripping import grasp
from pytest_safemanip.expert.motions.lowering import withdraw
from pytest_safemanip.expert.motions.placing import Spot, bring
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.tasks.calls import Call
from pytest_safemanip.expert.tasks.search import rehearsed
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.faults.handling import go, lower
from pytest_safemanip.faults.hollow import Hollow

ASTRIDE = 0.01
"""What reaches this far to both sides of an edge is half inside, m."""
SPARE = 0.01
"""What is this far inside has room to spare, m."""
STAYS = 0.008
"""How far inside the middle is, m: with that much of it on the shelf, it does not fall."""
BESIDE = (0.0, 0.05, -0.05, 0.1, -0.1, 0.15, -0.15)
"""From the middle of the shelf to where it is put, m."""


def put_at_edge(arm: Arm, role: str, interior: str, thing: str, unsafe: bool) -> Motion:
    """Takes an object, out of the interior if it stands there, and puts it down at its edge.

    Args:
        arm: the arm.
        role: the fixture.
        interior: name of its interior.
        thing: the object.
        unsafe: whether half of it stands out over the edge.
    """
    taken, hollow = Thing(arm, thing), Hollow(arm, role, interior)

    def inside() -> float:
        """From the edge to the middle of the object, m."""
        near, far = taken.extent_ahead()
        return STAYS if unsafe else (far - near) / 2.0 + SPARE

    def spots() -> list[Spot]:
        right, left = hollow.aside
        most = (left - right) / 2.0 - max(width for _, width in taken.sides()) / 2.0
        there = [off for off in BESIDE if abs(off) <= most] or [0.0]
        return [Spot(hollow.point(inside(), off, 0.0), abs(off)) for off in there]

    def put_there() -> Motion:
        reach = yield from bring(arm, taken, spots)
        floor = hollow.height[0]

        def over_edge() -> Array:
            way = hollow.ahead[0] + inside() - arm.ahead(taken.centre)
            return np.add(arm.position, (*(way * arm.forward), floor + 0.01 - taken.bottom))

        yield from go(arm, over_edge, tolerance=0.004, speed=0.4, steps=60)
        yield from lower(arm, taken, floor, arm.rotation)
        if unsafe:
            expect_part_in(arm, taken, hollow, thing, role)
        yield from arm.grip(False)
        yield from withdraw(arm, reach)

    motions = {"take": lambda: grasp(arm, thing, goal=spots), "put": put_there}
    calls = [
        Call("take", (thing,), f"take {thing}"),
        Call("put", (thing, role), f"put {thing} at the edge of {role}"),
    ]
    yield from rehearsed(arm, calls, lambda call: motions[call.skill]())


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
