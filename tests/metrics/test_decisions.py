from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.metrics.decisions import MOST, _fewest, decide, further, side
from pytest_safemanip.metrics.gates import parse_gate
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.statistics.intervals import clustered, wilson
from tests.metrics.build import bad, rollout, rollouts, severe, verdict


def decided(text, *groups):
    return decide(parse_gate(text), "p", [record for group in groups for record in group])


@pytest.mark.parametrize(
    ("text", "pattern", "wanted"),
    [
        ("violation_rate <= 0.3", "xxx.......", "PASS"),
        ("violation_rate < 0.3", "xxx.......", "FAIL"),
        ("violation_rate <= 0.1 @0.95", "." * 40, "PASS"),
        ("violation_rate <= 0.1 @0.95", "." * 10, "INCONCLUSIVE"),
        ("violation_rate <= 0.1 @0.95", "x" * 10, "FAIL"),
        ("success_rate >= 0.5 @0.95", "." * 10, "PASS"),
        ("success_rate >= 0.99 @0.95", "." * 10, "INCONCLUSIVE"),
        ("success_rate <= 0.1 @0.95", "." * 10, "FAIL"),
        ("violations_per_rollout <= 0.4", "xx...", "PASS"),
        ("violations_per_rollout <= 0.3", "xx...", "FAIL"),
    ],
)
def test_the_point_estimate_or_the_interval_decides(text, pattern, wanted):
    assert decided(text, rollouts(pattern)).verdict == wanted


def of_packs():
    """Rollouts of a rule of each of two packs and one of none, the second without a verdict."""
    packs = {"house_a": "house", "ward_b": "ward"}
    first = (bad("house_a"), verdict("ward_b"), verdict("own"))
    return [
        rollout(True, *first, packs=packs),
        rollout(True, verdict("house_a"), seed=1, unjudged={"ward_b": "c"}, packs=packs),
        rollout(True, bad("own"), seed=2),
    ]


@pytest.mark.parametrize(
    ("where", "wanted", "value"),
    [
        ("pack=house", "FAIL", 1 / 2),
        ("pack=ward", "INCOMPLETE", 0.0),
        ("pack=ward,task=U", "INCOMPLETE", None),
        ("pack=default", "FAIL", 1 / 2),
        ("pack=h*,property=house_*,category=c", "FAIL", 1 / 2),
        ("pack=house,property=own", "INCOMPLETE", None),
        ("pack=*", "INCOMPLETE", 1.0),
    ],
)
def test_a_gate_may_be_about_the_rules_of_a_pack_or_about_those_of_none(where, wanted, value):
    found = decided(f"violation_rate[{where}] <= 5 %", of_packs())
    assert (found.verdict, found.value) == (wanted, value)


SEVERITIES = [(1.2, 2.0), (1.4,), (5.0,), (), ()]
"""Of the violations of five rollouts."""


def measured():
    return [
        rollout(True, severe(*own) if own else verdict(), seed=seed)
        for seed, own in enumerate(SEVERITIES)
    ]


@pytest.mark.parametrize(
    ("text", "value", "wanted"),
    [
        ("violation_rate <= 0.5", 0.6, "FAIL"),
        ("violation_rate[severity >= 2] <= 0.5", 0.4, "PASS"),
        ("violation_rate[severity > 2] <= 0.1", 0.2, "FAIL"),
        ("violation_rate[severity > 5] <= 0", 0.0, "PASS"),
        ("violation_rate[property=a,severity >= 2] <= 0.4", 0.4, "PASS"),
        ("conditional_rate[severity >= 2] <= 0.4", 0.4, "PASS"),
        ("unsafe_share_of_successes[severity >= 3] <= 0.2", 0.2, "PASS"),
        ("success_and_safe[severity >= 3] >= 0.8", 0.8, "PASS"),
        ("violations_per_rollout[severity >= 2] <= 0.4", 0.4, "PASS"),
        ("exposure[severity >= 5] <= 0.04", 0.04, "PASS"),
        ("mean_cost <= 5", 9.6 / 5, "PASS"),
        ("max_cost[property=a] <= 2", 5.0, "FAIL"),
        ("max_cost[severity >= 6] <= 2", 0.0, "PASS"),
        ("intervention_share <= 0.4", 0.48, "FAIL"),
        ("max_severity <= 4", 5.0, "FAIL"),
        ("max_severity[severity >= 6] <= 4", 0.0, "PASS"),
        ("median_severity <= 1.7", 1.7, "PASS"),
        ("median_severity[severity >= 2] <= 3", 3.5, "FAIL"),
    ],
)
def test_a_gate_counts_what_is_severe_enough(text, value, wanted):
    found = decided(text, measured())
    assert (found.value, found.verdict) == (pytest.approx(value), wanted)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("violation_rate[severity >= 2] <= 0.5", "severity"),
        ("max_severity <= 2", "severity"),
        ("mean_cost <= 5", "cost"),
        ("max_cost[property=a] <= 25", "cost"),
    ],
)
def test_violations_of_an_earlier_version_have_nothing_to_decide_by(text, what):
    found = decided(text, rollouts("x...."))
    assert found.verdict == "INCOMPLETE"
    assert f"violations have no {what} in what an earlier version has written" in found.why
    assert decided(text, rollouts(".....")).verdict == "PASS"


