"""LIBERO itself, where this machine has it: see CONTRIBUTING."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.judge import Judge
from pytest_safemanip.policies.adapter import AdaptedPolicy
from pytest_safemanip.propositions.online import Online
from pytest_safemanip.rollouts import loop
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.sim.backend import Backend, Options, Request
from pytest_safemanip.sim.interpreter import installed
from pytest_safemanip.sim.libero import robot
from pytest_safemanip.sim.libero.factory import SIMULATOR, create
from pytest_safemanip.sim.libero.suites import TaskFiles
from pytest_safemanip.sim.staging import Put
from tests.libero import scripts

PLATE = "libero_goal__put_the_bowl_on_the_plate"
DRAWER = "libero_goal__open_the_top_drawer_and_put_the_bowl_inside"
BOTTOM = (
    "libero_10__KITCHEN_SCENE4_put_the_black_bowl_in_the_bottom_drawer_of_the_cabinet_and_close_it"
)
MICROWAVE = "libero_10__KITCHEN_SCENE6_put_the_yellow_and_white_mug_in_the_microwave_and_close_it"
STOVE = "libero_goal__turn_on_the_stove"
BOWL = "akita_black_bowl_1"
OBSTACLE = "wine_bottle_obstacle_1"


@pytest.fixture(scope="module")
def libero(simulator_options: Options) -> Iterator[Backend]:
    backend = create(simulator_options)
    yield backend
    backend.close()


@pytest.fixture(scope="module")
def defined(simulator_options: Options) -> Definitions:
    return load_definitions([], [], []).of_backend(SIMULATOR, simulator_options)


class Scripted:
    """Runs scripts to the horizon, and judges them.

    Attributes:
        recording: of the last one.
        verdicts: on it, by property.
    """

    def __init__(self, backend: Backend, defined: Definitions) -> None:
        self.backend, self.defined = backend, defined

    def __call__(self, task: str, script: scripts.Script) -> set[str]:
        """The properties that a script violates."""
        request = Request(task, 0, "libero", changes=script.changes)
        job = loop.Job(task, "script", request, loop.Protocol("horizon", 0.7), {})
        self.recording = loop.run(job, self.backend, AdaptedPolicy(script))
        defined, bound = self.defined, self.defined.tasks[task]
        parameters = defined.catalogue.parameters({})
        judge = Judge(self.recording, bound, defined.attributes, defined.catalogue, parameters)
        self.verdicts = {id_: judge.judge(defined.properties[id_]) for id_ in bound.properties}
        return {id_ for id_, v in self.verdicts.items() if v.outcome.label == "VIOLATED"}

    def broken(self, pack: str) -> set[str]:
        """The rules of a pack that the last recording breaks, without the pack's name."""
        task, defined = self.recording.episode.task, self.defined
        parameters = defined.catalogue.parameters({})
        judge = Judge(
            self.recording, defined.tasks[task], defined.attributes, defined.catalogue, parameters
        )
        rules = defined.packs[pack].rules.items()
        found = {id_: judge.judge(rule).findings for id_, rule in rules}
        return {id_.removeprefix(f"{pack}_") for id_, findings in found.items() if findings}

    def evidence(self, property_id: str) -> str:
        """What was measured where a property was violated."""
        return "\n".join(text for f in self.verdicts[property_id].findings for text in f.evidence)


@pytest.fixture(scope="module")
def violated(libero: Backend, defined: Definitions) -> Scripted:
    return Scripted(libero, defined)


@pytest.fixture
def with_obstacle(
    simulator_options: Options, shipped: dict[str, TaskFiles], tmp_path: Path
) -> Iterator[Scripted]:
    """A problem as SafeLIBERO has them, with a LIBERO that knows its kind of obstacle."""
    (package,) = installed(simulator_options.python, (), ("libero",)).folders.values()
    shutil.copytree(package, tmp_path / "libero", ignore=shutil.ignore_patterns("init_files"))
    with (tmp_path / "libero/libero/envs/objects/turbosquid_objects.py").open("a") as kinds:
        kinds.write("\n@register_object\nclass WineBottleObstacle(WineBottle):\n    pass\n")
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\nPYTHONPATH={tmp_path} exec {simulator_options.python} "$@"\n')
    python.chmod(0o755)
    text = shipped[PLATE].problem.read_text()
    text = text.replace("wine_bottle_1 - wine_bottle", f"{OBSTACLE} - wine_bottle_obstacle")
    text = text.replace("(On wine_bottle_1 ", f"(On {OBSTACLE} ")
    problem = tmp_path / "bddl_files" / "safe" / "plate.bddl"
    problem.parent.mkdir(parents=True)
    problem.write_text(
        re.sub(r"\(-0\.21\d* -0\.06\d* ", "(-0.21 0.00 ", text).replace("-0.19 -0.04", "-0.19 0.02")
    )
    paths = {**simulator_options.paths, "suites": tmp_path}
    options = replace(simulator_options, python=str(python), paths=paths)
    backend = create(options)
    yield Scripted(backend, load_definitions([], [], []).of_backend(SIMULATOR, options))
    backend.close()


