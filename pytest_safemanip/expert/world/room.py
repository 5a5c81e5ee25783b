"""Room: how far points are from everything solid around a place, of many points at once.

All is seen from the base's heading: coordinates ahead, to the left and up, from the world's origin.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import handles, solids
from pytest_safemanip.expert.world.things import Thing, other_things
from pytest_safemanip.trace.geometry import CORNERS

FAR = 0.10
"""Farther off than this nobody asks how far, m."""
OUT = 1.0
"""Given for what is farther, m."""
CELL = 0.015
"""Between the points at which distances are noted, m."""
COARSE = CELL * math.sqrt(3.0) / 2.0
"""By how much a distance between them is wrong at most, m: half a diagonal."""
WALL, SIDES = 0.005, 8
"""Thickness of a vessel's wall and floor, m, and how many flat pieces its wall is taken for."""
LUG = 0.02
"""Of what stands out from a vessel's rim: its thickness, and half of its width, m."""
BEFORE, BEYOND = np.array((-1.3, -0.9, -0.35)), np.array((0.3, 0.9, 0.8))
"""From some points to where an arm that reaches them may be, ahead, to the left and up, m."""


class Room:
    """The solid boxes around a place.

    Args:
        boxes: their corners (B, 8, 3), world.
        frame: the base's directions, as columns (3, 3).
        low: where what is looked at begins (3,), seen from the base's heading.
        high: where it ends (3,).
    """

    def __init__(self, boxes: Array, frame: Array, low: Array, high: Array) -> None:
        seen = boxes @ frame
        near = (seen.min(axis=1) < high + FAR).all(axis=1)
        near &= (seen.max(axis=1) > low - FAR).all(axis=1)
        seen = seen[near]
        sides = np.stack((seen[:, 4], seen[:, 2], seen[:, 1]), axis=1) - seen[:, :1]
        lengths = np.linalg.norm(sides, axis=2)
        self._middle, self._half = seen.mean(axis=1), lengths / 2.0
        self._axes = sides / np.maximum(lengths, 1e-9)[..., None]
        self._low, self._high = seen.min(axis=1) - FAR, seen.max(axis=1) + FAR
        self._from, self._size = low, np.ceil((high - low) / CELL).astype(int) + 2

    @classmethod
    def around(
        cls,
        arm: Arm,
        points: Sequence[Array],
        without: Collection[str] = (),
        extra: Sequence[Array] = (),
    ) -> Room:
        """What stands near some points, and where an arm is that reaches them.

        Args:
            arm: the arm.
            points: the points, each (3,).
            without: entities that are left out.
            extra: corners of other boxes, each (8, 3).
        """
        own = [Thing(arm, name) for name in without if name in arm.scene.object_index]
        things = [thing.corners for thing in other_things(arm, *own)]
        others = [box[None] for box in (*things, *extra)]
        boxes = np.concatenate((solids(arm), handles(arm), *others))
        spots = np.array(points) @ arm.frame
        return cls(boxes, arm.frame, spots.min(axis=0) + BEFORE, spots.max(axis=0) + BEYOND)

    def exactly(self, points: Array) -> Array:
        """Distance from the nearest box to each of some points (P, 3), below 0 inside (P,), m.

        Args:
            points: the points, seen from the base's heading; likewise :meth:`least` and
                :meth:`away`.
        """
        found = np.full(len(points), FAR)
        low, high = points.min(axis=0), points.max(axis=0)
        near = (self._low < high).all(axis=1) & (self._high > low).all(axis=1)
        for number in np.flatnonzero(near).tolist():
            np.minimum(found, self._off(number, points), out=found)
        return found

    def least(self, points: Array) -> float:
        """The least of these distances, m: computed only of the points that may have it."""
        noted, outside = self._noted(points)
        noted[outside] = math.inf
        return float(self.exactly(points[outside | (noted <= noted.min() + 2.0 * COARSE)]).min())

    def away(self, points: Array, radii: Array | float = 0.0) -> Array:
        """Likewise to balls (..., P, 3) of some radii (P,), within 4 mm (..., P), m."""
        noted, outside = self._noted(points)
        return np.asarray(np.where(outside | (noted > 0.99 * FAR), OUT, noted - radii))

    def _noted(self, points: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Distances (...,) between those that are noted, m, and whether points are beyond these."""
        x, y, z = at = np.moveaxis((points - self._from) / CELL, -1, 0)
        a, b, c = self._size - 1.0
        outside = (x < 0.0) | (x > a) | (y < 0.0) | (y > b) | (z < 0.0) | (z > c)
        return map_coordinates(self._field, at, order=1, mode="nearest"), outside

    def _off(self, number: int, points: Array) -> Array:
        """Distance from one box to some points (..., 3), below 0 inside, m."""
        over = np.abs((points - self._middle[number]) @ self._axes[number].T) - self._half[number]
        # Rows of three are slow to reduce: one direction after the other.
        x, y, z = np.moveaxis(over, -1, 0)
        inside = np.minimum(np.maximum(np.maximum(x, y), z), 0.0)
        x, y, z = np.moveaxis(np.maximum(over, 0.0), -1, 0)
        return np.asarray(np.sqrt(x * x + y * y + z * z) + inside)

    @cached_property
    def _field(self) -> Array:
        field = np.full(tuple(self._size), FAR)
        axes = [self._from[k] + CELL * np.arange(self._size[k]) for k in range(3)]
        for number, (low, high) in enumerate(zip(self._low, self._high, strict=True)):
            part = tuple(
                slice(*np.searchsorted(axis, (low[k], high[k])).tolist())
                for k, axis in enumerate(axes)
            )
            spans = [axis[cut] for axis, cut in zip(axes, part, strict=True)]
            if min(map(len, spans)):
                points = np.stack(np.meshgrid(*spans, indexing="ij"), axis=-1)
                np.minimum(field[part], self._off(number, points), out=field[part])
        return field


def walls(vessel: Thing) -> list[Array]:
    """Corners (8, 3) of boxes that a hollow vessel's wall and floor fit into: nobody knows whether
    its corners are round.
    """
    (narrow, width), (long, length) = vessel.sides()
    middle, up, height = vessel.middle, np.array((0.0, 0.0, 1.0)), vessel.height
    centre = np.append(middle[:2], vessel.bottom + height / 2.0)
    floor = narrow * width / 2.0, long * length / 2.0, up * WALL / 2.0
    found = [_box(centre - (height - WALL) / 2.0 * up, *floor)]
    # What is longer than wide is a box, or round and has lugs.
    for long_way in {width, length}:
        across, along = narrow * width / 2.0, long * long_way / 2.0
        for turn in np.arange(SIDES) * 2.0 * np.pi / SIDES:
            side = np.tan(np.pi / SIDES) * (np.cos(turn) * along - np.sin(turn) * across)
            at = np.cos(turn) * across + np.sin(turn) * along
            out = np.cross(side, up) * WALL / 2.0 / np.linalg.norm(side)
            out *= math.copysign(1.0, float(out @ at))
            found.append(_box(centre + at - out, out, side, up * height / 2.0))
    beyond = (length - width) / 4.0
    if beyond > WALL:
        for way in (long, -long):
            at = centre + (width / 2.0 + beyond) * way + (height / 2.0 - LUG / 2.0) * up
            found.append(_box(at, way * beyond, narrow * LUG, up * LUG / 2.0))
    return found


def _box(middle: Array, *halves: Array) -> Array:
    return np.asarray(middle + CORNERS @ np.array(halves))
