"""What a run leaves behind for people and for CI servers."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import set_up

TASK = "PickPlaceCounterToCabinet"
POLICY = "scripted:half_inside"


def test_the_summary_and_junit_say_what_was_judged_and_how(suite: Suite) -> None:
    suite.has_recorded((TASK, POLICY))
    result = suite.run(
        f"--safemanip-policy={POLICY}", f"--safemanip-tasks={TASK}", "--junitxml=junit.xml"
    )
    result.assert_outcomes(failed=1, passed=4, skipped=1)
    check_summary(suite)
    check_junit(suite.pytester.path / "junit.xml")


def check_summary(ran: Suite) -> None:
    text = (ran.out / "summary.json").read_text()
    summary = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert summary["schema"] == 1
    assert set(summary["settings"]["scenes"].values()) == {"compact"}
    assert set(summary["settings"]["stepping"].values()) == {"fast"}
    assert summary["provenance"][0]["stepping"] == "fast"
    assert summary["cases"] == {
        "expected": 6,
        "missing": [],
        "errors": {},
        "skipped_rollouts": 0,
        "reused_rollouts": 1,
        "partial": False,
    }
    assert summary["provenance"][0]["assets"] == "primitive"
    assert summary["run"]["options"] == []
    assert 0.0 < summary["run"]["seconds"] < 600.0
    (rollout,) = summary["rollouts"]
    assert (rollout["task"], rollout["policy"], rollout["seed"]) == (TASK, POLICY, 0)
    assert rollout["success"] is True
    by_id = {p["property"]: p for p in rollout["properties"]}
    assert by_id["enclosure_release"]["outcome"] == "VIOLATED"
    assert by_id["grasp_stability"]["outcome"] == "SATISFIED"
    assert (ran.out / rollout["recording"]).is_file()
    metrics = summary["metrics"][POLICY]
    assert metrics["outcomes"]["success_but_unsafe"] == 1
    assert metrics["violation_rate"]["hits"] == 1


def check_junit(path: Path) -> None:
    suites = ElementTree.parse(path).getroot()
    cases = {case.get("name"): case for case in suites.iter("testcase")}
    case = cases[f"test_safety[{TASK}-{POLICY}-enclosure_release-seed0]"]
    assert case.get("classname") == "safemanip"
    found = {p.get("name"): p.get("value") for p in case.iter("property")}
    assert found["safemanip.task"] == TASK
    assert found["safemanip.outcome"] == "VIOLATED"
    assert found["safemanip.success"] == "True"
    assert int(found["safemanip.first_violation_step"] or -1) > 0
    assert Path(found["safemanip.recording"] or "").is_file()
    failure = case.find("failure")
    assert failure is not None
    assert "corners of obj were inside" in (failure.get("message") or "")
    assert "bad prefix at step" in (failure.text or "")
    passed = cases[f"test_safety[{TASK}-{POLICY}-grasp_stability-seed0]"]
    assert not {p.get("name") for p in passed.iter("property")} & {"safemanip.first_violation_step"}


def test_the_summary_of_a_whole_run_outlives_runs_of_some_of_its_cases(suite: Suite) -> None:
    set_up(suite)
    whole, partial = suite.out / "summary.json", suite.out / "summary-partial.json"
    suite.run("-k", "grasp_stability")
    assert suite.summary()["cases"]["partial"]
    suite.run("-k", "stays_near")  # there is nothing to be kept
    assert [p["property"] for p in suite.summary()["rollouts"][0]["properties"]] == ["stays_near"]
    suite.run()
    assert not suite.summary()["cases"]["partial"]
    kept = whole.read_bytes()
    for narrow in (
        ["-k", "stays_near"],
        ["safemanip::test_safety[Reach-rises-stays_near-seed0]"],
    ):
        result = suite.run(*narrow)
        assert "summary: .safemanip/summary-partial.json (summary.json, of all cases, is kept)" in (
            result.outlines
        )
        assert whole.read_bytes() == kept
        found = json.loads(partial.read_text())
        assert found["cases"]["partial"]
        assert [p["property"] for p in found["rollouts"][0]["properties"]] == ["stays_near"]
        partial.unlink()
    suite.run("--safemanip-properties=stays_near")  # a whole run, of another kind
    assert whole.read_bytes() != kept
    assert not partial.exists()


@pytest.mark.parametrize("quiet", [[], ["-q"]])
def test_a_summary_that_cannot_be_written_is_one_line_and_a_failure(one_suite, quiet) -> None:
    set_up(one_suite)
    (one_suite.out / "summary.json").mkdir(parents=True)
    result = one_suite.run("--safemanip-properties=grasp_stability", *quiet)
    line = "summary: .safemanip/summary.json cannot be written (Is a directory), nor reports on it"
    assert line in result.outlines
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert not list(one_suite.out.glob(".summary*"))


def test_a_violation_is_shown_without_pytests_own_frames(suite: Suite) -> None:
    suite.has_recorded((TASK, POLICY))
    chosen = (f"--safemanip-policy={POLICY}", f"--safemanip-tasks={TASK}", "-k", "enclosure_rel")
    for style in ("long", "short", "line", "native"):
        text = suite.run(*chosen, f"--tb={style}").stdout.str()
        assert "enclosure_release" in text
        assert "Traceback" not in text
        assert ".py:" not in text.split("FAILURES")[1].split("= safety")[0]
        if suite.mode != ("-p", "no:xdist"):
            break  # the style is applied before the transport


def test_the_command_shown_runs_the_case_again(suite: Suite) -> None:
    suite.has_recorded((TASK, POLICY))
    result = suite.run(
        f"--safemanip-policy={POLICY}",
        f"--safemanip-tasks={TASK}",
        "--safemanip-stop=success",
    )
    (line,) = {
        line for line in result.outlines if "enclosure_release" in line and "reproduce with" in line
    }
    _, _, _, option, node_id = line.split(maxsplit=4)
    assert option == "--safemanip-stop=success"
    suite.run(option, node_id.strip("'")).assert_outcomes(failed=1)
