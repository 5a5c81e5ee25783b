"""What the things of a recording look like, as a simulator draws them: meshes that move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CLUSTERED_ABOVE = 64
"""Meshes with fewer triangles are kept as they are."""
FINEST, COARSER = 0.012, 1.3
"""Points of a mesh that are nearer than this share of its diagonal become one, and by how much the
share grows while there are too many triangles."""


@dataclass(frozen=True)
class Look:
    """A rigid piece of an entity.

    Attributes:
        entity: whose it is.
        colour: red, green and blue, 0 to 1 (3,).
        points: in the piece's frame (V, 3), m.
        triangles: numbers of points (F, 3).
        poses: the frame's, over the steps of the recording (T, 7), world frame, ``wxyz``.
    """

    entity: str
    colour: tuple[float, float, float]
    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    poses: NDArray[np.float64]


def simplified(
    meshes: list[tuple[NDArray[np.float64], NDArray[np.int64]]], most: int
) -> list[tuple[NDArray[np.float64], NDArray[np.int64]]]:
    """Meshes, points (V, 3) and triangles (F, 3) each, with at most so many triangles in all.

    Points that are near each other, relative to the size of the mesh, become one.
    """
    share, found = FINEST, [_clustered(*mesh, FINEST) for mesh in meshes]
    while sum(len(triangles) for _, triangles in found) > most and share < 1.0:
        share *= COARSER
        found = [_clustered(*mesh, share) for mesh in meshes]
    kept, room = [], most
    for points, triangles in found:
        kept.append((points, triangles[:room]))
        room -= len(kept[-1][1])
    return kept


def _clustered(
    points: NDArray[np.float64], triangles: NDArray[np.int64], share: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A mesh whose points within the cells of a grid are one, in their middle."""
    if len(triangles) <= CLUSTERED_ABOVE:
        return points, triangles
    cell = share * float(np.linalg.norm(np.ptp(points, axis=0)))
    keys = np.floor((points - points.min(axis=0)) / max(cell, 1e-9)).astype(np.int64)
    _, number = np.unique(keys, axis=0, return_inverse=True)
    number = number.reshape(-1)
    count = np.bincount(number)
    middle = np.stack([np.bincount(number, points[:, axis]) / count for axis in range(3)], axis=1)
    corners = number[triangles]
    flat = (corners == np.roll(corners, 1, axis=1)).any(axis=1)
    corners = corners[~flat]
    _, first = np.unique(np.sort(corners, axis=1), axis=0, return_index=True)
    return middle, corners[np.sort(first)]
