"""What a recording shows, and a task's description."""

from __future__ import annotations

import json
import re

import pytest

from pytest_safemanip.trace.hazard import Hazard
from tests import toy
from tests.cli.conftest import Command

UP = (0, 0, 1)


def bumped():
    """The forearm presses on the apple for a while."""
    rows = [(step, "robot/link5", "apple/body", 30.0, UP) for step in range(8, 12)]
    hazard = Hazard("collision_contact", (), 7, 9)
    about = toy.episode(hazards=(hazard,), horizon=20)
    return toy.recording(20, 4, about=about, contacts=toy.contacts(*rows))


def test_a_recording_is_told_with_its_verdicts_and_what_proves_a_violation(safemanip, recorded):
    path = recorded(bumped())
    found = safemanip("show", path)
    assert found.status == 1
    head, table, proof, watch = found.out.split("\n\n", 3)[:4]
    assert head.startswith(
        "PickPlaceCounterToCabinet, policy toy, seed 0: no success up to step 15"
    )
    assert "'put the mug into the cabinet'" in head
    assert "hazard: collision_contact, begun on purpose at step 7 (0.35 s) to 9 (0.45 s)" in head
    verdicts = dict(line.split()[:2] for line in table.splitlines()[1:] if line[0] != " ")
    assert verdicts.pop("collision_contact") == "VIOLATED"
    assert set(verdicts.values()) == {"VACUOUS"}
    assert proof.startswith("collision_contact: The robot and what it holds touch only")
    assert "VIOLATED at step 8 (0.40 s), unsafe for 0.20 s" in watch
    assert "bad prefix at step 8" in watch


def test_a_recording_that_a_warning_ended_says_before_what(safemanip, recorded):
    near = "release_stability for mug in 5.12 s, to be prevented within 0.12 s: obj_released"
    about = toy.episode(ended="warning", warned=near, horizon=20)
    head = " ".join(safemanip("show", recorded(toy.recording(6, 1, about=about))).out.split())
    assert f"stopped before step 5, since a violation was near: {near}" in head


def test_what_was_otherwise_is_told_whatever_it_is(safemanip, recorded):
    changes = [{"kind": "move", "role": "obj", "by": [0.0, 0.02]}, {"kind": "\x1b[31m"}, 7]
    push = {"kind": "push", "target": "robot", "impulse": 6.0}
    about = toy.episode(request={"changes": changes}, disturbances=(push,))
    lines = safemanip("show", recorded(toy.recording(6, 1, about=about))).out.splitlines()
    assert "  changed: move: by [0.0, 0.02], role obj" in lines
    assert "  changed: '\\x1b[31m: '" in lines
    assert "  changed: 7" in lines
    assert "  disturbed: push: impulse 6.0, target robot" in lines


def test_without_a_violation_the_exit_status_is_0(safemanip, recorded):
    assert safemanip("show", recorded()).status == 0
    found = safemanip("show", recorded(bumped()), "--property", "grasp_*,release_stability")
    assert found.status == 0
    assert "collision_contact " not in found.out


def test_parameters_and_semantics_decide(safemanip, recorded, tmp_path):
    path = recorded(bumped())
    harder = ("--params", "collision.force=50")
    assert safemanip("show", path, *harder).status == 0
    assert safemanip("show", path, "--semantics", "paper").status == 1
    (tmp_path / "pytest.ini").write_text("[pytest]\nsafemanip_params = collision.force=50\n")
    assert safemanip("show", path).status == 0


def test_json_has_the_episode_and_the_verdicts(safemanip, recorded):
    found = json.loads(safemanip("show", recorded(bumped()), "--json").out)
    assert found["episode"]["hazards"][0]["property_id"] == "collision_contact"
    assert found["verdicts"]["collision_contact"]["outcome"] == "VIOLATED"
    assert found["verdicts"]["collision_contact"]["findings"][0]["first"] == 8


def test_a_proposition_that_fails_is_no_verdict(safemanip, recorded, monkeypatch):
    def fail(self, prop):
        raise ZeroDivisionError("by nothing")

    monkeypatch.setattr("pytest_safemanip.judge.Judge.judge", fail)
    found = safemanip("show", recorded())
    assert found.status == 1
    assert found.out.count("ERROR") == found.out.count("ZeroDivisionError: by nothing") > 3


@pytest.mark.parametrize("command", ["show", "video"])
@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: b"hello",
        lambda data: data[: len(data) // 2],
        lambda data: data[:500] + bytes([data[500] ^ 1]) + data[501:],
        lambda data: bytes(byte ^ 1 for byte in data),
    ],
    ids=["empty", "text", "truncated", "a byte", "all bytes"],
)
def test_a_broken_file_is_one_line(safemanip, recorded, command, damage):
    path = recorded()
    path.write_bytes(damage(path.read_bytes()))
    line = safemanip(command, path).refusal
    assert line.startswith(f"safemanip {command}: error: {path}: ")
    assert line.endswith("; restore the file, or record the rollout again")


