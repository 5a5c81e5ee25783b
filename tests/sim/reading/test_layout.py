"""A scene read by a layout: whose each body is, which parts it has, where it stands open."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.backend import GripperSpec
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.mujoco.describing import describe
from pytest_safemanip.sim.mujoco.layout import (
    FingerJoint,
    FixtureLayout,
    HandLayout,
    JointLayout,
    Layout,
    LiquidLayout,
    ObjectLayout,
    Region,
    RobotLayout,
)
from pytest_safemanip.sim.mujoco.reading import Reader
from pytest_safemanip.trace.elements import ActionEntry, Camera, Liquid, Part
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.steps import Contacts

WORLD = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <geom name="ground" type="plane" size="5 5 .1"/>
    <body name="arm" pos="0 0 1">
      <geom name="arm" size=".05"/>
      <body name="wrist" pos=".3 0 0" quat=".7071068 0 .7071068 0">
        <geom name="wrist" type="box" size=".02 .05 .01"/>
        <site name="grip" pos="0 0 .05"/>
        <camera name="eye" pos="0 0 .1" quat="0 1 0 0" fovy="75"/>
        <body name="left" pos="0 .02 .05"><joint name="l" type="slide" axis="0 1 0"/>
          <geom type="box" size=".01 .005 .03"/></body>
        <body name="right" pos="0 -.02 .05"><joint name="r" type="slide" axis="0 1 0"/>
          <geom type="box" size=".01 .005 .03"/></body>
      </body>
    </body>
    <body name="cup_main" pos="1 0 .1"><freejoint/>
      <geom type="box" size=".03 .03 .05" pos="0 0 .02" mass=".2"/>
      <body name="cup_ear" pos=".05 0 0"><geom type="box" size=".02 .005 .02" mass=".1"/></body>
    </body>
    <body name="chest" pos="-1 0 .5">
      <geom type="box" size=".3 .3 .01" pos="0 0 -.3"/>
      <site name="space" type="box" size=".28 .28 .25"/>
      <body name="flap" pos="-.3 0 .3"><joint name="chest_hinge" axis="0 -1 0" range="0 1.6"/>
        <geom type="box" size=".3 .3 .01" pos=".3 0 0"/>
        <geom name="grip_bar" type="box" size=".01 .05 .01" pos=".6 0 .02"/></body>
    </body>
    <body name="drop0" pos="1.5 0 .01"><freejoint/><geom size=".01" mass=".001"/></body>
    <body name="drop1" pos="1.5 .05 .02"><freejoint/><geom size=".01" mass=".001"/></body>
  </worldbody>
</mujoco>
"""
HAND = HandLayout(
    GripperSpec("only", (("finger_left",), ("finger_right",)), ("palm",), "close"),
    frame="grip",
    fingers=(("left",), ("right",)),
    palm=("wrist",),
    joints=(FingerJoint("l", 0.0, 0.04), FingerJoint("r", 0.0, -0.04)),
)
LAYOUT = Layout(
    control_period=0.05,
    robot=RobotLayout("Arm", ("arm",), (HAND,), "arm"),
    actions=(ActionEntry("close"),),
    objects={"cup": ObjectLayout("cup_main", "mug")},
    fixtures={
        "chest": FixtureLayout(
            ("chest",),
            "Chest",
            joints={"chest_hinge": JointLayout(0.0, 1.6, gives_access=True)},
            parts={"grip_bar": "handle"},
            interiors={"space": "space", "lid": Region("flap", (0.1, 0.1, 0.05), (0.3, 0.0, 0.0))},
        )
    },
    roles={"container": "chest"},
    cameras={"eye": 1.5},
    liquids={"water": LiquidLayout(("drop0", "drop1"), "water")},
)


@pytest.fixture
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(WORLD)


def reader(model: mujoco.MjModel, layout: Layout = LAYOUT) -> tuple[mujoco.MjData, Reader]:
    live = mujoco.MjData(model)
    return live, Reader(model, live, lambda data: describe(model, data, layout))


def test_every_geom_that_collides_is_a_part_of_what_its_nearest_declared_body_is(
    model: mujoco.MjModel,
) -> None:
    scene = reader(model)[1].description.scene
    assert set(scene.parts) == {
        Part("room", "body"),
        Part("robot", "arm"),
        Part("robot", "palm"),
        Part("robot", "finger_left"),
        Part("robot", "finger_right"),
        Part("cup", "body"),
        Part("chest", "body"),
        Part("chest", "door", "chest/hinge"),
        Part("chest", "handle", "chest/hinge"),
    }
    assert scene.roles == {
        "cup": "cup",
        "chest": "chest",
        "water": "water",
        "container": "chest",
    }
    assert {e.name: e.kind for e in scene.entities}["room"] == "room"


