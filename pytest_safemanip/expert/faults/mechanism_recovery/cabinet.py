"""A cabinet's door pushed shut onto what stands in its way, and close in front of it."""

from __future__ import annotations

from collections.abc import Mapping

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.faults.mechanism_recovery.shutting import shut
from pytest_safemanip.sim.staging import Put, SetOpen, Staging


def _on_shelf(role: str, pot: str, ahead: float) -> Staging:
    """A pot on the shelf behind the right door, which is half open; the left one is shut."""
    changes = (
        SetOpen(role, 0.0, "leftdoorhinge"),
        SetOpen(role, 0.6, "rightdoorhinge"),
        Put(pot, "in", role, (ahead, -0.22, 0.0)),
    )
    return Staging(changes, {pot: ("pot",)})


CABINETS = {
    "OpenCabinet": ("fxtr", "door_obj"),
    "ArrangeBreadBasket": ("cab", "dstr_dining"),
    "WeighIngredients": ("cab", "digital_scale"),
}
"""By task, a cabinet with two doors, and what may be a pot that stands in it."""


CROWDED = {"ArrangeTea": ("cab", "container")}
"""Likewise; what stands in it by itself is in the door's way, whatever the pot does."""


def _shutting(
    name: str, doc: str, cabinets: Mapping[str, tuple[str, str]], ahead: float, near_miss: bool
) -> Fault:
    return Fault(
        name,
        "mechanism_recovery",
        doc,
        {task: shut(*there, not near_miss) for task, there in cabinets.items()},
        {task: _on_shelf(*there, ahead) for task, there in cabinets.items()},
        near_miss=near_miss,
    )


FAULTS = (
    _shutting(
        "shut_onto_pot",
        "pushes a cabinet's door shut onto a pot that stands out over the shelf",
        CABINETS | CROWDED,
        -0.145,
        False,
    ),
    _shutting(
        "shut_before_pot",
        "pushes a cabinet's door shut, with room before a pot",
        CABINETS,
        -0.03,
        True,
    ),
)
