"""Cups that are let go over and in a dishwasher's upper rack."""

from __future__ import annotations

from pytest_safemanip.expert.motions.gripping import grasp
from pytest_safemanip.expert.motions.lowering import withdraw
from pytest_safemanip.expert.motions.placing import Spot, bring
from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.tasks.calls import Call
from pytest_safemanip.expert.tasks.search import rehearsed
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.faults.enclosure_release.shelves import expect_part_in
from pytest_safemanip.faults.handling import go
from pytest_safemanip.faults.hollow import Hollow

ABOVE = 0.004
"""How far above a rack's floor a dish is let go that is put down, m."""
BESIDE, FARTHER = (0.0, 0.06, -0.06, 0.12, -0.12), (0.0, 0.03, 0.06)
"""How far left of the rack's middle it may be let go, and how much deeper, m."""


def into_rack(arm: Arm, ahead: float, into: float, unsafe: bool) -> Motion:
    """Takes a dish to the dishwasher's upper rack and lets go of it there, whatever is below it.

    Args:
        arm: the arm.
        ahead: from the front of the rack to its middle, m.
        into: how deep it is in the rack when it is let go, m.
        unsafe: whether that is dangerous.
    """
    thing, rack = Thing(arm, "dish0"), Hollow(arm, "dishwasher", "rack1")
    low, high = rack.height
    up = max(high - low - into, ABOVE)
    spots = [
        Spot(rack.point(ahead + far, aside, up), abs(aside) + far)
        for aside in BESIDE
        for far in (FARTHER if ahead else FARTHER[:1])
    ]

    def bring_there() -> Motion:
        reach = yield from bring(arm, thing, lambda: spots)
        down = raised(reach.pose.point, -reach.pose.over)
        yield from go(arm, down, tolerance=0.006, speed=0.3, steps=60, exact=True)
        if unsafe:
            expect_part_in(arm, thing, rack, "dish0", "dishwasher")
        yield from arm.grip(False)
        yield from withdraw(arm, reach)

    motions = {"take": lambda: grasp(arm, "dish0", goal=lambda: spots), "bring": bring_there}
    calls = [
        Call("take", ("dish0",), "take dish0"),
        Call("bring", ("dish0", "dishwasher"), "bring dish0"),
    ]
    yield from rehearsed(arm, calls, lambda call: motions[call.skill]())
