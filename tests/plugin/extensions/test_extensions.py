"""A user's own simulator, policy, proposition, property and task, from hooks and the ini file."""

from __future__ import annotations

import pytest

from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import set_up


@pytest.fixture
def own(suite: Suite) -> Suite:
    set_up(suite)
    return suite


def test_everything_of_the_user_is_used(own: Suite) -> None:
    result = own.run()
    result.assert_outcomes(failed=1, skipped=1)
    result.stdout.fnmatch_lines(
        [
            "*Reach / rises / stays_near / seed 0*",
            "stays_near: The hand stays near (the house rules)",
            "VIOLATED for mug (mug) at step 5 (0.25 s), unsafe for *",
            "VIOLATED stays_near: * - safemanip::test_safety[[]Reach-rises-stays_near-seed0]",
        ]
    )
    summary = own.summary()
    assert summary["settings"]["backend"] == "toy"
    assert list(summary["metrics"]["rises"]["groups"]["categories"]) == [
        "grasp_stability",
        "housekeeping",
    ]


def test_own_parameters_and_seeds(own: Suite) -> None:
    result = own.run("--safemanip-params=straying.distance=5", "--safemanip-seeds=3", "-k", "near")
    result.assert_outcomes(passed=3, deselected=own.seen_deselected(3))
    assert len(own.recordings()) == 3


def test_what_a_hook_gives_is_checked_as_what_an_option_gives(own: Suite) -> None:
    result = own.run("--safemanip-policy=risen")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["ERROR: unknown policy 'risen'; did you mean 'rises'?*"])


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("policies", "mapping"), ("backends", "mapping"), ("propositions", "sequence")],
)
def test_a_hook_that_gives_something_else_is_refused(own: Suite, kind: str, expected: str) -> None:
    with (own.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(f"\ndef pytest_safemanip_{kind}():\n    return 5\n")
    result = own.run()
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    message = f"pytest_safemanip_{kind} gave 5, expected a {expected} of {kind}"
    result.stderr.fnmatch_lines([f"ERROR: *conftest.py: {message}"])


@pytest.mark.parametrize("distribution", ["load", "worksteal", "loadscope", "each"])
def test_each_rollout_is_run_once_however_cases_are_distributed(
    one_suite: Suite, distribution: str
) -> None:
    set_up(one_suite)
    with (one_suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(
            "    \n"
            "original = Rises.reset\n"
            "def reset(self, episode):\n"
            "    with open('resets.txt', 'a') as log:\n"
            "        log.write(f'{episode.seed}\\n')\n"
            "Rises.reset = reset\n"
        )
    one_suite.mode = ("-n", "2", "--dist", distribution)
    one_suite.run("--safemanip-seeds=6")
    resets = (one_suite.pytester.path / "resets.txt").read_text().split()
    assert sorted(resets) == sorted(map(str, range(6)))
    assert one_suite.summary()["metrics"]["rises"]["rollouts"] == 6
