from __future__ import annotations

import dataclasses
import json

import pytest

from pytest_safemanip.metrics.gates import Gates, parse_gate
from pytest_safemanip.metrics.release_gate import ReleaseGate, Ruling
from pytest_safemanip.report.rulings import (
    comparison_text,
    gate_line,
    gate_text,
    ruling_lines,
)
from tests.metrics.build import rollout, rollouts, severe, verdict
from tests.metrics.test_summaries import summary


def ruled(records, *gates, before=None, **changed):
    own = Gates(tuple(gates), **changed)
    baseline = summary(before, "runs/main") if before is not None else None
    return ReleaseGate(own, baseline).rule(summary(records))


def test_a_gate_is_a_line_with_counts_interval_and_what_would_help():
    ruling = ruled(
        rollouts("x........."),
        parse_gate("violation_rate <= 0.05 @0.95", "strict"),
        parse_gate("violation_rate <= 20 %"),
        parse_gate("violations_per_rollout <= 0.5", "few", required=False),
    )
    assert ruling_lines(ruling) == [
        "gates",
        "  INCONCLUSIVE         strict: violation_rate <= 0.05 @0.95, p: 1 of 10 = 10.0",
        "                       %, 95 % CI (these tasks) 1.8 to 40.4 %; about 180 more",
        "                       rollouts would likely decide it, if the rate stays",
        "  PASS                 violation_rate <= 0.2, p: 1 of 10 = 10.0 %",
        "  PASS (not required)  few: violations_per_rollout <= 0.5, p: 0.1",
    ]


def test_the_text_of_a_broken_gate_names_the_tasks_that_weigh_most():
    records = [*rollouts("xx..", "A"), *rollouts("....", "B"), *rollouts("xxx.", "C")]
    (decision,) = ruled(records, parse_gate("violation_rate <= 0.1")).decisions
    assert gate_text(decision).splitlines() == [
        "FAIL  violation_rate <= 0.1, p: 5 of 12 = 41.7 %",
        "",
        "rollouts with a violated property / complete rollouts",
        "  C: 3 of 4",
        "  A: 2 of 4",
    ]


def costly():
    """Rollouts that cost 0, 1, 2, ..., of seeds that are as high."""
    return [rollout(True, severe(float(n)) if n else verdict(), seed=n) for n in range(8)]


def test_the_text_of_a_broken_gate_on_costs_names_the_rollouts_that_cost_most_and_their_rules():
    other = rollout(True, severe(1.5), severe(7.25, 1.25, name="b"), task="U")
    (decision,) = ruled([*costly(), other], parse_gate("mean_cost <= 2")).decisions
    dearest = "U, seed 3: 10 (b 8.5, a 1.5)"
    assert gate_line(decision) == f"mean_cost <= 2, p: 4.22222; most expensive: {dearest}"
    assert gate_text(decision).splitlines()[1:] == [
        "",
        "mean cost of a rollout",
        f"  {dearest}",
        "  T, seed 7: 7 (a 7)",
        "  T, seed 6: 6 (a 6)",
        "  T, seed 5: 5 (a 5)",
        "  T, seed 4: 4 (a 4)",
        "  and 3 rollouts that cost less",
    ]


def test_of_many_rules_of_a_rollout_those_that_cost_most_are_named():
    found = [severe(float(n), name=f"r{n}") for n in range(1, 7)]
    (decision,) = ruled([rollout(True, *found)], parse_gate("max_cost <= 2")).decisions
    assert gate_line(decision).endswith("T, seed 3: 21 (r6 6, r5 5, r4 4, and 3 more)")


@pytest.mark.parametrize("text", ["max_cost <= 7", "max_cost >= 8", "violations_per_rollout <= 0"])
def test_no_rollout_is_to_blame_for_what_is_kept_or_asks_for_more_or_for_no_costs(text):
    (decision,) = ruled(costly(), parse_gate(text)).decisions
    assert not decision.dearest
    assert "most expensive:" not in gate_text(decision)


def test_the_text_of_an_incomplete_gate_names_what_is_missing():
    (decision,) = ruled(rollouts("..e-"), parse_gate("violation_rate <= 0.1")).decisions
    assert "2 of 4 rollouts have no verdict" in gate_line(decision)
    assert gate_text(decision).splitlines()[-2:] == [
        "  no verdict: T, seed 2: the server is gone",
        "  no verdict: T, seed 3: not run to its end",
    ]


