"""From where a replay is first looked at: near what went wrong, with the least in the way."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from pytest_safemanip.report.replay.placing import composed
from pytest_safemanip.report.replay.stage import STILL, Stage
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import Array, matrix, rotate
from pytest_safemanip.trace.recording import Recording

AZIMUTHS = np.radians((35.0, -35.0, 55.0, -55.0, 15.0, -15.0, 75.0, -75.0))
ELEVATIONS = np.radians((22.0, 10.0, 35.0, 50.0))
"""Directions of the camera from behind the robot and from above, the best first, rad."""
WORSE = 0.4
"""What is between the camera and what it looks at counts one; a worse direction so much, times how
much it differs from the best one, rad.
"""
GUILTY = 3.0
"""What hides a guilty object counts so much."""
LEAST_DISTANCE = 1.5
NEAR = 1.5
"""Things this far from the hand are looked at too, m."""
MARGIN = 0.12
"""Around a point that is looked at, nothing counts as in its way, m."""


def choose_view(
    recording: Recording, stage: Stage, step: int, guilty: Collection[str]
) -> dict[str, list[float]]:
    """Where the camera is (``eye``) and what it looks at (``target``), world frame, m."""
    points, weights = _points(recording, step, guilty)
    target = (points.min(axis=0) + points.max(axis=0)) / 2.0
    spread = float(np.linalg.norm(np.ptp(points, axis=0)))
    distance = LEAST_DISTANCE + 1.2 * spread
    facing = rotate(recording.steps.base_pose[step, 3:].astype(float), np.array((1.0, 0.0, 0.0)))
    heading = float(np.arctan2(facing[1], facing[0]))
    ways = [(azimuth, elevation) for elevation in ELEVATIONS for azimuth in AZIMUTHS]
    eyes = target + distance * np.array([_direction(heading + a, e) for a, e in ways])
    worse = [abs(abs(a) - AZIMUTHS[0]) + abs(e - ELEVATIONS[0]) for a, e in ways]
    costs = _between(eyes, points, weights, *_boxes(stage, step)) + WORSE * np.array(worse)
    eye = eyes[int(np.argmin(costs))]
    return {"eye": np.round(eye, 3).tolist(), "target": np.round(target, 3).tolist()}


def _direction(azimuth: float, elevation: float) -> Array:
    """From what is looked at back to a camera that looks along an azimuth, downwards."""
    flat = np.cos(elevation)
    return np.array((-flat * np.cos(azimuth), -flat * np.sin(azimuth), np.sin(elevation)))


def _points(recording: Recording, step: int, guilty: Collection[str]) -> tuple[Array, Array]:
    """The hands, the guilty objects near them and the robot's hardest contact, at a step (K, 3); of
    a robot without a hand, its base. Guilty objects that are all far from the hands alone. And what
    each counts if it is hidden (K,).
    """
    steps = recording.steps
    points = list(steps.eef_poses[step, :, :3].astype(float))
    if not points:
        points = [steps.base_pose[step, :3].astype(float)]
    objects = [
        steps.object_pose[step, index, :3].astype(float)
        for index, body in enumerate(recording.scene.bodies)
        if body.entity in guilty
    ]
    near = [place for place in objects if np.linalg.norm(place - points[0]) < NEAR]
    if objects and not near:
        return np.array(objects), np.full(len(objects), GUILTY)
    hands = len(points)
    points += near
    contacts = steps.contacts.window(step, step + 1)
    robot = np.array([part.entity == ROBOT for part in recording.scene.parts], bool)
    own = np.flatnonzero(robot[contacts.a] | robot[contacts.b])
    if own.size:
        points.append(contacts.position[own[np.argmax(contacts.sustained[own])]].astype(float))
    weights = np.ones(len(points))
    weights[hands : hands + len(near)] = GUILTY
    return np.array(points), weights


def _boxes(stage: Stage, step: int) -> tuple[Array, Array]:
    """Poses (N, 7) and half extents (N, 3) of boxes around the solids at a step."""
    solids = [solid for solid in stage.solids if solid.form != "outline"]
    poses = [
        s.pose if s.track == STILL else composed(stage.tracks[s.track][step], s.pose)
        for s in solids
    ]
    caps = [(0.0, 0.0, s.half[0] if s.form == "capsule" else 0.0) for s in solids]
    half = np.array([s.half for s in solids]).reshape(-1, 3)
    return np.array(poses).reshape(-1, 7), half + np.array(caps).reshape(-1, 3)


def _between(eyes: Array, points: Array, weights: Array, poses: Array, half: Array) -> Array:
    """How many boxes are between each eye (E, 3) and points (K, 3), weighted, over all points (E,).

    Args:
        eyes: where one may look from.
        points: what is looked at.
        weights: of the points (K,).
        poses: of the boxes (N, 7).
        half: their half extents (N, 3).
    """
    turns = matrix(poses[:, 3:])
    local_eyes = np.einsum("enk,nkj->enj", eyes[:, None] - poses[:, :3], turns)
    count = np.zeros(len(eyes))
    for point, weight in zip(points, weights, strict=True):
        way = eyes - point
        length = np.linalg.norm(way, axis=1, keepdims=True)
        starts = point + way * np.minimum(MARGIN / np.maximum(length, MARGIN), 1.0)
        local_starts = np.einsum("enk,nkj->enj", starts[:, None] - poses[:, :3], turns)
        count += weight * np.count_nonzero(_crossed(local_starts, local_eyes, half), axis=1)
    return count


def _crossed(start: Array, end: Array, half: Array) -> Array:
    """Whether segments (..., N, 3) cross boxes of half extents (N, 3) about the origin (..., N)."""
    way = end - start
    way = np.where(np.abs(way) < 1e-12, 1e-12, way)
    one, other = (-half - start) / way, (half - start) / way
    enter = np.minimum(one, other).max(axis=-1)
    leave = np.maximum(one, other).min(axis=-1)
    crossed: Array = (enter <= leave) & (leave >= 0.0) & (enter <= 1.0)
    return crossed