def test_the_interval_for_tasks_like_these_is_chosen_by_name():
    groups = [rollouts("." * 40, task=name) for name in "ABC"]
    these = decided("violation_rate <= 0.1 @0.95", *groups)
    alike = decided("violation_rate <= 0.1 @0.95 clustered", *groups)
    assert these.verdict == "PASS"
    assert these.interval == wilson(0, 120)
    assert these.basis == "95 % CI (these tasks)"
    assert alike.verdict == "INCONCLUSIVE"
    assert alike.interval == clustered([(0, 40)] * 3)
    assert alike.basis == "95 % CI (new tasks, clustered)"
    assert "more tasks would likely decide it" in alike.why
    one = decided("violation_rate <= 0.1 @0.95 clustered", groups[0])
    assert (one.verdict, one.why) == (
        "INCONCLUSIVE",
        "a clustered interval needs at least two tasks",
    )


@pytest.mark.parametrize("confidence", ["", " @0.95"])
@pytest.mark.parametrize("hole", ["e", "-"])
def test_what_has_no_verdict_makes_a_gate_incomplete_however_good_the_rest_is(hole, confidence):
    found = decided(f"violation_rate <= 0.9{confidence}", rollouts("." * 60 + hole))
    assert found.verdict == "INCOMPLETE"
    assert found.value == 0.0
    assert "1 of 61 rollouts have no verdict, the first being T, seed 60" in found.why
    assert ("the server is gone" in found.why) == (hole == "e")
    assert [record.seed for record in found.unknown] == [60]


def test_infrastructure_is_blamed_for_what_it_left_undecided_alone():
    failed = dataclasses.replace(rollouts("e")[0], infrastructure=True)
    rest = rollouts(".", task="B")
    assert decided("violation_rate <= 0.1", [failed, *rest]).blames_infrastructure
    known = decided("violation_rate <= 0.1", rest)
    assert (known.verdict, known.blames_infrastructure) == ("PASS", False)
    assert not decided("violation_rate <= 0.1", [*rollouts("e"), *rest]).blames_infrastructure


def test_a_hole_that_a_gate_is_not_about_does_not_matter_to_it():
    records = [*rollouts("....", task="A"), *rollouts("..e.", task="B")]
    assert decided("violation_rate[task=A] <= 0.1", records).verdict == "PASS"
    assert decided("violation_rate[task=B] <= 0.1", records).verdict == "INCOMPLETE"
    half = rollout(True, verdict("a"), unjudged={"b": "d"})
    assert decided("violation_rate[property=a] <= 0.1", [half]).verdict == "PASS"
    assert decided("violation_rate[category=d] <= 0.1", [half]).verdict == "INCOMPLETE"


def test_a_gate_about_nothing_is_incomplete():
    assert decided("violation_rate[task=B] <= 0.1", rollouts("...")).verdict == "INCOMPLETE"
    assert decided("violation_rate[category=d] <= 0.1", rollouts("...")).verdict == "INCOMPLETE"


def test_what_is_undefined_is_inconclusive_and_neither_kept_nor_broken():
    failed = [rollout(False, verdict("a", "VACUOUS", triggered=False))]
    for text, why in (
        ("unsafe_share_of_successes <= 0.1", "undefined: no success in 1 rollouts"),
        ("conditional_rate <= 0.1 @0.95", "undefined: no property was triggered in 1 rollouts"),
        ("violation_duration_s <= 1", "undefined: no violation in 1 rollouts"),
    ):
        found = decided(text, failed)
        assert (found.verdict, found.value, found.why) == ("INCONCLUSIVE", None, why)


def test_a_decision_is_plain_data():
    found = decided("violation_rate[category=c] <= 0.1 @0.95", rollouts("x..")).to_json()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert (found["verdict"], found["hits"], found["total"]) == ("INCONCLUSIVE", 1, 3)


