"""What is what in the model of a LIBERO environment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from pytest_safemanip.sim.libero.bddl import Problem
from pytest_safemanip.sim.libero.kinds import (
    COOK_REGION,
    HEADROOM,
    HEATED_HEIGHT,
    WORKSPACES,
    category_of,
    kind_of,
)
from pytest_safemanip.sim.libero.robot import CAMERAS, PANDA, SPEC
from pytest_safemanip.sim.mujoco.description import Read
from pytest_safemanip.sim.mujoco.extents import vector
from pytest_safemanip.sim.mujoco.layout import (
    FingerJoint,
    FixtureLayout,
    HandLayout,
    JointLayout,
    Layout,
    ObjectLayout,
    Region,
    RobotLayout,
)
from pytest_safemanip.trace.elements import Switch
from pytest_safemanip.trace.geometry import rotate

ROBOT = RobotLayout(
    name=SPEC.robot.name,
    bodies=("robot0_base",),
    hands=(
        HandLayout(
            spec=PANDA,
            frame="gripper0_grip_site",
            fingers=(("gripper0_leftfinger",), ("gripper0_rightfinger",)),
            palm=("gripper0_right_gripper",),
            joints=(
                FingerJoint("gripper0_finger_joint1", 0.0, 0.04),
                FingerJoint("gripper0_finger_joint2", 0.0, -0.04),
            ),
        ),
    ),
    base="robot0_base",
)
"""robosuite 1.4's names, mounted or standing on the ground."""


def layout_of(problem: Problem, model: Any, data: Any, control_period: float) -> Layout:
    """What is what in the model of a problem.

    Args:
        problem: of the environment.
        model: its ``MjModel``.
        data: its ``MjData``, with kinematics.
        control_period: s.
    """
    placed = {fact[1] for fact in problem.begins if len(fact) == 3}
    return Layout(
        control_period=control_period,
        robot=ROBOT,
        actions=SPEC.robot.actions.entries,
        objects={
            name: ObjectLayout(f"{name}_main", category_of(category))
            for name, category in problem.objects.items()
            if name in placed  # what SafeLIBERO declares and does not place is far below the floor
        },
        fixtures={
            name: _fixture(name, category, model, data)
            for name, category in problem.fixtures.items()
        },
        cameras={name.partition(".")[2]: 1.0 for name in CAMERAS},
    )


def switches_of(problem: Problem, model: Any, data: Any) -> Sequence[tuple[Switch, Read]]:
    """The burners, each with what reads it."""
    return [
        (Switch(name, joint.removeprefix(f"{name}_"), "burner", _key(name, joint)), _on(data, at))
        for name, category in problem.fixtures.items()
        if kind_of(category).moves == "knob"
        for joint in _joints(model, name)
        for at in [(int(model.joint(joint).qposadr[0]), category)]
    ]


def _heated(model: Any, name: str) -> Region:
    """What the burner of a stove heats: above and below its site."""
    site = model.site(f"{name}_{COOK_REGION}")
    half = (float(site.size[0]), float(site.size[1]), HEATED_HEIGHT)
    body = model.body(int(site.bodyid[0])).name
    return Region(body, half, vector(site.pos), vector(site.quat))


def _on(data: Any, at: tuple[int, str]) -> Read:
    address, category = at
    kind = kind_of(category)
    return lambda: [bool(data.qpos[address] >= kind.open_at * kind.opened)]


def _key(fixture: str, joint: str) -> str:
    return f"{fixture}/{joint.removeprefix(f'{fixture}_')}"


def _fixture(name: str, category: str, model: Any, data: Any) -> FixtureLayout:
    if category in WORKSPACES:
        return FixtureLayout((WORKSPACES[category],), category)
    kind = kind_of(category)
    joints = _joints(model, name)
    regions = {
        region: _interior(model, data, f"{name}_{region}", HEADROOM * (kind.moves == "drawer"))
        for region in kind.interiors
        if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, f"{name}_{region}") >= 0
    }
    moved = [model.body(int(model.joint(joint).bodyid[0])).name for joint in joints]
    return FixtureLayout(
        bodies=(f"{name}_main",),
        category=category,
        joints={joint: JointLayout(0.0, kind.opened, kind.opens) for joint in joints},
        parts={body: kind.moves for body in moved if kind.moves},
        interiors=regions,
        burners={
            joint.removeprefix(f"{name}_"): _heated(model, name)
            for joint in joints
            if kind.moves == "knob"
        },
        attributes=kind.attributes,
    )


def _interior(model: Any, data: Any, name: str, headroom: float) -> Region:
    """The box of a site, higher by some headroom, m."""
    site = model.site(name)
    vertical = data.site(name).xmat.reshape(3, 3)[2]  # as seen from the site
    axis = int(np.argmax(np.abs(vertical)))
    half, shift = np.array(site.size), np.zeros(3)
    half[axis] += headroom / 2.0
    shift[axis] = np.copysign(headroom / 2.0, vertical[axis])
    centre = np.array(site.pos) + rotate(np.array(site.quat), shift)
    body = model.body(int(site.bodyid[0])).name
    return Region(body, vector(half), vector(centre), vector(site.quat))


def _joints(model: Any, name: str) -> list[str]:
    """The hinges and slides of a fixture."""
    kinds = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
    found = [model.joint(number) for number in range(model.njnt)]
    return [j.name for j in found if j.name.startswith(f"{name}_") and j.type[0] in kinds]
