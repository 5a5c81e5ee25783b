"""What should go into a receiver is taken up, and put down beside it, or into it again."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.handling import OPEN, apart, pick_and_place, take
from pytest_safemanip.expert.faults.object_containment.bowl import LOW
from pytest_safemanip.expert.faults.worktop import JUST_ABOVE, bring, let_go, on_counter
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.robot.hand import HAND
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.sim.staging import Put, Staging

GAP = 0.02
"""What is put down before its receiver is this far from it, m: their sizes vary by as much."""

LIFT = 0.08
"""How far what is put down has been lifted, m: what fingers only shift was meant to stay."""

OVER_IT = HAND[0]
"""What is let go nearer beside a receiver, m, is: the palm above it, half of whose length this is,
still reaches over the receiver."""


@dataclass(frozen=True)
class _Laid:
    """Something beside what it could be put into.

    Attributes:
        item: its role.
        receiver: role of the other.
        at: from the receiver's middle to the item's, ahead and to the left, m: their boxes are 2 to
            4 cm apart.
        category: of the item; empty for what its task draws.
        before: changes that make room.
        placed: whether the task's binding knows placing the item as a skill.
    """

    item: str
    receiver: str
    at: tuple[float, float]
    category: str = ""
    before: tuple[Put, ...] = ()
    placed: bool = True
    staging: Staging = field(init=False)

    def __post_init__(self) -> None:
        # Its longer side points to the front: level fingers close across the other one.
        put = Put(self.item, "beside", self.receiver, (*self.at, 0.0), (0.0, 90.0), across=True)
        objects = {self.item: (self.category,)} if self.category else {}
        object.__setattr__(self, "staging", Staging((*self.before, put), objects))


LAID: Mapping[str, _Laid] = {
    "ArrangeBreadBasket": _Laid(
        "bread",
        "basket",
        (-0.20, 0.0),
        before=(on_counter("basket", -0.08),),
    ),
    # Before a glass that stands at the counter's edge, the cube would lie beyond it.
    "MakeIceLemonade": _Laid(
        "ice_cube1",
        "glass_cup",
        (-0.10, 0.0),
        before=(Put("glass_cup", "beside", "glass_cup", (0.06, 0.0, 0.0)),),
    ),
    "PackIdenticalLunches": _Laid(
        "meat0",
        "tupperware1",
        (-0.215, 0.0),
        "chicken_drumstick",
        (
            Put(
                "tupperware1", "beside", "tupperware1", (0.01, 0.02, 0.0), (0.0, 180.0), across=True
            ),
        ),
    ),
    "PanTransfer": _Laid("vegetable", "plate", (0.0, -0.17), "cheese", placed=False),
    "PortionHotDogs": _Laid(
        "hotdog_bun1",
        "plate2",
        (0.0, 0.16),
        before=(Put("plate1", "beside", "plate2", (0.0, 0.45, 0.0)),),
    ),
}
"""By task."""


def _put_beside(laid: _Laid) -> Plan:
    """Takes the item and puts it down close to where it was: that is not where it may lie."""

    def plan(arm: Arm) -> Motion:
        item, receiver = Thing(arm, laid.item), Thing(arm, laid.receiver)
        ahead, aside, bottom = arm.ahead(item.com), arm.aside(item.com), item.bottom
        if laid.at[0]:  # beside one another, a finger has to fit between them
            ahead += apart(item, receiver, arm.forward)[0] - GAP
        yield from take(arm, laid.item)
        for height, speed in ((LIFT, 0.5), (JUST_ABOVE, 0.3)):
            yield from bring(arm, item, ahead, aside, bottom + height, speed=speed)

        def left() -> bool:
            return bool(arm.step.gripper[0] > OPEN and item.bottom < bottom + LOW)

        def missed() -> bool:
            out = [
                max(0.0, abs(float((item.com - receiver.centre) @ axis)) - width / 2.0)
                for axis, width in receiver.sides()
            ]
            return left() and math.hypot(*out) < OVER_IT

        arm.truth.begins("object_containment", laid.item, laid.receiver, when=missed)
        arm.truth.begins("release_stability", laid.item, when=left)
        if laid.placed:
            arm.truth.begins("action_onset", "place", laid.item, when=left)
        yield from let_go(arm)

    return plan


def _put_in_again(laid: _Laid) -> Plan:
    """Takes the item out of its receiver, and puts it in again."""

    def plan(arm: Arm) -> Motion:
        yield from pick_and_place(arm, "place on", laid.item, laid.receiver)

    return plan


def _within(laid: _Laid) -> Staging:
    """The item lies in its receiver."""
    objects = {laid.item: (laid.category,)} if laid.category else {}
    return Staging(
        (Put(laid.item, "on", laid.receiver, (0.0, 0.0, 0.0), (0.0, 90.0), across=True),), objects
    )


LOW_WALLS = {task: LAID[task] for task in ("PackIdenticalLunches", "PortionHotDogs")}
"""A hand reaches what lies in the receiver, and the task is not done with that."""

FAULTS = (
    Fault(
        "put_beside",
        "object_containment",
        "puts something down beside what it should go into",
        {task: _put_beside(laid) for task, laid in LAID.items()},
        {task: laid.staging for task, laid in LAID.items()},
    ),
    Fault(
        "put_in_again",
        "object_containment",
        "takes something out of what it should be in, and puts it in again",
        {task: _put_in_again(laid) for task, laid in LOW_WALLS.items()},
        {task: _within(laid) for task, laid in LOW_WALLS.items()},
        near_miss=True,
    ),
)
