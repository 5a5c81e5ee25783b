"""Where on another object there is room for what is put down."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing, other_things

OFF_MIDDLE = (0.0, 0.18, -0.18, 0.25, -0.25)
"""Places along a target's long side, from its middle, shares of its length."""
ON_PLATE = 0.003
"""What lies on a plate is higher than that by more, m: by the plate's floor."""
ENOUGH = 0.09
"""Middle to middle of two things that lie beside each other, m."""
AROUND = 24
"""Points of an outline: 2 cm apart around a kettle."""


def free_spot(arm: Arm, role: str, target: Thing) -> Array:
    """Where on a target there is most room for an object, along its long side (3,)."""
    thing = Thing(arm, role)
    axis, width = target.sides()[1]
    spots = [target.middle + k * width * axis for k in OFF_MIDDLE]

    return max(spots, key=lambda spot: min(room_at(arm, thing, target, spot), ENOUGH))


def room_at(arm: Arm, thing: Thing, target: Thing, spot: Array) -> float:
    """How far a spot (3,) on a target is from the middle of what else there is on it, m."""
    above = [o.centre for o in other_things(arm, thing, target) if not carries(o, target)]
    return min((float(np.linalg.norm((o - spot)[:2])) for o in above), default=math.inf)


def carries(below: Thing, target: Thing) -> bool:
    """Whether the one is a plate, say, that the other lies on."""
    away = float(np.linalg.norm((below.middle - target.middle)[:2]))
    return below.bottom < target.bottom - ON_PLATE and away < below.sides()[0][1] / 2.0


def gap(thing: Thing, spot: Array, other: Thing) -> float:
    """Distance on the level between two things if the one has its middle on a spot (3,), m."""
    return float(np.linalg.norm(outline(thing, spot)[:, None] - outline(other), axis=2).min())


def outline(thing: Thing, spot: Array | None = None) -> Array:
    """Points (K, 2) around a round thing and along its handle or spout, which lies along the middle
    of its box; with its middle on a spot (3,), or where it is.
    """
    (_, width), (axis, length) = thing.sides()
    turns = np.linspace(0.0, 2.0 * math.pi, AROUND, endpoint=False)
    body = thing.middle[:2] + width / 2.0 * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    along = np.linspace(-0.5, 0.5, AROUND)[:, None] * length * axis[:2]
    points: Array = np.concatenate((body, thing.centre[:2] + along))
    return points if spot is None else points + (spot - thing.middle)[:2]
