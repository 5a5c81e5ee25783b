"""Postures of the arm: which joint angles bring the hand to a pose, and where its links are then.

Everything is relative to the base: x ahead, y to the left, z up from the floor, the torso down.
Arrays hold many postures at once (K, ...): hundreds are looked at for one grasp.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.robot.rotations import Array

SHOULDER = 0.7
"""Height of the arm's own base above the floor, m, the torso down."""
QUARTER = math.pi / 2.0
CHAIN = (
    ((0.0, 0.0, 0.333), 0.0),
    ((0.0, 0.0, 0.0), -QUARTER),
    ((0.0, -0.316, 0.0), QUARTER),
    ((0.0825, 0.0, 0.0), QUARTER),
    ((-0.0825, 0.384, 0.0), -QUARTER),
    ((0.0, 0.0, 0.0), QUARTER),
    ((0.088, 0.0, 0.0), QUARTER),
)
"""From each link of a Franka Emika Panda to the next: where it is, m, and its turn about x, rad
(Franka's Denavit-Hartenberg parameters, after Craig)."""
GRIP, HAND_TURN = 0.2035, -1.5 * QUARTER
"""From the last link to the grip point, m, and the hand's turn about the approach, rad."""
LOW = np.array((-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973))
HIGH = np.array((2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973))
HOME = np.array((0.0, -1.0, 0.0, -2.27, 0.0, 1.516, 0.675))
"""Limits of the joints and where the controller pulls them as far as the hand leaves it free, rad.
"""
SPHERES = (
    (1, (0.0, -0.046, -0.085), 0.084),
    (1, (0.0, -0.065, 0.002), 0.085),
    (2, (0.0, 0.016, 0.102), 0.058),
    (2, (0.0, -0.075, 0.0), 0.06),
    (2, (0.0, -0.156, 0.0), 0.067),
    (2, (0.0, 0.029, 0.033), 0.067),
    (3, (0.086, 0.043, 0.048), 0.055),
    (3, (0.129, 0.044, 0.0), 0.054),
    (3, (0.0, 0.0, -0.074), 0.073),
    (3, (0.085, 0.099, 0.004), 0.049),
    (4, (-0.105, 0.067, -0.009), 0.053),
    (4, (-0.083, 0.106, 0.0), 0.059),
    (4, (0.012, -0.012, 0.033), 0.064),
    (4, (0.006, -0.007, 0.088), 0.058),
    (5, (-0.006, 0.062, -0.216), 0.063),
    (5, (0.0, -0.011, -0.239), 0.065),
    (5, (0.0, 0.075, -0.15), 0.05),
    (5, (0.0, 0.085, -0.09), 0.045),
    (5, (0.0, 0.09, -0.03), 0.042),
    (5, (0.028, 0.114, 0.021), 0.040),
    (5, (-0.024, 0.114, 0.022), 0.041),
    (5, (0.0, 0.016, 0.025), 0.045),
    (6, (-0.016, -0.003, 0.021), 0.057),
    (6, (0.093, -0.051, -0.003), 0.048),
    (6, (0.072, -0.016, 0.044), 0.049),
    (6, (0.094, 0.046, -0.002), 0.053),
    (7, (-0.005, -0.005, 0.096), 0.048),
    (7, (0.048, 0.056, 0.074), 0.043),
)
"""What the links' shapes fit into: the link, where in its frame, m, and a radius, m."""
ROUNDS, DAMPING, PULL, STEP = 12, 1e-3, 0.2, 0.5
"""Of the iteration: how many, its damping, share of the way home in one, and most turn in one, rad.
"""
STRIDE = 5
"""Rounds of it between two places on a way."""
NEAR, NEARLY, FOUND = 0.004, 0.03, 0.03
"""Distance, m, and angle, rad, that count as there, and distance at which angles are the arm's, m.
"""


def solve(
    points: Array, hands: Array, start: Array | None = None, rounds: int = ROUNDS
) -> tuple[Array, NDArray[np.bool_]]:
    """Joint angles (K, 7) that bring the hand to some poses, and which of them do (K,).

    Damped least squares (Nakamura and Hanafusa, 1986); what the hand leaves free is pulled home, as
    the controller does.

    Args:
        points: grip points (K, 3), m, from the base.
        hands: orientations (K, 3, 3), likewise.
        start: joint angles to begin with (K, 7); None for those at home.
        rounds: of the iteration.
    """
    if start is None:
        start = np.tile(HOME, (len(points), 1))
        start[:, 0] = np.arctan2(points[:, 1], points[:, 0])
    joints = start
    eye = DAMPING * np.eye(6)
    for number in range(rounds + 1):
        origins, frames = links(joints)
        error = _error(origins[:, -1], frames[:, -1], points, hands)
        if number == rounds:
            break
        axes = frames[:, :7, :, 2]
        arms = origins[:, -1:] - origins[:, :7]
        jac = np.concatenate((np.cross(axes, arms), axes), axis=2).transpose(0, 2, 1)
        home = PULL * (HOME - joints)
        wanted = error - (jac @ home[..., None])[..., 0]
        push = _solved(jac @ jac.transpose(0, 2, 1) + eye, wanted)
        turn = home + (jac.transpose(0, 2, 1) @ push[..., None])[..., 0]
        most = np.abs(turn).max(axis=1, keepdims=True)
        joints = np.clip(joints + turn * np.minimum(1.0, STEP / np.maximum(most, STEP)), LOW, HIGH)
    off = np.linalg.norm(error[:, :3], axis=1), np.linalg.norm(error[:, 3:], axis=1)
    return joints, (off[0] < NEAR) & (off[1] < NEARLY)


