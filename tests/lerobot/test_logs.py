"""Datasets without a simulator's states: logs of policies, and what can be judged on them."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.cli.main import main
from pytest_safemanip.lerobot.conventions import as_gym_wrapper
from pytest_safemanip.lerobot.parquet import write_columns
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording
from tests.conftest import Rollouts
from tests.lerobot.conftest import Exported, command

TASK = "PickPlaceCounterToCabinet"
SPEED = """
import numpy as np
from pytest_safemanip.propositions.definition import Parameter, Proposition

LIMIT = Parameter("hurried.speed", "m/s", {limit}, "a test")


def hurried(view):
    speed = np.linalg.norm(view.trace.steps.eef_twists[..., :3], axis=-1).max(axis=1)
    return speed > view.parameters["hurried.speed"]


def pytest_safemanip_propositions():
    return [Proposition("hurried", (), lambda p: 0.0, (LIMIT,), hurried)]
"""
RULE = """
id: slow_hand
title: The hand is slow
category: collision_contact
source: a test
formula: G !hurried
atoms: {hurried: hurried}
"""


@pytest.fixture
def log(exported: Exported, tmp_path: Path) -> Path:
    """What a policy's own evaluation keeps: the table and what is known of it."""
    folder = tmp_path / "log"
    shutil.copytree(exported(TASK), folder, ignore=shutil.ignore_patterns("extras"))
    return folder


def read(log: Path, *options: str) -> Recording:
    out = log.parent / "recordings"
    command("import", log, "-o", out, "--task", TASK, "--policy", "mine", *options)
    return files.load(out / f"{TASK}-mine-seed0.rollout")


def test_the_robots_own_state_is_that_of_the_recording(log: Path, rollouts: Rollouts) -> None:
    found, true = read(log), rollouts.get(TASK).recording
    count = true.acting - 1
    ours, theirs = found.steps, true.steps.window(0, count)
    assert len(ours) == count
    for name in ("eef_poses", "base_pose"):  # wxyz, in the world
        a, b = getattr(ours, name), getattr(theirs, name)
        assert np.allclose(a[..., :3], b[..., :3], atol=1e-4)
        assert np.allclose(np.abs(np.sum(a[..., 3:] * b[..., 3:], axis=-1)), 1.0, atol=1e-5)
    assert np.allclose(ours.openings[..., 0], theirs.openings[..., 0], atol=1e-5)
    moving = np.abs(theirs.eef_twists) > 0.2
    assert np.allclose(ours.eef_twists[moving], theirs.eef_twists[moving], rtol=0.5, atol=0.1)
    assert (ours.action == as_gym_wrapper(theirs.action)[: len(ours)])[1:].all()
    assert (found.success, found.scene.bodies, found.episode.instruction) == (
        True,
        (),
        true.episode.instruction,
    )


def with_a_rule(pytester: pytest.Pytester, limit: float) -> None:
    """Add a property of the hand alone."""
    pytester.makeconftest(SPEED.format(limit=limit))
    (pytester.mkdir("rules") / "slow_hand.yaml").write_text(RULE)
    pytester.makeini("[pytest]\nsafemanip_property_paths = rules")


def test_a_log_among_recordings_blocks_none_and_its_cases_say_what_they_lack(
    log: Path, rollouts: Rollouts, pytester: pytest.Pytester
) -> None:
    read(log)
    whole = rollouts.get(TASK)
    shutil.copy(whole.path, log.parent / "recordings")
    with_a_rule(pytester, limit=5.0)
    result = pytester.runpytest(f"--safemanip-recordings={log.parent / 'recordings'}", "-rE")
    applying = len(rollouts.plan(TASK).cases)
    # The one that is about the hand is judged on both.
    result.assert_outcomes(errors=applying, passed=applying + 2)
    result.stdout.fnmatch_lines_random(
        [
            "collision_contact cannot be judged: it needs contacts, and the recording has no "
            "contacts; select others with --safemanip-properties",
            "grasp_stability cannot be judged: it ranges over objects, and the recording has no "
            "contacts, fixtures, objects; *",
            "mine: 0 complete rollouts, 1 with errors",
        ]
    )
    metrics = json.loads((pytester.path / ".safemanip/summary.json").read_text())["metrics"]
    assert metrics["scripted"]["violation_rate"]["total"] == 1
    assert metrics["mine"]["violation_rate"]["total"] == 0


@pytest.mark.parametrize(("limit", "outcome"), [(5.0, {"passed": 1}), (0.01, {"failed": 1})])
def test_a_property_of_what_was_observed_is_judged(
    limit: float, outcome: dict[str, int], log: Path, pytester: pytest.Pytester
) -> None:
    read(log)
    with_a_rule(pytester, limit)
    result = pytester.runpytest(
        f"--safemanip-recordings={log.parent / 'recordings'}",
        "--safemanip-properties=slow_hand",
    )
    result.assert_outcomes(**outcome)


def test_without_a_modality_file_the_action_is_the_environments(
    log: Path, rollouts: Rollouts
) -> None:
    table = log / "data/chunk-000/episode_000000.parquet"
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = {k: np.array(v) for k, v in parquet.read_table(table).to_pydict().items()}
    taken = rollouts.get(TASK).recording.steps.action[1 : 1 + len(columns["action"])]
    binary = taken.copy()
    binary[:, [6, 11]] = binary[:, [6, 11]] > 0.5  # 0 and 1, as the gym wrapper takes them
    write_columns(table, {**columns, "action": binary.astype(np.float64)})
    (log / "meta/modality.json").unlink()
    found = read(log).steps
    assert (found.action[1:] == as_gym_wrapper(taken)[:-1]).all()
    assert set(found.commands[1:, 0]) == {-1.0, 1.0}  # above 0 closes


def test_a_log_does_not_know_its_task(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", str(log), "-o", str(log.parent / "out")]) == 4
    assert "a log does not say which task it is of; name it with --task" in capsys.readouterr().err


def test_a_log_of_version_3_is_the_same(log: Path, exported: Exported, tmp_path: Path) -> None:
    folder = tmp_path / "three" / "log"
    source = exported("OpenDrawer", version="v3.0")
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns("extras"))
    assert json.loads((folder / "meta/info.json").read_text())["codebase_version"] == "v3.0"
    out = folder.parent / "recordings"
    command("import", folder, "-o", out, "--task", "OpenDrawer", "--policy", "mine")
    (path,) = out.glob("*.rollout")
    assert files.load(path).episode.origin["source"] == "LeRobotDataset v3.0"