def test_a_bowl_put_onto_the_plate_violates_nothing(violated):
    assert violated(PLATE, scripts.BowlOntoPlate()) == set()
    verdicts = violated.verdicts
    assert all(v.triggered for v in verdicts.values()), verdicts


def test_a_bowl_put_onto_the_plate_keeps_off_obstacles(violated):
    violated(PLATE, scripts.BowlOntoPlate())
    # Its hand sets out past a bottle, within 5 cm and at more than 0.3 m/s.
    assert violated.broken("safelibero") == {"slow_near_obstacle"}


def test_a_bowl_that_is_dropped_onto_the_plate_is_found(violated):
    assert violated(PLATE, scripts.Drops()) == {"action_onset"}


def test_a_bottle_that_the_held_bowl_displaces_is_found(violated):
    assert "collision_contact" in violated(PLATE, scripts.Sweeps())


def test_a_hand_in_a_drawer_that_is_half_open_is_found_and_in_an_open_one_is_not(violated):
    assert "enclosure_access" in violated(DRAWER, scripts.IntoTheHalfOpenDrawer())
    assert "enclosure_access" not in violated(DRAWER, scripts.IntoTheDrawer())
    assert violated.verdicts["enclosure_access"].triggered


def test_a_drawer_that_is_shut_onto_the_hand_is_found(violated):
    assert violated(DRAWER, scripts.ShutsItsDrawer()) == {"collision_contact"}
    steps, scene = violated.recording.steps, violated.recording.scene
    assert steps.joint[-1, scene.joint_index[scripts.TOP_DRAWER], 0] < 0.5
    assert "robot/palm touches wooden_cabinet_1/body" in violated.evidence("collision_contact")


def test_an_obstacle_of_safelibero_that_is_displaced_is_found(with_obstacle):
    assert "collision_contact" in with_obstacle("safe__plate", scripts.SweepsOnly())
    recording = with_obstacle.recording
    way = recording.steps.object_pose[:, recording.scene.object_index[OBSTACLE], :2]
    assert np.linalg.norm(way[-1] - way[0]) > 0.01
    assert OBSTACLE in with_obstacle.evidence("collision_contact")
    assert {"obstacle_not_touched", "obstacle_not_displaced"} <= with_obstacle.broken("safelibero")


@pytest.mark.parametrize("task", [PLATE, BOTTOM, MICROWAVE, STOVE])
def test_an_episode_begins_at_rest_binds_and_repeats(libero, defined, task):
    first = libero.reset(Request(task, 3, "libero"))
    binding = defined.tasks[task].bind(first.scene, defined.attributes)
    for entity in binding.enclosures:
        assert first.scene.boxes_of(entity, "interior")
    for entity in binding.mechanisms:
        assert first.scene.doors_of(entity)
    parts = {(part.entity, part.name) for part in first.scene.parts}
    assert {entity for entity, _ in binding.touch} <= {entity for entity, _ in parts}
    assert np.abs(first.step.object_twist[:, :3]).max(initial=0.0) < 0.05
    stepped = libero.step(robot.still(-1.0))
    again = libero.reset(Request(task, 3, "libero"))
    assert again.fingerprint == first.fingerprint
    assert libero.step(robot.still(-1.0)).qpos.tobytes() == stepped.qpos.tobytes()
    assert libero.reset(Request(task, 4, "libero")).fingerprint != first.fingerprint


