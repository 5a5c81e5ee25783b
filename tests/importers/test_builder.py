"""Recordings from states of any model: doors, switches, the settle tail, commands."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import mujoco
import numpy as np
import pytest

from pytest_safemanip import RecordingBuilder
from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.importers.builder import About, States
from pytest_safemanip.importers.commands import infer_commands
from pytest_safemanip.sim.backend import GripperSpec
from pytest_safemanip.sim.mujoco.layout import (
    FingerJoint,
    FixtureLayout,
    HandLayout,
    JointLayout,
    Layout,
    ObjectLayout,
    RobotLayout,
)
from pytest_safemanip.trace.elements import Switch
from pytest_safemanip.trace.recording import Recording

WORLD = """
<mujoco><option timestep="0.002" cone="elliptic"/><worldbody>
  <geom name="ground" type="plane" size="5 5 .1"/>
  <body name="arm" pos="-1 0 .5"><joint name="turn" axis="0 0 1" damping="1"/>
    <geom type="box" size=".2 .02 .02" pos=".2 0 0"/></body>
  <body name="box" pos="1 0 .3"><geom type="box" size=".1 .1 .01"/>
    <body name="lid" pos="-.1 0 .02"><joint name="hinge" axis="0 -1 0" damping="5"/>
      <geom type="box" size=".1 .1 .005" pos=".1 0 0"/></body></body>
  <body name="ball" pos="0 0 1"><freejoint/><geom size=".05" mass=".1"/></body>
