"""The space between two shelves of an open fridge, and what stands there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import STANDS_OUT
from pytest_safemanip.expert.world.things import Furniture, Thing, other_things

ON_SHELF = 0.03
"""How far the underside of what stands on a shelf is from it at most, m."""
SAME_SHELF = 0.05
"""Likewise where it may lean on something, m."""
BRUSHED = 0.003
"""How far a finger may push aside what it may touch, m."""
GRID = 5
"""Points along an edge of a thing's box."""


@dataclass(frozen=True)
class Compartment:
    """The space between two shelves, along the base's directions, m.

    Attributes:
        front: where the shelf begins, ahead.
        left: its left wall.
        right: its right wall.
        floor: height of the lower shelf.
        ceiling: height of the upper one.
        door: the left side of the door that stands open on its right.
    """

    front: float
    left: float
    right: float
    floor: float
    ceiling: float
    door: float


@dataclass(frozen=True)
class Crowd:
    """What else stands on a shelf.

    Attributes:
        points: on the sides of its boxes (P, 3).
        pushed: how far the hand may push each of them, m (P,).
    """

    points: Array
    pushed: Array

    @property
    def top(self) -> float:
        """Height of the highest point, m; 0 if there is none."""
        return float(self.points[:, 2].max(initial=0.0))


def compartment(arm: Arm, thing: Thing, fridge: Furniture) -> Compartment:
    """Where in an open fridge a thing stands.

    Raises:
        SkillFailed: if it is on no shelf, or no door is open.
    """
    doors = [
        arm.aside(corner)
        for joint in fridge.doors()
        if fridge.openness(joint) > STANDS_OUT
        for corner in fridge.outline(joint)
    ]
    for pose, half in fridge.interiors():
        floor, aside = float(pose[2] - half[2]), arm.aside(pose)
        beside = abs(arm.aside(thing.centre) - aside) > half[0]
        if doors and not beside and abs(floor - thing.bottom) < ON_SHELF:
            return Compartment(
                front=arm.ahead(pose) - float(half[1]),
                left=aside + float(half[0]),
                right=aside - float(half[0]),
                floor=floor,
                ceiling=float(pose[2] + half[2]),
                door=max(doors),
            )
    raise SkillFailed(f"{thing.entity} is on no shelf of an open {fridge.entity}")


def crowd(arm: Arm, thing: Thing, space: Compartment, like: str = "") -> Crowd:
    """What else stands on a thing's shelf.

    Args:
        arm: the arm.
        thing: what is to be taken.
        space: where it stands.
        like: role of what the hand may brush; empty if there is nothing.
    """
    mild = Thing(arm, like).entity if like else ""
    sides = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, GRID)] * 3), axis=-1).reshape(-1, 3)
    sides = sides[np.abs(sides).max(axis=1) == 1.0]
    points, pushed = [np.empty((0, 3))], [np.empty(0)]
    for other in other_things(arm, thing):
        if abs(other.bottom - space.floor) < SAME_SHELF:
            points.append(other.centre + sides @ spans(other).T)
            pushed.append(np.full(len(sides), BRUSHED if other.entity == mild else 0.0))
    return Crowd(np.concatenate(points), np.concatenate(pushed))


def spans(thing: Thing) -> Array:
    """From the centre of a thing's box to the middles of three of its sides, as columns (3, 3)."""
    at = thing.corners
    return np.stack([(at[4] - at[0]) / 2.0, (at[2] - at[0]) / 2.0, (at[1] - at[0]) / 2.0], axis=1)


def off_box(points: Array, low: Array, high: Array) -> float:
    """From the nearest of some points (P, 3) to a box, m; negative inside, by 3 cm at most."""
    away = np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=1)
    inside = np.minimum(np.minimum(points - low, high - points).min(axis=1), ON_SHELF)
    gaps: Array = np.where(away > 0.0, away, -inside)
    return float(gaps.min())


def off_rod(points: Array, start: Array, end: Array, thick: float) -> float:
    """From the nearest of some points (P, 3) to a rod of a radius, m."""
    way = end - start
    share = np.clip((points - start) @ way / (way @ way), 0.0, 1.0)
    away: Array = np.linalg.norm(points - (start + share[:, None] * way), axis=1)
    return float(away.min()) - thick
