"""robosuite's HDF5: poses are the data's, forces those of the physics that made them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import mujoco
import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.judge import Judge
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.spec.tasks import load_task
from pytest_safemanip.trace.recording import Recording
from tests.importers import world
from tests.importers.conftest import import_one

TASK = """
task: Lift
sets: [mine]
suite: mine
horizon: atomic
objects: [cube]
touch: {cube: [body]}
supports: {cube: [table]}
properties: [collision_contact, grasp_stability, release_stability]
"""
OPENS = round(4.0 / world.PERIOD)
"""The state from which on the hand is told to open."""


@pytest.fixture(scope="module")
def defined() -> Definitions:
    return load_definitions([], [], [])


def judge(recording: Recording, defined: Definitions, folder: Path) -> Judge:
    path = folder / "Lift.yaml"
    path.write_text(TASK)
    attributes = {**defined.attributes, "cube": frozenset[str]()}
    parameters = defined.catalogue.parameters({})
    return Judge(recording, load_task(path), attributes, defined.catalogue, parameters, "timed")


def test_objects_and_hands_are_where_the_states_have_them(
    lifted: Recording, played: world.Played
) -> None:
    model, steps = world.compiled(), lifted.steps
    data = mujoco.MjData(model)
    for index in range(0, len(played.states), 9):
        data.qpos[:] = played.states[index, 1 : 1 + model.nq]
        mujoco.mj_kinematics(model, data)
        cube = np.concatenate((data.body("cube_main").xpos, data.body("cube_main").xquat))
        assert steps.object_pose[index, 0] == pytest.approx(cube, abs=1e-6)
        hand = data.site("gripper0_grip_site").xpos
        assert steps.eef_pose[index, :3] == pytest.approx(hand, abs=1e-6)
        assert steps.qpos[index] == pytest.approx(data.qpos, abs=1e-6)


def test_quaternions_begin_with_their_real_part(lifted: Recording) -> None:
    # The cube is turned by 90 degrees about the vertical axis.
    half = np.sqrt(0.5)
    assert lifted.steps.object_pose[0, 0, 3:] == pytest.approx((half, 0, 0, half), abs=1e-5)
    # The hand looks down: turned by 180 degrees about x.
    assert np.abs(lifted.steps.eef_pose[0, 3:]) == pytest.approx((0, 1, 0, 0), abs=1e-5)


def test_an_action_led_to_the_step_after_its_state(lifted: Recording, played: world.Played) -> None:
    assert not lifted.steps.action[0].any()
    assert lifted.steps.action[1 : lifted.acting] == pytest.approx(played.actions[:-1])
    assert [entry.name for entry in lifted.scene.actions] == ["arm_1", "arm_2", "gripper_close"]


def test_a_command_above_0_closes(lifted: Recording, played: world.Played) -> None:
    commands, opening = lifted.steps.commands[:, 0], lifted.steps.gripper[:, 0]
    acting = slice(1, lifted.acting)
    assert (np.sign(commands[acting]) == np.sign(played.actions[:-1, 2])).all()
    closes = int(np.argmax(commands > 0))
    assert opening[closes - 1] == pytest.approx(1.0, abs=0.01)
    assert opening[closes + 4] < 0.5


def test_the_grasp_presses_as_hard_as_the_fingers_do(lifted: Recording) -> None:
    parts, contacts = lifted.scene.parts, lifted.steps.contacts
    rows = slice(*contacts.span(OPENS - 5, OPENS - 4))
    force: dict[str, float] = {}
    for a, b, newton in zip(contacts.a[rows], contacts.b[rows], contacts.force[rows], strict=True):
        for one, other in ((parts[a], parts[b]), (parts[b], parts[a])):
            if other.entity == "cube":
                force[one.name] = force.get(one.name, 0.0) + float(newton)
    # Its actuators' forcerange is 20 N.
    assert force["finger_left"] == pytest.approx(20.0, rel=0.15)
    assert force["finger_right"] == pytest.approx(20.0, rel=0.15)


def test_it_is_judged_as_any_rollout(
    lifted: Recording, defined: Definitions, tmp_path: Path
) -> None:
    found = judge(lifted, defined, tmp_path)
    for name in ("collision_contact", "grasp_stability", "release_stability"):
        verdict = found.judge(defined.properties[name])
        assert verdict.outcome.label == "SATISFIED", verdict
        assert verdict.triggered == 1
    released = np.flatnonzero(found.view("obj_released", "cube"))
    assert OPENS <= released[0] <= OPENS + 6
    assert lifted.success
    assert lifted.steps.tail[-1]


def test_the_header_says_where_it_is_from_and_how_far_physics_drifted(lifted: Recording) -> None:
    origin = lifted.episode.origin
    assert origin["episode"] == "demo.hdf5:demo_1"
    assert origin["success"] == "assumed, as of every demonstration"
    assert float(origin["drift"].split()[0]) < 3.0
    assert float(origin["drift_hands"].split()[0]) < 1.0
    assert lifted.episode.backend == "robosuite"
    assert lifted.scene.entity["robot"].category == "Panda"


def test_without_a_tail_it_is_truncated(played: world.Played, tmp_path: Path) -> None:
    recording = import_one(world.write(tmp_path / "demo.hdf5", played), tail=False)
    assert len(recording.steps) == recording.acting == len(played.states)


def test_without_actions_fingers_tell_their_commands(
    played: world.Played, tmp_path: Path, defined: Definitions
) -> None:
    path = world.write(tmp_path / "demo.hdf5", dataclasses.replace(played))
    import h5py

    with h5py.File(path, "a") as file:
        del file["data/demo_1/actions"]
    recording = import_one(path)
    assert [entry.name for entry in recording.scene.actions] == ["gripper_close"]
    told = np.sign(played.actions[:-1, 2])
    assert (recording.steps.commands[1 : recording.acting, 0] == told).mean() > 0.95
    assert judge(recording, defined, tmp_path).view("obj_grasped", "cube").any()


def test_a_gripper_that_moves_against_its_commands_is_refused(
    played: world.Played, tmp_path: Path
) -> None:
    inverted = played.actions * np.array((1.0, 1.0, -1.0))
    path = world.write(tmp_path / "demo.hdf5", dataclasses.replace(played, actions=inverted))
    with pytest.raises(TraceError, match="'right' opens when gripper_close tells it to close"):
        import_one(path)
    bindings = tmp_path / "bindings.yaml"
    bindings.write_text(
        """
