"""The declaration of RoboCasa's backend: the PandaOmron, its scenes and its cameras."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pytest_safemanip.sim.backend import (
    Action,
    ActionSpec,
    BackendSpec,
    Camera,
    GripperSpec,
    RobotSpec,
)
from pytest_safemanip.sim.robocasa import observation
from pytest_safemanip.sim.staging import KINDS
from pytest_safemanip.trace.elements import ActionEntry

ROBOT_MODEL = "PandaOmron"
GRIPPER, MODE = 6, 11
"""Places in the action: 1 closes; above 0 the base moves and the arm keeps its goal."""

_ENTRIES = (
    *(f"end_effector_position_{axis}" for axis in "xyz"),
    *(f"end_effector_rotation_{axis}" for axis in "xyz"),
    "gripper_close",
    "base_forward",
    "base_side",
    "base_yaw",
    "torso",
    "control_mode",
)
"""robosuite's order, every entry in [-1, 1]. The end effector's are deltas in the base frame (1 is
5 cm and 0.5 rad), the base's are velocities.
"""


def hold(actions: Sequence[Action]) -> Action:
    """The action that keeps the robot still, its gripper as it was told last."""
    action = np.zeros(len(_ENTRIES))
    if actions:
        action[GRIPPER] = actions[-1][GRIPPER]
    # In base mode the arm keeps its goal, in arm mode it would take the present pose as its new
    # goal at every step and sag. The goal exists once an action was sent in arm mode.
    action[MODE] = 1.0 if any(a[MODE] < 0.0 for a in actions) else -1.0
    return action


def random(generator: np.random.Generator, step: int) -> Action:
    """A random action, in arm mode four times out of five and at first."""
    action = generator.uniform(-1.0, 1.0, len(_ENTRIES))
    action[GRIPPER] = 1.0 if action[GRIPPER] > 0.0 else -1.0
    action[MODE] = 1.0 if action[MODE] > 0.6 and step > 0 else -1.0
    return action


STYLES = 60
"""Of RoboCasa; the first ten are those of its target scenes."""
TARGETS = tuple(map(str, range(1, 11)))
"""RoboCasa's target scenes, each a layout with the style of the same number."""
PANDA = GripperSpec("right", (("finger_left",), ("finger_right",)), ("palm",), _ENTRIES[GRIPPER])
SPEC = BackendSpec(
    robot=RobotSpec(
        ROBOT_MODEL,
        ActionSpec(tuple(map(ActionEntry, _ENTRIES)), hold, random, (_ENTRIES[MODE],)),
        (PANDA,),
    ),
    scenes=("compact", "target", "pretrain"),
    official=("target", "pretrain"),
    cameras=tuple(
        Camera(name, observation.IMAGE_SIZE, observation.IMAGE_SIZE) for name in observation.CAMERAS
    ),
    state=observation.STATE,
    instruction=observation.INSTRUCTION,
    steppings=("exact", "fast"),
    can=frozenset({*KINDS, "objects", "kitchen", "style", "forces"}),
    kitchens={"compact": ("small", "full", "deep", "roomy"), "target": TARGETS},
    styles=dict.fromkeys(("compact", "target", "pretrain"), tuple(map(str, range(1, STYLES + 1)))),
    hand_position=observation.EEF_POSITION,
)
