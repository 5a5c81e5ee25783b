"""What the clones see: where the hand is, where what the task is about is from there, and what they
remember of what they did.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step

Floats = NDArray[np.float64]

ROLES = ("obj", "cab", "drawer", "fxtr", "sink", "microwave", "dishwasher", "toaster_oven")
"""The task's own names for what it is about."""
GRIPPER, MODE = 6, 11
"""Of an action: fingers open (-1), stay (0) or close (1); the arm (-1) or the base (1) moves."""
SWITCHES = 6
"""What fingers and mode may be together, see :func:`switch`."""
SEGMENTS, LONGEST = 12, 200
"""Switches that are told apart, and steps since the last that are."""
SIZE = 55
LEAST, FARTHEST = 0.02, 3.0
"""Standard deviations are at least this; an observation counts as so many of them off at most."""


def switch(actions: Floats) -> NDArray[np.int64]:
    """What fingers and mode are, as one number in 0 to 5, of actions (..., 12)."""
    fingers = np.round(actions[..., GRIPPER]).astype(np.int64) + 1
    return fingers + 3 * (actions[..., MODE] > 0.0)


def scaled(seen: Floats, middle: Floats, spread: Floats) -> Floats:
    """Observations (..., :data:`SIZE`) as the networks get them: never far beyond what they have
    learnt from, where they would say anything.

    Args:
        seen: the observations.
        middle: their means.
        spread: their standard deviations.
    """
    return np.clip((seen - middle) / np.maximum(spread, LEAST), -FARTHEST, FARTHEST)


class Memory:
    """How often fingers or mode were switched, and how long ago: no state shows how far a clone is.

    Attributes:
        switches: how often.
        since: control steps since the last time.
        last: what they are, see :func:`switch`.
    """

    def __init__(self) -> None:
        self.switches = self.since = self.last = 0

    def told(self, action: Floats) -> None:
        """Take in what the robot was told."""
        now = int(switch(action))
        self.since += 1
        if now != self.last:
            self.switches, self.since, self.last = self.switches + 1, 0, now

    def __call__(self) -> Floats:
        """What is remembered (15,)."""
        segment = np.zeros(SEGMENTS + 1)
        segment[min(self.switches, SEGMENTS)] = 1.0
        fingers, mode = self.last % 3 - 1, self.last // 3
        return np.array([*segment, 3 * mode + fingers, min(self.since, LONGEST) / LONGEST])


class Features:
    """Makes the observation of a clone from the simulator's state, in the frame of the base.

    Args:
        scene: the static part of the episode.
        first: its first step.

    Attributes:
        memory: of what the robot was told.
    """

    def __init__(self, scene: Scene, first: Step) -> None:
        entities = [scene.roles[role] for role in ROLES if role in scene.roles]
        objects = [scene.object_index[name] for name in entities if name in scene.object_index]
        self._object = objects[0] if objects else None
        self._joints = [k for name in entities for k in scene.joints_of(name)]
        self._boxes = [
            [k for name in entities for k in scene.boxes_of(name, kind) if _wanted(scene, k)]
            for kind in ("handle", "control", "interior")
        ]
        self._start = np.asarray(first.base_pose, np.float64)
        self.memory = Memory()

    def __call__(self, step: Step) -> Floats:
        """The observation (:data:`SIZE`,).

        Args:
            step: the state.
        """
        frame, hand = matrix(np.asarray(step.base_pose[3:], np.float64)).T, step.eef_pose[:3]
        turn = frame @ matrix(np.asarray(step.eef_pose[3:], np.float64))
        parts = [frame @ (hand - step.base_pose[:3]), turn[:, 0], turn[:, 2], step.gripper]
        parts += [frame @ (step.base_pose[:3] - self._start[:3]), self.memory()]
        parts += [self._of_object(step, frame, hand), self._of_others(step, frame, hand)]
        parts += [_nearest([step.box_pose[k] for k in boxes], frame, hand) for boxes in self._boxes]
        openness = [step.joint[k][0] for k in self._joints[:2]]
        parts += [np.pad(openness, (0, 2 - len(openness)))]
        return np.concatenate(parts).astype(np.float64)

    def _of_object(self, step: Step, frame: Floats, hand: Floats) -> Floats:
        if self._object is None:
            return np.zeros(12)
        pose = np.asarray(step.object_pose[self._object], np.float64)
        turn = frame @ matrix(pose[3:])
        place = frame @ (pose[:3] - step.base_pose[:3])
        return np.concatenate((frame @ (pose[:3] - hand), place, turn[:, 0], turn[:, 2]))

    def _of_others(self, step: Step, frame: Floats, hand: Floats) -> Floats:
        others = [pose for k, pose in enumerate(step.object_pose) if k != self._object]
        return _nearest(others, frame, hand)


def _wanted(scene: Scene, box: int) -> bool:
    """Whether a box may be what a task is about: a button that stops something is not."""
    return not scene.boxes[box].name.startswith("stop")


def _nearest(poses: list[Floats], frame: Floats, hand: Floats) -> Floats:
    """From the hand to the nearest of some poses (3,); 0 if there is none."""
    ways = [frame @ (pose[:3] - hand) for pose in poses]
    return min(ways, key=np.linalg.norm, default=np.zeros(3))
