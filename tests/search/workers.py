"""Scripted policies for the bench: one that does its tasks safely, and what it may do wrong."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pytest_safemanip.trace.geometry import matrix
from tests.physics.world import COUNTER, SHELF
from tests.search.bench import PLACES, REACH

SPEED = 0.4
"""Of full scale: 0.4 m/s."""
GAIN = 0.5
"""Share of the way to its goal that the hand is asked to go at each step."""
CARRIED = 0.1
"""How high above where it stood a thing is carried, m."""
GRIP, WAIT = 9, 4
"""Control steps that fingers are given to close, and to open."""


@dataclass
class Seen:
    """What a worker sees when its episode begins.

    Attributes:
        place: of the thing (3,), m.
        forward: how far it stands from where it usually does, forward, m.
        left: likewise to the left.
        turn: how far it is turned, rad.
        category: what it is.
        beside: where other things stand, from it, m (N, 2).
        hand: how far the hand begins from where it usually does, m.
        door: how far open the cabinet is.
    """

    place: np.ndarray
    forward: float
    left: float
    turn: float
    category: str
    beside: np.ndarray
    hand: float
    door: float


@dataclass(frozen=True)
class Goal:
    """Where the hand goes next.

    Attributes:
        place: m (3,).
        closed: whether the fingers are told to close.
        near: how near counts as there, m.
        steps: after which it goes on, there or not.
    """

    place: np.ndarray
    closed: bool
    near: float = 0.01
    steps: int = 40


@dataclass
class Habits:
    """How a worker does its task; a weak one has others in some situations.

    Attributes:
        grasp: where it takes hold of the thing, from its middle (3,), m.
        put: where it puts it, from where it should (3,), m.
        carried: how high it carries it, m.
        speed: of full scale.
        grip: control steps that it gives the fingers to close.
        drop: how high above its place it lets go, m.
        least_open: how far open the door has to be for it to reach in.
    """

    grasp: np.ndarray = field(default_factory=lambda: np.zeros(3))
    put: np.ndarray = field(default_factory=lambda: np.zeros(3))
    carried: float = CARRIED
    speed: float = SPEED
    grip: int = GRIP
    drop: float = 0.0
    least_open: float = 0.92


class Worker:
    """Takes the thing and puts it away, or down."""

    tasks = tuple(PLACES)
    fingerprint = 1

    def habits(self, seen):
        """How it goes about it in a situation."""
        return Habits()

    def reset(self, episode):
        self._episode, self._plan = episode, None
        self.done = False

    def act(self, observation):
        step = observation.step
        hand = np.asarray(step.eef_poses[0, :3], np.float64)
        if self._plan is None:
            self._seen = self._look(step, hand)
            self._habits = self.habits(self._seen)
            self._plan = iter(self._goals())
            self._goal, self._since = next(self._plan), 0
        goal = self._goal
        self._since += 1
        if np.linalg.norm(goal.place - hand) < goal.near or self._since > goal.steps:
            following = next(self._plan, None)
            if following is None:
                self.done = True
            else:
                self._goal, self._since = following, 0
                goal = following
        action = np.zeros(5)
        limit = self._habits.speed
        action[:3] = np.clip(GAIN * (goal.place - hand) / REACH, -limit, limit)
        action[4] = 1.0 if goal.closed else -1.0
        return action

    def _look(self, step, hand):
        scene = self._episode.scene
        usual = PLACES[self._episode.task]
        poses = {n: step.object_pose[k] for n, k in scene.object_index.items()}
        place = np.asarray(poses["obj"][:3], np.float64)
        axis = matrix(np.asarray(poses["obj"][3:], np.float64))[:, 0]
        others = [p[:2] - place[:2] for n, p in poses.items() if n != "obj"]
        return Seen(
            place,
            float(place[1] - usual[1]),
            float(usual[0] - place[0]),
            float(np.arctan2(axis[1], axis[0])),
            next(e.category for e in scene.entities if e.name == "obj"),
            np.array(others).reshape(-1, 2),
            float(np.linalg.norm(hand - (usual[0], usual[1] - 0.3, 1.15))),
            float(step.joint[0, 0]),
        )

    def _goals(self):
        habits, place = self._habits, self._seen.place
        at = place + habits.grasp
        stands = place[2] - COUNTER
        yield Goal(at - (0.0, 0.15, -habits.carried), False, 0.02)
        yield Goal(at - (0.0, 0.15, 0.0), False)
        yield Goal(at, False)
        yield Goal(at, True, 0.0, habits.grip)
        yield Goal(at + np.array((0.0, 0.0, habits.carried)), True, 0.02)
        if self._episode.task == "PutAway":
            front = np.array((0.35, -0.25, SHELF + stands + 0.03)) + habits.grasp
            inside = np.array((0.35, 0.12, SHELF + stands + 0.02 + habits.drop))
            if self._seen.door < habits.least_open:
                yield Goal(at, True)
                yield Goal(at, False, 0.0, WAIT)
                yield Goal(at - (0.0, 0.15, 0.0), False, 0.03)
                return
            yield Goal(front, True, 0.02)
        else:
            inside = np.array((-0.5, -0.1, COUNTER + stands + habits.drop))
            yield Goal(inside + habits.grasp + (0.0, 0.0, habits.carried), True, 0.02)
        goal = inside + habits.put + habits.grasp
        yield Goal(goal, True, 0.01)
        yield Goal(goal - (0.0, 0.0, 0.02 if habits.drop == 0.0 else 0.0), True, 0.005, 10)
        yield Goal(goal, False, 0.0, WAIT)
        yield Goal(goal - (0.0, 0.3, 0.0), False, 0.03)
