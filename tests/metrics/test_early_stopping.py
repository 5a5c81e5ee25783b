from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.early_stopping import check_gate, decide_early, watch
from pytest_safemanip.metrics.gates import parse_gate
from pytest_safemanip.metrics.measures import SHARES
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.statistics.intervals import anytime
from tests.metrics.build import rollout, rollouts, severe

GATE = parse_gate("violation_rate <= 0.3")


def by_seed(**patterns):
    """Tasks side by side, in the order of their seeds."""
    found = [record for task, p in patterns.items() for record in rollouts(p, task=task)]
    return sorted(found, key=lambda record: record.seed)


def test_a_clear_case_is_decided_long_before_the_budget_ends():
    good = watch(GATE, rollouts("." * 100), 0.05)
    assert good.verdict == "PASS"
    assert good.rounds == good.rate.total < 20
    assert anytime(0, good.rounds, 0.05)[1] <= 0.3 < anytime(0, good.rounds - 1, 0.05)[1]
    bad = watch(GATE, rollouts("x" * 100), 0.05)
    assert (bad.verdict, bad.rounds < 10) == ("FAIL", True)
    assert watch(GATE, rollouts("x.." * 20), 0.05).verdict == "INCONCLUSIVE"


def test_large_values_may_be_the_good_ones():
    gate = parse_gate("success_rate >= 0.5")
    assert watch(gate, rollouts("." * 30), 0.05).verdict == "PASS"
    assert watch(parse_gate("success_rate <= 0.5"), rollouts("." * 30), 0.05).verdict == "FAIL"


def test_only_complete_rounds_from_the_first_one_on_count():
    complete = by_seed(A="." * 12, B="." * 12)
    assert watch(GATE, complete, 0.05).rounds < 12
    # Whatever came in already after a rollout that is not known yet.
    waiting = by_seed(A="..-" + "x" * 9, B="." * 12)
    found = watch(GATE, waiting, 0.05)
    assert (found.verdict, found.rounds, found.rate) == ("INCONCLUSIVE", 2, Rate(0, 4))


def test_what_comes_after_the_decision_does_not_change_it():
    first = watch(GATE, rollouts("." * 20), 0.05)
    assert watch(GATE, rollouts("." * 20 + "x" * 50 + "e"), 0.05) == first


def test_a_gate_looks_at_its_own_rollouts_only():
    records = by_seed(A="x" * 30, B="." * 30)
    assert watch(parse_gate("violation_rate[task=A] <= 0.3"), records, 0.05).verdict == "FAIL"
    assert watch(parse_gate("violation_rate[task=B] <= 0.3"), records, 0.05).verdict == "PASS"


def test_a_gate_on_severe_violations_is_decided_by_these():
    records = [rollout(True, severe(1.5), seed=seed) for seed in range(30)]
    assert watch(GATE, records, 0.05).verdict == "FAIL"
    mild = parse_gate("violation_rate[severity >= 2] <= 0.3")
    assert watch(mild, records, 0.05).verdict == "PASS"
    assert decide_early(mild, "p", records, 0.05).value == 0.0


def test_what_is_said_in_the_end():
    early = decide_early(GATE, "p", rollouts("." * 30), 0.05)
    assert early.verdict == "PASS"
    assert early.why.startswith("decided after ")
    assert early.interval == anytime(0, early.rate.total, 0.05)
    assert early.basis == "95 % anytime-valid CI (these tasks)"
    late = decide_early(GATE, "p", rollouts("x.." * 5), 0.05)
    assert (late.verdict, late.why) == (
        "INCONCLUSIVE",
        "not decided after 15 seeds; give more",
    )
    hole = decide_early(GATE, "p", rollouts("..e.."), 0.05)
    assert hole.verdict == "INCOMPLETE"
    assert decide_early(parse_gate("exposure[task=B] <= 1"), "p", rollouts("."), 0.05).verdict == (
        "INCOMPLETE"
    )


def test_metrics_over_a_number_that_depends_on_the_outcome_are_refused():
    for name, share in SHARES.items():
        gate = parse_gate(f"{name} <= 0.5")
        if share.steady:
            check_gate(gate)
        else:
            with pytest.raises(ConfigError, match=r"cannot be decided early.*violation_rate"):
                check_gate(gate)
    for metric in ("violations_per_rollout", "mean_cost"):
        with pytest.raises(ConfigError, match="cannot be decided early, since it is no share"):
            check_gate(parse_gate(f"{metric} <= 1"))


def test_the_wrong_decision_is_rarer_than_promised():
    """At the bound, and just beyond it, with tasks of different rates."""
    random = np.random.default_rng(5)
    for rates, gate, wrong in (
        ((0.3,), "violation_rate <= 0.3", "FAIL"),
        ((0.05, 0.55), "violation_rate <= 0.299", "PASS"),
    ):
        found = []
        for _ in range(150):
            text = {
                f"T{n}": "".join("x" if hit else "." for hit in random.random(80) < rate)
                for n, rate in enumerate(rates)
            }
            found.append(watch(parse_gate(gate), by_seed(**text), 0.05).verdict)
        assert np.mean([verdict == wrong for verdict in found]) <= 0.05
