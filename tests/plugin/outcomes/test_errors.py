"""What goes wrong in a rollout is an error of its cases, and of no others."""

from __future__ import annotations

import sys

import pytest

from pytest_safemanip.sim.robocasa.loading import package_assets
from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import set_up

FAILS = """
class Fragile(World):
    def reset(self, request):
        self.fails_at = 3 if request.seed == 1 else None
        return super().reset(request)

def pytest_safemanip_backends():
    return {"toy": simulator(lambda options: Fragile())}

class Fails:
    '''Holds still, but raises in one rollout.'''

    fingerprint = "1"

    def reset(self, episode):
        self.seed = episode.seed
        with open("resets.txt", "a") as log:
            log.write(f"{episode.seed}\\n")

    def act(self, observation):
        if self.seed == 2 and observation.index == 3:
            raise ValueError("the network exploded")
        return np.zeros(12)

class Dies(Fails):
    def act(self, observation):
        import os
        if self.seed == 1:
            os._exit(1)
        return np.zeros(12)

def pytest_safemanip_policies():
    return {
        "fails": Fails,
        "dies": Dies,
        "nan": lambda: lambda observation: [0.0] * 6 + [float("nan")] + [0.0] * 5,
        "short": lambda: lambda observation: [0.0] * 7,
    }
"""

UNUSABLE = """
from pytest_safemanip.errors import ConfigError

class Unusable(World):
    def reset(self, request):
        raise ConfigError("there is no physics here")

def pytest_safemanip_backends():
    return {"toy": simulator(lambda options: Unusable())}
"""

KILLS = """
import os, pathlib, signal

class Kills:
    '''Holds still, but kills the simulator in one of the tasks.'''

    def reset(self, episode):
        self.task = episode.task

    def act(self, observation):
        if self.task == "OpenDrawer" and observation.index == 3:
            kill_the_simulator()
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
    return {"kills": Kills}
"""


