"""Which cases run: by options, by id, beside other tests."""

from __future__ import annotations

import itertools

import pytest

from tests.plugin.conftest import Suite

DRAWER, FAUCET = "OpenDrawer", "TurnOnSinkFaucet"
FIRST = f"safemanip::test_safety[{DRAWER}-scripted-collision_contact-seed0]"
SECOND = f"safemanip::test_safety[{FAUCET}-scripted-action_onset-seed0]"


@pytest.fixture
def recorded(suite: Suite) -> Suite:
    suite.has_recorded((DRAWER, "scripted"), (FAUCET, "scripted"))
    return suite


def chosen(*tasks: str) -> tuple[str, str]:
    return "--safemanip-policy=scripted", f"--safemanip-tasks={','.join(tasks)}"


def test_no_test_file_is_needed_and_none_is_collected(recorded: Suite) -> None:
    recorded.pytester.makepyfile("def test_of_the_user(): pass")
    recorded.run(*chosen(DRAWER)).assert_outcomes(passed=2, skipped=1)


def test_testpaths_are_no_paths_on_the_command_line(recorded: Suite) -> None:
    recorded.pytester.makeini("[pytest]\ntestpaths = tests")
    recorded.pytester.mkdir("tests").joinpath("test_it.py").write_text("def test_it(): pass")
    recorded.run(*chosen(DRAWER)).assert_outcomes(passed=2, skipped=1)


def test_with_a_path_the_suite_is_not_collected_and_says_so(recorded: Suite) -> None:
    path = recorded.pytester.makepyfile("def test_of_the_user(): pass")
    result = recorded.run(*chosen(DRAWER), str(path))
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(
        ["safemanip: not collected: paths were given; add safemanip:: to run it too"]
    )


def test_beside_a_path_if_it_is_named(recorded: Suite) -> None:
    path = recorded.pytester.makepyfile("def test_of_the_user(): pass")
    recorded.run(*chosen(DRAWER), str(path), "safemanip::").assert_outcomes(passed=3, skipped=1)


def test_an_id_is_enough(recorded: Suite) -> None:
    result = recorded.run(FIRST)
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["safemanip: 1 case on 1 rollout of 1 task, policy scripted, *"])


def test_several_ids_of_several_tasks(recorded: Suite) -> None:
    result = recorded.run(FIRST, SECOND, "-v")
    result.assert_outcomes(passed=2)
    for node_id in (FIRST, SECOND):
        assert any(node_id in line and "PASSED" in line for line in result.outlines)


def test_an_id_beside_a_path(recorded: Suite) -> None:
    path = recorded.pytester.makepyfile("def test_of_the_user(): pass")
    recorded.run(FIRST, str(path)).assert_outcomes(passed=2)


def test_deselecting_by_id(recorded: Suite) -> None:
    result = recorded.run(*chosen(DRAWER), "--deselect", FIRST)
    result.assert_outcomes(passed=1, skipped=1, deselected=recorded.seen_deselected(1))


def test_nothing_left_is_exit_code_5(recorded: Suite) -> None:
    result = recorded.run(*chosen(DRAWER), "-k", "nothing_like_this")
    assert result.ret == pytest.ExitCode.NO_TESTS_COLLECTED


def test_last_failed_runs_the_violated_cases_only(suite: Suite) -> None:
    task = "PickPlaceCounterToCabinet"
    suite.has_recorded((task, "scripted:half_inside"))
    run = ("--safemanip-policy=scripted:half_inside", f"--safemanip-tasks={task}", "--lf")
    suite.run(*run).assert_outcomes(failed=1, passed=4, skipped=1)
    result = suite.run(*run)
    result.assert_outcomes(failed=1, deselected=suite.seen_deselected(5))


def test_listing_simulates_nothing_and_needs_no_simulator(one_suite: Suite) -> None:
    without_robocasa(one_suite)
    result = one_suite.run("--safemanip-policy=scripted", "--collect-only", "-q")
    assert result.ret == 0
    assert FIRST in result.outlines
    assert not one_suite.out.exists()


def test_the_ini_file_can_say_it_all(recorded: Suite) -> None:
    recorded.pytester.makeini(
        f"[pytest]\nsafemanip_policy = scripted\nsafemanip_tasks = {DRAWER}\n"
        "safemanip_vacuous = pass\n"
    )
    recorded.run().assert_outcomes(passed=3)
    # The command line wins.
    recorded.run("--safemanip-vacuous=skip").assert_outcomes(passed=2, skipped=1)


def test_cases_of_a_rollout_are_neighbours(one_suite: Suite) -> None:
    result = one_suite.run(
        "--safemanip-policy=scripted,hold",
        "--safemanip-tasks=quick",
        "--safemanip-seeds=2",
        "--collect-only",
        "-q",
    )
    ids = [line for line in result.outlines if line.startswith("safemanip::")]
    rollouts = [tuple(i[i.index("[") :].split("-")[k] for k in (0, 1, 3)) for i in ids]
    changes = sum(a != b for a, b in itertools.pairwise(rollouts))
    assert changes + 1 == len(set(rollouts)) == 20
    assert len(set(ids)) == len(ids) == 4 * 19


def without_robocasa(suite: Suite) -> None:
    """As on a machine where it is not installed."""
    suite.pytester.makeconftest("import sys\nsys.modules['robocasa'] = None\n")
