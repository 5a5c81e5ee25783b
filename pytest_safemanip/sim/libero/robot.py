"""The declaration of LIBERO's backend: its Panda, its cameras, what policies see."""

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
from pytest_safemanip.trace.elements import ActionEntry

GRIPPER = 6
"""Place in the action: 1 closes, -1 opens."""
_ENTRIES = (
    *(f"end_effector_position_{axis}" for axis in "xyz"),
    *(f"end_effector_rotation_{axis}" for axis in "xyz"),
    "gripper_close",
)
"""Deltas of the end effector in the world frame, 1 is 5 cm and 0.5 rad (robosuite 1.4's
``OSC_POSE``), and the gripper."""

AGENT_VIEW = "image.agentview"
WRIST = "image.robot0_eye_in_hand"
CAMERAS = (AGENT_VIEW, WRIST)
"""Images (256, 256, 3), uint8, RGB, the top row first. LIBERO's own are upside down."""
IMAGE_SIZE = 256
INSTRUCTION = "instruction"
EEF_POSITION = "state.eef_position"
EEF_ROTATION = "state.eef_quaternion"
FINGERS = "state.gripper_qpos"
STATE = {EEF_POSITION: 3, EEF_ROTATION: 4, FINGERS: 2}
"""Length of each part of the state, float32: metres, quaternion (x, y, z, w), both in the world
frame, and the positions of the finger joints. As in robosuite 1.4, the position is that of the
gripper's site and the rotation that of the hand's body, a quarter turn apart."""


def still(gripper: float) -> Action:
    """The action that keeps the arm where it is."""
    action = np.zeros(len(_ENTRIES))
    action[GRIPPER] = gripper
    return action


def hold(actions: Sequence[Action]) -> Action:
    """The action that keeps the robot still, its gripper as it was told last."""
    return still(float(actions[-1][GRIPPER]) if actions else -1.0)


PANDA = GripperSpec("right", (("finger_left",), ("finger_right",)), ("palm",), _ENTRIES[GRIPPER])
SPEC = BackendSpec(
    robot=RobotSpec("Panda", ActionSpec(tuple(map(ActionEntry, _ENTRIES)), hold), (PANDA,)),
    scenes=("libero",),
    official=("libero",),
    cameras=tuple(Camera(name, IMAGE_SIZE, IMAGE_SIZE) for name in CAMERAS),
    state=STATE,
    instruction=INSTRUCTION,
    can=frozenset({"put", "open", "forces"}),
)
