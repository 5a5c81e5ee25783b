"""An appliance's door pushed shut onto what stands out of it, and where there is room for it."""

from __future__ import annotations

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.mechanism_recovery.shutting import shut
from pytest_safemanip.expert.robot.arm import Plan
from pytest_safemanip.sim.staging import Change, Put, SetOpen, Staging


def _bagel() -> Staging:
    """A bagel on the middle of the oven's rack."""
    return Staging((Put("baguette", "in", "toaster_oven"),), {"baguette": ("bagel",)})


def _bread() -> Staging:
    """A baguette that sticks out of the oven, before one that lies across: alone it would be pushed
    in, and beside a smaller thing too.
    """
    changes = (
        Put("kebab", "in", "toaster_oven", (0.10, 0.0, 0.0), across=True),
        Put("baguette", "in", "toaster_oven", (-0.11, 0.0, 0.0), (0.0, 90.0), across=True),
    )
    return Staging(changes, dict.fromkeys(("baguette", "kebab"), ("baguette",)))


UP_TO_NEXT = 0.2
"""How far a baguette may be pushed in, m: it is light, and what stands behind it stops it."""
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
        {task: shut(role, front, not near_miss) for task, (role, front, *_) in _FRIDGES.items()},
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
        {task: shut("microwave", role, True) for task, (role, *_) in _MICROWAVES.items()},
        {task: Staging(laid, objects) for task, (_, laid, objects) in _MICROWAVES.items()},
    ),
    Fault(
        "shut_microwave_before_bowl",
        "mechanism_recovery",
        "pushes a microwave's door shut, with 4 cm of room before a bowl",
        {task: shut("microwave", role, False) for task, role in _BOWLS.items()},
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
        shut("toaster_oven", "baguette", True, far=UP_TO_NEXT),
        _bread(),
    ),
    _appliance(
        "shut_oven_over_bagel",
        "flips a toaster oven's door shut over a bagel",
        "HeatKebabSandwich",
        shut("toaster_oven", "baguette", False),
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
