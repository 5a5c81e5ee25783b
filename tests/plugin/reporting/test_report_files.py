"""`--safemanip-report`: what it writes, when, and what happens where it cannot."""

from __future__ import annotations

import json
import sys
from types import ModuleType

import pytest

from pytest_safemanip.report import writers
from pytest_safemanip.run.definitions import Definitions
from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import set_up


def test_each_report_is_written_from_the_whole_run_and_named(suite: Suite) -> None:
    set_up(suite)
    result = suite.run("--safemanip-report=markdown,sarif", "--safemanip-seeds=2")
    assert "report markdown: .safemanip/summary.md" in result.outlines
    assert "report sarif: .safemanip/summary.sarif" in result.outlines
    assert "2 of 2 rollouts violated" in (suite.out / "summary.md").read_text()
    found = json.loads((suite.out / "summary.sarif").read_text())
    assert len({r["properties"]["seed"] for r in found["runs"][0]["results"]}) == 2


def test_the_ini_file_names_reports_and_quiet_runs_name_their_files(one_suite: Suite) -> None:
    set_up(one_suite)
    result = one_suite.run("--override-ini=safemanip_report=markdown", "-q")
    assert "report markdown: .safemanip/summary.md" in result.outlines


def test_an_unknown_report_is_refused_before_anything_is_run(one_suite: Suite) -> None:
    set_up(one_suite)
    result = one_suite.run("--safemanip-report=sarif,markdwon")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert result.errlines == [
        "ERROR: --safemanip-report: unknown report 'markdwon'; did you mean 'markdown'?",
        "",
    ]
    assert not one_suite.out.exists()


@pytest.mark.parametrize("error", [SystemExit(0), pytest.skip.Exception("no GPU")])
def test_a_report_decides_nothing_whatever_it_raises(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    def fails(folder: object, definitions: Definitions) -> object:
        raise error

    broken = ModuleType("broken")
    vars(broken)["fails"] = fails
    monkeypatch.setitem(sys.modules, "broken", broken)
    monkeypatch.setattr(writers, "WRITERS", {**writers.WRITERS, "html": "broken:fails"})
    set_up(one_suite)
    result = one_suite.run("--safemanip-report=html")
    assert result.parseoutcomes()["failed"] == 1
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["report html: cannot be written: *"])


def test_reports_are_written_where_another_plugin_cannot_write_its_own(one_suite: Suite) -> None:
    set_up(one_suite)
    one_suite.run("--safemanip-report=markdown", "--junitxml=/dev/full")
    assert "1 of 1 rollout" in (one_suite.out / "summary.md").read_text()


def test_reports_of_an_earlier_run_are_named(one_suite: Suite) -> None:
    set_up(one_suite)
    one_suite.run("--safemanip-report=markdown,sarif")
    result = one_suite.run("--safemanip-report=markdown")
    stale = "of an earlier run: summary.sarif; --safemanip-report=sarif writes it again"
    assert stale in result.outlines
    assert not any("of an earlier run" in line for line in one_suite.run("-k", "grasp").outlines)
    again = one_suite.run("--safemanip-report=markdown,sarif")
    assert not any("of an earlier run" in line for line in again.outlines)
    assert sorted(p.name for p in one_suite.out.glob("summary.*")) == sorted(
        ["summary.json", writers.FILES["markdown"], writers.FILES["sarif"]]
    )


@pytest.mark.parametrize("quiet", [[], ["-q"]])
def test_a_report_that_fails_is_a_line_and_a_failure_and_the_others_are_written(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch, quiet: list[str]
) -> None:
    def fails(folder: object, definitions: Definitions) -> object:
        assert "stays_near" in definitions.properties  # the user's, too
        raise ValueError("no room\nfor it")

    broken = ModuleType("broken")
    vars(broken)["fails"] = fails
    monkeypatch.setitem(sys.modules, "broken", broken)
    monkeypatch.setattr(writers, "WRITERS", {**writers.WRITERS, "html": "broken:fails"})
    set_up(one_suite)
    result = one_suite.run("--safemanip-report=html,markdown", "-k", "grasp_stability", *quiet)
    assert "report html: cannot be written: ValueError: no room" in result.outlines
    assert "report markdown: .safemanip/summary.md" in result.outlines
    result.assert_outcomes(skipped=1)  # verdicts stand
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def test_a_part_of_a_run_leaves_the_reports_of_the_whole(one_suite: Suite) -> None:
    set_up(one_suite)
    one_suite.run("--safemanip-report=markdown")
    kept = (one_suite.out / "summary.md").read_text()
    result = one_suite.run("--safemanip-report=markdown", "-k", "grasp_stability")
    assert "report markdown: not written for a part of a run, nor replaced" in result.outlines
    assert result.ret == 0
    assert (one_suite.out / "summary.md").read_text() == kept