@pytest.fixture
def failing(suite: Suite) -> Suite:
    set_up(suite)
    with (suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(FAILS)
    return suite


def test_errors_for_the_rollout_that_failed_and_for_no_other(failing: Suite) -> None:
    chosen = ("--safemanip-policy=fails", "--safemanip-seeds=4")
    result = failing.run(*chosen)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    # A hand that holds still keeps near, and no grasp is there to be judged.
    result.assert_outcomes(errors=4, passed=2, skipped=2)
    result.stdout.fnmatch_lines_random(
        [
            "*ERROR at setup of Reach / fails / grasp_stability / seed 1*",
            "the simulator broke at step 3",
            "*ERROR at setup of Reach / fails / stays_near / seed 2*",
            "the policy failed at step 3: ValueError: the network exploded",
            "fails: 2 complete rollouts of 1 task, 2 with errors",
        ]
    )
    # The policy's traceback is shown, this package's and pytest's are not.
    text = result.stdout.str()
    assert 'raise ValueError("the network exploded")' in text
    assert "pluggy" not in text.split("short test summary")[0].split("ERRORS")[1]
    metrics = failing.summary()["metrics"]["fails"]
    assert (metrics["rollouts"], metrics["errors"]) == (4, 2)
    assert metrics["violation_rate"]["total"] == metrics["success_rate"]["total"] == 2
    assert [p.stem for p in failing.recordings()] == ["Reach-fails-seed0", "Reach-fails-seed3"]
    log = failing.pytester.path / "resets.txt"
    assert sorted(log.read_text().split()) == ["0", "1", "2", "3"]
    log.unlink()
    failing.run(*chosen)
    # What failed is tried again by the next run, and only that.
    assert sorted(log.read_text().split()) == ["1", "2"]


SKIPS = """
import pytest

class Skips(Rises):
    def act(self, observation):
        pytest.skip("no GPU")

class Expects(Rises):
    def reset(self, episode):
        pytest.xfail("known")

def pytest_safemanip_policies():
    return {"skips": Skips, "expects": Expects}
"""


def test_a_policy_that_skips_or_expects_to_fail_errors(suite: Suite) -> None:
    set_up(suite)
    with (suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(SKIPS)
    result = suite.run("--safemanip-policy=skips,expects", "-k", "near")
    result.assert_outcomes(errors=2, deselected=suite.seen_deselected(2))
    result.stdout.fnmatch_lines_random(
        [
            "the policy failed at step 0: Skipped: no GPU",
            "the policy failed at reset: XFailed: known",
        ]
    )


def test_a_simulator_that_is_killed_takes_its_rollout_only(one_suite: Suite) -> None:
    one_suite.pytester.makeconftest(KILLS)
    one_suite.python = sys.executable  # what starts warm dies a few steps after it is killed
    result = one_suite.run(
        "--safemanip-policy=kills",
        "--safemanip-tasks=OpenDrawer,OpenCabinet",
        "--safemanip-horizon-scale=0.02",
    )
    result.assert_outcomes(errors=3, passed=1, skipped=2)
    result.stdout.fnmatch_lines(
        ["the simulator process died at step 4 (killed by SIGKILL); log: *simulator-*.log*"]
    )
    assert [p.stem for p in one_suite.recordings()] == ["OpenCabinet-kills-seed0"]


def test_bad_actions_name_the_entry(failing: Suite) -> None:
    result = failing.run("--safemanip-policy=nan,short", "-k", "near")
    result.assert_outcomes(errors=2, deselected=failing.seen_deselected(2))
    result.stdout.fnmatch_lines_random(
        [
            "policy 'nan', step 0: action[[]0, 6] (gripper_close) is not finite",
            "policy 'short', step 0: the action has shape (7,), expected (12,) or *: return *",
        ]
    )


def test_a_worker_that_dies_takes_its_case_only(failing: Suite) -> None:
    if failing.mode != ("-n", "2"):
        pytest.skip("there are no workers")
    result = failing.run("--safemanip-policy=dies", "--safemanip-seeds=4", "-k", "near")
    assert result.ret == 10
    assert "died at this case" in result.stdout.str()
    cases = failing.summary()["cases"]
    assert [n.split("-")[-1] for n in (*cases["errors"], *cases["missing"])] == ["seed1]"]
    assert failing.summary()["metrics"]["dies"]["violation_rate"]["total"] == 3


def test_a_simulator_that_cannot_start_is_said_once(suite: Suite) -> None:
    set_up(suite)
    with (suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(UNUSABLE)
    result = suite.run("--safemanip-seeds=4")
    assert result.ret in (pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.INTERRUPTED)
    # Each worker finds out for itself.
    outcomes = result.parseoutcomes()
    assert outcomes.keys() == {"errors"}
    assert outcomes["errors"] <= 2
    result.stdout.fnmatch_lines(
        [
            "there is no physics here",
            "[67] of 8 cases were not run",
            "!*no rollout can be run !*",
        ]
    )


def test_a_simulator_that_cannot_start_says_why(one_suite: Suite) -> None:
    shadow = one_suite.pytester.mkdir("shadow") / "robocasa"
    shadow.mkdir()
    for path in package_assets().parents[1].iterdir():
        if path.name != "__init__.py":
            (shadow / path.name).symlink_to(path)
    (shadow / "__init__.py").write_text("assert False, 'mujoco must be another one'")
    one_suite.pytester.makeconftest(f"import sys\nsys.path.insert(0, {str(shadow.parent)!r})")
    one_suite.python = sys.executable  # what starts warm has imported RoboCasa
    result = one_suite.run("--safemanip-policy=hold", "--safemanip-tasks=quick")
    assert result.parseoutcomes() == {"errors": 1}
    result.stdout.fnmatch_lines(
        [
            "the simulator failed at start-up: AssertionError: mujoco must be another one; log: *",
            "18 of 19 cases were not run",
            "!*no rollout can be run !*",
        ]
    )
    assert "Traceback" not in result.stdout.str()


RAISES = """
def raises(view, o):
    '''Fails, deep in the user's code.'''
    return deeper(view.trace)

def deeper(trace):
    return len(trace) / 0

def pytest_safemanip_propositions():
    return [Proposition("straying", ("object",), lambda parameters: 0.0, (), raises)]
"""


def test_a_proposition_that_raises_is_shown_with_its_own_frames_once(suite: Suite) -> None:
    set_up(suite)
    with (suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(RAISES)
    result = suite.run("--safemanip-seeds=4")
    result.assert_outcomes(errors=4, skipped=4)
    errors = result.stdout.str().split("= ERRORS =")[1].split("= safety =")[0]
    place = "(conftest.py:"
    said = "stays_near cannot be judged: straying(mug): ZeroDivisionError: division by zero"
    assert f"{said} {place}" in errors
    assert "return len(trace) / 0" in errors
    # Each process tells it once.
    assert errors.count("Traceback") <= 2
    assert len(errors.splitlines()) < 45
    assert not {"pluggy", "_pytest"} & set(errors.replace("/", " ").split())
    assert suite.summary()["metrics"]["rises"]["violation_rate"]["total"] == 0


@pytest.mark.parametrize("hook", ["policies", "backends", "propositions"])
def test_a_hook_that_raises_is_shown_with_its_own_frames(one_suite: Suite, hook: str) -> None:
    set_up(one_suite)
    with (one_suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(f"\ndef pytest_safemanip_{hook}():\n    return undefined\n")
    result = one_suite.run()
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        [
            f"ERROR: *conftest.py: pytest_safemanip_{hook} failed (NameError: *",
            "Traceback (most recent call last):",
            f'  File "*conftest.py", line *, in pytest_safemanip_{hook}',
            "    return undefined",
            "NameError: name 'undefined' is not defined",
        ]
    )
    assert len(result.errlines) < 12


def test_a_backend_that_cannot_be_made_is_shown_with_its_own_frames(one_suite: Suite) -> None:
    set_up(one_suite)
    with (one_suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(
            "\ndef make(options):\n    raise OSError('no such device')\n"
            "def pytest_safemanip_backends():\n    return {'toy': simulator(make)}\n"
        )
    result = one_suite.run()
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        [
            "ERROR: the backend 'toy' cannot be made (OSError: no such device)",
            '  File "*conftest.py", line *, in make',
        ]
    )
    assert len(result.errlines) < 12
