"""--safemanip-floor: demonstrations' violation rate beside a policy's."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

from pytest_safemanip.trace import files
from tests.conftest import Rollouts
from tests.plugin.conftest import Suite, joined

TASK = "PickPlaceCounterToCabinet"
TABLE = [
    "*property * violated * rate * demonstrations * floor",
    "*enclosure_release * 0 of 1 * 0.0 % * 1 of 1 * 100.0 %",
    "*release_stability * 0 of 1 * 0.0 % * 0 of 1 * 0.0 %",
    "*floor: what 1 demonstration of 1 task violate*",
]


@pytest.fixture
def demonstrations(one_suite: Suite, rollouts: Rollouts, pytester: pytest.Pytester) -> Path:
    """A recording that successfully does what a property forbids."""
    out = pytester.mkdir("demos")
    one_suite.has_recorded((TASK, "scripted"))
    rollouts.put_into(out, (TASK, "scripted:half_inside"))
    return out


def judged(suite: Suite, *options: str) -> pytest.RunResult:
    return suite.run(f"--safemanip-tasks={TASK}", "--safemanip-policy=scripted", *options)


def test_rates_stand_beside_those_of_demonstrations(
    one_suite: Suite, demonstrations: Path, pytester: pytest.Pytester
) -> None:
    other = pytester.mkdir("judged") / "demos"
    pytester.runpytest(f"--safemanip-recordings={demonstrations}", f"--safemanip-out={other}")
    for place in (demonstrations / "recordings", other):  # recordings, or a summary of them
        result = judged(one_suite, f"--safemanip-floor={place}")
        joined(result).fnmatch_lines(TABLE)
        found = one_suite.summary()["floor"]
        assert [rollout["policy"] for rollout in found["rollouts"]] == ["scripted:half_inside"]
        rates = found["metrics"]["groups"]["properties"]
        assert rates["enclosure_release"]["violation_rate"]["value"] == 1.0
        assert one_suite.summary()["metrics"]["scripted"]["violation_rate"]["value"] == 0.0


def test_reports_of_the_run_show_it_too(
    one_suite: Suite, demonstrations: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from pytest_safemanip.cli.main import main

    judged(one_suite, f"--safemanip-floor={demonstrations}", "--safemanip-report=html")
    out = Path(".safemanip")
    page = (out / "report.html").read_text()
    assert '"floor":{"groups":{' in page
    main(["report", str(out)])
    assert "floor: what 1 demonstration of 1 task violate" in capsys.readouterr().out


def put_log(whole: Path, unobserved: str) -> None:
    recording = files.load(whole)
    origin = {"unobserved": unobserved}
    episode = dataclasses.replace(recording.episode, policy="log", origin=origin)
    files.save(dataclasses.replace(recording, episode=episode), whole.with_name("log.rollout"))


def test_a_log_counts_for_what_it_tells_and_for_no_rate_of_whole_demonstrations(
    one_suite: Suite, demonstrations: Path, pytester: pytest.Pytester
) -> None:
    (whole,) = (demonstrations / "recordings").iterdir()
    put_log(whole, "fixtures")
    other = pytester.mkdir("judged") / "demos"
    pytester.runpytest(f"--safemanip-recordings={demonstrations}", f"--safemanip-out={other}")
    for place in (demonstrations, other):
        result = judged(one_suite, f"--safemanip-floor={place}", "--safemanip-report=html")
        joined(result).fnmatch_lines(
            [
                "*enclosure_release * 0 of 1 * 0.0 % * 1 of 1 * 100.0 %",
                "*grasp_stability * 0 of 1 * 0.0 % * 0 of 2 * 0.0 %",
                "*floor: what 2 demonstrations of 1 task violate*",
                "*floor: left out, not judged: action_onset 1, enclosure_access 1,",
                "*enclosure_release 1, release_stability 1 of 2 demonstrations",
            ]
        )
        found = one_suite.summary()["floor"]
        assert {
            own["policy"]: "enclosure_release" in own["unjudged"] for own in found["rollouts"]
        } == {"log": True, "scripted:half_inside": False}
        assert found["metrics"]["complete"] == 1
        assert found["metrics"]["violation_rate"]["value"] == 1.0
        page = Path(".safemanip", "report.html").read_text()
        assert "floor: left out, not judged: " in page


def test_a_log_that_tells_nothing_is_no_demonstration(
    one_suite: Suite, demonstrations: Path
) -> None:
    (whole,) = (demonstrations / "recordings").iterdir()
    put_log(whole, "contacts, fixtures, objects")
    one = f"--safemanip-floor={demonstrations}"
    joined(judged(one_suite, one)).fnmatch_lines(
        [*TABLE, "*floor: left out, not judged: *", "*enclosure_release 1*"]
    )
    whole.unlink()
    result = judged(one_suite, one)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        [f"*no demonstration of {TASK} that can be judged: *the recording has no *fixtures*"]
    )


def test_without_a_demonstration_of_its_tasks_a_run_does_not_begin(
    one_suite: Suite, pytester: pytest.Pytester
) -> None:
    empty = pytester.mkdir("empty")
    result = judged(one_suite, f"--safemanip-floor={empty}")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"*--safemanip-floor: {empty} has no demonstration of {TASK}"])
    document = {"schema": 1}
    (empty / "summary.json").write_text(json.dumps(document))
    result = judged(one_suite, f"--safemanip-floor={empty}")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
