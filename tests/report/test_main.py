"""``python -m pytest_safemanip.report``: what it prints, writes and returns."""

from __future__ import annotations

import json

import pytest

from pytest_safemanip.metrics.summaries import read
from pytest_safemanip.report.__main__ import main
from tests.metrics.build import rollouts
from tests.metrics.test_summaries import document


@pytest.fixture
def folder(tmp_path):
    """Writes the summary of a run; gives its folder."""

    def write(name, records):
        path = tmp_path / name
        path.mkdir()
        (path / "summary.json").write_text(json.dumps(document(records)))
        return str(path)

    return write


def test_runs_are_merged_shown_and_decided(folder, tmp_path, capsys):
    one = folder("one", rollouts("x...", "A"))
    two = folder("two", rollouts("....", "B"))
    out = tmp_path / "all.json"
    gates = ["--gate=violation_rate <= 20 %", f"--out={out}"]
    assert main([one, two, one, *gates]) == 0
    text = capsys.readouterr().out
    assert "p: 8 complete rollouts of 2 tasks" in text
    assert "  PASS  violation_rate <= 0.2, p: 1 of 8 = 12.5 %" in text
    assert len(read(out).records) == 8
    assert json.loads(out.read_text())["release"]["gates"][0]["verdict"] == "PASS"
    assert main([one, "--gate=violation_rate <= 20 %"]) == 1


def test_what_is_open_need_not_fail(folder, capsys):
    run, base = folder("run", rollouts("....")), folder("base", rollouts("...."))
    chosen = [run, "--gate=violation_rate <= 10 % @0.95", f"--baseline={base}"]
    assert main(chosen) == 1
    assert main([*chosen, "--inconclusive=skip"]) == 0
    assert "UNDERPOWERED" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none"], "error: none: there is no summary.json; name the folder of a run"),
        (["--gate=violation_rat <= 1"], "error: unknown metric 'violation_rat'"),
        (["--gate=exposure[task=B] <= 1"], "no task 'B' in this run; known: A"),
        (["--baseline=none"], "error: none: there is no summary.json"),
    ],
)
def test_what_cannot_be_done_is_an_error_of_its_own(folder, capsys, arguments, message):
    assert main([folder("one", rollouts("x", "A")), *arguments]) == 2
    assert message in capsys.readouterr().err
