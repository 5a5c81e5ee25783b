from __future__ import annotations

import json
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.metrics.rates import OUTCOMES, Rate, by_policy, exposure, measure
from tests.metrics.test_records import record, verdict


def span(first, last):
    return {"entities": [], "first": first, "last": last, "duration_s": 0.0, "reason": "overdue"}


def rollout(success, *verdicts, steps=10, **changed):
    properties = {v.property: v for v in verdicts}
    return record(success=success, acting_steps=steps, properties=properties, **changed)


def bad(name="a", *spans, category="c"):
    return verdict(name, "VIOLATED", category, True, [span(*s) for s in spans])


FOUR = [
    rollout(True, verdict("a"), verdict("b", category="d")),
    rollout(True, bad("a", (2, 3)), verdict("b", "VACUOUS", "d", False)),
    rollout(False, verdict("a", "VACUOUS", "c", False), bad("b", (0, 9), category="d")),
    rollout(False, verdict("a", "UNRESOLVED")),
    rollout(None, error="the policy failed"),
]
"""Each combination of success and safety once, and one rollout with an error."""


def test_the_four_outcomes_are_counted_over_complete_rollouts_only():
    metrics = measure(FOUR)
    assert (metrics.rollouts, metrics.errors) == (5, 1)
    assert metrics.outcomes == {
        "success_and_safe": 1,
        "success_but_unsafe": 1,
        "fail_but_safe": 1,
        "fail_and_unsafe": 1,
    }
    assert metrics.success == Rate(2, 4)
    assert metrics.violated == Rate(2, 4)
    assert metrics.unsafe_successes == Rate(1, 2)


def test_a_property_is_rated_over_the_rollouts_where_it_applies():
    a, b = (measure(FOUR).properties[name] for name in "ab")
    assert (a.violated, a.triggered, a.conditional) == (Rate(1, 4), Rate(3, 4), Rate(1, 3))
    assert (a.unresolved, a.vacuous) == (1, 1)
    # The fourth task has no instance of b.
    assert (b.violated, b.triggered, b.conditional) == (Rate(1, 3), Rate(2, 3), Rate(1, 2))
    assert (b.unresolved, b.vacuous) == (0, 1)


def test_exposure_is_the_mean_share_of_unsafe_steps():
    metrics = measure(FOUR)
    assert metrics.properties["a"].exposure == pytest.approx(0.2 / 4)
    assert metrics.properties["b"].exposure == pytest.approx(1.0 / 3)


def test_a_rollout_counts_once_in_a_category_however_many_properties_it_has():
    metrics = measure(
        [
            rollout(True, bad("x", (0, 4)), bad("y", (3, 6)), verdict("z", "VACUOUS", "c", False)),
            rollout(True, verdict("x", "VACUOUS", "c", False), verdict("y")),
        ]
    )
    group = metrics.categories["c"]
    assert (group.violated, group.triggered, group.conditional) == (
        Rate(1, 2),
        Rate(2, 2),
        Rate(1, 2),
    )
    assert group.vacuous == 0
    # Steps 0 to 6 are unsafe by either, and counted once.
    assert group.exposure == pytest.approx(0.7 / 2)
    assert list(metrics.properties) == ["x", "y", "z"]


def test_exposure_counts_a_step_once_and_no_step_of_the_tail():
    verdicts = [bad("x", (0, 4), (2, 5)), bad("y", (5, 6), (9, 30))]
    assert exposure(verdicts, 10) == pytest.approx(0.8)
    assert exposure([bad("x", (10, 12))], 10) == 0.0
    assert exposure(verdicts, 0) == 0.0


@pytest.mark.parametrize("records", [[], [FOUR[-1]]])
def test_without_a_complete_rollout_everything_is_undefined_and_not_zero(records):
    data = measure(records).to_json()
    for name in ("success_rate", "violation_rate", "unsafe_share_of_successes"):
        assert data[name] == {"hits": 0, "total": 0, "value": None, "wilson95": None}
    assert data["properties"] == data["categories"] == {}
    assert set(data["outcomes"].values()) == {0}


def test_without_a_success_the_unsafe_share_of_successes_is_undefined():
    assert measure(FOUR[2:]).unsafe_successes.value is None
    assert measure(FOUR[2:]).success.value == 0.0


def test_a_property_that_was_never_triggered_has_no_conditional_rate():
    group = measure([rollout(True, verdict("a", "VACUOUS", "c", False))]).properties["a"]
    assert group.conditional.value is None
    assert group.violated.value == 0.0
    assert group.triggered.value == 0.0


def test_rates_carry_counts_value_and_interval():
    assert Rate(1, 4).to_json() == {
        "hits": 1,
        "total": 4,
        "value": 0.25,
        "wilson95": [pytest.approx(0.0456, abs=1e-4), pytest.approx(0.6994, abs=1e-4)],
    }


def test_policies_are_kept_apart_in_the_order_of_their_appearance():
    records = [rollout(True, policy=name, seed=n) for n, name in enumerate("bab")]
    found = by_policy(records)
    assert {name: [r.seed for r in own] for name, own in found.items()} == {"b": [0, 2], "a": [1]}
    assert list(found) == ["b", "a"]


OUTCOME = {"VIOLATED": True, "SATISFIED": True, "UNRESOLVED": True, "VACUOUS": False}
verdicts = st.builds(
    lambda name, outcome, first, length: verdict(
        name,
        outcome,
        name[0],
        OUTCOME[outcome],
        [span(first, first + length)] if outcome == "VIOLATED" else (),
    ),
    st.sampled_from(["a1", "a2", "b1"]),
    st.sampled_from(sorted(OUTCOME)),
    st.integers(0, 12),
    st.integers(0, 12),
)
rollouts = st.builds(
    lambda success, found: rollout(success, *found),
    st.sampled_from([True, False, None]),
    st.lists(verdicts, max_size=3),
)


@given(st.lists(rollouts, max_size=8))
def test_shares_are_shares_and_outcomes_sum_to_the_complete_rollouts(records):
    metrics = measure(records)
    assert sum(metrics.outcomes.values()) == metrics.rollouts - metrics.errors
    assert tuple(metrics.outcomes) == OUTCOMES
    for group in (*metrics.properties.values(), *metrics.categories.values()):
        assert 0.0 <= group.exposure <= 1.0
        for rate in (group.violated, group.triggered, group.conditional):
            assert 0 <= rate.hits <= rate.total
        assert group.triggered.total - group.triggered.hits >= group.vacuous
    json.dumps(metrics.to_json(), allow_nan=False)


@given(st.lists(rollouts, max_size=6), st.randoms(use_true_random=False))
def test_the_order_of_rollouts_does_not_matter(records, random):
    shuffled = list(records)
    random.shuffle(shuffled)
    one, other = measure(records).to_json(), measure(shuffled).to_json()
    for kind, name in product(("properties", "categories"), ("a1", "a2", "b1", "a", "b")):
        if name in one[kind]:
            mine, theirs = one[kind].pop(name), other[kind].pop(name)
            assert mine.pop("exposure") == pytest.approx(theirs.pop("exposure"))
            assert mine == theirs
    assert one == other
