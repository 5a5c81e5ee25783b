"""What CI servers and other reports are given: job summaries, annotations, attachments."""

from __future__ import annotations

import base64
import html
import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest

from pytest_safemanip.plugin.reports import junit  # once: a second import has another limit
from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import set_up


def on_github(suite: Suite, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The environment of GitHub's runner; the file of the job summary."""
    set_up(suite)
    step = suite.pytester.path / "step.md"
    for name, value in {
        "CI": "true",
        "GITHUB_ACTIONS": "true",
        "GITHUB_STEP_SUMMARY": str(step),
        "GITHUB_WORKSPACE": str(suite.pytester.path),
    }.items():
        monkeypatch.setenv(name, value)
    return step


def test_github_has_a_job_summary_and_annotations_after_all_else(
    suite: Suite, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = on_github(suite, monkeypatch)
    result = suite.run()
    assert "#### 1. stays_near: Reach, rises, seed 0" in step.read_text()
    assert "█" in step.read_text()
    assert result.outlines[-1].startswith(
        "::error file=mine/properties/own.yaml,line=1,title=stays_near violated::Reach, rises"
    )
    assert " in " in result.outlines[-2]  # pytest's own last line


def test_violations_that_gates_tolerate_are_warnings(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = on_github(one_suite, monkeypatch)
    result = one_suite.run("--safemanip-gate=violation_rate <= 50 %")
    first, second = (line for line in result.outlines if line.startswith("::"))
    assert first.startswith("::error title=FAIL%3A violation_rate <= 0.5::rises: 1 of 1")
    assert second.startswith("::warning ")
    assert "| FAIL |" in step.read_text()


def test_both_can_be_switched_off(one_suite: Suite, monkeypatch: pytest.MonkeyPatch) -> None:
    step = on_github(one_suite, monkeypatch)
    result = one_suite.run("--safemanip-ci=off")
    assert not step.exists()
    assert not [line for line in result.outlines if line.startswith("::")]


def test_a_job_summary_that_cannot_be_written_is_a_line_and_a_failure(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = on_github(one_suite, monkeypatch)
    step.mkdir()
    result = one_suite.run("-k", "grasp_stability")
    assert f"job summary: {step}: is not a file" in result.outlines
    result.assert_outcomes(skipped=1)  # verdicts stand
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def outputs(path: Path) -> list[str]:
    """The texts of all ``system-out`` of the violated case."""
    case = ET.parse(path).find(".//testcase[failure]")
    assert case is not None
    return [found.text or "" for found in case.iter("system-out")]


DRAWN = "[[ATTACHMENT|.safemanip/timelines/Reach-rises-seed0-stays_near.svg]]"
RECORDED = "[[ATTACHMENT|.safemanip/recordings/Reach-rises-seed0.rollout]]"


def test_junit_links_picture_and_recording_of_a_violation(suite: Suite) -> None:
    set_up(suite)
    suite.run("--junitxml=all.xml")
    path = suite.pytester.path / "all.xml"
    assert outputs(path) == [f"{DRAWN}\n{RECORDED}"]
    assert path.read_text().count("ATTACHMENT") == 2  # none of other cases
    picture = ET.parse(suite.out / "timelines" / "Reach-rises-seed0-stays_near.svg")
    assert "straying" in ET.tostring(picture.getroot(), encoding="unicode")


@pytest.mark.parametrize("logging", ["all", "system-out", "log", "system-err"])
def test_there_is_one_output_whatever_pytest_logs(one_suite: Suite, logging: str) -> None:
    set_up(one_suite)
    result = one_suite.run("--junitxml=all.xml", f"--override-ini=junit_logging={logging}", "-s")
    (text,) = outputs(one_suite.pytester.path / "all.xml")
    assert DRAWN in text.splitlines()  # Jenkins wants a line of its own
    assert "ATTACHMENT" not in result.stdout.str()


def test_paths_are_relative_to_the_checkout(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch
) -> None:
    set_up(one_suite)
    monkeypatch.setenv("CI_PROJECT_DIR", str(one_suite.pytester.path.parent))
    one_suite.run("--junitxml=all.xml")
    (text,) = outputs(one_suite.pytester.path / "all.xml")
    assert f"[[ATTACHMENT|{one_suite.pytester.path.name}/.safemanip/recordings/" in text


def test_a_junit_file_that_gitlab_refuses_is_shortened_and_said_so(
    one_suite: Suite, monkeypatch: pytest.MonkeyPatch
) -> None:
    set_up(one_suite)
    monkeypatch.setattr(junit, "MAX_BYTES", 2000)
    result = one_suite.run("--junitxml=all.xml", "--safemanip-seeds=2")
    path = one_suite.pytester.path / "all.xml"
    assert path.stat().st_size <= 2000
    assert any(re.match(r"all\.xml: over .* 4 cases shortened", x) for x in result.outlines)
    found = ET.parse(path)
    assert len(found.findall(".//testcase")) == 4
    messages = {failure.get("message") for failure in found.iter("failure")}
    assert {message.split(":")[0] for message in messages if message} == {"stays_near"}


def test_pytest_html_shows_the_picture_and_links_the_recording(suite: Suite) -> None:
    pytest.importorskip("pytest_html")
    set_up(suite)
    suite.without = ()
    suite.run("--html=page/report.html", "--self-contained-html")
    page = (suite.pytester.path / "page" / "report.html").read_text()
    blob = re.search('data-jsonblob="([^"]*)"', page)
    assert blob
    (test,) = (
        own[0]
        for name, own in json.loads(html.unescape(blob[1]))["tests"].items()
        if "near" in name
    )
    picture, link = test["extras"]
    kind, _, data = picture["content"].partition(";base64,")
    assert kind == "data:image/svg+xml"
    assert ET.fromstring(base64.b64decode(data)).tag.endswith("svg")
    assert link["content"] == "../.safemanip/recordings/Reach-rises-seed0.rollout"


def test_allure_has_the_picture_and_the_recording(suite: Suite) -> None:
    pytest.importorskip("allure_pytest")
    set_up(suite)
    suite.without = ()
    suite.run("--alluredir=allure")
    folder = suite.pytester.path / "allure"
    cases: list[dict[str, Any]] = [json.loads(p.read_text()) for p in folder.glob("*-result.json")]
    names = {
        own["name"]: (case["status"], folder / own["source"])
        for case in cases
        for own in case.get("attachments", [])
        if own["name"].startswith("Reach")
    }
    assert {Path(name).suffix for name in names} == {".svg", ".rollout"}
    assert all(status == "failed" and file.is_file() for status, file in names.values())