def test_what_does_not_fit_is_one_line(safemanip: Command, recorded, tmp_path):
    path = recorded()
    assert "cannot be read: No such file" in safemanip("show", "none.rollout").refusal
    assert f"{tmp_path}: cannot be read: Is a directory" in safemanip("show", tmp_path).refusal
    line = safemanip("show", path, "--property", "grasp_stabilty").refusal
    assert "--property: 'grasp_stabilty' matches no property; did you mean" in line
    line = safemanip("show", path, "--property", "object_containment").refusal
    assert "none of object_containment applies to PickPlaceCounterToCabinet" in line
    assert "--params: expected NAME=VALUE" in safemanip("show", path, "--params", "x").refusal
    assert "unknown proposition parameter" in safemanip("show", path, "--params", "x=1").refusal
    other = recorded(toy.recording(about=toy.episode(task="Juggle")), "other")
    assert "unknown task 'Juggle'; name its folder" in safemanip("show", other).refusal
    foreign = recorded(toy.recording(about=toy.episode(task="OpenDrawer")), "foreign")
    assert "the scene has no role 'drawer'" in safemanip("show", foreign).refusal


def test_a_task_is_described_from_its_file_alone(safemanip: Command):
    found = safemanip("task", "PickPlaceCounterToCabinet").out
    roles, binding, properties = found.split("\n\n")[1:]
    assert roles.splitlines()[1:] == [
        "obj      object      body*",
        "cab      cabinet     body, door, handle",
        "counter  counter     body*",
    ]
    assert "placements  obj in cab\n" in binding
    assert "supports    obj on counter, cab" in binding
    assert "enclosure_release  1          obj, cab\n" in properties


def test_a_task_says_what_cannot_be_judged_and_why(safemanip: Command):
    found = safemanip("task", "CloseBlenderLid").out
    assert "grasp_stability    not judged  the lid is part of RoboCasa's blender" in found


def test_a_recording_gives_a_tasks_roles_their_entities(safemanip: Command, recorded):
    chosen = ("task", "PickPlaceCounterToCabinet", "--recording", recorded())
    found = safemanip(*chosen).out
    assert "obj      mug (mug)               body*\n" in found
    assert "cab      cabinet (HingeCabinet)  door\n" in found
    assert "enclosure_release  1          mug, cabinet\n" in found
    plain = json.loads(safemanip(*chosen, "--json").out)
    assert plain["properties"]["grasp_stability"] == ["mug"]
    line = safemanip("task", "OpenDrawer", "--recording", chosen[-1]).refusal
    assert "a recording of PickPlaceCounterToCabinet" in line


def test_a_misspelt_part_or_property_of_a_users_task_is_one_line(safemanip: Command, tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\nsafemanip_task_paths = .\n")
    text = "task: CloseDrawer\nsets: [mine]\nsuite: s\nhorizon: atomic\nmechanisms: [drawer]\n"
    path = tmp_path / "own.yaml"
    path.write_text(f"{text}touch:\n  drawer: [hanle]\nproperties: [collision_contact]\n")
    assert "unknown part 'hanle' of drawer" in safemanip("task", "CloseDrawer").refusal
    path.write_text(f"{text}properties: [colision_contact]\n")
    assert "did you mean 'collision_contact'?" in safemanip("task", "CloseDrawer").refusal


def test_an_unknown_task_has_a_near_miss(safemanip: Command):
    assert "did you mean 'OpenDrawer'?" in safemanip("task", "OpenDrawr").refusal
    line = safemanip("task", "Juggle").refusal
    assert "unknown task 'Juggle'; nearest of 61: " in line
    assert line.endswith("; 'safemanip tasks' lists all")
    assert line.count(",") == 2


def test_a_task_that_no_file_binds_is_described_as_far_as_it_is_known(safemanip: Command):
    found = safemanip("task", "StackCans")
    assert found.status == 0
    assert "StackCans is a task of robocasa, and no file binds it" in found.out
    assert re.search(r"^cab +cabinet_double_door +body, door, handle$", found.out, re.M)
    assert re.search(r"^can\d? +object +body$", found.out, re.M)
    assert json.loads(safemanip("task", "StackCans", "--json").out)["path"] is None
    assert "no file binds it" in safemanip("task", "StackCans", "--scene").refusal
    assert (
        "expected a seed from 0 up, found '-1'"
        in safemanip("task", "OpenDrawer", "--seed=-1").refusal
    )