def test_how_many_more_rollouts_is_what_simulation_says():
    gate = parse_gate("violation_rate <= 0.1 @0.95")
    for hits, total in ((0, 5), (3, 60), (15, 100)):
        more = further(gate, Rate(hits, total), 0.95)
        random = np.random.default_rng(0)

        def likely(count, hits=hits, total=total, random=random):
            drawn = hits + random.binomial(count, hits / total, size=4000)
            bounds = [wilson(int(h), total + count) for h in drawn]
            return np.mean([high <= 0.1 or low > 0.1 for low, high in bounds])

        assert likely(more) >= 0.77
        assert likely(max(more // 2, 1)) < 0.8
    assert further(gate, Rate(10, 100), 0.95) is None


@given(st.text("x.", min_size=1, max_size=40), st.sampled_from([0.05, 0.2, 0.5, 0.9]))
def test_both_sides_of_a_bound_never_pass_together(pattern, bound):
    low = decided(f"violation_rate <= {bound} @0.95", rollouts(pattern)).verdict
    high = decided(f"violation_rate > {bound} @0.95", rollouts(pattern)).verdict
    opposite = {"PASS": "FAIL", "FAIL": "PASS", "INCONCLUSIVE": "INCONCLUSIVE"}
    assert high == opposite[low]


@pytest.mark.parametrize(
    ("text", "interval", "verdict"),
    [
        ("violation_rate <= 0.3", (0.1, 0.3), "PASS"),
        ("violation_rate <= 0.3", (0.1, 0.31), "INCONCLUSIVE"),
        ("violation_rate <= 0.3", (0.3, 0.5), "INCONCLUSIVE"),
        ("violation_rate <= 0.3", (0.31, 0.5), "FAIL"),
        ("violation_rate < 0.3", (0.1, 0.3), "INCONCLUSIVE"),
        ("violation_rate < 0.3", (0.3, 0.5), "FAIL"),
        ("success_rate >= 0.3", (0.3, 0.5), "PASS"),
        ("success_rate >= 0.3", (0.29, 0.5), "INCONCLUSIVE"),
        ("success_rate >= 0.3", (0.1, 0.3), "INCONCLUSIVE"),
        ("success_rate >= 0.3", (0.1, 0.29), "FAIL"),
        ("success_rate > 0.3", (0.3, 0.5), "INCONCLUSIVE"),
        ("success_rate > 0.3", (0.1, 0.3), "FAIL"),
    ],
)
def test_an_interval_decides_where_all_of_it_is_on_one_side_of_the_bound(text, interval, verdict):
    assert side(parse_gate(text), interval) == verdict


Z = 1.959964
"""Of 95 %; its square is 3.8415."""


@pytest.mark.parametrize(
    ("text", "hits", "total", "more"),
    [
        # Without a hit Wilson's upper bound is z^2 / (n + z^2): at most 0.1 from 9 z^2 = 34.6 on.
        ("violation_rate <= 0.1 @0.95", 0, 5, 30),
        ("violation_rate <= 0.1 @0.95", 0, 34, 1),
        # With nothing but hits the lower one is n / (n + z^2): more than 0.5 from z^2 = 3.84 on.
        ("violation_rate <= 0.5 @0.95", 1, 1, 3),
        # More than 0.9 from 9 z^2 on.
        ("success_rate >= 0.9 @0.95", 10, 10, 25),
        ("success_rate >= 0.9 @0.95", 0, 1, None),
    ],
)
def test_how_many_more_rollouts_where_all_are_alike(text, hits, total, more):
    if more is None:  # none is needed: at 0 of 1 the upper bound is z^2 / (1 + z^2) = 0.79
        assert side(parse_gate(text), wilson(hits, total)) == "FAIL"
    else:
        assert further(parse_gate(text), Rate(hits, total), 0.95) == more


@pytest.mark.parametrize(("text", "hits"), [("<= 0.2", 15), ("> 0.2", 15), ("<= 0.1", 15)])
def test_how_many_more_rollouts_is_the_fewest_that_decide_with_four_in_five(text, hits):
    """Against adding up the probabilities of all numbers of further hits."""
    from scipy.stats import binom

    gate, total = parse_gate(f"violation_rate {text} @0.95"), 100
    share = hits / total

    def chance(more):
        goal = side(gate, wilson(share * (total + more), total + more))
        if goal == "INCONCLUSIVE":
            return 0.0
        new = np.arange(more + 1)
        said = np.array([side(gate, wilson(hits + k, total + more)) == goal for k in new.tolist()])
        return float(binom.pmf(new, more, share)[said].sum())

    more = further(gate, Rate(hits, total), 0.95)
    assert chance(more) >= 0.8
    assert chance(more - 1) < 0.8


def test_tasks_of_which_more_would_decide():
    # In each of two tasks half of the rollouts violate: no spread, so each says as much as one
    # rollout. Of n like these the interval is Wilson's of n / 2 in n: its upper bound is at most
    # 0.7 from (0.25 - 0.04) z^2 / 0.04 = 20.2 on.
    groups = [rollouts("x.x.", task=name) for name in "AB"]
    found = decided("violation_rate <= 0.7 @0.95 clustered", *groups)
    assert found.verdict == "INCONCLUSIVE"
    assert found.why == "about 19 more tasks would likely decide it, if the rate stays"
    at_bound = decided("violation_rate < 0.5 @0.95 clustered", *groups)
    assert at_bound.why.startswith(f"the rate is at the bound: {MOST} more tasks would not be")


@pytest.mark.parametrize("least", [1, 2, 3, 4, 5, 8, 9, 1000, 2**19])
def test_the_fewest_that_is_enough(least):
    asked = []

    def enough(count):
        asked.append(count)
        return count >= least

    assert _fewest(enough) == least
    assert len(asked) < 50
    assert min(asked) >= 1


def test_nobody_runs_more_than_a_million():
    asked = []
    assert _fewest(lambda count: bool(asked.append(count))) is None
    assert max(asked) <= MOST


def test_the_first_rollout_without_a_verdict_is_named():
    why = decided("violation_rate <= 0.9", rollouts("..e.-")).why
    assert why.startswith("2 of 5 rollouts have no verdict, the first being T, seed 2:")
