"""The static part of an episode, read once after reset."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from pytest_safemanip.sim.mujoco import extents
from pytest_safemanip.sim.mujoco.describing import body_of, closed_kinematics, joint_of
from pytest_safemanip.sim.mujoco.description import (
    Attached,
    Description,
    Hand,
    camera_of,
    camera_place,
    find,
    site_place,
)
from pytest_safemanip.sim.mujoco.reading import Reader
from pytest_safemanip.sim.robocasa import parts as part_names
from pytest_safemanip.sim.robocasa import regions
from pytest_safemanip.sim.robocasa.liquids import liquids_in
from pytest_safemanip.sim.robocasa.observation import CAMERAS
from pytest_safemanip.sim.robocasa.robot import PANDA, SPEC
from pytest_safemanip.sim.robocasa.switches import reached, switches
from pytest_safemanip.trace.elements import ROBOT, Body, Entity, EntityKind
from pytest_safemanip.trace.geometry import conjugate, rotate, to_local
from pytest_safemanip.trace.scene import Scene

EEF_SITE = "gripper0_right_grip_site"
BASE_BODY = "mobilebase0_base"
GRIPPER_OPEN = 0.04
"""Joint position of an open Panda finger, m."""
ATTRIBUTES = {"Microwave": ("no_metal",)}
"""Attributes of fixtures by the name of their class."""


def describe(env: Any, data: Any) -> Description:
    """Read a RoboCasa environment's scene.

    Args:
        env: after its reset.
        data: ``MjData`` with kinematics and centres of mass up to date.
    """
    model = env.sim.model._model
    fixtures = {name: model.body(f.root_body).id for name, f in env.fixtures.items()}
    objects = {name: int(body) for name, body in env.obj_body_id.items()}
    roots = {int(model.body_rootid[b]): (n, False) for n, b in fixtures.items()}
    roots |= {int(model.body_rootid[b]): (n, True) for n, b in objects.items()}
    table = part_names.build(model, roots)
    meta = env.get_ep_meta()
    roles = _fixture_roles(env, meta)
    categories = {cfg["name"]: str(cfg["info"]["cat"]) for cfg in meta["object_cfgs"]}
    joints = [
        (name, joint)
        for name, root in fixtures.items()
        for joint in _joints_below(model, int(model.body_rootid[root]))
    ]
    travel = [_travel(env.fixtures[name], model, joint) for name, joint in joints]
    closed = closed_kinematics(model, data, {joint: 0.0 for _, joint in joints})
    boxes = regions.boxes(model, data, table, env, sorted(set(roles.values())))
    at_sites = reached(model, env)
    found, readers = switches(model, env)
    cameras = [find(model, "camera", name.removeprefix("video.")) for name in CAMERAS]
    liquid_entities, liquids, particles = liquids_in(model)
    hand = _hand(model)
    geoms = np.flatnonzero(_of_hand(model))
    half, centre = map(extents.vector, extents.box_around(model, data, hand.pose(data), geoms))
    scene = Scene(
        control_period=float(env.control_timestep),
        entities=(
            Entity(ROBOT, "robot", type(env.robots[0].robot_model).__name__),
            *(Entity(n, "object", categories[n], _filled(model, n)) for n in objects),
            *(_fixture(n, f) for n, f in env.fixtures.items()),
            *liquid_entities,
        ),
        bodies=tuple(_body(model, data, name, body) for name, body in objects.items()),
        parts=table.parts,
        joints=tuple(
            joint_of(
                model,
                closed,
                name,
                joint,
                opened,
                model.joint(joint).name in env.fixtures[name].door_joint_names,
            )
            for (name, joint), opened in zip(joints, travel, strict=True)
        ),
        boxes=tuple(box for box, _ in (*boxes, *at_sites)),
        switches=tuple(found),
        surfaces=tuple(extents.surfaces(model, closed, table, set(fixtures))),
        grippers=(PANDA.in_scene(half, centre),),
        actions=SPEC.robot.actions.entries,
        roles={
            **roles,
            **{name: name for name in objects},
            **{liquid.name: liquid.name for liquid in liquid_entities},
        },
        liquids=liquids,
        cameras=tuple(camera_of(model, camera, 1.0) for camera in cameras),
    ).checked()
    ids = np.array([joint for _, joint in joints], np.intp)
    return Description(
        scene=scene,
        table=table,
        hands=(hand,),
        base=model.body(BASE_BODY).id,
        object_body=np.array(list(objects.values()), np.intp),
        joint_qpos=model.jnt_qposadr[ids].astype(np.intp),
        joint_dof=model.jnt_dofadr[ids].astype(np.intp),
        joint_closed=np.zeros(len(ids)),
        joint_open=np.array(travel, np.float64),
        cameras=Attached.of([camera_place(model, camera) for camera in cameras]),
        boxes=Attached.of(
            [
                *(place for _, place in boxes),
                *(site_place(model, site) for _, site in at_sites),
            ]
        ),
        read_switches=readers,
        particles=particles,
    )


def _hand(model: Any) -> Hand:
    site = model.site(EEF_SITE).id
    fingers = [model.joint(f"gripper0_right_finger_joint{i}").id for i in (1, 2)]
    opened = np.array((GRIPPER_OPEN, -GRIPPER_OPEN))
    return Hand(
        site=site,
        body=int(model.site_bodyid[site]),
        qpos=model.jnt_qposadr[fingers].astype(np.intp),
        dof=model.jnt_dofadr[fingers].astype(np.intp),
        closed=np.zeros(2),
        opened=opened,
    )


def _filled(model: Any, name: str) -> tuple[str, ...]:
    """``liquid`` of an object that RoboCasa shows a liquid in: of a site, or a geom, that is not
    transparent.
    """
    kinds = (mujoco.mjtObj.mjOBJ_SITE, model.site_rgba), (mujoco.mjtObj.mjOBJ_GEOM, model.geom_rgba)
    for kind, colours in kinds:
        number = mujoco.mj_name2id(model, kind, f"{name}_liquid")
        if number >= 0 and colours[number, 3] > 0.0:
            return ("liquid",)
    return ()


def _of_hand(model: Any) -> list[bool]:
    """Whether each geom is the hand's and collides."""
    return [
        model.geom(geom).name.startswith("gripper0_right_") and bool(model.geom_contype[geom])
        for geom in range(model.ngeom)
    ]


