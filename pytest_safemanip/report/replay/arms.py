"""Arms that are drawn from the joint positions of a recording, without a simulator.

A recording has the poses of hand and base and the simulator's joint positions. Where the robot is
one that is known here, its links follow from them; the links' shapes are simplified.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from pytest_safemanip.report.replay.placing import IDENTITY, between, composed, turned
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import Array
from pytest_safemanip.trace.recording import Recording

PANDA = "PandaOmron"
"""robosuite's name of a Franka Panda on an Omron base, as the robot's category says it."""
_TORSO, _ARM = 3, slice(4, 11)
"""Columns of the joint positions: the column's height and the seven joints of the arm."""
_MOUNT = 0.7
"""Height of the arm's mount above the base with the column down, m."""
_QUARTER = 0.5**0.5
_LINKS: Sequence[tuple[tuple[float, ...], tuple[float, ...]]] = (
    ((0.0, 0.0, 0.333), (1.0, 0.0, 0.0, 0.0)),
    ((0.0, 0.0, 0.0), (_QUARTER, -_QUARTER, 0.0, 0.0)),
    ((0.0, -0.316, 0.0), (_QUARTER, _QUARTER, 0.0, 0.0)),
    ((0.0825, 0.0, 0.0), (_QUARTER, _QUARTER, 0.0, 0.0)),
    ((-0.0825, 0.384, 0.0), (_QUARTER, -_QUARTER, 0.0, 0.0)),
    ((0.0, 0.0, 0.0), (_QUARTER, _QUARTER, 0.0, 0.0)),
    ((0.088, 0.0, 0.0), (_QUARTER, _QUARTER, 0.0, 0.0)),
)
"""Origin and turn of each link of the Panda in the frame of the one before, by Franka's data sheet
of its Denavit-Hartenberg parameters; each turns about its own z axis."""
_FLANGE = 0.2035
"""From the last link's frame to the end effector along z, m."""
_TOLERANCE = 0.02
"""How far the computed end effector may be from the recorded one, m: else it is another robot, or
its joint positions are in another order."""
_STROKE = 0.04
"""Way of each finger of the hand, m."""


@dataclass(frozen=True)
class Piece:
    """A simplified shape in the frame of a link; form and half as of a solid, pose (7,)."""

    form: Literal["box", "capsule"]
    half: Sequence[float]
    pose: Sequence[float]


@dataclass(frozen=True)
class Link:
    """Pieces that move together; their frame's poses over the steps (T, 7)."""

    poses: Array
    pieces: Sequence[Piece]


def links_of(recording: Recording) -> list[Link]:
    """The robot's links; only its hands, as boxes, where the robot is not known here."""
    scene, steps = recording.scene, recording.steps
    robot = scene.entity.get(ROBOT)
    if robot is not None and robot.category == PANDA and len(scene.grippers) == 1:
        arm = _panda(recording)
        if arm:
            return arm
    return [
        Link(steps.eef_poses[:, index].astype(float), (_box(gripper.half, gripper.centre),))
        for index, gripper in enumerate(scene.grippers)
    ]


def _panda(recording: Recording) -> list[Link]:
    """Links of the Panda; none if the joint positions do not lead to the recorded hand."""
    steps = recording.steps
    if steps.qpos.shape[1] < _ARM.stop:
        return []
    base, eef = steps.base_pose.astype(float), steps.eef_poses[:, 0].astype(float)
    mount = np.tile(np.array(IDENTITY), (len(steps), 1))
    mount[:, 2] = _MOUNT + steps.qpos[:, _TORSO]
    frames = [composed(base, mount)]
    for (origin, turn), angles in zip(_LINKS, steps.qpos[:, _ARM].T, strict=True):
        frames.append(composed(frames[-1], turned((0.0, 0.0, 1.0), angles, origin, turn)))
    tip = composed(frames[-1], np.tile((0.0, 0.0, _FLANGE, *IDENTITY[3:]), (len(steps), 1)))
    if np.linalg.norm(tip[:, :3] - eef[:, :3], axis=1).max() > _TOLERANCE:
        return []
    links = [Link(base, _platform()), Link(frames[0], _pedestal())]
    links += [Link(poses, pieces) for poses, pieces in zip(frames, _panda_pieces(), strict=True)]
    return [
        *links,
        Link(eef, (_box((0.1, 0.028, 0.036), (0.0, 0.0, -0.064)),)),
        *_fingers(recording),
    ]


def _fingers(recording: Recording) -> list[Link]:
    """The two fingers, which move along the hand's x axis."""
    eef = recording.steps.eef_poses[:, 0].astype(float)
    links = []
    for side in (-1.0, 1.0):
        local = np.tile(np.array(IDENTITY), (len(eef), 1))
        local[:, 0] = side * (0.008 + _STROKE * recording.steps.openings[:, 0, 0])
        pieces = (_box((0.008, 0.011, 0.029), (0.0, 0.0, -0.017)),)
        links.append(Link(composed(eef, local), pieces))
    return links


def _platform() -> tuple[Piece, ...]:
    return (
        _box((0.33, 0.24, 0.17), (-0.2, 0.0, 0.2)),
        _box((0.08, 0.08, 0.16), (-0.05, 0.0, 0.52)),
    )


def _pedestal() -> tuple[Piece, ...]:
    return (_box((0.12, 0.12, 0.02), (-0.02, 0.0, -0.02)),)


@cache
def _panda_pieces() -> tuple[tuple[Piece, ...], ...]:
    """Simplified shapes of the links 0 to 7 in their frames."""
    return (
        (_rod((-0.06, 0.0, 0.06), (0.0, 0.0, 0.06), 0.065), _rod((0, 0, 0.06), (0, 0, 0.2), 0.06)),
        (_rod((0, 0, -0.12), (0, 0, 0), 0.06), _rod((0, -0.05, 0), (0, 0.05, 0), 0.062)),
        (_rod((0, 0, 0), (0, -0.2, 0), 0.06),),
        (
            _rod((0, 0, -0.08), (0.0825, 0, 0), 0.056),
            _rod((0.0825, -0.04, 0), (0.0825, 0.04, 0), 0.06),
        ),
        (
            _rod((0, 0, 0), (-0.0825, 0.1, 0), 0.055),
            _rod((-0.0825, 0.1, 0), (-0.0825, 0.14, 0), 0.058),
        ),
        (_rod((0, 0, -0.23), (0, 0.05, -0.1), 0.05), _rod((0, 0.05, -0.1), (0, 0, 0), 0.046)),
        (_rod((0, 0, 0), (0.088, 0, 0), 0.048), _rod((0.088, 0, -0.02), (0.088, 0, 0.05), 0.046)),
        (_rod((0, 0, 0.05), (0, 0, 0.09), 0.042),),
    )


def _box(half: Sequence[float], centre: Sequence[float]) -> Piece:
    return Piece("box", half, (*centre, *IDENTITY[3:]))


def _rod(start: Sequence[float], end: Sequence[float], radius: float) -> Piece:
    """A capsule from one point to another."""
    pose, half = between(start, end)
    return Piece("capsule", (radius, radius, half), pose.tolist())
