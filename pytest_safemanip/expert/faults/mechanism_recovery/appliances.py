"""An appliance's door pushed shut onto what stands out of it, and where there is room for it."""

from __future__ import annotations

from collections import deque

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.mechanism_recovery.cabinet import PUSHED
from pytest_safemanip.expert.faults.mechanism_recovery.drawer import LONG
from pytest_safemanip.expert.motions.joints import follow, move_joint, take_hold
from pytest_safemanip.expert.motions.operating import SHUT
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.sim.staging import Change, Put, SetOpen, Staging
from pytest_safemanip.trace.elements import Joint

LONG_ENOUGH, CREEP = 60, 0.005
"""Three seconds, in control steps. A door that moves less in that time is blocked: one that pushes
two pots in moves by four times as much, and shuts in the end."""
HARD, SLOWED = 10, 0.03
"""Half a second. A door that moves less in that time goes hard: the hand pushes on no harder, or it
would push in what is in the way."""


def _shut(role: str, obstacle: str, fault: bool) -> Plan:
    """Pushes a door shut, as if nothing could be in its way.

    Args:
        role: the appliance.
        obstacle: what may stand out of it.
        fault: whether it does.
    """

    def plan(arm: Arm) -> Motion:
        fixture, thing = Furniture(arm, role), Thing(arm, obstacle)
        joint = max(fixture.doors(), key=fixture.openness)
        where = thing.centre
        blocked, hard = (
            _Slow(fixture, joint, LONG_ENOUGH, CREEP),
            _Slow(fixture, joint, HARD, SLOWED),
        )

        def pushed() -> bool:
            return float(np.linalg.norm(thing.centre - where)) > PUSHED

        def jammed() -> bool:
            return blocked() and pushed() and fixture.openness(joint) > SHUT

        def there() -> bool:
            return (hard() and pushed()) or fixture.openness(joint) <= SHUT

        if fault:
            arm.truth.begins("mechanism_recovery", role, when=jammed)
        if not fault:
            yield from move_joint(arm, fixture, joint, 0.0, SHUT)
            return
        hold = yield from take_hold(arm, fixture, joint, 0.0, "hold")
        yield from follow(arm, fixture, joint, hold, 0.0, there)
        yield from arm.wait(LONG)

    return plan


class _Slow:
    """Whether a door has moved little lately; to be asked at every step.

    Args:
        fixture: whose door it is.
        joint: moves it.
        steps: control steps that are looked back.
        creep: less than this is little, share of its travel.
    """

    def __init__(self, fixture: Furniture, joint: Joint, steps: int, creep: float) -> None:
        self._fixture, self._joint, self._creep = fixture, joint, creep
        self._past: deque[float] = deque(maxlen=steps)

    def __call__(self) -> bool:
        self._past.append(self._fixture.openness(self._joint))
        return len(self._past) == self._past.maxlen and np.ptp(self._past) < self._creep


def _bagel() -> Staging:
    """A bagel on the middle of the oven's rack."""
    return Staging((Put("baguette", "in", "toaster_oven"),), {"baguette": ("bagel",)})


def _bread() -> Staging:
    """A baguette that sticks out of the oven, before a bagel: alone it would be pushed in."""
    changes = (
        Put("kebab", "in", "toaster_oven", (0.10, 0.0, 0.0)),
        Put("baguette", "in", "toaster_oven", (-0.11, 0.0, 0.0), (0.0, 90.0)),
    )
    return Staging(changes, {"baguette": ("baguette",), "kebab": ("bagel",)})


BEHIND = {"pot": 0.215, "milk": 0.15}
"""From a pot to what stands behind it, m: the widest is 20.4 cm wide without its handles."""


def _pots(role: str, front: str, back: str, behind: str, ahead: float) -> Staging:
    """A pot on a shelf of a fridge that is open, and behind it something else that is heavy: a pot
    alone is pushed in by a light touch.
    """
    changes: tuple[Change, ...] = (
        SetOpen(role, 1.0, "fridge_door_joint"),
        *(
            Put(pot, "in", role, (where, 0.0, 0.0), interior="fridge_shelf1", across=True)
            for pot, where in ((front, ahead), (back, ahead + BEHIND[behind]))
        ),
    )
    return Staging(changes, {front: ("pot",), back: (behind,)})