</worldbody></mujoco>
"""
LAYOUT = Layout(
    control_period=0.05,
    robot=RobotLayout("Arm", ("arm",), (), "arm"),
    actions=(),
    objects={"ball": ObjectLayout("ball", "orange")},
    fixtures={
        "chest": FixtureLayout(
            ("box",), "Chest", joints={"hinge": JointLayout(0.0, 1.5, gives_access=True)}
        )
    },
)
LAMP = Switch("chest", "lamp", "appliance")


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(WORLD)


@pytest.fixture(scope="module")
def states(model: mujoco.MjModel) -> States:
    """The arm turns, the lid opens, the ball falls; the lamp is lit from the tenth state on."""
    data = mujoco.MjData(model)
    times, qpos, qvel = [], [], []
    for _ in range(12):
        times.append(data.time)
        qpos.append(data.qpos.copy())
        qvel.append(data.qvel.copy())
        for _ in range(25):
            data.joint("turn").qvel[0], data.joint("hinge").qvel[0] = 0.5, 1.0
            mujoco.mj_step(model, data)
    lit = (np.arange(12) >= 9)[:, None]
    return States(
        np.array(times),
        np.array(qpos),
        np.array(qvel),
        actions=np.zeros((12, 0)),
        switches=lit,
    )


def build(model: mujoco.MjModel, states: States, **options: bool) -> Recording:
    return RecordingBuilder(model, LAYOUT, switches=(LAMP,), **options).build(
        states, About(task="Any")
    )


def test_doors_and_switches_are_as_the_states_say(model: mujoco.MjModel, states: States) -> None:
    steps = build(model, states).steps
    hinge = states.qpos[:, model.joint("hinge").qposadr[0]]
    assert steps.joint[:12, 0, 0] == pytest.approx(hinge / 1.5, abs=1e-6)
    assert steps.switch[:12, 0].tolist() == [0.0] * 9 + [1.0] * 3
    assert steps.switch[12:, 0].all()


def test_what_falls_when_data_end_falls_on_in_the_tail(
    model: mujoco.MjModel, states: States
) -> None:
    recording = build(model, states)
    height = recording.steps.object_pose[:, 0, 2]
    assert recording.acting == 12
    assert height[11] < 0.4
    assert height[-1] == pytest.approx(0.05, abs=0.01)
    # The robot is held where it was.
    turned = recording.steps.qpos[:, 0]
    assert turned[-1] == pytest.approx(turned[11], abs=0.02)
    assert len(build(model, states, tail=False).steps) == 12


def test_the_last_state_of_a_demonstration_is_its_success(
    model: mujoco.MjModel, states: States
) -> None:
    recording = build(model, states)
    assert recording.steps.success[:11].tolist() == [False] * 11
    assert recording.steps.success[11:].all()


def test_states_must_say_what_switches_do(model: mujoco.MjModel, states: States) -> None:
    silent = States(states.times, states.qpos, states.qvel)
    with pytest.raises(TraceError, match="switches: the states do not say"):
        build(model, silent)


def test_a_category_that_nobody_has_described_is_told_when_the_recording_is_built(
    model: mujoco.MjModel, states: States
) -> None:
    layout = dataclasses.replace(LAYOUT, objects={"ball": ObjectLayout("ball", "ornage")})
    refused = "object 'ball': category 'ornage' has no row in objects.yaml.*mean 'orange'"
    with pytest.raises(ConfigError, match=refused):
        RecordingBuilder(model, layout)
    recording = RecordingBuilder(model, layout, switches=(LAMP,), categories={"ornage"}).build(
        states, About(task="Any")
    )
    assert recording.scene.entity["ball"].category == "ornage"


HAND = HandLayout(
    GripperSpec("hand", (("left",), ("right",)), (), entry="close"),
    frame="arm",
    fingers=(("arm",), ("arm",)),
    palm=(),
    joints=(FingerJoint("turn", 0.0, 0.1),),
)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({}, "hand 'hand': no entry of the actions is 'close'; there is none"),
        ({"joints": (FingerJoint("turn", 0.1, 0.1),)}, "'turn' is closed at 0.1 and opened at 0.1"),
        ({"fingers": (("arm",),)}, "hand 'hand': 2 finger groups, and bodies of 1"),
        (
            {"spec": dataclasses.replace(HAND.spec, entry="", opens=1.0)},
            "what opens it, 1, closes it, too",
        ),
    ],
)
def test_a_hand_that_contradicts_itself_is_told_when_the_recording_is_built(
    changed: dict[str, Any], message: str, model: mujoco.MjModel, states: States
) -> None:
    unnamed = dataclasses.replace(HAND, spec=dataclasses.replace(HAND.spec, entry=""))
    hand = dataclasses.replace(unnamed if changed else HAND, **changed)
    robot = dataclasses.replace(LAYOUT.robot, hands=(hand,))
    builder = RecordingBuilder(model, dataclasses.replace(LAYOUT, robot=robot), switches=(LAMP,))
    with pytest.raises(ConfigError, match=re.escape(message)):
        builder.build(states, About(task="Any"))


def test_what_would_be_wrong_in_a_recording_is_told_when_it_is_built(
    model: mujoco.MjModel, states: States
) -> None:
    uneven = dataclasses.replace(LAYOUT, control_period=0.0513)
    with pytest.raises(ConfigError, match=r"0.0513 s is no multiple of .* physics step, 0.002 s"):
        RecordingBuilder(model, uneven, switches=(LAMP,)).build(states, About(task="Any"))
    builder = RecordingBuilder(model, LAYOUT, switches=(LAMP,))
    with pytest.raises(ConfigError, match="'any task' is no name of a task"):
        builder.build(states, About(task="any task"))
    flat = {"chest": FixtureLayout(("box",), "Chest", joints={"hinge": JointLayout(1.0, 1.0)})}
    with pytest.raises(ConfigError, match="fixture 'chest': joint 'hinge' is closed at 1 and"):
        RecordingBuilder(model, dataclasses.replace(LAYOUT, fixtures=flat), switches=(LAMP,)).build(
            states, About(task="Any")
        )


def test_the_same_states_give_the_same_recording(model: mujoco.MjModel, states: States) -> None:
    one, two = build(model, states), build(model, states)
    assert (one.steps.object_pose == two.steps.object_pose).all()
    assert (one.steps.contacts.force == two.steps.contacts.force).all()


TIMES = np.arange(60) * 0.05


def test_fingers_that_stand_still_are_told_what_moved_them_last() -> None:
    opening = np.concatenate((np.ones(20), np.full(20, 0.4), np.ones(20)))
    commands = infer_commands(TIMES, opening)
    assert (commands[:18] == -1).all()
    assert (commands[21:38] == 1).all()
    assert (commands[41:] == -1).all()


def test_fingers_that_are_forced_apart_are_still_closing() -> None:
    levered = np.concatenate((np.ones(20), np.full(20, 0.2), np.linspace(0.2, 0.6, 20)))
    assert (infer_commands(TIMES, levered)[21:] == 1).all()


def test_fingers_that_never_move_are_open() -> None:
    assert (infer_commands(TIMES, np.ones(60)) == -1).all()
