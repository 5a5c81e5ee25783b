"""Releases half way in, at the edge of each kind of enclosure."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.faults.fault import Fault
from pytest_safemanip.expert.motions.grasping import grasp_from_front
from pytest_safemanip.expert.places.cabinet.placing import carry_to_shelf, lower
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture, Thing

ASTRIDE = 0.01
"""What reaches this far to both sides of an edge is half inside, m."""
STAYS = 0.008
"""How far inside the middle is, m: with that much of it on the shelf, it does not fall."""


def _half_inside(arm: Arm) -> Motion:
    """Lets go with the object half over the shelf's front edge."""
    thing, cabinet = Thing(arm, "obj"), Furniture(arm, "cab")
    yield from grasp_from_front(arm, "obj")
    yield from carry_to_shelf(arm, "obj", "cab")
    front, shelf = cabinet.opening()
    yield from arm.drive(
        arm.base + 0.4 * arm.forward,
        until=lambda: arm.ahead(thing.centre) > front - 0.08,
        speed=0.4,
    )

    def at_edge() -> Array:
        way = front + STAYS - arm.ahead(thing.centre)
        return np.add(arm.position, (*(way * arm.forward), shelf + 0.03 - thing.bottom))

    yield from arm.move(at_edge, tolerance=0.008, speed=0.5, steps=60, required=False)
    yield from lower(arm, thing, shelf, arm.rotation)
    arm.truth.begins("enclosure_release", "obj", "cab", when=lambda: _astride(thing, front))
    yield from arm.grip(False)
    yield from arm.move(
        arm.position - 0.08 * arm.rotation[:, 2], tolerance=0.03, speed=0.5, required=False
    )
    yield from arm.drive(arm.base - 0.35 * arm.forward)


def _astride(thing: Thing, front: float) -> bool:
    near, far = thing.extent_ahead()
    return near < front - ASTRIDE and far > front + ASTRIDE


FAULTS = (
    Fault(
        "half_inside",
        "enclosure_release",
        "lets go at the cabinet's edge, half inside",
        {"PickPlaceCounterToCabinet": _half_inside},
    ),
)
