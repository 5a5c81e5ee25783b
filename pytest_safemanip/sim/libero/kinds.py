"""What LIBERO's kinds of furniture are: how they open, what they hold, what stands for a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

WORKSPACES: Mapping[str, str] = {
    "table": "table",
    "kitchen_table": "table",
    "living_room_table": "living_room_table",
    "study_table": "study_table",
    "coffee_table": "coffee_table",
    "floor": "floor",
}
"""The body of the model that each kind of workspace is."""


@dataclass(frozen=True)
class Kind:
    """A kind of fixture.

    Attributes:
        moves: what its joints move: drawers, doors or knobs; empty if it has none.
        opened: joint position at openness 1; closed and off is 0. Metres or radians.
        open_at: openness from which LIBERO's own check calls it open, or on.
        interiors: names of the regions that things are put in.
        exclusive: whether it takes one item at a time.
        attributes: see :class:`~pytest_safemanip.trace.elements.Entity`.
    """

    moves: Literal["", "drawer", "door", "knob"] = ""
    opened: float = 0.0
    open_at: float = 0.9
    interiors: tuple[str, ...] = ()
    exclusive: bool = False
    attributes: tuple[str, ...] = ()

    @property
    def encloses(self) -> bool:
        """Whether things are put into it, through a door or from the side."""
        return bool(self.interiors)

    @property
    def opens(self) -> bool:
        """Whether its joints give access to its interiors."""
        return self.moves in ("drawer", "door")


_DRAWERS = Kind("drawer", -0.16, 0.14 / 0.16, ("top_region", "middle_region", "bottom_region"))
KINDS: Mapping[str, Kind] = {
    "wooden_cabinet": _DRAWERS,
    "white_cabinet": _DRAWERS,
    "short_cabinet": Kind("drawer", 0.16, 0.10 / 0.16, _DRAWERS.interiors),
    "microwave": Kind(
        "door", -2.094, 1.3 / 2.094, ("heating_region",), exclusive=True, attributes=("no_metal",)
    ),
    "short_fridge": Kind("door", 2.7, 2.0 / 2.7, ("contain_region",)),
    "flat_stove": Kind("knob", 2.1, 0.5 / 2.1),
    "wooden_two_layer_shelf": Kind(interiors=("top_region", "bottom_region")),
}
"""From the classes in LIBERO's ``envs/objects``; a kind that is not here holds and opens nothing.
"""
PLAIN = Kind()

HEADROOM = 0.02
"""How far above a drawer's region its inside begins for a hand, m. The regions are 6 cm high; in
them LIBERO looks for the middle of what was put in. A hand whose fingers reach the bottom has its
own middle just above."""

COOK_REGION = "cook_region"
"""The site of a stove that LIBERO looks for pans on."""
HEATED_HEIGHT = 0.1
"""How far above and below that a burner heats, m."""

RECEIVERS = frozenset(
    {"basket", "wooden_tray", "white_storage_box", "akita_black_bowl", "white_bowl"}
)
"""Kinds of objects that others are put into, and not only onto."""

OBSTACLE = "_obstacle"
"""What SafeLIBERO appends to the category of an obstacle."""


def kind_of(category: str) -> Kind:
    """What is known of a category of fixtures."""
    return KINDS.get(category, PLAIN)


def category_of(name: str) -> str:
    """The category of an object in ``tasks/objects.yaml``; an obstacle is what it looks like."""
    return name.removesuffix(OBSTACLE)
