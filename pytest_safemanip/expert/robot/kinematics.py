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
HIGH = np.array((2.8973, 1.7628, 2.8973, -0.467, 2.8973, 3.7525, 2.8973))
HOME = np.array((0.0, -1.0, 0.0, -2.27, 0.0, 1.516, 0.675))
"""Limits of the joints and where the controller pulls them as far as the hand leaves it free, rad.
The elbow turns farther, to -0.07, but at -0.467 the arm is straight, for its links are offset: from
beyond that, what draws the hand back turns it on to its end.
"""
ELBOW = 3
MASSES = np.array((3.0, 3.0, 2.0, 2.0, 2.0, 1.5))
INERTIAS = np.array((0.3, 0.3, 0.2, 0.2, 0.2, 0.1))
CENTRES = np.array(
    (
        (0.0, 0.0, -0.07),
        (0.0, -0.1, 0.0),
        (0.04, 0.0, -0.05),
        (-0.04, 0.05, 0.0),
        (0.0, 0.0, -0.15),
        (0.06, 0.0, 0.0),
    )
)
"""Of the first six links in robosuite's model of the arm: masses, kg, moments of inertia about any
axis, kg m2, and centres of mass in their frames, m. The last link and the hand do not move in the
null space.
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
TINY = 1e-12
"""Least denominator: the null space may have nothing to move."""
STRIDE, SWUNG = 5, 0.06
"""Rounds of it between two places on a way, and the share of the way home in one while the hand
swings along it."""
FARTHEST = 0.82
"""From the shoulder to the wrist, m: no posture gets there, with what counts as there."""
NEAR, NEARLY, FOUND = 0.004, 0.03, 0.03
"""Distance, m, and angle, rad, that count as there, and distance at which angles are the arm's, m.
"""


def solve(
    points: Array,
    hands: Array,
    start: Array | None = None,
    rounds: int = ROUNDS,
    pull: float = PULL,
) -> tuple[Array, NDArray[np.bool_]]:
    """Joint angles (K, 7) that bring the hand to some poses, and which of them do (K,).

    Damped least squares (Nakamura and Hanafusa, 1986); the null space is pulled home by torques, as
    operational-space control does, and so weighted by the mass matrix (Khatib, 1987).

    Args:
        points: grip points (K, 3), m, from the base.
        hands: orientations (K, 3, 3), likewise.
        start: joint angles to begin with (K, 7); None for those at home.
        rounds: of the iteration.
        pull: share of the way home in one round.
    """
    if start is None:
        start = np.tile(HOME, (len(points), 1))
        start[:, 0] = np.arctan2(points[:, 1], points[:, 0])
    joints = np.ascontiguousarray(start.T)
    there, wanted = points.T, hands.transpose(1, 2, 0)
    low, high = LOW[:, None], HIGH[:, None]
    for number in range(rounds + 1):
        origins, frames = _chain(joints)
        error = _error(origins[7], frames[7], there, wanted)
        if number == rounds:
            break
        axes = frames[:7, :, 2]
        jac = np.concatenate((_cross(axes, origins[7] - origins[:7]), axes), axis=1)
        inverse = _inverse(jac)
        factor = _mass_factor(origins, frames)
        home = pull * (HOME[:, None] - joints)
        free = _null_motion(jac, inverse, factor, home - _least(jac, inverse, error))
        turn = free + _least(jac, inverse, error - (jac * free[:, None]).sum(axis=0))
        most = np.abs(turn).max(axis=0)
        joints = np.clip(joints + turn * np.minimum(1.0, STEP / np.maximum(most, STEP)), low, high)
    off = np.linalg.norm(error[:3], axis=0), np.linalg.norm(error[3:], axis=0)
    return joints.T, (off[0] < NEAR) & (off[1] < NEARLY)


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
        joints, there = solve(points[:, number], hands[:, number], joints, STRIDE, SWUNG)
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
    origins, frames = _chain(windows.T)
    off = _error(origins[7], frames[7], point[:, None], hand[..., None])
    away = np.linalg.norm(off[:3], axis=0) + 0.2 * np.linalg.norm(off[3:], axis=0)
    best = int(np.argmin(away))
    return best if away[best] < FOUND else None


def _inverse(jac: Array) -> Array:
    """Inverses (6, 6, K) of the damped normal equations of some Jacobians (7, 6, K): by hand, for a
    library's threads wait for one another longer than this takes.
    """
    table = np.zeros((6, 12, jac.shape[2]))
    for row in range(6):
        table[row, : row + 1] = (jac[:, row, None] * jac[:, : row + 1]).sum(axis=0)
        table[: row + 1, row] = table[row, : row + 1]
        table[row, row] += DAMPING
        table[row, 6 + row] = 1.0
    for row in range(6):
        table[row, row + 1 : row + 7] /= table[row, row]
        for other in range(6):
            if other != row:
                table[other, row + 1 : row + 7] -= table[other, row] * table[row, row + 1 : row + 7]
    return table[:, 6:]


def _least(jac: Array, inverse: Array, wanted: Array) -> Array:
    """The least turns of the joints (7, K) that move the hand as wanted (6, K): the damped
    pseudoinverse.
    """
    return np.asarray((jac * (inverse * wanted).sum(axis=1)).sum(axis=1))


def _null_motion(jac: Array, inverse: Array, factor: Array, wanted: Array) -> Array:
    """Wanted turns of the joints (7, K), projected into the null space of the hand's motion, as
    weighted by the mass matrix.
    """
    free = _mass_times(factor, wanted)
    # Twice, for the inverse is damped.
    for _ in range(2):
        free = free - _least(jac, inverse, (jac * free[:, None]).sum(axis=0))
    weight = (free * _mass_times(factor, free)).sum(axis=0)
    return np.asarray(free * ((free * free).sum(axis=0) / np.maximum(weight, TINY)))


def _mass_factor(origins: Array, frames: Array) -> Array:
    """A factor (7, 36, K) of the mass matrix of the first six links, which is this times its own
    transpose: their Jacobians, linear and angular, times the roots of masses and inertias.
    """
    found = np.zeros((7, 12, 3, origins.shape[2]))
    axes = frames[:6, :, 2]
    centres = origins[:6] + (frames[:6] * CENTRES[:, None, :, None]).sum(axis=2)
    for joint in range(6):
        lever = _cross(axes[joint], centres[joint:] - origins[joint])
        found[joint, joint:6] = np.sqrt(MASSES[joint:, None, None]) * lever
        found[joint, 6 + joint :] = np.sqrt(INERTIAS[joint:, None, None]) * axes[joint]
    return found.reshape(7, 36, -1)


def _mass_times(factor: Array, turns: Array) -> Array:
    """The mass matrix times some turns of the joints (7, K)."""
    moved = (factor * turns[:, None]).sum(axis=0)
    return np.asarray((factor * moved).sum(axis=1))


def links(joints: Array) -> tuple[Array, Array]:
    """Origins (K, 8, 3) and frames (K, 8, 3, 3) of the seven links and of the hand."""
    origins, frames = _chain(joints.T)
    return origins.transpose(2, 0, 1), frames.transpose(3, 0, 1, 2)


def _chain(joints: Array) -> tuple[Array, Array]:
    """Likewise (8, 3, K) and (8, 3, 3, K), of joints (7, K): numpy is quick along the last axis."""
    count = joints.shape[1]
    origins, frames = np.empty((8, 3, count)), np.empty((8, 3, 3, count))
    origin = np.tile(np.array(((0.0,), (0.0,), (SHOULDER,))), count)
    x, y, z = (np.tile(column[:, None], count) for column in np.eye(3))
    cosines, sines = np.cos(joints), np.sin(joints)
    for number, (offset, twist) in enumerate(CHAIN):
        for length, axis in zip(offset, (x, y, z), strict=True):
            origin = origin + length * axis if length else origin
        y, z = (
            math.cos(twist) * y + math.sin(twist) * z,
            math.cos(twist) * z - math.sin(twist) * y,
        )
        c, s = cosines[number], sines[number]
        x, y = c * x + s * y, c * y - s * x
        origins[number] = origin
        frames[number, :, 0], frames[number, :, 1], frames[number, :, 2] = x, y, z
    c, s = math.cos(HAND_TURN), math.sin(HAND_TURN)
    origins[7] = origin + GRIP * z
    frames[7, :, 0], frames[7, :, 1], frames[7, :, 2] = c * x + s * y, c * y - s * x, z
    return origins, frames


def bodies(joints: Array) -> tuple[Array, Array]:
    """Middles (K, S, 3) of the spheres around the arm's links, and their radii (S,), m."""
    origins, frames = links(joints)
    which = [link - 1 for link, _, _ in SPHERES]
    local = np.array([middle for _, middle, _ in SPHERES])
    middles = origins[:, which] + (frames[:, which] @ local[..., None])[..., 0]
    return middles, np.array([radius for _, _, radius in SPHERES])