def _fixture_roles(env: Any, meta: Any) -> dict[str, str]:
    """The task's own names for its fixtures: registered references, and its attributes.

    Most tasks register theirs (``env.cab`` is reference ``cab``); some only keep an attribute. What
    belongs to a fixture and comes off it has that fixture's name for it, such as ``blender_lid``.
    """
    from robocasa.models.fixtures import Fixture

    held = {
        role: value
        for role, value in vars(env).items()
        if isinstance(value, Fixture) and role != "init_robot_base_ref"
    }
    loose = {
        role: value
        for fixture in held.values()
        for role, value in vars(fixture).items()
        if isinstance(value, Fixture)
    }
    own = {role: str(fixture.name) for role, fixture in {**loose, **held}.items()}
    return {**own, **{role: str(name) for role, name in meta["fixture_refs"].items()}}


def _fixture(name: str, fixture: Any) -> Entity:
    from robocasa.models.fixtures import Wall

    kind: EntityKind = "room" if isinstance(fixture, Wall) else "fixture"
    category = type(fixture).__name__
    return Entity(name, kind, category, ATTRIBUTES.get(category, ()))


def _joints_below(model: Any, root: int) -> list[int]:
    return [
        joint
        for joint in range(model.njnt)
        if model.body_rootid[model.jnt_bodyid[joint]] == root
        and model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE
    ]


def _travel(fixture: Any, model: Any, joint: int) -> float:
    """Joint position of the fully open state; 0 is closed, whichever way the joint turns.

    RoboCasa counts a drawer as open at 55 % of its depth (``Drawer.get_door_state``), other
    joints at the end of their range.
    """
    from robocasa.models.fixtures import Drawer

    low, high = model.jnt_range[joint]
    if isinstance(fixture, Drawer):
        return -0.55 * float(fixture.size[1])
    return float(low) if abs(low) > abs(high) else float(high)


def _body(model: Any, data: Any, name: str, body: int) -> Body:
    pose = np.concatenate((data.xpos[body], data.xquat[body]))
    geom = model.geom(f"{name}_reg_bbox").id
    matrix = data.geom_xmat[geom].reshape(3, 3)
    axes = np.stack([rotate(conjugate(pose[3:]), matrix[:, k]) for k in range(3)], axis=-1)
    half = extents.vector(np.abs(axes) @ model.geom_size[geom])
    return body_of(
        model, data, name, body, half, extents.vector(to_local(pose, data.geom_xpos[geom]))
    )


def open_reader(env: Any) -> Reader:
    """What reads the steps of a RoboCasa environment, after its reset."""
    model, live = env.sim.model._model, env.sim.data._data
    return Reader(model, live, lambda data: describe(env, data))
