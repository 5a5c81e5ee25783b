"""The parts of RoboCasa's entities.

RoboCasa and robosuite name every geom, body and joint; the names are the only place where a
handle differs from the door that it sits on. This module is the one that reads them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco

from pytest_safemanip.sim.mujoco import parts
from pytest_safemanip.sim.mujoco.describing import local_name
from pytest_safemanip.sim.mujoco.parts import PartTable
from pytest_safemanip.trace.elements import BUTTON, ROBOT, Part

GRIPPER_PARTS = {
    "leftfinger": "finger_left",
    "rightfinger": "finger_right",
    "finger_joint1_tip": "finger_left",
    "finger_joint2_tip": "finger_right",
}
"""Bodies of the Panda gripper that are fingers; the rest of it is the palm."""

MOVING_PARTS = ("handle", "knob", BUTTON, "switch", "lever", "lid", "spout", "rack", "tray")
"""Parts of fixtures that are told apart by name; other moving parts are doors and drawers."""


def build(model: Any, entity_of_root: Mapping[int, tuple[str, bool]]) -> PartTable:
    """Make the table of parts.

    Args:
        model: a ``mujoco.MjModel``.
        entity_of_root: entity name of each root body (child of the world), and whether the
            entity moves freely (an object).
    """

    def name_part(geom: int) -> tuple[Part, bool] | None:
        body = int(model.geom_bodyid[geom])
        root = int(model.body_rootid[body])
        if is_robot(model.body(root).name):
            return Part(ROBOT, _robot_part(model.body(body).name)), True
        if root not in entity_of_root:
            return None
        return _part(model, geom, *entity_of_root[root])

    return parts.build(model, name_part)


def is_robot(root_body: str) -> bool:
    """Whether a root body is the robot's."""
    return root_body.startswith(("robot0_", "mobilebase0_", "gripper0_"))


def _part(model: Any, geom: int, entity: str, free: bool) -> tuple[Part, bool]:
    if free:
        return Part(entity, "body"), True
    body = int(model.geom_bodyid[geom])
    own = f"{model.geom(geom).name} {model.body(body).name}".replace(entity, "")
    joint = parts.joint_of_body(model, body)
    if joint < 0:
        return Part(entity, BUTTON if BUTTON in own else "body"), False
    key = f"{entity}/{local_name(model, joint, entity)}"
    for name in MOVING_PARTS:
        if name in own:
            return Part(entity, name, key), True
    hinge = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
    return Part(entity, "door" if hinge else "drawer", key), True


def _robot_part(body: str) -> str:
    if body.startswith("gripper0_"):
        for ending, part in GRIPPER_PARTS.items():
            if body.endswith(ending):
                return part
        return "palm"
    if body.startswith("robot0_link"):
        return body.removeprefix("robot0_")
    return "base" if body.startswith("mobilebase0_") else "arm"