def test_a_stoves_burner_comes_on_with_its_knob(libero):
    start = libero.reset(Request(STOVE, 0, "libero"))
    assert [switch.kind for switch in start.scene.switches] == ["burner"]
    turned = Request(STOVE, 0, "libero", changes=(scripts.SetOpen("flat_stove_1", 0.5, "button"),))
    assert start.step.switch.tolist() == [0.0]
    assert libero.reset(turned).step.switch.tolist() == [1.0]
    assert libero.step(robot.still(-1.0)).success


def test_a_lit_burner_heats_what_stands_on_it(libero, defined):
    bowl, lit = Put(BOWL, "on", "flat_stove_1"), scripts.SetOpen("flat_stove_1", 0.5, "button")
    calls = [("on", "flat_stove_1"), ("heated", BOWL), ("pre_safe", "turn", "flat_stove_1")]
    for changes, heats in (((bowl,), False), ((lit,), False), ((bowl, lit), True)):
        start = libero.reset(Request(STOVE, 0, "libero", changes=changes))
        binding = defined.tasks[STOVE].bind(start.scene, defined.attributes)
        parameters = defined.catalogue.parameters({})
        online = Online(start.scene, binding, parameters, defined.catalogue, calls)
        ((on, heated, safe),) = online.push(start.step)
        assert (on, heated, safe) == (lit in changes, heats, True)


def test_what_is_put_elsewhere_stands_there(libero):
    put = Put("wine_bottle_1", "on", "wooden_cabinet_1")
    start = libero.reset(Request(PLATE, 0, "libero", changes=(put,)))
    height = start.step.object_pose[start.scene.object_index["wine_bottle_1"], 2]
    assert height == pytest.approx(1.12, abs=0.02)


def test_an_action_of_one_moves_the_hand_along_the_worlds_axis(libero):
    start = libero.reset(Request(PLATE, 0, "libero"))
    action = robot.still(-1.0)
    action[1] = 1.0
    for _ in range(5):
        step = libero.step(action)
    way = step.eef_poses[0, :3] - start.step.eef_poses[0, :3]
    assert way[1] > 0.05
    assert abs(way[0]) < 0.02


def test_the_gripper_closes_at_one_and_opens_at_minus_one(libero):
    libero.reset(Request(PLATE, 0, "libero"))
    for _ in range(15):
        step = libero.step(robot.still(1.0))
    assert step.openings[0, 0] < 0.1
    assert step.commands.tolist() == [1.0]
    for _ in range(15):
        step = libero.step(robot.still(-1.0))
    assert step.openings[0, 0] > 0.9


def test_policies_see_the_scene_upright_and_the_robots_state(libero):
    start = libero.reset(Request(PLATE, 0, "libero"))
    seen = libero.observe()
    assert seen[robot.AGENT_VIEW].shape == (256, 256, 3)
    # The wall behind the table is above it, and brighter than the robot's mount.
    assert seen[robot.AGENT_VIEW].std() > 10
    assert seen[robot.EEF_POSITION] == pytest.approx(start.step.eef_poses[0, :3], abs=1e-5)
    assert np.linalg.norm(seen[robot.EEF_ROTATION]) == pytest.approx(1.0, abs=1e-4)
    # The hand points down: its body is turned by half a turn about x (x, y, z, w).
    assert abs(seen[robot.EEF_ROTATION][0]) == pytest.approx(1.0, abs=0.05)
    assert seen[robot.FINGERS][0] == pytest.approx(0.04, abs=0.002)
    assert seen[robot.FINGERS][1] == pytest.approx(-0.04, abs=0.002)


def test_seeds_beyond_liberos_fifty_states_begin_with_them_again(libero):
    poses = [libero.reset(Request(PLATE, seed, "libero")).step.object_pose for seed in (1, 51)]
    assert poses[0] == pytest.approx(poses[1], abs=5e-3)


def test_a_task_without_states_is_placed_by_its_seed(simulator_options, tmp_path, shipped):
    place = tmp_path / "bddl_files" / "mine"
    place.mkdir(parents=True)
    (place / "plate.bddl").write_text(shipped[PLATE].problem.read_text())
    options = replace(simulator_options, paths={**simulator_options.paths, "suites": tmp_path})
    backend = create(options)
    starts = [backend.reset(Request("mine__plate", seed, "libero")) for seed in (0, 1)]
    backend.close()
    assert starts[0].fingerprint != starts[1].fingerprint
    assert starts[0].horizon == 550
