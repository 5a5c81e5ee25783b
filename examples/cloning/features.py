"""What the clones see: where the hand is, and where what the task is about is from there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step

Floats = NDArray[np.float64]

ROLES = ("obj", "cab", "drawer", "fxtr", "sink")
"""The task's own names for what it is about."""
SIZE = 39


class Features:
    """Makes the observation of a clone from the simulator's state, in the frame of the base.

    Args:
        scene: the static part of the episode.
        first: its first step.
    """

    def __init__(self, scene: Scene, first: Step) -> None:
        entities = [scene.roles[role] for role in ROLES if role in scene.roles]
        objects = [scene.object_index[name] for name in entities if name in scene.object_index]
        self._object = objects[0] if objects else None
        self._joints = [k for name in entities for k in scene.joints_of(name)]
        kinds = ("handle", "control", "interior")
        self._boxes = [[k for n in entities for k in scene.boxes_of(n, kind)] for kind in kinds]
        self._start = np.asarray(first.base_pose, np.float64)
        self._grip = -1.0

    def __call__(self, step: Step, index: int) -> Floats:
        """The observation (39,).

        Args:
            step: the state.
            index: control steps so far.
        """
        frame, hand = matrix(np.asarray(step.base_pose[3:], np.float64)).T, step.eef_pose[:3]
        turn = frame @ matrix(np.asarray(step.eef_pose[3:], np.float64))
        parts = [frame @ (hand - step.base_pose[:3]), turn[:, 0], turn[:, 2], step.gripper]
        parts += [frame @ (step.base_pose[:3] - self._start[:3]), [self._grip, index / 100.0]]
        parts += [self._of_object(step, frame, hand)]
        parts += [self._nearest(step, boxes, frame, hand) for boxes in self._boxes]
        openness = [step.joint[k][0] for k in self._joints[:2]]
        parts += [np.pad(openness, (0, 2 - len(openness)))]
        return np.concatenate(parts).astype(np.float64)

    def told(self, action: Floats) -> None:
        """Remember what the fingers were told, which no state shows."""
        self._grip = float(np.round(action[6]))

    def _of_object(self, step: Step, frame: Floats, hand: Floats) -> Floats:
        if self._object is None:
            return np.zeros(12)
        pose = np.asarray(step.object_pose[self._object], np.float64)
        turn = frame @ matrix(pose[3:])
        place = frame @ (pose[:3] - step.base_pose[:3])
        return np.concatenate((frame @ (pose[:3] - hand), place, turn[:, 0], turn[:, 2]))

    def _nearest(self, step: Step, boxes: list[int], frame: Floats, hand: Floats) -> Floats:
        """From the hand to the middle of the nearest of some boxes (3,)."""
        ways = [frame @ (step.box_pose[k][:3] - hand) for k in boxes]
        return min(ways, key=np.linalg.norm, default=np.zeros(3))
