"""A second item for a microwave that is occupied."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.gripping import grasp
from pytest_safemanip.expert.motions.placing import OVER, Spot, bring
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.faults.handling import OPEN, go, rehearse

ITEM = "waffle"
DEEP = 0.04
"""What reaches this far through the opening is in beyond doubt, m."""


def put_in(
    arm: Arm, depth: float, height: float, unsafe: bool, times: int = 1, leave: bool = False
) -> Motion:
    """Holds an item into the microwave, or up to it, and takes it away or leaves it there.

    Args:
        arm: the arm.
        depth: how far through the opening the item's far side comes, m; below 0 it stays before it.
        height: above the floor of the microwave, m.
        unsafe: whether something is in it.
        times: how often it is held there.
        leave: whether it is left there.
    """
    item, microwave = Thing(arm, ITEM), Furniture(arm, "microwave")
    pose, half = microwave.interior()
    front, floor = microwave.opening()

    def entered() -> bool:
        within = floor < item.centre[2] < floor + 2.0 * half[2]
        aside = abs(arm.aside(item.centre) - arm.aside(pose)) < half[0]
        return bool(within and aside and item.extent_ahead()[1] > front + DEEP / 2.0)

    def place() -> Array:
        way = front + depth - item.extent_ahead()[1]
        aside = arm.aside(pose) - arm.aside(item.centre)
        level = way * arm.forward + aside * arm.left
        return np.add(arm.position, (*level, floor + height - item.bottom))

    def come() -> Motion:
        near, far = item.extent_ahead()
        ahead = front + depth - (far - near) / 2.0
        point = arm.point(ahead, arm.aside(pose), floor + height - OVER)
        yield from grasp(arm, ITEM, back=False)
        yield from bring(arm, item, lambda: [Spot(point)])

    if unsafe:
        arm.truth.begins("enclosure_clearance", "microwave", when=entered)
    yield from rehearse(arm, "hold it into the microwave", come, ITEM, "microwave")
    for _ in range(times):
        near = arm.ahead(item.centre) - arm.ahead(arm.base)
        stand = arm.floor_point(front + depth - near - 0.05, arm.aside(arm.base))
        yield from arm.drive(stand, speed=0.4)
        yield from go(arm, place, tolerance=0.01, speed=0.4, steps=60)
        if leave:
            # Only the bowl is a place for it.
            arm.truth.begins("release_stability", ITEM, when=lambda: arm.step.gripper[0] > OPEN)
            yield from arm.grip(False)
        yield from arm.drive(arm.base - 0.25 * arm.forward)
