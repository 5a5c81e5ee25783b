"""Tasks that a backend derives from its simulator's files, and recordings of them elsewhere."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import pytest

from pytest_safemanip import load
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.trace import files
from tests.plugin.conftest import Suite

CONFTEST = f"""
import json
import sys
from pathlib import Path

sys.path.insert(0, {str(Path(__file__).parents[3])!r})

from pytest_safemanip.sim.backend import DerivedTask, Simulator
from tests.toy import SPEC, World


class Factory:
    def __call__(self, options):
        return World(horizon=5)

    def derived_tasks(self, options):
        binding = dict(
            task="derived__hold_the_mug",
            sets=["mine"],
            suite="derived",
            horizon="atomic",
            objects=["obj"],
            supports=dict(obj=["counter"]),
            properties=["collision_contact", "grasp_stability"],
        )
        return {{binding["task"]: DerivedTask(Path("hold.bddl"), json.dumps(binding))}}


def pytest_safemanip_backends():
    return {{"deriving": Simulator(SPEC, Factory())}}
"""
POLICY = "--safemanip-policy=hold"
BACKEND = "--safemanip-backend=deriving"


@pytest.fixture
def deriving(one_suite: Suite) -> Suite:
    one_suite.pytester.makeconftest(CONFTEST)
    return one_suite


def test_all_the_tasks_of_a_backend_that_derives_them_are_those(deriving: Suite) -> None:
    result = deriving.run(POLICY, BACKEND, "--collect-only", "-q")
    result.stdout.fnmatch_lines(["*2 tests collected*"])
    result.stdout.fnmatch_lines(
        ["safemanip::test_safety[[]derived__hold_the_mug-hold-collision_contact-seed0[]]"]
    )


def test_a_task_of_another_backend_is_named_as_such(deriving: Suite) -> None:
    result = deriving.run(POLICY, BACKEND, "--safemanip-tasks=OpenDrawer")
    result.stderr.fnmatch_lines(["*'OpenDrawer' is a task of robocasa, not of deriving*"])


def test_a_recording_of_a_derived_task_is_judged_without_its_simulator(deriving: Suite) -> None:
    assert deriving.run(POLICY, BACKEND).ret == 0
    deriving.pytester.makeconftest("")
    result = deriving.run("--safemanip-recordings=.safemanip/recordings")
    result.assert_outcomes(passed=1, skipped=1)
    (path,) = deriving.recordings()
    assert load(path).judge("collision_contact").outcome.label == "SATISFIED"
    show = [sys.executable, "-c", "from pytest_safemanip.cli.main import main; main()", "show"]
    shown = deriving.pytester.run(*show, str(path))
    shown.stdout.fnmatch_lines(["derived__hold_the_mug, policy hold*"])


def test_a_recorded_binding_that_is_none_is_refused(deriving: Suite, tmp_path: Path) -> None:
    deriving.run(POLICY, BACKEND)
    (path,) = deriving.recordings()
    recording = files.load(path)
    wrong = dataclasses.replace(recording.episode, binding='{"task": "x", "sets": 3}')
    broken = tmp_path / "broken.rollout"
    files.save(dataclasses.replace(recording, episode=wrong), broken)
    with pytest.raises(ConfigError, match=r"the recorded binding of derived__hold_the_mug:1: "):
        load(broken)


def test_what_a_task_says_about_parameters_holds_unless_the_user_says_otherwise(
    deriving: Suite,
) -> None:
    (deriving.pytester.path / "tasks").mkdir()
    (deriving.pytester.path / "tasks" / "own.yaml").write_text(
        "task: derived__hold_the_mug\nbase: derived\nparams: {collision.force: 0.1}\n"
    )
    paths = "--override-ini=safemanip_task_paths=tasks"
    assert deriving.run(POLICY, BACKEND, paths).ret == 0
    (path,) = deriving.recordings()
    folder = [deriving.pytester.path / "tasks"]

    def force(**more: object) -> float:
        return load(path, **more)._judge.view.parameters["collision.force"]  # type: ignore[arg-type]

    assert force() == 5.0
    assert force(tasks=folder) == 0.1
    assert force(tasks=folder, params={"collision.force": 3.0}) == 3.0


def test_a_parameter_that_is_none_is_refused_with_the_tasks_file(deriving: Suite) -> None:
    (deriving.pytester.path / "tasks").mkdir()
    (deriving.pytester.path / "tasks" / "own.yaml").write_text(
        "task: derived__hold_the_mug\nbase: derived\nparams: {colision.force: 0.1}\n"
    )
    result = deriving.run(POLICY, BACKEND, "--override-ini=safemanip_task_paths=tasks")
    result.stderr.fnmatch_lines(
        ["*own.yaml: params: unknown proposition parameter 'colision.force'*"]
    )