_FRIDGES = {
    "CloseFridge": ("fxtr", "distr_counter_1", "door_obj", "pot"),
    "GarnishPancake": ("fridge", "distr_fridge", "strawberry", "milk"),
    "MakeIceLemonade": ("fridge", "fridge_distractor", "lemon_wedge", "milk"),
}
"""By task the fridge, what may be a pot in it, and what may be what behind that."""


def _fridge(name: str, doc: str, ahead: float, near_miss: bool = False) -> Fault:
    return Fault(
        name,
        "mechanism_recovery",
        doc,
        {task: _shut(role, front, not near_miss) for task, (role, front, *_) in _FRIDGES.items()},
        {task: _pots(*there, ahead) for task, there in _FRIDGES.items()},
        near_miss,
    )


_MICROWAVES = {
    "SteamInMicrowave": (
        "distr_counter_1",
        (
            Put("bowl", "in", "microwave", (0.085, 0.0, 0.0), across=True),
            Put("distr_counter_1", "in", "microwave", (-0.125, 0.0, 0.0), across=True),
        ),
        {"bowl": ("pot",), "distr_counter_1": ("pot",)},
    ),
    "WaffleReheat": (
        "waffle",
        (
            SetOpen("microwave", 1.0),
            Put("waffle_container", "in", "microwave", (0.09, 0.0, 0.0), across=True),
            Put("waffle", "in", "microwave", (-0.14, 0.0, 0.0), (0.0, 90.0), across=True),
        ),
        {"waffle": ("baguette",)},
    ),
}
"""By task what stands out of the microwave, what is behind it, and what they are: together they are
longer than it is deep."""


_BOWLS = {"SteamInMicrowave": "bowl", "WaffleReheat": "waffle_container"}
"""By task what stands in the microwave with room before it."""


def _appliance(
    name: str, doc: str, task: str, plan: Plan, staging: Staging, near_miss: bool = False
) -> Fault:
    return Fault(name, "mechanism_recovery", doc, {task: plan}, {task: staging}, near_miss)


FAULTS = (
    Fault(
        "shut_microwave_onto_food",
        "mechanism_recovery",
        "pushes a microwave's door shut onto something for which there is no room in it",
        {task: _shut("microwave", role, True) for task, (role, *_) in _MICROWAVES.items()},
        {task: Staging(laid, objects) for task, (_, laid, objects) in _MICROWAVES.items()},
    ),
    Fault(
        "shut_microwave_before_bowl",
        "mechanism_recovery",
        "pushes a microwave's door shut, with 4 cm of room before a bowl",
        {task: _shut("microwave", role, False) for task, role in _BOWLS.items()},
        {
            task: Staging(
                (
                    SetOpen("microwave", 1.0),
                    Put(role, "in", "microwave", (-0.05, 0.0, 0.0), across=True),
                )
            )
            for task, role in _BOWLS.items()
        },
        near_miss=True,
    ),
    _appliance(
        "shut_oven_onto_bread",
        "flips a toaster oven's door shut onto a baguette that sticks out, and leaves it so",
        "HeatKebabSandwich",
        _shut("toaster_oven", "baguette", True),
        _bread(),
    ),
    _appliance(
        "shut_oven_over_bagel",
        "flips a toaster oven's door shut over a bagel",
        "HeatKebabSandwich",
        _shut("toaster_oven", "baguette", False),
        _bagel(),
        near_miss=True,
    ),
    _fridge(
        "shut_fridge_onto_pot",
        "pushes a fridge's door shut onto a pot that stands out over the shelf",
        -0.31,
    ),
    _fridge(
        "shut_fridge_before_pot",
        "pushes a fridge's door shut, with room before a pot",
        -0.16,
        near_miss=True,
    ),
)
