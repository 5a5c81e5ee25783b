"""Rotation matrices, as scripts need them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rotation_vector(rotation: Array) -> Array:
    """Axis times angle of a rotation matrix (3,)."""
    axis = np.array(
        (
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        )
    )
    sine = float(np.linalg.norm(axis)) / 2.0
    angle = math.atan2(sine, (float(np.trace(rotation)) - 1.0) / 2.0)
    if sine < 1e-8:
        return np.zeros(3) if angle < 1.0 else np.array((math.pi, 0.0, 0.0))
    return axis / (2.0 * sine) * angle


def quaternion(rotation: Array) -> Array:
    """Unit quaternion ``wxyz`` of a rotation matrix (4,): the eigenvector of Bar-Itzhack (2000)."""
    (a, b, c), (d, e, f), (g, h, i) = rotation.tolist()
    lower = (
        (a + e + i, 0.0, 0.0, 0.0),
        (h - f, a - e - i, 0.0, 0.0),
        (c - g, b + d, e - a - i, 0.0),
        (d - b, c + g, f + h, i - a - e),
    )
    found: Array = np.linalg.eigh(np.array(lower))[1][:, -1]
    return found


def about_y(degrees: float) -> Array:
    """Turn about the world's y axis (3, 3)."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array(((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)))


def about_z(degrees: float) -> Array:
    """Turn about the vertical (3, 3)."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def upright(axis: Array) -> Array:
    """The shortest turn (3, 3) that raises a unit vector (3,), not one straight down, upright."""
    x, y, z = axis
    skew = np.array(((0.0, 0.0, -x), (0.0, 0.0, -y), (x, y, 0.0)))
    turn: Array = np.eye(3) + skew + skew @ skew / (1.0 + z)
    return turn


def limited(vector: Array, length: float) -> Array:
    """A vector, shortened to a length if it is longer."""
    norm = float(np.linalg.norm(vector))
    return vector * (length / norm) if norm > length else vector


def fold(degrees: float, top: float) -> float:
    """The same line, as an angle in (top - 180, top]."""
    return top - (top - degrees) % 180.0