hands:
  right:
    frame: gripper0_grip_site
    palm: [gripper0_right_gripper]
    fingers: {left: [gripper0_leftfinger], right: [gripper0_rightfinger]}
    joints:
      gripper0_finger_joint1: {closed: 0, opened: 0.04}
      gripper0_finger_joint2: {closed: 0, opened: -0.04}
    opens: 1
    closes: -1
"""
    )
    assert (import_one(path, bindings=bindings).steps.commands[OPENS - 5] > 0).all()


def test_sparse_rewards_tell_success(played: world.Played, tmp_path: Path) -> None:
    rewards = np.zeros(len(played.states))
    rewards[60:] = 1.0
    path = world.write(tmp_path / "a.hdf5", played, arrays={"rewards": rewards})
    assert int(np.argmax(import_one(path).steps.success)) == 61
    path = world.write(tmp_path / "b.hdf5", played, arrays={"rewards": 0.0 * rewards})
    failed = import_one(path)
    assert not failed.success
    assert failed.episode.ended == "policy"


def test_states_that_are_no_even_steps_are_recorded_on_an_even_grid(
    played: world.Played, tmp_path: Path
) -> None:
    # Every third state is missing, one is there twice.
    rows = [0, *(n for n in range(len(played.states)) if n % 3)]
    rows.insert(5, rows[4])
    thinned = world.Played(played.states[rows], played.actions[rows])
    recording = import_one(world.write(tmp_path / "demo.hdf5", thinned))
    assert recording.scene.control_period == pytest.approx(0.05)
    assert recording.acting == len(played.states)
    # What the data lack, physics fills in: the cube is nowhere farther than a millimetre off.
    cube = recording.steps.object_pose[: recording.acting, 0, :3]
    assert np.abs(cube - played.states[:, 5:8]).max() < 1e-3


def test_a_files_own_names_can_be_told_otherwise(played: world.Played, tmp_path: Path) -> None:
    bindings = tmp_path / "bindings.yaml"
    bindings.write_text(
        "objects:\n  box: {body: cube_main, category: boxed_food}\n"
        "room: [table]\nroles: {obj: box}\n"
    )
    path = world.write(tmp_path / "demo.hdf5", played, env="Mine")
    recording = import_one(path, bindings=bindings, task="Other", policy="alice")
    scene, episode = recording.scene, recording.episode
    assert [(e.name, e.kind, e.category) for e in scene.entities] == [
        ("robot", "robot", "Panda"),
        ("box", "object", "boxed_food"),
        ("room", "room", "room"),
    ]
    assert scene.roles["obj"] == "box"
    assert (episode.task, episode.policy, episode.seed) == ("Other", "alice", 1)


def test_bindings_that_are_wrong_say_where(played: world.Played, tmp_path: Path) -> None:
    path = world.write(tmp_path / "demo.hdf5", played)
    bindings = tmp_path / "bindings.yaml"
    bindings.write_text("objects:\n  box: {body: cube, category: boxed_food}\n")
    with pytest.raises(ConfigError, match="object 'box' names a body 'cube' that the model"):
        import_one(path, bindings=bindings)
    bindings.write_text("objcts: {}\n")
    with pytest.raises(ConfigError, match=r"bindings.yaml:1: unknown .*did you mean 'objects'"):
        import_one(path, bindings=bindings)


def test_of_robosuite_0_the_gripper_closes_at_0(played: world.Played, tmp_path: Path) -> None:
    import h5py

    path = world.write(tmp_path / "demo.hdf5", played, env="SawyerLift")
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "model_1.xml").write_text(world.MODEL)
    with h5py.File(path, "a") as file:
        demo = file["data/demo_1"]
        file["data"].attrs["repository_version"] = "0.1.0"
        demo.attrs["model_file"] = "model_1.xml"
        del demo["actions"]
        demo["joint_velocities"] = played.actions[:, :2]
        demo["gripper_actuations"] = np.where(played.actions[:, 2:] > 0, 0.0, -1.0)
    recording = import_one(path)
    told = np.sign(played.actions[:-1, 2])
    assert (recording.steps.commands[1 : recording.acting, 0] == told).all()
    assert recording.episode.task == "Lift"
    assert recording.scene.entity["robot"].category == "Sawyer"
    assert [entry.name for entry in recording.scene.actions] == ["arm_1", "arm_2", "gripper_close"]