def test_boxes_masses_and_joints_are_those_of_the_model(model: mujoco.MjModel) -> None:
    scene = reader(model)[1].description.scene
    cup, hinge = scene.bodies[0], scene.joints[0]
    assert cup.half == pytest.approx((0.05, 0.03, 0.05))
    assert cup.centre == pytest.approx((0.02, 0.0, 0.02), abs=1e-6)
    assert cup.mass == pytest.approx(0.3)
    assert hinge.gives_access
    assert hinge.travel == pytest.approx(1.6)
    assert hinge.axis == pytest.approx((0, -1, 0))
    assert hinge.anchor == pytest.approx((-1.3, 0, 0.8))
    # The hand's box is in the frame of the site: fingers reach 3 cm beyond it.
    assert scene.grippers[0].centre[2] + scene.grippers[0].half[2] == pytest.approx(0.03)
    assert [(b.name, b.half) for b in scene.boxes] == [
        ("space", pytest.approx((0.28, 0.28, 0.25))),
        ("lid", pytest.approx((0.1, 0.1, 0.05))),
    ]


def test_a_step_has_poses_openings_and_boxes_that_move_along(model: mujoco.MjModel) -> None:
    live, read = reader(model)
    live.joint("chest_hinge").qpos[0] = 0.8
    live.joint("l").qpos[0], live.joint("r").qpos[0] = 0.04, 0.0
    live.joint("l").qvel[0] = 0.4
    step = read.read(True, Contacts.empty(), np.array([1.0]))
    assert step.joint[0, 0] == pytest.approx(0.5)
    assert step.openings[0] == pytest.approx((0.5, 5.0))
    assert step.eef_poses[0] == pytest.approx((0.35, 0, 1, 0.7071068, 0, 0.7071068, 0), abs=1e-6)
    lid = (-1.3 + 0.3 * np.cos(0.8), 0.0, 0.8 + 0.3 * np.sin(0.8))
    assert step.box_pose[1, :3] == pytest.approx(lid, abs=1e-6)
    assert step.box_pose[0, :3] == pytest.approx((-1, 0, 0.5))
    assert step.commands.tolist() == [1.0]
    assert step.success


def test_a_camera_moves_with_the_hand_that_it_is_on(model: mujoco.MjModel) -> None:
    live, read = reader(model)
    assert read.description.scene.cameras == (Camera("eye", float(np.deg2rad(75.0)), 1.5),)
    mujoco.mj_forward(model, live)
    pose = read.read(False, Contacts.empty()).camera_pose[0]
    assert pose[:3] == pytest.approx(live.camera("eye").xpos)
    assert matrix(pose[3:]) == pytest.approx(live.camera("eye").xmat.reshape(3, 3), abs=1e-6)


def test_of_a_liquid_its_particles_are_recorded_and_not_what_they_touch(
    model: mujoco.MjModel,
) -> None:
    live, read = reader(model)
    scene = read.description.scene
    assert scene.liquids == (Liquid("water", 2, 0.01),)
    assert scene.entity["water"].kind == "liquid"
    sampler = ContactSampler(model, read.description.table)
    for _ in range(200):
        mujoco.mj_step(model, live)
        sampler.sample(live)
    touched = sampler.take()
    assert {scene.parts[p].entity for p in (*touched.a, *touched.b)} <= {"room", "cup", "chest"}
    places = read.read(False, touched).particles
    assert places == pytest.approx(np.array(((1.5, 0, 0.01), (1.5, 0.05, 0.01))), abs=1e-3)


def test_things_touch_parts(model: mujoco.MjModel) -> None:
    live, read = reader(model)
    sampler = ContactSampler(model, read.description.table)
    for _ in range(200):
        mujoco.mj_step(model, live)
        sampler.sample(live)
    contacts = sampler.take()
    parts = read.description.scene.parts
    pairs = {
        (parts[a].entity, parts[b].entity) for a, b in zip(contacts.a, contacts.b, strict=True)
    }
    assert ("room", "cup") in pairs
    weight = contacts.force[(contacts.a == parts.index(Part("room", "body")))].sum()
    assert weight == pytest.approx(0.3 * 9.81, rel=0.05)


def test_what_the_model_does_not_have_is_named(model: mujoco.MjModel) -> None:
    wrong = replace(LAYOUT, objects={"cup": ObjectLayout("mug_main", "mug")})
    with pytest.raises(ConfigError, match="object 'cup' names a body 'mug_main'"):
        reader(model, wrong)
