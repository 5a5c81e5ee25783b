"""robosuite's robots, as they are declared before anything is simulated."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.sim.backend import (
    Action,
    ActionSpec,
    BackendSpec,
    Camera,
    GripperSpec,
    RobotSpec,
)
from pytest_safemanip.sim.robosuite.hands import HANDS, HandModel
from pytest_safemanip.sim.robosuite.tasks import TASKS, TaskModel
from pytest_safemanip.trace.elements import ActionEntry

IMAGE_SIZE = 256
"""Width and height of robosuite's images where nothing else is asked for, pixels."""
_AXES = (
    *(f"end_effector_position_{axis}" for axis in "xyz"),
    *(f"end_effector_rotation_{axis}" for axis in "xyz"),
)
"""Of robosuite's operational-space controller (``OSC_POSE``), each in [-1, 1]: deltas in the frame
of the arm's base, 1 is 5 cm and 0.5 rad (rotation vector)."""
_CLOSE = "gripper_close"


@dataclass(frozen=True)
class RobotModel:
    """A robot of robosuite.

    Attributes:
        hand: the gripper that it has unless a task gives it another.
        joints: of each arm.
        arms: their names.
    """

    hand: str
    joints: int = 7
    arms: tuple[str, ...] = ("right",)


ROBOTS: Mapping[str, RobotModel] = MappingProxyType(
    {
        "Panda": RobotModel("PandaGripper"),
        "Sawyer": RobotModel("RethinkGripper"),
        "IIWA": RobotModel("Robotiq140Gripper"),
        "Jaco": RobotModel("JacoThreeFingerGripper"),
        "Kinova3": RobotModel("Robotiq85Gripper"),
        "UR5e": RobotModel("Robotiq85Gripper", joints=6),
        "XArm7": RobotModel("XArm7Gripper"),
        "Baxter": RobotModel("RethinkGripper", arms=("right", "left")),
    }
)


@dataclass(frozen=True)
class Arm:
    """An arm of the robots of an episode.

    Attributes:
        robot: number of the robot that it belongs to.
        name: robosuite's name of it.
        label: what its parts and entries begin with; empty if it is the only one.
        hand: its gripper.
        joints: how many it has.
    """

    robot: int
    name: str
    label: str
    hand: HandModel
    joints: int

    @property
    def prefix(self) -> str:
        """What the names of its gripper's bodies and joints begin with."""
        return f"gripper{self.robot}_{self.name}_"

    @property
    def gripper(self) -> GripperSpec:
        """Its gripper as it is declared."""
        fingers = tuple((f"{self.label}finger_{name}",) for name in self.hand.fingers)
        entry = f"{self.label}{_CLOSE}" if fingers else ""
        return GripperSpec(
            self.label.rstrip("_") or self.name, fingers, (f"{self.label}palm",), entry
        )


def parse_robots(text: str) -> tuple[str, ...]:
    """The robots that a user names.

    Args:
        text: one name, or two joined by ``+``; empty for a Panda.

    Raises:
        ConfigError: if there is no such robot, or there are more.
    """
    names = tuple(text.split("+")) if text else ("Panda",)
    for name in names:
        if name not in ROBOTS:
            hint = did_you_mean(name, ROBOTS)
            raise ConfigError(f"--safemanip-backend: robosuite has no robot {name!r}; {hint}")
    if len(names) > 2 or (len(names) == 2 and any(len(ROBOTS[n].arms) > 1 for n in names)):
        raise ConfigError(
            f"--safemanip-backend: robosuite:{text}: tasks have two arms at most, found more"
        )
    return names


def robots_in(task: TaskModel, chosen: Sequence[str]) -> tuple[str, ...]:
    """The robots of a task: where it needs two arms and one robot with one arm was chosen, two of
    it; where it needs one arm, the first that was chosen.
    """
    if task.arms == 1 or len(ROBOTS[chosen[0]].arms) > 1:
        return (chosen[0],)
    return (chosen[0], chosen[-1])


def arms_of(task: TaskModel, robots: Sequence[str]) -> tuple[Arm, ...]:
    """The arms of a task's robots, in robosuite's order."""
    models = [ROBOTS[name] for name in robots]

    def label(number: int, arm: str) -> str:
        if len(models) > 1:
            return f"robot{number}_"
        return f"{arm}_" if len(models[0].arms) > 1 else ""

    return tuple(
        Arm(number, arm, label(number, arm), HANDS[task.hand or model.hand], model.joints)
        for number, model in enumerate(models)
        for arm in model.arms
    )


def declare(chosen: Sequence[str]) -> BackendSpec:
    """The declaration of the backend with these robots."""
    specs = {name: _declare(task, robots_in(task, chosen)) for name, task in TASKS.items()}
    return dataclasses.replace(next(iter(specs.values())), tasks=specs)


def _declare(task: TaskModel, robots: Sequence[str]) -> BackendSpec:
    arms = arms_of(task, robots)
    entries = _entries(arms)
    grippers = tuple(arm.gripper for arm in arms)
    told = [entries.index(gripper.entry) for gripper in grippers if gripper.entry]

    def hold(actions: Sequence[Action]) -> Action:
        """Keep still, the grippers as they were told last; robosuite sets a goal anew each time."""
        action = np.zeros(len(entries))
        if actions:
            action[told] = actions[-1][told]
        return action

    views = ("agentview", *(f"robot{a.robot}_{_own(a, robots)}eye_in_hand" for a in arms))
    return BackendSpec(
        robot=RobotSpec(
            "+".join(robots), ActionSpec(tuple(map(ActionEntry, entries)), hold), grippers
        ),
        scenes=("official",),
        official=("official",),
        cameras=tuple(Camera(f"{view}_image", IMAGE_SIZE, IMAGE_SIZE) for view in views),
        state=_state(arms, robots),
        can=frozenset({"forces"}),
    )


def _entries(arms: Sequence[Arm]) -> list[str]:
    """Robosuite's order: robot by robot, its arms and then their grippers."""
    entries = []
    for robot in dict.fromkeys(arm.robot for arm in arms):
        own = [arm for arm in arms if arm.robot == robot]
        entries += [f"{arm.label}{axis}" for arm in own for axis in _AXES]
        entries += [f"{arm.label}{_CLOSE}" for arm in own if arm.hand.fingers]
    return entries


def _own(arm: Arm, robots: Sequence[str]) -> str:
    """What robosuite puts between a robot's name and what is about one of its arms."""
    return f"{arm.name}_" if len(ROBOTS[robots[arm.robot]].arms) > 1 else ""


def _state(arms: Sequence[Arm], robots: Sequence[str]) -> dict[str, int]:
    """Robosuite's own keys of what robots feel, and their lengths."""
    state: dict[str, int] = {}
    for number, name in enumerate(robots):
        count = ROBOTS[name].joints * len(ROBOTS[name].arms)
        keys = ("pos", "pos_cos", "pos_sin", "vel", "acc")
        state |= {f"robot{number}_joint_{key}": count for key in keys}
    for arm in arms:
        key = f"robot{arm.robot}_{_own(arm, robots)}"
        state |= {f"{key}eef_pos": 3, f"{key}eef_quat": 4, f"{key}eef_quat_site": 4}
        if arm.hand.qpos:
            state |= {f"{key}gripper_qpos": arm.hand.qpos, f"{key}gripper_qvel": arm.hand.qpos}
    return state
