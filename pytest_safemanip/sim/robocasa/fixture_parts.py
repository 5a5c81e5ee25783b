"""The parts that each kind of RoboCasa's fixtures can have, known before a scene is built.

How a model names its geoms decides which of them a scene really has (:mod:`.parts`). What stands
here is what it may be: RoboCasa's downloaded appliances leave some of their handles, buttons and
racks without a name, so that those count as what moves them, a ``door`` or a ``drawer``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from pytest_safemanip.trace.elements import BUTTON

OBJECT = frozenset({"body"})
"""The parts of what moves freely."""

_CABINET = OBJECT | {"door", "handle"}
_APPLIANCE = OBJECT | {BUTTON, "door", "drawer", "handle", "knob"}

KINDS: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "BLENDER": _APPLIANCE | {"lid", "switch"},
        "CABINET": _CABINET,
        "CABINET_DOUBLE_DOOR": _CABINET,
        "CABINET_SINGLE_DOOR": _CABINET,
        "CABINET_WITH_DOOR": _CABINET,
        "COFFEE_MACHINE": _APPLIANCE | {"lever", "lid", "switch", "tray"},
        "COUNTER": OBJECT,
        "COUNTER_NON_CORNER": OBJECT,
        "COUNTER_NON_DINING": OBJECT,
        "DINING_COUNTER": OBJECT,
        "DISHWASHER": _APPLIANCE | {"rack"},
        "DISH_RACK": OBJECT | {"rack", "tray"},
        "DRAWER": OBJECT | {"drawer", "handle"},
        "ELECTRIC_KETTLE": _APPLIANCE | {"lever", "lid", "spout", "switch"},
        "FRIDGE": _APPLIANCE | {"rack", "tray"},
        "ISLAND": OBJECT,
        "MICROWAVE": _APPLIANCE | {"tray"},
        "OVEN": _APPLIANCE | {"rack", "tray"},
        "SHELF": _CABINET,
        "SINK": _APPLIANCE | {"lever", "spout"},
        "STAND_MIXER": _APPLIANCE | {"lever", "lid", "switch"},
        "STOOL": OBJECT,
        "STOVE": _APPLIANCE | {"rack", "tray"},
        "TOASTER": _APPLIANCE | {"lever", "tray"},
        "TOASTER_OVEN": _APPLIANCE | {"rack", "tray"},
        "TOP_DRAWER": OBJECT | {"drawer", "handle"},
        "WINDOW": OBJECT,
    }
)
"""Parts by the name of RoboCasa's ``FixtureType``."""

ANY = frozenset().union(*KINDS.values())
"""The parts of a fixture whose kind is not known."""


def parts_of(kinds: frozenset[str] | None) -> frozenset[str]:
    """The parts that a fixture of one of some kinds can have; None means that they are unknown."""
    if kinds is None or not kinds <= KINDS.keys():
        return ANY
    return frozenset().union(*(KINDS[kind] for kind in kinds))
