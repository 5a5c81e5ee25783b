"""Maps MuJoCo's geoms to entities and their parts.

RoboCasa and robosuite name every geom, body and joint; the names are the only place where a
handle differs from the door that it sits on. This module is the one that reads them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

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

NO_PART = -1


@dataclass(frozen=True)
class PartTable:
    """Which part each geom belongs to.

    Attributes:
        parts: the scene's contact vocabulary.
        of_geom: part index of each geom, -1 for geoms that are no entity's (ngeom,).
        matters: whether a contact between two parts is recorded (P, P): not within an entity,
            and not between two things that cannot move.
    """

    parts: tuple[Part, ...]
    of_geom: NDArray[np.int32]
    matters: NDArray[np.bool_]


def build(model: Any, entity_of_root: Mapping[int, tuple[str, bool]]) -> PartTable:
    """Make the table.

    Args:
        model: a ``mujoco.MjModel``.
        entity_of_root: entity name of each root body (child of the world), and whether the
            entity moves freely (an object).
    """
    index: dict[Part, int] = {}
    mobile: list[bool] = []
    of_geom = np.full(model.ngeom, NO_PART, np.int32)
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        root = int(model.body_rootid[body])
        if model.geom_contype[geom] == 0 and model.geom_conaffinity[geom] == 0:
            continue
        name = model.body(body).name
        if is_robot(model.body(root).name):
            part, moves = Part(ROBOT, _robot_part(name)), True
        elif root in entity_of_root:
            entity, free = entity_of_root[root]
            part, moves = _part(model, geom, entity, free)
        else:
            continue
        if part not in index:
            index[part] = len(index)
            mobile.append(moves)
        of_geom[geom] = index[part]
    parts = tuple(index)
    entities = np.array([p.entity for p in parts])
    moving = np.array(mobile, bool)
    matters = (entities[:, None] != entities[None, :]) & (moving[:, None] | moving[None, :])
    return PartTable(parts, of_geom, matters)


def is_robot(root_body: str) -> bool:
    """Whether a root body is the robot's."""
    return root_body.startswith(("robot0_", "mobilebase0_", "gripper0_"))


def joint_of_body(model: Any, body: int) -> int:
    """The hinge or slide joint that moves a body relative to its entity, or -1.

    Of several joints on one body the last counts: it is the one that is used (the faucet's
    on/off after its temperature).
    """
    while body > 0:
        count, first = int(model.body_jntnum[body]), int(model.body_jntadr[body])
        for joint in range(first + count - 1, first - 1, -1):
            if model.jnt_type[joint] in (
                mujoco.mjtJoint.mjJNT_HINGE,
                mujoco.mjtJoint.mjJNT_SLIDE,
            ):
                return joint
        body = int(model.body_parentid[body])
    return -1


def local_name(model: Any, joint: int, entity: str) -> str:
    """A joint's name within its entity."""
    name: str = model.joint(joint).name
    return name.removeprefix(f"{entity}_")


def _part(model: Any, geom: int, entity: str, free: bool) -> tuple[Part, bool]:
    if free:
        return Part(entity, "body"), True
    body = int(model.geom_bodyid[geom])
    own = f"{model.geom(geom).name} {model.body(body).name}".replace(entity, "")
    joint = joint_of_body(model, body)
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
