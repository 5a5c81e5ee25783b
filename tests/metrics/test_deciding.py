from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.metrics.deciding import decide, further
from pytest_safemanip.metrics.gates import parse_gate
from pytest_safemanip.metrics.intervals import clustered, wilson
from pytest_safemanip.metrics.rates import Rate
from tests.metrics.build import rollout, rollouts, verdict


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


def test_the_interval_for_tasks_like_these_is_chosen_by_name():
    groups = [rollouts("." * 40, task=name) for name in "ABC"]
    these = decided("violation_rate <= 0.1 @0.95", *groups)
    alike = decided("violation_rate <= 0.1 @0.95 clustered", *groups)
    assert these.verdict == "PASS"
    assert these.interval == wilson(0, 120)
    assert these.basis == "at 95 %, for these tasks"
    assert alike.verdict == "INCONCLUSIVE"
    assert alike.interval == clustered([(0, 40)] * 3)
    assert alike.basis == "at 95 %, for tasks like these"
    assert "more tasks like these would likely decide it" in alike.why
    one = decided("violation_rate <= 0.1 @0.95 clustered", groups[0])
    assert (one.verdict, one.why) == ("INCONCLUSIVE", "tasks like these need two tasks at least")


@pytest.mark.parametrize("confidence", ["", " @0.95"])
@pytest.mark.parametrize("hole", ["e", "-"])
def test_what_has_no_verdict_makes_a_gate_incomplete_however_good_the_rest_is(hole, confidence):
    found = decided(f"violation_rate <= 0.9{confidence}", rollouts("." * 60 + hole))
    assert found.verdict == "INCOMPLETE"
    assert found.value == 0.0
    assert "1 of 61 rollouts have no verdict, the first being T, seed 60" in found.why
    assert ("the server is gone" in found.why) == (hole == "e")
    assert [record.seed for record in found.unknown] == [60]


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
        ("conditional_rate <= 0.1 @0.95", "undefined: nothing was put to the test in 1 rollouts"),
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