def test_what_is_undefined_is_said_to_be():
    (decision,) = ruled(rollouts("...."), parse_gate("violation_duration_s <= 1")).decisions
    assert gate_line(decision).endswith("p: undefined; undefined: no violation in 4 rollouts")


def test_a_comparison_is_a_row_and_flipped_rollouts_are_listed():
    before, now = "." * 30, "x" * 25 + "." * 5
    ruling = ruled(rollouts(now), before=rollouts(before))
    lines = ruling_lines(ruling)
    assert lines[1] == "p against p of runs/main"
    row = next(line for line in lines if line.strip().startswith("c *"))
    assert row.split()[:8] == ["c", "*", "REGRESSED", "30", "0.0", "%", "83.3", "%"]
    assert "  regressed  T, seed 0: a" in lines
    assert lines[-1] == "  and 5 more, all in summary.json"
    text = comparison_text(ruling.contrast.comparisons[0], ruling.contrast)
    assert text.startswith("REGRESSED  c, p: violated in 0.0 % before, 83.3 % now, +83.3 (")
    assert "against runs/main, policy p" in text
    assert "regressed  T, seed 0: a" in text


def test_what_no_rollout_triggered_has_no_rate_to_compare():
    def run(*triggered):
        outcomes = [verdict("a", "SATISFIED" if own else "VACUOUS", "A", own) for own in triggered]
        return [rollout(True, own, seed=seed) for seed, own in enumerate(outcomes)]

    def row(before, now):
        (line,) = [x for x in ruling_lines(ruled(now, before=before), width=200) if "A *" in x]
        return line.split()[3:]

    assert row(run(False, False), run(False, False)) == ["2", "never", "never", "-", "-", "-"]
    contrast = ruled(run(False, False), before=run(False, False)).contrast
    (own,) = [own for own in contrast.comparisons if own.name == "A"]
    assert "A, p: never triggered, neither before nor now, in 2 pairs" in comparison_text(
        own, contrast
    )
    assert row(run(True, False), run(False, False))[:5] == ["2", "0.0", "%", "never", "+0.0"]


def test_what_the_baseline_has_more_is_counted():
    lines = ruling_lines(ruled(rollouts(".."), before=rollouts("....")))
    assert "  2 of the baseline's 4 rollouts have no counterpart" in lines


def test_runs_that_cannot_be_compared_are_refused_with_the_difference():
    release = ReleaseGate(Gates(), summary([], "runs/main", semantics="paper"))
    ruling = release.rule(summary(rollouts("..")))
    assert ruling.refused
    assert "semantics is paper and timed" in " ".join(map(str.strip, ruling_lines(ruling)))
    assert ruling.failures() == ["baseline"]


def test_what_fails_the_run():
    ruling = ruled(
        rollouts("x" * 3 + "." * 27),
        parse_gate("violation_rate <= 0.05", "fails"),
        parse_gate("violation_rate <= 0.05 @0.99", "open"),
        parse_gate("violation_rate <= 0.05", "shown", required=False),
        parse_gate("violation_rate <= 0.5", "passes"),
        before=rollouts("." * 30),
    )
    assert ruling.failures() == ["fails-p", "open-p", "c-p"]
    assert ruling.failures(inconclusive=False) == ["fails-p"]
    json.dumps(ruling.to_json(), allow_nan=False)


def test_what_is_decided_on_eleven_policies_fits_eighty_columns():
    names = [f"checkpoint-{n}-of-eleven" for n in range(11)]
    before = [r for n in names for r in rollouts("." * 30, policy=n)]
    now = [r for n in names for r in rollouts("x." * 15, policy=n)]
    ruling = ruled(now, parse_gate("violation_rate[category=c] <= 5 % @0.95"), before=before)
    for lines in (ruling_lines(ruling), ruling_lines(ruling, width=40)):
        assert max(map(len, lines)) <= 80
        assert [sum(n in line for line in lines) for n in names] == [2] * 11
        assert not any(line.endswith(" ") for line in lines)


def test_a_gate_that_stand_ins_may_decide_begins_with_its_verdict():
    (decision,) = ruled(rollouts("..."), parse_gate("violation_rate <= 0.1")).decisions
    ruling = Ruling((dataclasses.replace(decision, comparable=False),))
    allowed = ruling_lines(ruling, standins=True)
    assert allowed[1] == "  PASS, NOT COMPARABLE: stand-in assets"
    assert ruling_lines(ruling)[1] == "  NOT COMPARABLE: stand-in assets (PASS)"
