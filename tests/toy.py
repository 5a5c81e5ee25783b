"""A world of five things that needs no simulator: recordings by hand, and a backend."""

from __future__ import annotations

import dataclasses

import numpy as np

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.sim.backend import ACTION_SIZE, Provenance, Start
from pytest_safemanip.sim.observation import CAMERAS, IMAGE_SIZE, STATE
from pytest_safemanip.trace import (
    Box,
    Contacts,
    Entity,
    Episode,
    Joint,
    Part,
    Recording,
    Scene,
    Step,
    Steps,
)
from pytest_safemanip.trace.elements import Body, Surface

DT = 0.05
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
PARTS = (
    Part("robot", "finger_left"),
    Part("robot", "finger_right"),
    Part("robot", "link5"),
    Part("counter", "body"),
    Part("cabinet", "door", "cabinet/hinge"),
    Part("mug", "body"),
    Part("apple", "body"),
)
SCENE = Scene(
    control_period=DT,
    entities=(
        Entity("robot", "robot", "PandaOmron"),
        Entity("counter", "fixture", "Counter"),
        Entity("cabinet", "fixture", "HingeCabinet"),
        Entity("mug", "object", "mug"),
        Entity("apple", "object", "apple"),
    ),
    bodies=(
        Body("mug", (0.05, 0.05, 0.05), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.3),
        Body("apple", (0.04, 0.04, 0.04), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.1),
    ),
    parts=PARTS,
    joints=(
        Joint(
            "cabinet",
            "hinge",
            "hinge",
            True,
            (0.0, 0.0, 1.0),
            (-0.3, 0.4, 1.5),
            1.5,
            (0.3, 0.01, 0.3),
            (0.0, 0.4, 1.5, *UPRIGHT),
        ),
    ),
    boxes=(Box("cabinet", "shelf", "interior", (0.3, 0.2, 0.3)),),
    switches=(),
    surfaces=(Surface("counter", "", (1.0, 0.5, 0.45), (0.0, 0.0, 0.45, *UPRIGHT)),),
    gripper_half=(0.05, 0.1, 0.05),
    gripper_centre=(0.0, 0.0, 0.0),
    roles={"obj": "mug", "counter": "counter", "cab": "cabinet"},
)


def index(name):
    """Number of a part, given as ``entity/part``."""
    return next(n for n, part in enumerate(PARTS) if f"{part.entity}/{part.name}" == name)


def contacts(*rows):
    """Contacts from rows (step, part, part, force, normal), for example
    ``(3, "counter/body", "mug/body", 2.0, (0, 0, 1))``.
    """
    if not rows:
        return Contacts.empty()
    steps, a, b, force, normal = zip(*rows, strict=True)
    newtons = np.array(force, np.float32)
    return Contacts(
        step=np.array(steps, np.int32),
        a=np.array([index(name) for name in a], np.int32),
        b=np.array([index(name) for name in b], np.int32),
        force=newtons,
        peak=newtons.copy(),
        position=np.tile(np.float32((0.0, 0.0, 0.9)), (len(rows), 1)),
        normal=np.array(normal, np.float32),
    )


def at_rest(**changed):
    """One step: the mug and the apple on the counter, the hand beside them."""
    arrays = {
        "eef_pose": (0.5, -0.5, 1.2, *UPRIGHT),
        "eef_twist": np.zeros(6),
        "gripper": (1.0, 0.0),
        "base_pose": (0.0, -1.0, 0.0, *UPRIGHT),
        "object_pose": ((0.0, 0.0, 0.95, *UPRIGHT), (0.4, 0.0, 0.94, *UPRIGHT)),
        "object_twist": np.zeros((2, 6)),
        "joint": ((0.0, 0.0),),
        "box_pose": ((0.0, 0.6, 1.5, *UPRIGHT),),
        "switch": np.zeros(0),
        "qpos": np.arange(3.0),
        "qvel": np.zeros(2),
    }
    floats = {name: np.array(value, np.float32) for name, value in (arrays | changed).items()}
    return Step(**floats, success=False, contacts=contacts())


def episode(**changed):
    return Episode(
        **{
            "task": "PickPlaceCounterToCabinet",
            "seed": 0,
            "policy": "toy",
            "instruction": "put the mug into the cabinet",
            "horizon": 5,
            "ended": "horizon",
            "backend": "toy",
            "scenes": "compact",
            "stepping": "exact",
            "assets": "primitive",
            "versions": {"toy": "1"},
            "hashes": {"start": "0", "key": "k"},
            "served": {},
            **changed,
        }
    )


def recording(length=6, tail=0, scene=SCENE, about=None, **changed):
    """A rollout in which nothing happens but what is changed: whole arrays by name."""
    step = at_rest()
    stacked = Steps.stack([step] * length, [np.zeros(ACTION_SIZE)] * length, length - tail)
    return Recording(about or episode(), scene, dataclasses.replace(stacked, **changed))


class World:
    """A backend whose hand goes where it is told; the apple rolls for a while.

    Args:
        succeeds_at: first step whose success check holds; None for never.
        rests_from: first step at which the apple lies still; None for never.
        fails_at: step at which the simulator fails; None for never.
        horizon: of every task.
    """

    provenance = Provenance("toy", "primitive", {"toy": "1"}, {"backend": "abc"})

    def __init__(self, succeeds_at=None, rests_from=0, fails_at=None, horizon=10):
        self.succeeds_at, self.rests_from, self.fails_at = succeeds_at, rests_from, fails_at
        self.horizon = horizon
        self.actions, self.requests, self.closed = [], [], False

    def reset(self, request):
        self.requests.append(request)
        self.actions = []
        self._hand = np.array((0.1 * request.seed, -0.5, 1.2))
        return Start(SCENE, self._state(), "put it there", self.horizon, f"seed {request.seed}")

    def step(self, action):
        self.actions.append(np.array(action))
        if len(self.actions) == self.fails_at:
            raise RolloutError(f"the simulator broke at step {self.fails_at}")
        self._hand = self._hand + 0.05 * action[:3]
        return self._state()

    def observe(self):
        now, shape = len(self.actions), (IMAGE_SIZE, IMAGE_SIZE, 3)
        images = {key: np.full(shape, 100 * n + now, np.uint8) for n, key in enumerate(CAMERAS)}
        return {**images, **{key: np.full(size, now, np.float32) for key, size in STATE.items()}}

    def close(self):
        self.closed = True

    def _state(self):
        now = len(self.actions)
        rolls = self.rests_from is None or now < self.rests_from
        twist = np.zeros((2, 6))
        twist[1, 0] = 0.1 * rolls
        step = at_rest(eef_pose=(*self._hand, *UPRIGHT), object_twist=twist)
        done = self.succeeds_at is not None and now >= self.succeeds_at
        return dataclasses.replace(step, success=done)
