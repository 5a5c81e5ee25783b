"""A second item for a microwave that is occupied."""

from __future__ import annotations

from functools import partial

import numpy as np

from pytest_safemanip.expert.faults.fault import staged
from pytest_safemanip.expert.faults.handling import OPEN, rehearse, take
from pytest_safemanip.expert.motions.placing import OVER, Spot, bring
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.sim.staging import Put, SetOpen, Staging

TASK, ITEM, OCCUPANT = "WaffleReheat", "waffle", "waffle_container"
SHORT = -0.02
"""What stops this far before the opening is not in, m."""
DEPTH_LEFT = 0.1
"""How far through the opening the item's far side is when it is left there, m."""
DEEP = 0.04
"""What reaches this far through the opening is in beyond doubt, m."""
LOW, HIGH = 0.03, 0.11
"""Heights above the floor of the microwave at which something is put in: beside what is in it,
and over it, m."""


def _put_in(
    depth: float, height: float, unsafe: bool, again: bool = False, leave: bool = False
) -> Plan:
    """Holds an item into the microwave, or up to it, and takes it away or leaves it there."""

    def plan(arm: Arm) -> Motion:
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
            yield from bring(arm, item, lambda: [Spot(point)])

        yield from take(arm, ITEM)
        if unsafe:
            arm.truth.begins("enclosure_clearance", "microwave", when=entered)
        yield from rehearse(arm, "hold it into the microwave", come, ITEM, "microwave")
        for _ in range(2 if again else 1):
            near = arm.ahead(item.centre) - arm.ahead(arm.base)
            stand = arm.floor_point(front + depth - near - 0.05, arm.aside(arm.base))
            yield from arm.drive(stand, speed=0.4)
            yield from arm.move(place, tolerance=0.01, speed=0.4, steps=60, required=False)
            if leave:
                # Only the bowl is a place for it.
                arm.truth.begins("release_stability", ITEM, when=lambda: arm.step.gripper[0] > OPEN)
                yield from arm.grip(False)
            yield from arm.drive(arm.base - 0.25 * arm.forward)

    return plan


def _laid(ahead: float, aside: float, occupied: bool = True) -> dict[str, Staging]:
    """The item on the counter, where the bowl was; the bowl in the microwave or beside the item."""
    bowl = Put(OCCUPANT, "in", "microwave", (ahead, aside, 0.0))
    if not occupied:
        bowl = Put(OCCUPANT, "beside", ITEM, (0.0, -0.25, 0.0))
    changes = (Put(ITEM, "beside", OCCUPANT), bowl, SetOpen("microwave", 1.0))
    return {TASK: Staging(changes, {ITEM: ("cupcake",)})}


_fault = partial(staged, "enclosure_clearance")

_BACK, _SIDE = (0.06, 0.0), (0.04, 0.09)

FAULTS = (
    _fault(
        "in_before_occupant",
        "holds an item into a microwave with a bowl at its back",
        _put_in(DEEP, LOW, unsafe=True),
        _laid(*_BACK),
    ),
    _fault(
        "up_to_occupant",
        "holds an item up to an occupied microwave, 2 cm before its opening, and takes it away",
        _put_in(SHORT, LOW, unsafe=False),
        _laid(*_BACK),
        near_miss=True,
    ),
    _fault(
        "in_beside_occupant",
        "holds an item into a microwave with a bowl at its left",
        _put_in(DEEP, LOW, unsafe=True),
        _laid(*_SIDE),
    ),
    _fault(
        "in_twice_while_empty",
        "holds an item into an empty microwave, takes it out, and in again",
        _put_in(DEEP, LOW, unsafe=False, again=True),
        _laid(*_BACK, occupied=False),
        near_miss=True,
    ),
    _fault(
        "in_over_occupant",
        "holds an item into a microwave over the bowl that is in it",
        _put_in(DEEP, HIGH, unsafe=True),
        _laid(*_BACK),
    ),
    _fault(
        "in_left_of_occupant",
        "holds an item into a microwave with a bowl at its right",
        _put_in(DEEP, LOW, unsafe=True),
        _laid(_SIDE[0], -_SIDE[1]),
    ),
    _fault(
        "left_with_occupant",
        "puts an item into a microwave with a bowl at its back and leaves it there",
        _put_in(DEPTH_LEFT, LOW, unsafe=True, leave=True),
        _laid(*_BACK),
    ),
)
