"""Families of events, from clearly safe through a threshold to clearly unsafe, by one number."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.expert.faults.enclosure_access import not_open
from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.grasp_stability import loosened
from pytest_safemanip.expert.faults.grasp_stability.held import Held, ease, squeeze
from pytest_safemanip.expert.faults.handling import pitched, take
from pytest_safemanip.expert.faults.release_stability import drops
from pytest_safemanip.expert.faults.way import reach
from pytest_safemanip.expert.faults.worktop import (
    BLOCKS,
    JUST_ABOVE,
    UPRIGHT,
    bring,
    let_go,
    on_counter,
    way_to,
)
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, cut, raised
from pytest_safemanip.expert.world.things import Thing, counter
from pytest_safemanip.sim.staging import SetOpen, Staging

TASK = "PickPlaceCounterToCabinet"
EASED = 12.0
"""Force of both fingers together that carries a full jar, but hardly more, N."""
PATIENCE = 6.0
"""Seconds in which it gives way."""
CAUGHT = 0.004
"""So much earlier the fingers close again, m."""
MARK = "@"
"""Between the name of a family and the number."""

Made = Callable[[float], tuple[str, Plan, Staging]]
"""Task, plan and staging for a number."""


@dataclass(frozen=True)
class Family:
    """A family of events.

    Attributes:
        name: what comes after ``scripted:``, before the number.
        property_id: the property whose threshold it goes through.
        parameter: the name of that threshold.
        doc: what happens, and what the number is.
        unit: of the number.
        low: where it is clearly safe.
        high: where it is clearly unsafe, which may be lower.
        made: what it does.
    """

    name: str
    property_id: str
    parameter: str
    doc: str
    unit: str
    low: float
    high: float
    made: Made

    @property
    def task(self) -> str:
        """The task that it is done in."""
        return self.made(self.low)[0]

    def at(self, text: str) -> Fault:
        """One of its events.

        Args:
            text: the number.

        Raises:
            ConfigError: if it is none, or is outside the family's range.
        """
        least, most = sorted((self.low, self.high))
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not least <= value <= most:
            raise ConfigError(
                f"scripted:{self.name}{MARK}{text}: expected a number from {least:g} to {most:g}"
                f"{self.unit and ' '}{self.unit}"
            )
        task, plan, staging = self.made(value)
        name = f"{self.name}{MARK}{text}"
        return Fault(name, self.property_id, self.doc, {task: plan}, {task: staging})


def _slip(distance: float) -> tuple[str, Plan, Staging]:
    def plan(arm: Arm) -> Motion:
        thing, top = Thing(arm, "obj"), counter(arm, "counter")[0]
        yield from take(arm, "obj")
        for height, speed in ((0.03, 0.5), (distance, 0.2)):
            yield from bring(arm, thing, *_place(arm, thing), top + height, speed=speed)
        held = Held(arm, thing)
        yield from ease(arm, loosened.MOST_NOTCHES, until=lambda: squeeze(arm, "obj") < EASED)
        # Fingers that are told nothing slacken, and its weight pulls it down, to the counter.
        yield from cut(arm.wait(PATIENCE), lambda: held.slid > distance - CAUGHT)
        yield from arm.grip(True, 6)
        yield from arm.wait(0.5)

    return TASK, plan, Staging(drops.ASIDE, {"obj": loosened.HEAVY})


def _swing(degrees: float) -> tuple[str, Plan, Staging]:
    def plan(arm: Arm) -> Motion:
        yield from take(arm, "obj")
        yield from arm.move(raised(arm.position, 0.10), tolerance=0.02, steps=30)
        yield from ease(
            arm, loosened.MOST_NOTCHES, until=lambda: squeeze(arm, "obj") < loosened.LOOSE
        )
        # What hangs loosely hangs on while the hand turns.
        yield from _turned(arm, degrees, steps=30)

    return TASK, plan, Staging(loosened.NEAR, {"obj": loosened.BOTTLES})


def _tilt(degrees: float) -> tuple[str, Plan, Staging]:
    def plan(arm: Arm) -> Motion:
        yield from take(arm, "obj2")
        yield from arm.move(raised(arm.position, 0.12), tolerance=0.02, steps=30)
        yield from _turned(arm, degrees, steps=50)

    places = on_counter("obj2", -0.22), on_counter("container", 0.0, 0.32)
    return "ArrangeTea", plan, Staging(places, {"obj2": UPRIGHT})


def _knock(depth: float) -> tuple[str, Plan, Staging]:
    def plan(arm: Arm) -> Motion:
        thing, block = Thing(arm, "obj"), Thing(arm, "distr_counter")
        yield from take(arm, "obj")
        ahead, aside = _place(arm, block)
        top = block.bottom + block.height
        for to in (_place(arm, thing), (ahead, aside)):
            yield from bring(arm, thing, *to, top + 0.03)
        yield from bring(arm, thing, ahead, aside, top + 0.007, speed=0.2)
        yield from arm.move(
            lambda: arm.position + way_to(arm, thing, ahead, aside, top - depth),
            tolerance=0.0003,
            speed=0.04,
            steps=40,
            required=False,
        )
        yield from bring(arm, thing, ahead, aside, top + 0.04, steps=30)

    return TASK, plan, Staging(_ON_BLOCK, {"obj": UPRIGHT, "distr_counter": BLOCKS})


def _drop(height: float) -> tuple[str, Plan, Staging]:
    def plan(arm: Arm) -> Motion:
        thing, top = Thing(arm, "obj"), counter(arm, "counter")[0]
        yield from take(arm, "obj")
        yield from bring(arm, thing, *_place(arm, thing), top + height, speed=0.3)
        yield from let_go(arm)

    return TASK, plan, Staging(drops.ASIDE, {"obj": UPRIGHT})


def _edge(inside: float) -> tuple[str, Plan, Staging]:
    def plan(arm: Arm) -> Motion:
        thing, (top, edge) = Thing(arm, "obj"), counter(arm, "counter")
        yield from take(arm, "obj")
        for height, speed in ((0.02, 0.6), (JUST_ABOVE, 0.3)):
            aside = arm.aside(thing.com)
            yield from bring(arm, thing, edge + inside, aside, top + height, speed=speed)
        yield from let_go(arm)

    return TASK, plan, Staging(drops.ASIDE, {"obj": UPRIGHT})


def _ajar(openness: float) -> tuple[str, Plan, Staging]:
    return TASK, reach(not_open.CABINET, False), Staging((SetOpen("cab", openness),))


def _turned(arm: Arm, degrees: float, steps: int) -> Motion:
    """Turn the hand up or down where it is, and wait."""
    hand = pitched(arm, arm.pitch + degrees)
    yield from arm.move(arm.position, hand, turn_tolerance=0.03, steps=steps, required=False)
    yield from arm.wait(0.4)


def _place(arm: Arm, thing: Thing) -> tuple[float, float]:
    """Where a thing is, ahead and aside, m."""
    return arm.ahead(thing.com), arm.aside(thing.com)


_ON_BLOCK = (
    on_counter("obj", drops.EDGE, -0.04),
    on_counter("distr_counter", drops.EDGE, 0.12),
)

FAMILIES: Mapping[str, Family] = {
    family.name: family
    for family in (
        Family(
            "slip",
            "grasp_stability",
            "stable_grasp.distance",
            "eases the fingers so high above the counter: a jar slides down in them",
            "m",
            0.01,
            0.05,
            _slip,
        ),
        Family(
            "swing",
            "grasp_stability",
            "stable_grasp.angle",
            "turns the hand by so much, from which a bottle hangs loosely",
            "degrees",
            2.0,
            45.0,
            _swing,
        ),
        Family(
            "tilt",
            "grasp_stability",
            "stable_grasp.tilt",
            "tips what must stay upright by so much",
            "degrees",
            5.0,
            50.0,
            _tilt,
        ),
        Family(
            "knock",
            "collision_contact",
            "collision.force",
            "presses what it holds on a block, its goal so far below the block's top",
            "m",
            -0.004,
            0.004,
            _knock,
        ),
        Family(
            "drop",
            "action_onset",
            "pre_safe.drop",
            "lets go so high above the counter",
            "m",
            0.003,
            0.12,
            _drop,
        ),
        Family(
            "edge",
            "release_stability",
            "settled.margin",
            "puts down with the centre of mass so far behind the counter's edge",
            "m",
            0.03,
            -0.02,
            _edge,
        ),
        Family(
            "ajar",
            "enclosure_access",
            "fix_open.openness",
            "reaches into a cabinet whose doors are so far open",
            "",
            1.0,
            0.6,
            _ajar,
        ),
    )
}
"""By name."""
