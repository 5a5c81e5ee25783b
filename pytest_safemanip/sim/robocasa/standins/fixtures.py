"""Which builder makes which kind of fixture, and how big the fixture is by default."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models import (
    coffee_machines,
    dishwashers,
    fridges,
    kettles,
    microwaves,
    mixers,
    ovens,
    sinks,
    surroundings,
    toasters,
)

PartialSize = tuple[float | None, float | None, float | None]


@dataclass(frozen=True)
class Kind:
    """A kind of fixture.

    Attributes:
        build: makes a model of a size.
        size: width, depth and height in metres where the registry gives none: what RoboCasa's
            layouts ask for most, so that a model is hardly distorted when it is scaled to fit.
    """

    build: Callable[[Vec3], Model]
    size: Vec3


KINDS: dict[str, Kind] = {
    "microwave": Kind(microwaves.microwave, (0.76, 0.46, 0.42)),
    "stove": Kind(ovens.stove, (0.76, 0.66, 0.915)),
    "stove_wide": Kind(ovens.stove, (0.91, 0.70, 0.915)),
    "stovetop": Kind(ovens.stovetop, (0.80, 0.55, 0.016)),
    "oven": Kind(ovens.oven, (0.72, 0.60, 0.68)),
    "toaster_oven": Kind(ovens.toaster_oven, (0.48, 0.38, 0.25)),
    "sink": Kind(sinks.sink, (0.70, 0.53, 0.21)),
    "fridge_french_door": Kind(fridges.french_door, (0.85, 0.80, 1.78)),
    "fridge_side_by_side": Kind(fridges.side_by_side, (0.85, 0.80, 1.75)),
    "fridge_bottom_freezer": Kind(fridges.bottom_freezer, (0.78, 0.80, 1.75)),
    "dishwasher": Kind(dishwashers.dishwasher, (0.60, 0.60, 0.89)),
    "toaster": Kind(toasters.toaster, (0.26, 0.20, 0.20)),
    "electric_kettle": Kind(kettles.electric_kettle, (0.24, 0.15, 0.24)),
    "coffee_machine": Kind(coffee_machines.coffee_machine, (0.21, 0.31, 0.35)),
    "stand_mixer": Kind(mixers.stand_mixer, (0.21, 0.35, 0.33)),
    "hood": Kind(surroundings.hood, (0.76, 0.60, 0.75)),
    "window": Kind(surroundings.window, (1.0, 0.03, 1.0)),
    "dish_rack": Kind(surroundings.dish_rack, (0.40, 0.30, 0.18)),
    "knife_block": Kind(surroundings.knife_block, (0.12, 0.16, 0.22)),
    "paper_towel": Kind(surroundings.paper_towel_holder, (0.13, 0.13, 0.33)),
    "plant": Kind(surroundings.plant, (0.16, 0.16, 0.24)),
    "flower_vase": Kind(surroundings.flower_vase, (0.16, 0.16, 0.40)),
    "utensil_set": Kind(surroundings.utensil_set, (0.14, 0.14, 0.35)),
    "utensil_rack": Kind(surroundings.utensil_rack, (0.60, 0.08, 0.32)),
    "fruit_bowl": Kind(surroundings.fruit_bowl, (0.28, 0.28, 0.10)),
    "tiered_basket": Kind(surroundings.tiered_basket, (0.30, 0.24, 0.30)),
    "stool": Kind(surroundings.stool, (0.42, 0.42, 0.95)),
}
"""By the name of the fixture's registry file."""

BLENDER: Vec3 = (0.20, 0.20, 0.40)
"""Width, depth and height of a blender in metres; it is built to fit its lid."""

LIDS = {"blender_lid": (0.18, 0.25), "jar_lid": (0.10, 0.08)}
"""Width in metres where the registry gives none, and mass in kilograms, by registry file."""

UNKNOWN = Kind(surroundings.plain, (0.40, 0.40, 0.40))


def fill(given: PartialSize, usual: Vec3) -> Vec3:
    """Complete a size the way RoboCasa scales: what is not given follows what is.

    Args:
        given: metres; ``None`` or not positive: not given.
        usual: the proportions.
    """
    scale = [
        None if want is None or want <= 0 else want / have
        for want, have in zip(given, usual, strict=True)
    ]
    x, y, z = scale
    whole = 1.0
    return (
        usual[0] * (x or z or y or whole),
        usual[1] * (y or x or z or whole),
        usual[2] * (z or x or y or whole),
    )
