"""What is read of a kitchen is what MuJoCo and RoboCasa themselves say."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_safemanip.spec.tasks import load_tasks
from pytest_safemanip.trace.geometry import to_local, to_world
from tests.sim.conftest import QUICK, Kitchen

GetKitchen = Callable[..., Kitchen]


def physics(shared: Kitchen) -> tuple[Any, Any]:
    return shared.env.sim.model._model, shared.env.sim.data._data


def inside(point: NDArray[Any], pose: NDArray[Any], half: Any) -> bool:
    return bool((np.abs(to_local(pose, point)) < np.array(half)).all())


@pytest.mark.parametrize("task", QUICK)
def test_every_role_of_a_task_is_played(
    kitchen: GetKitchen, pytestconfig: pytest.Config, task: str
) -> None:
    scene = kitchen(task).scene
    spec = load_tasks([pytestconfig.rootpath / "tasks"])[task]
    named = {*spec.objects, *spec.enclosures, *spec.mechanisms, *spec.touch, *spec.supports}
    named |= {role for roles in spec.supports.values() for role in roles}
    assert named
    assert named <= set(scene.roles)
    for role in spec.objects:
        assert scene.entity[scene.roles[role]].kind == "object"
    for role in (*spec.enclosures, *spec.mechanisms):
        fixture = scene.roles[role]
        assert scene.entity[fixture].kind == "fixture"
        assert scene.joints_of(fixture)


@pytest.mark.parametrize("task", QUICK)
def test_entities_are_robocasas_own(kitchen: GetKitchen, task: str) -> None:
    shared = kitchen(task)
    kinds = {e.name: e.kind for e in shared.scene.entities}
    expected = {"robot", *shared.env.objects, *shared.env.fixtures}
    assert set(kinds) == expected
    assert {kinds[name] for name in shared.env.objects} <= {"object"}
    assert kinds["floor_room"] == "room"
    assert [b.entity for b in shared.scene.bodies] == list(shared.env.objects)


def test_interiors_and_handles_are_those_of_the_fixture_in_play(kitchen: GetKitchen) -> None:
    scene = kitchen("OpenDrawer").scene
    drawer = scene.roles["drawer"]
    assert len(scene.boxes_of(drawer, "interior")) == 1
    assert len(scene.boxes_of(drawer, "handle")) == 1
    sink = kitchen("TurnOnSinkFaucet").scene
    assert len(sink.boxes_of(sink.roles["sink"], "handle")) == 1


def test_poses_agree_with_mujoco_after_a_control_step(kitchen: GetKitchen) -> None:
    shared = kitchen("PickPlaceDrawerToCounter")
    action = np.zeros(12)
    action[:3], action[11] = (0.5, -0.3, 0.4), -1.0
    shared.env.step(action)
    step = shared.read()
    model, live = physics(shared)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = live.qpos, live.qvel
    mujoco.mj_forward(model, data)
    bodies = [shared.env.obj_body_id[b.entity] for b in shared.scene.bodies]
    assert step.object_pose[:, :3] == pytest.approx(data.xpos[bodies], abs=1e-6)
    assert step.object_pose[:, 3:] == pytest.approx(data.xquat[bodies], abs=1e-6)
    assert step.base_pose[:3] == pytest.approx(data.body("mobilebase0_base").xpos, abs=1e-6)
    hand = data.site("gripper0_right_grip_site")
    assert step.eef_pose[:3] == pytest.approx(hand.xpos, abs=1e-6)
    for k, box in enumerate(shared.scene.boxes):
        if box.kind == "handle":  # around several shapes, in the axes of what its joint moves
            moved = data.xquat[model.joint(f"{box.entity}_{box.name}").bodyid[0]]
            assert abs(step.box_pose[k, 3:] @ moved) == pytest.approx(1.0, abs=1e-6)
            continue
        prefix = {"interior": "_reg_", "burner": "_burner_on_"}.get(box.kind, "_")
        of_kind = data.site if box.kind in ("water", "burner") else data.geom
        shown = of_kind(f"{box.entity}{prefix}{box.name}")
        assert step.box_pose[k, :3] == pytest.approx(shown.xpos, abs=1e-6)
        corner = shown.xpos + shown.xmat.reshape(3, 3) @ np.array(box.half)
        assert to_world(step.box_pose[k], box.half) == pytest.approx(corner, abs=1e-5)


def test_twists_agree_with_mujoco(kitchen: GetKitchen) -> None:
    shared = kitchen("PickPlaceDrawerToCounter")
    model, data = physics(shared)
    data.qvel[:] = np.random.default_rng(0).uniform(-1.0, 1.0, model.nv)
    step = shared.read()
    mujoco.mj_forward(model, data)
    ids = [shared.env.obj_body_id[b.entity] for b in shared.scene.bodies]
    wanted = [(mujoco.mjtObj.mjOBJ_XBODY, body) for body in ids]
    wanted.append((mujoco.mjtObj.mjOBJ_SITE, model.site("gripper0_right_grip_site").id))
    read = [*step.object_twist, step.eef_twist]
    for (kind, number), twist in zip(wanted, read, strict=True):
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, kind, number, velocity, 0)
        assert twist == pytest.approx(np.concatenate((velocity[3:], velocity[:3])), abs=1e-5)


@pytest.mark.parametrize(("opening", "width"), [(1.0, 0.04), (0.5, 0.02), (0.0, 0.0)])
def test_the_grippers_opening_is_read(kitchen: GetKitchen, opening: float, width: float) -> None:
    shared = kitchen("OpenDrawer")
    for finger, sign in (("1", 1.0), ("2", -1.0)):
        shared.env.sim.data.set_joint_qpos(f"gripper0_right_finger_joint{finger}", sign * width)
    assert shared.read().gripper[0] == pytest.approx(opening)


@pytest.mark.parametrize("opening", [0.0, 0.4, 1.0])
def test_the_opening_of_a_drawer_is_what_robocasa_says(kitchen: GetKitchen, opening: float) -> None:
    shared = kitchen("OpenDrawer")
    drawer = shared.scene.roles["drawer"]
    fixture = shared.env.fixtures[drawer]
    fixture.set_joint_state(opening, opening, shared.env, fixture.door_joint_names)
    step = shared.read()
    (joint,) = shared.scene.joints_of(drawer)
    told = fixture.get_door_state(shared.env)
    assert step.joint[joint, 0] == pytest.approx(next(iter(told.values())), abs=1e-6)
    others = np.delete(step.joint[:, 0], joint)
    assert np.abs(others).max() < 0.05


@pytest.mark.parametrize("opening", [0.0, 0.5, 1.0])
def test_the_opening_of_doors_is_what_robocasa_says(kitchen: GetKitchen, opening: float) -> None:
    shared = kitchen("OpenCabinet")
    cabinet = shared.scene.roles["fxtr"]
    fixture = shared.env.fixtures[cabinet]
    fixture.set_joint_state(opening, opening, shared.env, fixture.door_joint_names)
    step, told = shared.read(), fixture.get_joint_state(shared.env, fixture.door_joint_names)
    for joint in shared.scene.joints_of(cabinet):
        name = f"{cabinet}_{shared.scene.joints[joint].name}"
        assert step.joint[joint, 0] == pytest.approx(told[name], abs=1e-6)
        assert step.joint[joint, 0] == pytest.approx(opening, abs=0.01)


def test_a_joint_that_opens_has_a_positive_rate(kitchen: GetKitchen) -> None:
    shared = kitchen("OpenDrawer")
    (joint,) = shared.scene.joints_of(shared.scene.roles["drawer"])
    info = shared.reader.description
    physics(shared)[1].qvel[info.joint_dof[joint]] = 0.1 * np.sign(info.joint_open[joint])
    assert shared.read().joint[joint, 1] == pytest.approx(0.1 / shared.scene.joints[joint].travel)


def test_opening_moves_along_the_axis_by_the_travel(kitchen: GetKitchen) -> None:
    shared = kitchen("OpenDrawer")
    scene, (_, data) = shared.scene, physics(shared)
    drawer = scene.roles["drawer"]
    (joint,), (handle,) = scene.joints_of(drawer), scene.boxes_of(drawer, "handle")
    address = shared.reader.description.joint_qpos[joint]
    places = []
    for opening in (0.0, 1.0):
        data.qpos[address] = opening * shared.reader.description.joint_open[joint]
        places.append(shared.read().box_pose[handle, :3].astype(float))
    moved = np.array(scene.joints[joint].axis) * scene.joints[joint].travel
    assert places[1] - places[0] == pytest.approx(moved, abs=1e-5)


def test_the_drawers_interior_contains_what_robocasa_put_into_it(kitchen: GetKitchen) -> None:
    shared = kitchen("PickPlaceDrawerToCounter")
    scene, step = shared.scene, shared.read()
    (box,) = scene.boxes_of(scene.roles["drawer"], "interior")
    half, pose = scene.boxes[box].half, step.box_pose[box]
    thing = step.object_pose[scene.object_index["obj"], :3]
    assert inside(thing, pose, half)
    assert not inside(step.eef_pose[:3], pose, half)
    (joint,) = scene.joints_of(scene.roles["drawer"])
    physics(shared)[1].qpos[shared.reader.description.joint_qpos[joint]] = 0.0
    closed = shared.read()
    assert not np.allclose(closed.box_pose[box], pose), "the interior moves with the drawer"


def test_an_object_stands_on_a_surface_of_the_counter(kitchen: GetKitchen) -> None:
    shared = kitchen("PickPlaceCounterToCabinet")
    scene, step = shared.scene, shared.read()
    body = scene.bodies[scene.object_index["obj"]]
    pose = step.object_pose[scene.object_index["obj"]]
    centre = to_world(pose, body.centre)
    tops = [
        s.pose[2] + s.half[2]
        for s in scene.surfaces
        if s.entity == scene.roles["counter"]
        and (np.abs(to_local(np.array(s.pose), centre))[:2] < s.half[:2]).all()
    ]
    heights = [centre[2] - top for top in tops]
    assert min(abs(h - min(body.half)) for h in heights) < max(body.half)
    assert body.mass > 0.0


def test_a_reading_is_bit_identical_if_nothing_moved(kitchen: GetKitchen) -> None:
    shared = kitchen("OpenDrawer")
    one, two = shared.read(), shared.read()
    assert all(
        np.array_equal(getattr(one, name), getattr(two, name)) for name in ("qpos", "box_pose")
    )
