"""The small MuJoCo kitchen of `tests/physics` as a backend: a hand that policies move, for search.

The robot faces the counter's back wall: forward is y, left is -x, where the counter ends.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import mujoco
import numpy as np

from pytest_safemanip.errors import CannotStage, ConfigError
from pytest_safemanip.sim.backend import (
    ActionSpec,
    BackendSpec,
    GripperSpec,
    Provenance,
    RobotSpec,
    Simulator,
    Start,
)
from pytest_safemanip.sim.pushing import checked
from pytest_safemanip.sim.staging import Add, Move, Posture, SetOpen
from pytest_safemanip.trace.elements import ROBOT, ActionEntry
from tests.physics.filming import Look
from tests.physics.world import COUNTER, DOOR_TRAVEL, FINGER_OPEN, TIMESTEP, Solver, Thing, mjcf

PERIOD = 0.05
SUBSTEPS = round(PERIOD / TIMESTEP)
REACH, TURN = 0.05, 0.2
"""What an action of 1 moves and turns the hand's goal by, from where the hand is: m and rad."""
CLOSES_IN = 0.3
"""Seconds in which fingers close."""
ENTRIES = ("hand_x", "hand_y", "hand_z", "hand_roll", "gripper_close")
HAND = GripperSpec("right", (("finger_left",), ("finger_right",)), ("palm",), "gripper_close")
HORIZON = 140
PLACES = {"PutAway": (0.35, -0.3), "SetDown": (-0.2, -0.1)}
"""Where the thing stands that is handled, by task, m."""
AWAY = (0.0, -0.3, 1.15)
"""Where the hand begins, from there and from the floor, m."""
SHAPES = {
    "can": ("box", (0.025, 0.025, 0.04), 0.2),
    "candle": ("box", (0.02, 0.02, 0.06), 0.2),
    "cheese": ("box", (0.03, 0.03, 0.025), 0.3),
    "jam": ("box", (0.03, 0.03, 0.045), 0.5),
}
"""Shape, half extents in m and mass in kg of what may stand there, by category."""
LEVER = 0.5
"""Metres that a radian of the arm's posture is at the hand."""
LOST = 0.02
"""What has moved so far while the scene came to rest does not stand where it should, m."""


def hold(actions):
    """The action that keeps the hand where it is, its fingers as they were told last."""
    action = np.zeros(len(ENTRIES))
    action[-1] = actions[-1][-1] if len(actions) else -1.0
    return action


SPEC = BackendSpec(
    RobotSpec("Hand", ActionSpec(tuple(map(ActionEntry, ENTRIES)), hold), (HAND,)),
    ("bench",),
    state={"hand": 3},
    can=frozenset({"move", "add", "posture", "open", "objects", "forces"}),
    hand_position="hand",
)


