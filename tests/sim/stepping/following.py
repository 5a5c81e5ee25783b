"""Ways of a hand that are foreseen, and then followed by the robot itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.sim.clearance import STAYS, Clearance, Path
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.robocasa.description import open_reader
from pytest_safemanip.sim.robocasa.foreseeing import open_foresight
from pytest_safemanip.sim.robocasa.stepping.fast import FastStepper
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.steps import Contacts

Floats = NDArray[np.float64]


def way(*poses: Floats, tolerance: float = 0.015, **rest: Any) -> Path:
    """A path of the hand's poses (7,) at top speed."""
    count = len(poses)
    return Path(
        np.array(poses),
        np.full((count, 3), STAYS),
        np.ones(count),
        np.full(count, tolerance),
        **rest,
    )


@dataclass(frozen=True)
class Reached:
    """What became of a path.

    Attributes:
        joints: positions of the arm's joints (7,).
        elbow: place of the elbow (3,).
        force: largest with which anything touched the robot, its wheels left out, N.
    """

    joints: Floats
    elbow: Floats
    force: float


class Kitchen:
    """A kitchen of RoboCasa's with a robot that foresees and follows."""

    def __init__(self, env: Any) -> None:
        self.env, self._reader = env, open_reader(env)
        self.model, self._data = env.sim.model._model, env.sim.data._data
        self._table = self._reader.description.table
        self.foresight = open_foresight(env, self._reader.description)
        controllers = env.robots[0].composite_controller.part_controllers
        self._joints = np.array(controllers["right"].qpos_index)
        self._elbow = self.model.body("robot0_link4").id
        self.arm = Arm(self._reader.description.scene, self._read())

    def reset(self) -> None:
        """Another start, for what is foreseen and followed next."""
        self._sampler = ContactSampler(self.model, self._table)
        self._stepper = FastStepper(self.env, self._sampler.sample)
        self.arm.step = self._read()

    def ask(self, path: Path) -> Clearance:
        """What is foreseen."""
        return self.foresight.answer(path)

    def follow(self, path: Path) -> Reached:
        """Go there, as the expert does."""
        self.reset()
        force = 0.0
        for pose in path.hand:
            motion = self.arm.move(pose[:3], matrix(pose[3:]), required=False)
            for action in motion:
                self._stepper.step(np.clip(action, -1.0, 1.0))
                contacts = self._sampler.take()
                self.arm.step = self._reader.read(False, contacts)
                force = max(force, self._force(contacts))
        joints = self._data.qpos[self._joints].copy()
        return Reached(joints, self.elbow(joints), force)

    def elbow(self, joints: Floats) -> Floats:
        """Where the elbow is (3,) with the arm in a posture (7,)."""
        data = mujoco.MjData(self.model)
        data.qpos[:] = self._data.qpos
        data.qpos[self._joints] = joints
        mujoco.mj_kinematics(self.model, data)
        return np.array(data.xpos[self._elbow])

    def pose(self, ahead: float, left: float, height: float, pitch: float, yaw: float) -> Floats:
        """A pose of the hand (7,) so far before the robot's base, m, pointing so, degrees."""
        turn = np.empty(4)
        mujoco.mju_mat2Quat(turn, self.arm.hand(pitch, yaw=yaw).ravel())
        aside = np.append(left * self.arm.left, 0.0)
        return np.concatenate((self.arm.before(ahead, height) + aside, turn))

    def _read(self) -> Any:
        return self._reader.read(False, Contacts.empty())

    def _force(self, contacts: Contacts) -> float:
        parts = self._table.parts
        own = [
            float(force)
            for a, b, force in zip(contacts.a, contacts.b, contacts.force, strict=True)
            if any(p.entity == ROBOT and p.name != "base" for p in (parts[a], parts[b]))
        ]
        return max(own, default=0.0)


def drawn(kitchen: Kitchen, count: int, seed: int) -> Iterator[Path]:
    """Ways of the hand over the counter, drawn at random."""
    random = np.random.default_rng(seed)
    low, high = (0.35, -0.35, 0.95, 0.0, -40.0), (0.75, 0.35, 1.45, 70.0, 40.0)
    for _ in range(count):
        yield way(kitchen.pose(*random.uniform(low, high)), margin=0.0)
