"""robosuite's environments as a simulator: declared as they are, stepped as they step."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, TaskError
from pytest_safemanip.sim.backend import Backend, Options, Provenance, Request, Start
from pytest_safemanip.sim.registry import find_simulator
from pytest_safemanip.sim.robosuite.factory import simulator
from pytest_safemanip.sim.robosuite.robots import ROBOTS, declare
from pytest_safemanip.sim.robosuite.tasks import TASKS
from pytest_safemanip.sim.staging import SetOpen
from pytest_safemanip.trace import Recording
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.steps import Step, Steps
from tests.robosuite.conftest import DEFINED, Judged, judge


def asked(task: str) -> Request:
    return Request(task, 0, "official")


def episode(backend: Backend, task: str, length: int = 4) -> tuple[Start, list[Step]]:
    """An episode with random actions, the same ones each time."""
    start = backend.reset(asked(task))
    random = np.random.default_rng(0)
    actions = backend.spec.in_task(task).robot.actions
    return start, [start.step, *(backend.step(actions.sample(random, n)) for n in range(length))]


def arrays(part: Any) -> dict[str, Any]:
    return {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}


def assert_identical(one: tuple[Start, list[Step]], other: tuple[Start, list[Step]]) -> None:
    assert one[0].scene == other[0].scene
    assert one[0].fingerprint == other[0].fingerprint
    for left, right in zip(one[1], other[1], strict=True):
        for a, b in ((left, right), (left.contacts, right.contacts)):
            for name, value in arrays(a).items():
                if isinstance(value, np.ndarray):
                    assert np.array_equal(value, arrays(b)[name]), name


def test_every_task_has_a_binding_and_every_binding_a_task() -> None:
    assert set(DEFINED.runnable) == set(TASKS)
    assert {task.suite for task in DEFINED.runnable.values()} == {"robosuite"}


@pytest.mark.parametrize(
    "task", ["Door", "NutAssemblySingle", "PickPlaceSingle", "Wipe", "TwoArmHandover"]
)
def test_a_task_is_reset_stepped_bound_and_judged(backend: Backend, task: str) -> None:
    start, steps = episode(backend, task)
    robot = backend.spec.in_task(task).robot
    stacked = Steps.stack(steps, [np.zeros(robot.actions.size, np.float32)] * len(steps), 5)
    about = Episode(
        task, 0, "random", "", 5, "policy", "robosuite", "official", "exact", "official", {}, {}, {}
    )
    judged = Judged(*(r := (Recording(about, start.scene, stacked),)), judge(*r))
    assert judged.violated == set()
    assert "collision_contact" in judged.triggered
    assert [g.name for g in start.scene.grippers] == [g.name for g in robot.grippers]
    assert start.scene.actions == robot.actions.entries
    objects = [body.entity for body in start.scene.bodies]
    roles = start.scene.roles
    handled = {roles[role] for role in DEFINED.tasks[task].objects}
    assert handled == set(objects)


@pytest.mark.parametrize("robot", ["Sawyer", "IIWA", "Jaco", "UR5e", "XArm7", "Baxter"])
def test_the_hand_of_every_robot_closes_and_opens_as_it_is_told(robot: str, tmp_path: Path) -> None:
    from pytest_safemanip.sim.robosuite.backend import RobosuiteBackend

    backend = RobosuiteBackend((robot,), Provenance("robosuite", "official"), "")
    start = backend.reset(asked("Lift"))
    spec = backend.spec.in_task("Lift").robot
    assert spec.name == start.scene.entities[0].category == robot
    assert len(start.scene.grippers) == len(ROBOTS[robot].arms)
    found = {}
    for command in (1.0, -1.0):
        action = np.zeros(spec.actions.size)
        for gripper in spec.grippers:
            action[spec.actions.index(gripper.entry)] = command
        for _ in range(8):
            step = backend.step(action)
        assert (step.commands == command).all()
        found[command] = step.openings[:, 0]
    assert (found[-1.0] > found[1.0] + 0.01).all()
    assert (np.abs(found[-1.0]) < 1.3).all()


def test_an_episode_is_robosuites_own_bit_for_bit(backend: Backend) -> None:
    from pytest_safemanip.sim.robosuite import environment

    environment.load()
    env = environment.make(asked("Stack"), ("Panda",))
    _, steps = episode(backend, "Stack")
    random = np.random.default_rng(0)
    actions = backend.spec.in_task("Stack").robot.actions
    low, high = env.action_spec
    assert (actions.low == low).all()
    assert (actions.high == high).all()
    for number, step in enumerate(steps[1:]):
        observed, _, _, _ = env.step(actions.sample(random, number))
        assert np.array_equal(step.qpos, env.sim.data.qpos.astype(np.float32))
        assert np.array_equal(step.qvel, env.sim.data.qvel.astype(np.float32))
    seen = backend.observe()
    for name, value in observed.items():
        assert np.array_equal(seen[name], np.atleast_1d(value).astype(np.float32)), name
    declared = backend.spec.in_task("Stack")
    assert {name: len(seen[name]) for name in declared.state} == declared.state


def test_the_first_row_of_an_image_is_the_top_one(backend: Backend) -> None:
    """The camera before the table looks down on the arm, which reaches into the picture from
    above, and on the red cube, which lies below the arm's base.
    """
    backend.reset(asked("Lift"))
    seen = backend.observe()
    for camera in backend.spec.in_task("Lift").cameras:
        assert seen[camera.name].shape == (camera.height, camera.width, 3)
    red, green, blue = np.moveaxis(seen["agentview_image"].astype(int), 2, 0)
    rows = np.flatnonzero((red > 2 * green) & (red > 2 * blue) & (red > 80)) // 256
    assert len(rows) > 50
    assert rows.mean() > 128


def test_looking_changes_no_bit(backend: Backend) -> None:
    blind = episode(backend, "Door", 2)
    start = backend.reset(asked("Door"))
    random, steps = np.random.default_rng(0), [start.step]
    for number in range(2):
        backend.observe()
        steps.append(
            backend.step(backend.spec.in_task("Door").robot.actions.sample(random, number))
        )
    assert_identical(blind, (start, steps))


def test_an_episode_is_the_same_after_another_and_in_another_process(
    backend: Backend, tmp_path: Path
) -> None:
    first = episode(backend, "Lift")
    episode(backend, "Door")
    assert_identical(episode(backend, "Lift"), first)
    other = simulator("").create(Options("auto", tmp_path))
    try:
        assert_identical(episode(other, "Lift"), first)
    finally:
        other.close()


def test_seeds_differ(backend: Backend) -> None:
    starts = [backend.reset(Request("Lift", seed, "official")) for seed in (0, 1)]
    assert starts[0].fingerprint != starts[1].fingerprint


def test_two_arms_are_two_robots_or_one_with_two() -> None:
    pandas, baxter = (
        declare(robots).tasks["TwoArmLift"].robot for robots in (["Panda"], ["Baxter"])
    )
    assert pandas.name == "Panda+Panda"
    assert [g.name for g in pandas.grippers] == ["robot0", "robot1"]
    assert [g.name for g in baxter.grippers] == ["right", "left"]
    places = [robot.actions.index(g.entry) for robot in (pandas, baxter) for g in robot.grippers]
    assert places == [6, 13, 12, 13]
    mixed = declare(["Panda", "Sawyer"]).tasks
    assert mixed["TwoArmLift"].robot.name == "Panda+Sawyer"
    assert mixed["Lift"].robot.name == "Panda"


def test_a_tool_that_holds_nothing_takes_no_command() -> None:
    robot = declare(["Panda"]).tasks["Wipe"].robot
    assert robot.actions.size == 6
    assert robot.commands(np.ones(6)).tolist() == [0.0]
    assert robot.grippers[0].fingers == ()


def test_holding_still_keeps_the_grippers_as_they_were_told() -> None:
    actions = declare(["Panda"]).tasks["TwoArmLift"].robot.actions
    told = np.linspace(-1.0, 1.0, 14)
    held = actions.hold([np.ones(14), told])
    assert held[[6, 13]].tolist() == told[[6, 13]].tolist()
    assert np.count_nonzero(held) == 2
    assert not actions.hold([]).any()


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("robosuite:Pander", "robosuite has no robot 'Pander'; did you mean 'Panda'?"),
        ("robosuite:Panda+Panda+Panda", "two arms at most, found more"),
        ("robosuite:Baxter+Panda", "two arms at most, found more"),
        ("robocasa:Panda", "'robocasa' has no variants"),
        ("robosuit", "unknown backend 'robosuit'; did you mean 'robosuite'?"),
    ],
)
def test_what_robosuite_does_not_have_is_a_configuration_error(name: str, line: str) -> None:
    with pytest.raises(ConfigError, match=line.replace("?", r"\?").replace("+", r"\+")):
        find_simulator(name, {})


@pytest.mark.parametrize(
    ("request_", "line"),
    [
        (Request("Lfit", 0, "official"), "robosuite has no task 'Lfit'; did you mean 'Lift'"),
        (
            Request("Door", 0, "official", changes=(SetOpen("Door", 1.0),)),
            "in robosuite nothing can be staged",
        ),
    ],
)
def test_what_cannot_be_arranged_is_refused(backend: Backend, request_: Request, line: str) -> None:
    with pytest.raises((ConfigError, TaskError), match=line):
        backend.reset(request_)


def test_the_door_is_moved_by_its_handle(backend: Backend) -> None:
    scene = backend.reset(asked("Door")).scene
    (joint,) = scene.joints
    assert (joint.key, joint.kind, joint.gives_access) == ("Door/hinge", "hinge", True)
    assert {scene.parts[k].name for k in scene.moved_by(0)} == {"door", "handle"}


def test_a_bin_has_a_compartment_for_each_thing(backend: Backend) -> None:
    start = backend.reset(asked("PickPlaceCan"))
    boxes = {
        box.name: pose for box, pose in zip(start.scene.boxes, start.step.box_pose, strict=True)
    }
    assert set(boxes) == {"bin", "milk", "bread", "cereal", "can"}
    # robosuite's own check of the can's compartment (PickPlace.not_in_bin).
    assert np.allclose(boxes["can"][:2], (0.2, 0.405), atol=0.02)
    assert [body.entity for body in start.scene.bodies] == ["Can"]  # the others are put away
    assert start.scene.roles["obj"] == "Can"


def test_another_robot_gives_other_recordings() -> None:
    def hashes(name: str) -> Any:
        make: Callable[[Options], Backend] = simulator(name).create
        return make(Options("auto", Path())).provenance.hashes

    assert hashes("Sawyer") != hashes("")
    assert hashes("Panda") == hashes("")
