"""``safemanip report`` and ``safemanip merge``: what they print, write and return."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pytest_safemanip.metrics.summaries import read
from tests.metrics.build import rollouts
from tests.metrics.test_summaries import document
from tests.report.ci.conftest import gate


@pytest.fixture
def folder(tmp_path):
    """Writes the summary of a run; gives its folder."""

    def write(name, records):
        path = tmp_path / name
        path.mkdir()
        whole = document(records)
        whole["cases"]["missing"] = []
        (path / "summary.json").write_text(json.dumps(whole))
        return str(path)

    return write


def test_runs_are_merged_into_a_summary_that_can_be_read_and_decided(folder, safemanip, tmp_path):
    one = folder("one", rollouts("x...", "A"))
    two = folder("two", rollouts("....", "B"))
    out = tmp_path / "all"
    found = safemanip("merge", one, two, one, "-o", out)
    assert (found.status, found.out) == (0, f"8 rollouts of 2 runs: {out}/summary.json\n")
    assert len(read(out).records) == 8
    found = safemanip("report", out, "--gate=violation_rate <= 20 %")
    assert found.status == 0
    assert "p: 8 complete rollouts of 2 tasks" in found.out
    assert "  PASS  violation_rate <= 0.2, p: 1 of 8 = 12.5 %" in found.out
    assert safemanip("report", one, "--gate=violation_rate <= 20 %").status == 1
    assert safemanip("report", one, two, "--gate=violation_rate <= 20 %").out == found.out


@pytest.mark.parametrize(
    ("pattern", "status", "text"),
    [
        ("....", 0, "PASS: 0 of 4 rollouts violated"),
        ("x...", 1, "FAIL: 1 of 4 rollouts violated"),
        ("..e", 1, "FAIL: 0 of 2 complete rollouts violated, 1 rollout incomplete"),
    ],
)
def test_without_gates_the_status_is_what_pytest_would_say(
    folder, safemanip, pattern, status, text
):
    found = safemanip("report", folder("run", rollouts(pattern)))
    assert found.status == status
    assert found.out.endswith(f"\n{text}\n")


def test_where_nothing_but_the_infrastructure_failed_the_status_says_so(folder, safemanip):
    lost = rollouts("e", first=9, infrastructure=True)
    assert safemanip("report", folder("run", rollouts("..") + lost)).status == 10
    assert safemanip("report", folder("bad", rollouts("x.") + lost)).status == 1


def test_the_gates_of_the_run_are_told_and_decide(folder, safemanip, tmp_path):
    run = Path(folder("run", rollouts("x...")))
    whole = json.loads((run / "summary.json").read_text())

    def ends(*gates, refused=""):
        release = {"gates": [*gates], "baseline": None, "refused": refused, "not_comparable": {}}
        (run / "summary.json").write_text(json.dumps({**whole, "release": release}))
        return safemanip("report", run)

    found = ends(gate(), gate(verdict="PASS"))
    assert "gates\n  FAIL  violation_rate <= 0.1, p: 1 of 2 = 50.0 %\n" in found.out
    assert found.out.endswith("FAIL: 1 of 2 gates failed, 1 of 4 rollouts violated\n")
    assert found.status == 1
    assert ends(gate(verdict="PASS")).status == 0
    assert ends(gate(required=False)).status == 0
    found = ends(gate(verdict="PASS"), refused="other tasks")
    assert (found.status, "no comparison with the baseline: other tasks" in found.out) == (1, True)
    assert ends(gate(verdict="INCONCLUSIVE")).status == 1
    assert safemanip("report", run, "--inconclusive=skip").status == 0
    assert json.loads(safemanip("report", run, "--json").out)["release"]["gates"]


def test_without_a_folder_the_usual_one_is_reported(folder, safemanip):
    folder(".safemanip", rollouts("x..."))
    assert "p: 4 complete rollouts of 1 task" in safemanip("report").out


def test_json_has_the_metrics_and_each_gate_once(folder, safemanip):
    gates = ["--gate=violation_rate <= 20 %", "--gate=violation_rate<=0.2"]
    found = safemanip("report", folder("one", rollouts("....")), *gates, "--json")
    plain = json.loads(found.out)
    assert [gate["verdict"] for gate in plain["release"]["gates"]] == ["PASS"]
    assert plain["metrics"].keys() == {"p"}


def test_what_is_open_need_not_fail(folder, safemanip):
    run, base = folder("run", rollouts("....")), folder("base", rollouts("...."))
    chosen = [run, "--gate=violation_rate <= 10 % @0.95", f"--baseline={base}"]
    assert safemanip("report", *chosen).status == 1
    found = safemanip("report", *chosen, "--inconclusive=skip")
    assert found.status == 0
    assert "UNDERPOWERED" in found.out


def test_a_run_without_a_rollout_passes_nothing(folder, safemanip):
    none, base = folder("none", []), folder("base", rollouts("...."))
    found = safemanip("report", none, "--gate=violation_rate <= 1")
    assert found.status == 1
    assert "INCOMPLETE  violation_rate <= 1, no policy: undefined; no rollout" in found.out
    found = safemanip("report", none, f"--baseline={base}")
    assert found.status == 1
    assert "no comparison with the baseline: there is no rollout to compare" in found.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none"], "error: none: does not exist; name the folder of a run"),
        (["--gate=violation_rat <= 1"], "error: --gate: unknown metric 'violation_rat'"),
        (["--gate=exposure[task=B] <= 1"], "no task 'B' in this run; known: A"),
        (["--baseline=none"], "error: none: there is no summary.json"),
    ],
)
def test_what_cannot_be_done_is_an_error_of_its_own(folder, safemanip, arguments, message):
    assert message in safemanip("report", folder("one", rollouts("x", "A")), *arguments).refusal


def test_runs_that_do_not_fit_are_not_merged(folder, safemanip, tmp_path):
    one, two = folder("one", rollouts("x")), folder("two", rollouts("."))
    assert "differ on a in the rollout of T" in safemanip("merge", one, two, "-o", "all").refusal
    assert not (tmp_path / "all").exists()
    (tmp_path / "file").touch()
    assert "file" in safemanip("merge", one, "-o", tmp_path / "file").refusal
