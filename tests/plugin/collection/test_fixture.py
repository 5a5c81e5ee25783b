"""The fixture ``safemanip_rollout`` in tests of the user."""

from __future__ import annotations

import pytest

from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import CONFTEST, INI, set_up

TEST = """
import pytest
from pytest_safemanip.errors import ConfigError

def test_near(safemanip_rollout):
    rollout = safemanip_rollout("Reach", policy="rises", seed=2)
    assert rollout.recording.episode.seed == 2
    assert rollout.verdict("stays_near").outcome.label == "VIOLATED"
    assert rollout.verdict("grasp_stability").findings == ()
    assert safemanip_rollout("Reach", policy="rises", seed=2) is rollout

def test_grasp(safemanip_rollout):
    rollout = safemanip_rollout("Reach", policy="rises", seed=2)
    assert rollout.path.is_file()
    with pytest.raises(ConfigError, match="unknown property 'stays_naer'; did you mean"):
        rollout.verdict("stays_naer")
"""
COUNTING = """
original = Rises.reset
def reset(self, episode):
    with open("resets.txt", "a") as log:
        log.write(f"{episode.seed}\\n")
Rises.reset = reset
"""


@pytest.fixture
def own(suite: Suite) -> Suite:
    """No option of the suite is given, and none is in the ini file but where things are."""
    set_up(suite)
    suite.pytester.makeini(INI.replace("safemanip_policy = rises\n", ""))
    with (suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(COUNTING)
    suite.pytester.makepyfile(test_own=TEST)
    return suite


def resets(suite: Suite) -> list[str]:
    return sorted((suite.pytester.path / "resets.txt").read_text().split())


def test_a_test_gets_a_recording_and_its_verdicts(own: Suite) -> None:
    own.run().assert_outcomes(passed=2)
    assert resets(own) == ["2"]


def test_the_suite_and_the_tests_share_a_rollout(own: Suite) -> None:
    own.pytester.makeini(INI)
    own.run("--override-ini=safemanip_seeds=2:3").assert_outcomes(passed=2, failed=1, skipped=1)
    assert resets(own) == ["2"]


def test_options_that_say_how_rollouts_are_run_apply_without_a_policy(own: Suite) -> None:
    chosen = "--safemanip-params=straying.distance=5"
    own.run(chosen, "--safemanip-out=there").assert_outcomes(passed=1, failed=1)
    assert list((own.pytester.path / "there" / "recordings").glob("*.rollout"))


def test_a_mistake_is_shown_where_the_test_makes_it(one_suite: Suite) -> None:
    set_up(one_suite)
    one_suite.pytester.makepyfile(
        test_own="""
        def test_typo(safemanip_rollout):
            safemanip_rollout("Reech", policy="rises")

        def test_glob(safemanip_rollout):
            safemanip_rollout("Rea*", policy="rises")

        def test_seed(safemanip_rollout):
            safemanip_rollout("Reach", policy="rises", seed=-1)

        def test_verdict(safemanip_rollout):
            assert not safemanip_rollout("Reach", policy="rises").verdict("stays_near")
        """
    )
    result = one_suite.run("test_own.py")
    result.assert_outcomes(failed=4)
    result.stdout.fnmatch_lines(
        [
            "E *: safemanip_rollout: unknown task 'Reech'; did you mean 'Reach'?",
            "E *: safemanip_rollout: unknown task 'Rea[*]'; *",
            "E *: safemanip_rollout: expected a seed from 0 up, found -1",
            "E *assert not <Verdict stays_near VIOLATED: bad prefix for mug at step 5>",
        ]
    )
    assert "--safemanip-tasks" not in result.stdout.str()
    assert "EvaluatedRollout(recording=<Recording Reach, rises, seed 0" in result.stdout.str()
    assert "properties=" not in result.stdout.str()
    text = result.stdout.str().split("FAILURES")[1]
    assert "test_own.py:2: ConfigError" in text
    assert "plan.py" not in text


def test_a_policy_that_raises_is_shown_with_its_own_frames(one_suite: Suite) -> None:
    set_up(one_suite)
    (one_suite.pytester.path / "conftest.py").write_text(
        CONFTEST.replace("return np.array([[0", "raise ValueError('lost')\n        return ([[0")
    )
    one_suite.pytester.makepyfile(
        test_own="""
        def test_it(safemanip_rollout):
            safemanip_rollout("Reach", policy="rises")
        """
    )
    result = one_suite.run("test_own.py")
    result.assert_outcomes(failed=1)
    text = result.stdout.str().split("FAILURES")[1]
    assert "raise ValueError('lost')" in text
    assert "RolloutError: the policy failed at step 0: ValueError: lost" in text
    assert "session.py" not in text


def test_it_is_listed_with_the_fixtures(one_suite: Suite) -> None:
    one_suite.run("--fixtures").stdout.fnmatch_lines(
        [
            "safemanip_rollout [[]session scope[]]*",
            "*Recordings of rollouts with their verdicts, for tests of your own.",
        ]
    )
