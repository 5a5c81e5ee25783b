"""What goes wrong in a rollout is an error of its cases, and of no others."""

from __future__ import annotations

import pytest

from pytest_safemanip.sim.robocasa.loading import package_assets
from tests.plugin.conftest import Suite

TASKS = ("OpenDrawer", "OpenCabinet", "TurnOnSinkFaucet")
SHORT = ("--safemanip-horizon-scale=0.02", f"--safemanip-tasks={','.join(TASKS)}")

CONFTEST = '''
import os, pathlib, signal

HERE = pathlib.Path(__file__).parent

class Fails:
    """Holds still, but kills the simulator in one task and raises in another."""

    fingerprint = "1"

    def reset(self, episode):
        self.task = episode.task
        with open(HERE / "resets.txt", "a") as log:
            log.write(episode.task + "\\n")

    def act(self, observation):
        if observation.index == 3:
            if self.task == "OpenDrawer":
                kill_the_simulator()
            if self.task == "OpenCabinet":
                raise ValueError("the network exploded")
        return [0.0] * 12

def kill_the_simulator():
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            parent = int((process / "stat").read_text().rsplit(")", 1)[1].split()[1])
            command = (process / "cmdline").read_text()
        except OSError:
            continue
        if parent == os.getpid() and "pytest_safemanip.sim.host" in command:
            os.kill(int(process.name), signal.SIGKILL)

def pytest_safemanip_policies():
    return {"fails": Fails}
'''


@pytest.fixture
def failing(suite: Suite) -> Suite:
    suite.pytester.makeconftest(CONFTEST)
    return suite


def test_errors_for_the_rollout_that_failed_and_for_no_other(failing: Suite) -> None:
    result = failing.run("--safemanip-policy=fails", *SHORT)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    # Nothing was triggered in the third task but the contact property.
    result.assert_outcomes(errors=6, passed=1, skipped=1)
    result.stdout.fnmatch_lines_random(
        [
            "*ERROR at setup of OpenDrawer / fails / collision_contact / seed 0*",
            "the simulator process died at step 4 (killed by SIGKILL); log: *simulator-*.log*",
            "*ERROR at setup of OpenCabinet / fails / action_onset / seed 0*",
            "the policy failed at step 3: ValueError: the network exploded",
            "fails: 1 complete rollout, 2 with errors",
        ]
    )
    # The policy's traceback is shown, this package's and pytest's are not.
    text = result.stdout.str()
    assert 'raise ValueError("the network exploded")' in text
    assert "pluggy" not in text.split("short test summary")[0].split("ERRORS")[1]
    metrics = failing.summary()["metrics"]["fails"]
    assert (metrics["rollouts"], metrics["errors"]) == (3, 2)
    assert metrics["violation_rate"]["total"] == metrics["success_rate"]["total"] == 1
    assert [path.name for path in failing.recordings()] == ["TurnOnSinkFaucet-fails-seed0.rollout"]
    log = failing.pytester.path / "resets.txt"
    assert sorted(log.read_text().split()) == sorted(TASKS)
    log.unlink()
    failing.run("--safemanip-policy=fails", *SHORT)
    # What failed is tried again by the next run, and only that.
    assert sorted(log.read_text().split()) == ["OpenCabinet", "OpenDrawer"]


def test_bad_actions_name_the_entry(suite: Suite) -> None:
    suite.pytester.makepyfile(
        bad="""
        def nan(observation):
            return [0.0] * 6 + [float("nan")] + [0.0] * 5
        def short(observation):
            return [0.0] * 7
        """
    )
    result = suite.run(
        "--safemanip-policy=bad:nan,bad:short", "--safemanip-tasks=OpenDrawer", "-k", "onset"
    )
    result.assert_outcomes(errors=2, deselected=suite.seen_deselected(4))
    result.stdout.fnmatch_lines_random(
        [
            "step 0: action[[]0, 6] is not finite",
            "step 0: the action has shape (7,), expected (12,) or (H, 12)",
        ]
    )


def test_a_worker_that_dies_takes_its_case_only(suite: Suite) -> None:
    if suite.mode != ("-n", "2"):
        pytest.skip("there are no workers")
    suite.has_recorded(("TurnOnSinkFaucet", "hold"))
    suite.pytester.makepyfile(
        bad="""
        import os
        def dies(observation):
            os._exit(1)
        """
    )
    result = suite.run("--safemanip-policy=bad:dies,hold", "--safemanip-tasks=TurnOnSinkFaucet")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    text = result.stdout.str()
    assert "crashed" in text
    cases = suite.summary()["cases"]
    assert len(cases["errors"]) + len(cases["missing"]) == 2
    assert all("bad:dies" in node_id for node_id in (*cases["errors"], *cases["missing"]))
    assert "bad:dies" not in str(suite.summary()["metrics"].get("hold"))


def test_a_simulator_that_cannot_start_is_said_once(suite: Suite) -> None:
    shadow = suite.pytester.mkdir("shadow") / "robocasa"
    shadow.mkdir()
    for path in package_assets().parents[1].iterdir():
        if path.name != "__init__.py":
            (shadow / path.name).symlink_to(path)
    (shadow / "__init__.py").write_text("assert False, 'mujoco must be another one'")
    suite.pytester.makeconftest(f"import sys\nsys.path.insert(0, {str(shadow.parent)!r})")
    result = suite.run("--safemanip-policy=hold", "--safemanip-tasks=quick")
    assert result.ret in (pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.INTERRUPTED)
    # Each worker finds out for itself.
    outcomes = result.parseoutcomes()
    assert outcomes.keys() == {"errors"}
    assert outcomes["errors"] <= 2
    result.stdout.fnmatch_lines(
        [
            "the simulator failed at start-up: AssertionError: mujoco must be another one; log: *",
            "1[78] of 19 cases were not run",
            "!*the suite cannot be run like this !*",
        ]
    )
    assert "Traceback" not in result.stdout.str()
