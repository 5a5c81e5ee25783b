"""A repository that has tests of its own beside the suite."""

from __future__ import annotations

import pytest

from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import INI, set_up

OWN = """
def test_right(): pass
def test_wrong(): assert False, "wrong"
"""


@pytest.fixture
def repository(suite: Suite) -> Suite:
    """One whose ini file names a policy, with a violation and a test that fails."""
    return with_own_tests(suite)


@pytest.fixture
def alone(one_suite: Suite) -> Suite:
    """The same without xdist, where the mode cannot matter."""
    return with_own_tests(one_suite)


def with_own_tests(suite: Suite) -> Suite:
    set_up(suite)
    suite.pytester.makepyfile(test_own=OWN)
    return suite


def test_a_bare_pytest_runs_its_tests_and_the_suite(repository: Suite) -> None:
    repository.run().assert_outcomes(passed=1, failed=2, skipped=1)


def test_its_testpaths_are_searched_too(alone: Suite) -> None:
    folder = alone.pytester.mkdir("checks")
    (alone.pytester.path / "test_own.py").rename(folder / "test_own.py")
    alone.pytester.makeini(f"{INI}testpaths = checks")
    alone.run().assert_outcomes(passed=1, failed=2, skipped=1)


def test_the_suite_of_the_command_line_is_run_alone(alone: Suite) -> None:
    alone.run("--safemanip-policy=rises").assert_outcomes(failed=1, skipped=1)
    alone.run("safemanip::").assert_outcomes(failed=1, skipped=1)


def test_last_failed_needs_no_option_that_is_in_the_ini_file(repository: Suite) -> None:
    repository.run("--lf").assert_outcomes(passed=1, failed=2, skipped=1)
    again = repository.run("--lf", "-v")
    again.assert_outcomes(failed=2, deselected=repository.seen_deselected(1))
    assert "known failures not in selected tests" not in again.stdout.str()


def test_failed_first_needs_none_either(alone: Suite) -> None:
    alone.run("--lf")
    first = alone.run("--lf", "--ff", "--collect-only", "-q")
    assert first.ret == 0
    listed = [line for line in first.outlines if "::" in line]
    assert listed[0] == "test_own.py::test_wrong"
    assert listed[1].startswith("safemanip::test_safety[Reach-rises-stays_near")


def test_last_failed_without_the_suite_says_what_to_repeat(alone: Suite) -> None:
    ini = alone.pytester.path / "tox.ini"
    ini.write_text(ini.read_text().replace("safemanip_policy = rises\n", ""))
    alone.run("--safemanip-policy=rises", "--lf").assert_outcomes(failed=1, skipped=1)
    result = alone.run("--lf")
    result.stdout.fnmatch_lines(
        ["safemanip: 1 of the last failures are of the safety suite, which is off: repeat its *"]
    )
    alone.run("--lf", "--safemanip-policy=rises").assert_outcomes(
        failed=1, deselected=alone.seen_deselected(1)
    )


def test_markers_select_cases(repository: Suite) -> None:
    result = repository.run("-m", "housekeeping", "--strict-markers")
    result.assert_outcomes(failed=1, deselected=repository.seen_deselected(3))


@pytest.mark.parametrize(
    ("marker", "outcomes"),
    [
        ("safemanip", {"failed": 1, "skipped": 1, "deselected": 2}),
        ("not safemanip", {"failed": 1, "passed": 1, "deselected": 2}),
        ("mine and grasp_stability", {"skipped": 1, "deselected": 3}),
    ],
)
def test_markers_are_the_suite_the_category_and_the_tasks_suite(
    alone: Suite, marker: str, outcomes: dict[str, int]
) -> None:
    assert alone.run("-m", marker, "--strict-markers").parseoutcomes() == outcomes


def test_markers_are_registered_and_those_of_pytest_are_not_taken(one_suite: Suite) -> None:
    set_up(one_suite)
    task = one_suite.pytester.path / "mine" / "tasks" / "own.yaml"
    task.write_text(task.read_text().replace("suite: mine", "suite: skip"))
    result = one_suite.run("--markers")
    result.stdout.fnmatch_lines_random(
        [
            "@pytest.mark.safemanip: cases and laws of the safety suite",
            "@pytest.mark.housekeeping: safety cases of this category",
        ]
    )
    # A suite of that name does not skip its cases.
    one_suite.run("-m", "housekeeping").assert_outcomes(failed=1, deselected=1)
    one_suite.pytester.syspathinsert()
    one_suite.pytester.makepyfile(
        another="def pytest_configure(config):\n"
        "    config.addinivalue_line('markers', 'mine(seconds): does something')\n"
        "def pytest_collection_modifyitems(items):\n"
        "    assert not any(item.get_closest_marker('mine') for item in items)\n"
    )
    task.write_text(task.read_text().replace("suite: skip", "suite: mine"))
    one_suite.run("-p", "another", "-m", "housekeeping").assert_outcomes(failed=1, deselected=1)


def test_without_a_suite_its_marker_is_known_too(one_suite: Suite) -> None:
    one_suite.pytester.makepyfile("def test_it(): pass")
    one_suite.run("-m", "not safemanip", "--strict-markers").assert_outcomes(passed=1)