def reach_of(wrists: Array) -> Array:
    """Distances (...) of wrists (..., 3) from the shoulder, m."""
    return np.asarray(np.linalg.norm(wrists - (0.0, 0.0, SHOULDER + CHAIN[0][0][2]), axis=-1))


def strain(joints: Array) -> Array:
    """How near the joints are to their limits (K,): 0 in the middle, 1 at one."""
    share: Array = np.abs(2.0 * joints - LOW - HIGH) / (HIGH - LOW)
    return np.asarray(share.max(axis=1))


def _error(point: Array, frame: Array, points: Array, hands: Array) -> Array:
    """Way and turn that are left (6, K), from grip points (3, K) and orientations (3, 3, K)."""
    axis: Array = np.sum([_cross(frame[:, k], hands[:, k]) for k in range(3)], axis=0)
    cosine = ((frame * hands).sum(axis=(0, 1)) - 1.0) / 2.0
    sine = np.linalg.norm(axis, axis=0) / 2.0
    angle = np.arctan2(sine, cosine)
    scale = np.where(sine > 1e-8, angle / np.maximum(2.0 * sine, 1e-8), 0.5)
    return np.concatenate((np.broadcast_to(points - point, axis.shape), axis * scale))


def _cross(one: Array, other: Array) -> Array:
    """Products (..., 3, K)."""
    a, b = np.moveaxis(one, -2, 0), np.moveaxis(other, -2, 0)
    found = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return np.stack(found, axis=-2)
