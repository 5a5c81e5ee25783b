"""A world of five things that needs no simulator: recordings by hand, and a backend."""

from __future__ import annotations

import dataclasses

import numpy as np

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.sim.backend import GripperSpec, Provenance, RobotSpec, Simulator, Start
from pytest_safemanip.sim.robocasa import robot
from pytest_safemanip.sim.robocasa.observation import CAMERAS, IMAGE_SIZE, STATE
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
HAND = GripperSpec("hand", (("finger_left",), ("finger_right",)), (), "gripper_close")
ROBOT = RobotSpec("Toy", robot.SPEC.robot.actions, (HAND,))
SPEC = dataclasses.replace(robot.SPEC, robot=ROBOT)
"""RoboCasa's actions, scenes and cameras."""
PATCHES = ("toy_patch",)
ACTION_SIZE = ROBOT.actions.size
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
HAND_HEIGHT = 1.2
"""Of the hand when an episode begins, m."""
PLACE = (0.0, 0.0, 0.9)
"""Where a contact is that is said to be nowhere: below the mug."""
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
    grippers=(HAND.in_scene((0.05, 0.1, 0.05), (0.0, 0.0, 0.0)),),
    actions=ROBOT.actions.entries,
    roles={"obj": "mug", "counter": "counter", "cab": "cabinet"},
)


def index(name, scene=SCENE):
    """Number of a part, given as ``entity/part``."""
    return [f"{part.entity}/{part.name}" for part in scene.parts].index(name)


def contacts(*rows, scene=SCENE):
    """Contacts from rows (step, part, part, force, normal, place, sustained), for example
    ``(3, "counter/body", "mug/body", 2.0, (0, 0, 1), (0.0, 0.0, 0.9), 5.0)``; the last two may be
    missing.
    """
    if not rows:
        return Contacts.empty()
    complete = [(*row, PLACE, row[3])[:7] if len(row) < 6 else row for row in rows]
    steps, a, b, force, normal, place, sustained = zip(*complete, strict=True)
    return Contacts(
        step=np.array(steps, np.int32),
        a=np.array([index(name, scene) for name in a], np.int32),
        b=np.array([index(name, scene) for name in b], np.int32),
        force=np.array(force, np.float32),
        sustained=np.array(sustained, np.float32),
        position=np.array(place, np.float32),
        normal=np.array(normal, np.float32),
    )


ONE_HAND = {"eef_pose": "eef_poses", "eef_twist": "eef_twists", "gripper": "openings"}
"""What a step has of one gripper, and the array that has it of all."""


def of_all_hands(changed, axis):
    """Arrays of the one hand as arrays of all hands, where they are given by its name."""
    return {
        ONE_HAND.get(name, name): np.expand_dims(value, axis) if name in ONE_HAND else value
        for name, value in changed.items()
    }


def at_rest(**changed):
    """One step: the mug and the apple on the counter, the hand beside them."""
    arrays = {
        "eef_poses": [(0.5, -0.5, 1.2, *UPRIGHT)],
        "eef_twists": np.zeros((1, 6)),
        "openings": [(1.0, 0.0)],
        "commands": np.zeros(1),
        "base_pose": (0.0, -1.0, 0.0, *UPRIGHT),
        "object_pose": ((0.0, 0.0, 0.95, *UPRIGHT), (0.4, 0.0, 0.94, *UPRIGHT)),
        "object_twist": np.zeros((2, 6)),
        "joint": ((0.0, 0.0),),
        "box_pose": ((0.0, 0.6, 1.5, *UPRIGHT),),
        "switch": np.zeros(0),
        "qpos": np.arange(3.0),
        "qvel": np.zeros(2),
    }
    floats = {
        name: np.array(value, np.float32)
        for name, value in (arrays | of_all_hands(changed, 0)).items()
    }
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
    """A rollout in which nothing happens but what is changed: whole arrays by name.

    The hand is told what the actions say.
    """
    step = at_rest()
    stacked = Steps.stack([step] * length, [np.zeros(ACTION_SIZE)] * length, length - tail)
    if "action" in changed:
        told = changed["action"][:, [ROBOT.actions.index(HAND.entry)]]
        changed.setdefault("commands", told.astype(np.float32))
    changed = of_all_hands(changed, 1)
    return Recording(about or episode(), scene, dataclasses.replace(stacked, **changed))


class World:
    """A backend whose hand goes where it is told; the apple rolls for a while.

    Args:
        succeeds_at: first step whose success check holds; None for never.
        rests_from: first step at which the apple lies still; None for never.
        fails_at: step at which the simulator fails; None for never.
        horizon: of every task.
    """

    spec = SPEC
    provenance = Provenance("toy", "primitive", {"toy": "1"}, {"backend": "abc"})

    def __init__(self, succeeds_at=None, rests_from=0, fails_at=None, horizon=10):
        self.succeeds_at, self.rests_from, self.fails_at = succeeds_at, rests_from, fails_at
        self.horizon = horizon
        self.actions, self.requests, self.closed = [], [], False

    def reset(self, request):
        self.requests.append(request)
        self.actions = []
        self._hand = np.array((0.1 * request.seed, -0.5, HAND_HEIGHT))
        digest = f"seed {request.seed}"
        return Start(SCENE, self._state(), "put it there", self.horizon, digest, PATCHES)

    def step(self, action):
        self.actions.append(np.array(action))
        if len(self.actions) == self.fails_at:
            raise RolloutError(f"the simulator broke at step {self.fails_at}")
        self._hand = self._hand + 0.05 * action[:3]
        return self._state(commands=ROBOT.commands(action))

    def observe(self):
        now, shape = len(self.actions), (IMAGE_SIZE, IMAGE_SIZE, 3)
        images = {key: np.full(shape, 100 * n + now, np.uint8) for n, key in enumerate(CAMERAS)}
        return {**images, **{key: np.full(size, now, np.float32) for key, size in STATE.items()}}

    def close(self):
        self.closed = True

    def _state(self, **changed):
        now = len(self.actions)
        rolls = self.rests_from is None or now < self.rests_from
        twist = np.zeros((2, 6))
        twist[1, 0] = 0.1 * rolls
        step = at_rest(eef_pose=(*self._hand, *UPRIGHT), object_twist=twist, **changed)
        done = self.succeeds_at is not None and now >= self.succeeds_at
        return dataclasses.replace(step, success=done)


def simulator(create):
    """What a hook gives: the toy's declaration with a function that makes a backend."""
    return Simulator(SPEC, create)