def follow(joints: Array, points: Array, hands: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Joint angles (K, N, 7) of arms whose hands go along some ways, and which come to an end (K,):
    a joint may be at its limit there.

    Args:
        joints: angles before (K, 7).
        points: grip points on the ways (K, N, 3), m, from the base.
        hands: orientations there (K, N, 3, 3), likewise.
    """
    found, there = np.empty((*points.shape[:2], 7)), np.zeros(len(points), bool)
    for number in range(points.shape[1]):
        joints, there = solve(points[:, number], hands[:, number], joints, STRIDE)
        found[:, number] = joints
    return found, there


def find(values: Array, point: Array, hand: Array) -> int | None:
    """Where among some values those of the arm's joints begin; None if they are not among them.

    Args:
        values: positions of everything that a simulator moves (N,).
        point: grip point (3,), m, from the base.
        hand: orientation there (3, 3), likewise.
    """
    if len(values) < 7:
        return None
    windows = np.lib.stride_tricks.sliding_window_view(np.asarray(values, np.float64), 7)
    origins, frames = links(windows)
    count = len(windows)
    off = _error(origins[:, -1], frames[:, -1], np.tile(point, (count, 1)), hand[None])
    away = np.linalg.norm(off[:, :3], axis=1) + 0.2 * np.linalg.norm(off[:, 3:], axis=1)
    best = int(np.argmin(away))
    return best if away[best] < FOUND else None


def _solved(matrices: Array, rights: Array) -> Array:
    """Solutions (K, N) of positive definite systems (K, N, N): by hand, for a library's threads
    wait for one another longer than this takes.
    """
    size = rights.shape[1]
    table = np.concatenate((matrices, rights[..., None]), axis=2)
    for row in range(size):
        table[:, row] /= table[:, row, row, None]
        others = [other for other in range(size) if other != row]
        table[:, others] -= table[:, others, row, None] * table[:, None, row]
    return np.asarray(table[..., -1])


def links(joints: Array) -> tuple[Array, Array]:
    """Origins (K, 8, 3) and frames (K, 8, 3, 3) of the seven links and of the hand."""
    count = len(joints)
    origin, frame = np.tile((0.0, 0.0, SHOULDER), (count, 1)), np.tile(np.eye(3), (count, 1, 1))
    origins, frames = np.empty((count, 8, 3)), np.empty((count, 8, 3, 3))
    for number, (offset, twist) in enumerate(CHAIN):
        origin = origin + frame @ np.array(offset)
        frame = frame @ _about_x(twist) @ _about_z(joints[:, number])
        origins[:, number], frames[:, number] = origin, frame
    origins[:, 7] = origin + GRIP * frame[..., 2]
    frames[:, 7] = frame @ _about_z(np.array([HAND_TURN]))
    return origins, frames


def bodies(joints: Array) -> tuple[Array, Array]:
    """Middles (K, S, 3) of the spheres around the arm's links, and their radii (S,), m."""
    origins, frames = links(joints)
    which = [link - 1 for link, _, _ in SPHERES]
    local = np.array([middle for _, middle, _ in SPHERES])
    middles = origins[:, which] + (frames[:, which] @ local[..., None])[..., 0]
    return middles, np.array([radius for _, _, radius in SPHERES])


def strain(joints: Array) -> Array:
    """How near the joints are to their limits (K,): 0 in the middle, 1 at one."""
    share: Array = np.abs(2.0 * joints - LOW - HIGH) / (HIGH - LOW)
    return np.asarray(share.max(axis=1))


def _error(point: Array, frame: Array, points: Array, hands: Array) -> Array:
    """Way and turn that are left (K, 6)."""
    turn = hands @ frame.transpose(0, 2, 1)
    axis = np.stack(
        (
            turn[:, 2, 1] - turn[:, 1, 2],
            turn[:, 0, 2] - turn[:, 2, 0],
            turn[:, 1, 0] - turn[:, 0, 1],
        ),
        axis=1,
    )
    sine = np.linalg.norm(axis, axis=1) / 2.0
    angle = np.arctan2(sine, (np.trace(turn, axis1=1, axis2=2) - 1.0) / 2.0)
    scale = np.where(sine > 1e-8, angle / np.maximum(2.0 * sine, 1e-8), 0.5)
    return np.concatenate((points - point, axis * scale[:, None]), axis=1)


def _about_x(turn: float) -> Array:
    c, s = math.cos(turn), math.sin(turn)
    return np.array(((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)))


def _about_z(turns: Array) -> Array:
    c, s, zero = np.cos(turns), np.sin(turns), np.zeros_like(turns)
    rows = np.stack((c, -s, zero, s, c, zero, zero, zero, zero + 1.0), axis=-1)
    return np.asarray(rows.reshape(*turns.shape, 3, 3))
