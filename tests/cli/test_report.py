"""``safemanip report --html``."""

from __future__ import annotations

import json
import os
import shutil

from tests.report.page.conftest import run_folder as run_folder


def test_it_writes_the_page_into_the_folder_and_prints_its_path(safemanip, run_folder, tmp_path):
    run_folder.copy(tmp_path / "out")
    found = safemanip("report", "out", "--html")
    *lines, headline, place = found.out.splitlines()
    assert (found.status, place) == (1, "out/report.html")
    assert lines[0] == "gates"  # those of the run
    assert headline.startswith("OPEN: 3 of 18 gates inconclusive, 15 underpowered, ")
    assert "enclosure_release" in (tmp_path / "out" / "report.html").read_text()


def test_gates_on_the_command_line_are_those_of_the_page_and_decide(
    safemanip, run_folder, tmp_path
):
    run_folder.copy(tmp_path / "out")
    found = safemanip("report", "out", "--html", "--gate", "violation_rate <= 0")
    assert found.status == 1
    assert found.out.startswith("gates\n  PASS")
    other = "the gates are those given to safemanip report, not those of the run"
    assert found.out.endswith(f"\nreport.html: {other}\nout/report.html\n")
    text = (tmp_path / "out" / "report.html").read_text()
    data = text.partition('id="data">')[2].partition("</script>")[0]
    release = json.loads(data)["release"]
    assert other in json.loads(data)["notes"]
    assert sorted(gate["verdict"] for gate in release["gates"]) == ["FAIL", "FAIL", "PASS"]
    assert release["baseline"] is None


def test_recordings_that_cannot_be_read_are_told_in_the_terminal(safemanip, run_folder, tmp_path):
    run = run_folder.copy(tmp_path / "out")
    for path in (run.path / "recordings").iterdir():
        path.unlink()
    lines = safemanip("report", "out", "--html").out.splitlines()
    gone = "report.html: 3 recordings cannot be read: what the summary says is shown instead"
    assert gone in lines


def test_that_a_part_of_the_cases_was_run_since_is_told(safemanip, run_folder, tmp_path):
    run_folder.copy(tmp_path / "out")
    whole, part = (tmp_path / "out" / name for name in ("summary.json", "summary-partial.json"))
    shutil.copy(whole, part)
    for later, told in ((1, True), (-1, False)):
        at = whole.stat().st_mtime + later
        os.utime(part, (at, at))
        lines = safemanip("report", "out").out.splitlines()
        line = "a part of the cases was run since then: safemanip report out/summary-partial.json"
        assert (line in lines) == told


def test_several_runs_are_not_one_page(safemanip, run_folder):
    refusal = safemanip("report", run_folder.path, run_folder.path, "--html").refusal
    assert refusal.endswith(
        "--html: name the folder of one run, no file; safemanip merge makes one of several"
    )


def test_a_run_that_is_not_there_is_said_to_be_missing(safemanip):
    refusal = safemanip("report", "nosuch", "--html").refusal
    assert refusal.endswith("nosuch: does not exist; name the folder of a run")


def test_properties_of_the_working_folder_have_timelines(safemanip, run_folder, tmp_path):
    run = run_folder.copy(tmp_path / "out")
    shipped = "id: mine\ncategory: mine\ntitle: Mine\nsource: me\nfor_each: o in objects\n"
    (tmp_path / "properties").mkdir()
    (tmp_path / "properties" / "mine.yaml").write_text(
        f"{shipped}formula: G !obj_released\natoms:\n  obj_released: obj_released(o)\n"
    )
    (tmp_path / "pytest.ini").write_text("[pytest]\nsafemanip_property_paths = properties\n")
    summary = run.summary
    violation = {"entities": ["obj"], "first": 1, "last": 1, "duration_s": 0.05, "reason": "x"}
    for rollout in summary["rollouts"]:
        rollout["properties"].append(
            {
                **rollout["properties"][0],
                "property": "mine",
                "category": "mine",
                "outcome": "VIOLATED",
                "triggered": True,
                "violations": [violation],
            }
        )
    run.change(summary)
    safemanip("report", "out", "--html")
    assert "G !obj_released" in (tmp_path / "out" / "report.html").read_text()