class Bench:
    """Runs episodes in which something stands on the counter, and a cabinet beside it is open."""

    spec = SPEC
    provenance = Provenance("bench", "primitive", {"mujoco": mujoco.__version__}, {"backend": "1"})

    def reset(self, request):
        random = np.random.default_rng(request.seed)
        category = request.object_groups.get("obj", ["can"])[0]
        place = np.array(PLACES[request.task])
        things = [self._thing("obj", category, place + random.uniform(-0.01, 0.01, 2))]
        turn, door, start = random.uniform(-3.0, 3.0), 1.0, np.array(AWAY)
        start[:2] += place
        for change in request.changes:
            if isinstance(change, Move):
                shift = np.array((-change.by[1], change.by[0], 0.0))
                things[0] = dataclasses.replace(
                    things[0], place=tuple(np.array(things[0].place) + shift)
                )
                turn += change.turn
            elif isinstance(change, Add):
                beside = np.add(things[0].place[:2], (-change.by[1], change.by[0]))
                name = f"added_{len(things)}"
                things.append(self._thing(name, change.category, beside))
            elif isinstance(change, Posture):
                way = np.random.default_rng(request.seed).normal(size=3)
                start = start + LEVER * change.size * way / np.linalg.norm(way)
            elif isinstance(change, SetOpen):
                door = change.openness
            else:
                raise ConfigError(f"the bench cannot make {change}")
        return self._begin(request, things, turn, door, start)

    def _thing(self, name, category, place):
        shape, half, mass = SHAPES[category]
        return Thing(name, category, shape, half, (*place, COUNTER + half[2]), mass)

    def _begin(self, request, things, turn, door, start):
        self._model = model = mujoco.MjModel.from_xml_string(mjcf(things, Solver()))
        self._data = data = mujoco.MjData(model)
        look = self._look = Look(model, things)
        self._sampler = look.camera(PERIOD, 0.05).sampler
        names = ("x", "y", "z", "roll")
        self._joints = np.array([model.joint(name).qposadr[0] for name in names])
        data.qpos[self._joints[:3]] = start
        data.qpos[[model.joint(j).qposadr[0] for j in ("left", "right")]] = FINGER_OPEN
        data.joint("cabinet_doorhinge").qpos[0] = door * DOOR_TRAVEL
        half = np.radians(turn) / 2.0
        data.joint(model.body("obj").jntadr[0]).qpos[3:] = (np.cos(half), 0, 0, np.sin(half))
        self._finger = FINGER_OPEN
        data.ctrl[:] = (*start, 0.0, self._finger, self._finger)
        self._bodies = {thing.name: model.body(thing.name).id for thing in things}
        self._bodies[ROBOT] = model.body("gripper0_right_hand").id
        for _ in range(10 * SUBSTEPS):
            mujoco.mj_step(model, data)
        self._sampler.sample(data)
        scene = look._scene(PERIOD)
        roles = {**scene.roles, **{thing.name: thing.name for thing in things}}
        self.scene = dataclasses.replace(
            scene, actions=SPEC.robot.actions.entries, roles=roles
        ).checked()
        step = self._state(np.zeros(len(ENTRIES)))
        for thing, pose in zip(things, step.object_pose, strict=True):
            if np.linalg.norm(pose[:3] - np.array(thing.place)) > LOST:
                raise CannotStage(f"{thing.name} does not stay where it should stand")
        return Start(self.scene, step, "put it away", HORIZON, f"seed {request.seed}")

    def step(self, action):
        data, model = self._data, self._model
        now = data.qpos[self._joints].copy()
        goal = now + np.array((REACH, REACH, REACH, TURN)) * action[:4]
        closes = action[4] > 0.0
        pace = FINGER_OPEN / (CLOSES_IN / TIMESTEP)
        for _ in range(SUBSTEPS):
            self._finger = max(0.0, self._finger - pace) if closes else FINGER_OPEN
            data.ctrl[:] = (*goal, self._finger, self._finger)
            mujoco.mj_step(model, data)
            self._sampler.sample(data)
        data.xfrc_applied[:] = 0.0
        return self._state(action)

    def push(self, entity, force):
        self._data.xfrc_applied[self._bodies[entity], :3] += checked(force)

    def observe(self):
        return {"hand": self._hand().astype(np.float32)}

    def close(self):
        pass

    def _hand(self):
        return self._data.qpos[self._joints[:3]] - (0.0, -1.5, 0.0)

    def _state(self, action):
        command = np.zeros(8)
        command[5] = action[4] <= 0.0
        step = self._look.step(self._data, command)
        half = np.sqrt(0.5)
        base = np.array((0.0, -1.5, 0.0, half, 0.0, 0.0, half), np.float32)
        told = np.array((1.0 if action[4] > 0.0 else -1.0,), np.float32)
        return dataclasses.replace(
            step, base_pose=base, commands=told, contacts=self._sampler.take()
        )


SIMULATOR = Simulator(SPEC, lambda options: Bench())
FILE = Path(__file__)
