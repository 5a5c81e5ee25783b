"""Poses of pieces in frames that move. World frame, metres, ``wxyz``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from pytest_safemanip.trace.elements import Vector
from pytest_safemanip.trace.geometry import Array, multiply, rotate

IDENTITY: Vector = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def composed(frame: Array, local: Array) -> Array:
    """Poses ``local`` (..., 7) that are given in the frames ``frame`` (..., 7), in the world."""
    turn = (
        np.broadcast_to(frame[..., 3:], (*local.shape[:-1], 4))
        if local.ndim > 1
        else frame[..., 3:]
    )
    place = frame[..., :3] + rotate(turn, local[..., :3])
    both = multiply(frame[..., 3:], local[..., 3:])
    return np.concatenate((np.broadcast_to(place, (*both.shape[:-1], 3)), both), axis=-1)


def turned(axis: Sequence[float], angles: Array, origin: ArrayLike, turn: ArrayLike) -> Array:
    """Poses (T, 7) of a link in its parent's frame, as its joint's angles (T,) turn it.

    Args:
        axis: of the joint (3,).
        angles: rad.
        origin: of the link's frame in its parent's (3,), m.
        turn: of the link's frame at angle 0 (4,).
    """
    half = np.asarray(angles, float)[:, None] / 2.0
    joint = np.concatenate((np.cos(half), np.sin(half) * np.asarray(axis, float)), axis=-1)
    poses: Array = np.empty((len(joint), 7))
    poses[:, :3] = origin
    poses[:, 3:] = multiply(np.asarray(turn, float), joint)
    return poses


def between(start: ArrayLike, end: ArrayLike) -> tuple[Array, float]:
    """The pose (7,) midway between two points whose z axis points from one to the other, and half
    their distance.
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    way = end - start
    length = float(np.linalg.norm(way))
    along = way / length if length > 0 else np.array((0.0, 0.0, 1.0))
    turn = np.array((1.0 + along[2], -along[1], along[0], 0.0))
    norm = float(np.linalg.norm(turn))
    turn = turn / norm if norm > 1e-9 else np.array((0.0, 1.0, 0.0, 0.0))
    return np.concatenate(((start + end) / 2.0, turn)), length / 2.0
