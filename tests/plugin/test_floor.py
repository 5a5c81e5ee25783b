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


def test_what_a_log_does_not_tell_is_left_out_by_name(
    one_suite: Suite, demonstrations: Path
) -> None:
    (whole,) = (demonstrations / "recordings").iterdir()
    recording = files.load(whole)
    origin = {"unobserved": "contacts, fixtures, objects"}
    episode = dataclasses.replace(recording.episode, policy="log", origin=origin)
    files.save(dataclasses.replace(recording, episode=episode), whole.with_name("log.rollout"))
    one = f"--safemanip-floor={demonstrations}"
    result = judged(one_suite, one)
    joined(result).fnmatch_lines(
        [*TABLE, "*floor: left out, not observed: log.rollout (*enclosure_release*)"]
    )
    assert [r["policy"] for r in one_suite.summary()["floor"]["rollouts"]] == [
        "scripted:half_inside"
    ]
    whole.unlink()
    result = judged(one_suite, one)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"*no demonstration of {TASK} (left out, not observed: log.*"])


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
