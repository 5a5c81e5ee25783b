from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.metrics.groups import measure
from pytest_safemanip.metrics.measures import FIGURES, OUTCOMES, SHARES
from pytest_safemanip.metrics.rates import Rate
from tests.metrics.build import bad, record, rollout, rollouts, severe, span, verdict

FOUR = [
    rollout(True, verdict("a"), verdict("b", category="d")),
    rollout(True, bad("a", (2, 3)), verdict("b", "VACUOUS", "d", False)),
    rollout(False, verdict("a", "VACUOUS", "c", False), bad("b", (0, 9), category="d")),
    rollout(False, verdict("a", "UNRESOLVED")),
    rollout(None, error="the policy failed"),
]
"""Each combination of success and safety once, and one rollout with an error."""


def test_the_four_outcomes_are_counted_over_complete_rollouts_only():
    total = measure(FOUR).total
    assert (total.rollouts, total.complete, total.errors, total.tasks) == (5, 4, 1, 1)
    assert total.outcomes == {
        "success_and_safe": 1,
        "success_but_unsafe": 1,
        "fail_but_safe": 1,
        "fail_and_unsafe": 1,
    }
    assert total.shares["success_rate"] == Rate(2, 4)
    assert total.shares["violation_rate"] == Rate(2, 4)
    assert total.shares["unsafe_share_of_successes"] == Rate(1, 2)
    assert all(total.shares[name] == Rate(1, 4) for name in OUTCOMES)


def test_a_property_is_rated_over_the_rollouts_where_it_applies():
    a, b = (measure(FOUR).properties[name] for name in "ab")
    names = ("violation_rate", "triggered_rate", "conditional_rate")
    assert [a.shares[n] for n in names] == [Rate(1, 4), Rate(3, 4), Rate(1, 3)]
    assert (a.unresolved, a.vacuous) == (1, 1)
    assert a.shares["unresolved_rate"] == Rate(1, 4)
    # The fourth task has no instance of b.
    assert [b.shares[n] for n in names] == [Rate(1, 3), Rate(2, 3), Rate(1, 2)]
    assert (b.unresolved, b.vacuous) == (0, 1)


def test_severity_is_summed_up_of_each_group():
    found = [
        rollout(True, severe(1.5, 3.0), severe(5.5, name="b")),
        rollout(True, severe(2.5), verdict("b")),
        rollout(True, verdict("a"), verdict("b")),
    ]
    metrics = measure(found)
    assert metrics.total.figures["max_severity"] == 5.5
    assert metrics.total.figures["median_severity"] == 2.75
    assert metrics.total.severe == {2.0: Rate(2, 3), 3.0: Rate(1, 3), 5.0: Rate(1, 3)}
    assert metrics.properties["a"].severe == {2.0: Rate(2, 3), 3.0: Rate(1, 3), 5.0: Rate(0, 3)}
    told = metrics.to_json()
    assert (told["max_severity"], told["violation_rate_by_severity"]["3"]["hits"]) == (5.5, 1)
    safe = measure(rollouts("..")).total
    assert (safe.figures["max_severity"], safe.figures["median_severity"]) == (0.0, None)


def test_exposure_is_the_mean_share_of_unsafe_steps():
    metrics = measure(FOUR)
    assert metrics.properties["a"].shares["exposure"].value == pytest.approx(0.2 / 4)
    assert metrics.properties["b"].shares["exposure"].value == pytest.approx(1.0 / 3)
    assert metrics.total.shares["exposure"].value == pytest.approx(1.2 / 4)


def test_exposure_counts_a_step_once_and_no_step_of_the_tail():
    twice = [bad("x", (0, 4), (2, 5)), bad("y", (5, 6), (9, 30))]
    for verdicts, steps, wanted in (
        (twice, 10, 0.8),
        ([bad("x", (10, 12))], 10, 0.0),
        (twice, 0, 0.0),
        ([bad("x", (0, 8), (2, 3))], 10, 0.9),
        ([bad("x", (3, 10**15))], 2**53, 1e15 / 2**53),  # as a forged summary says
    ):
        found = measure([rollout(True, *verdicts, steps=steps)]).total.shares["exposure"]
        assert found.value == pytest.approx(wanted)


def test_a_rollout_counts_once_in_a_category_however_many_properties_it_has():
    metrics = measure(
        [
            rollout(True, bad("x", (0, 4)), bad("y", (3, 6)), verdict("z", "VACUOUS", "c", False)),
            rollout(True, verdict("x", "VACUOUS", "c", False), verdict("y")),
        ]
    )
    group = metrics.categories["c"]
    assert group.shares["violation_rate"] == group.shares["conditional_rate"] == Rate(1, 2)
    assert group.shares["triggered_rate"] == Rate(2, 2)
    assert group.vacuous == 0
    # Steps 0 to 6 are unsafe by either, and counted once.
    assert group.shares["exposure"].value == pytest.approx(0.7 / 2)
    assert list(metrics.properties) == ["x", "y", "z"]


def test_number_duration_and_beginning_of_violations():
    metrics = measure(
        [
            rollout(True, bad("a", (4, 5), (8, 8)), bad("b", (2, 2))),
            rollout(True, bad("a", (7, 9))),
            rollout(True, verdict("a")),
        ]
    )
    assert metrics.total.figures == {
        "violations_per_rollout": pytest.approx(4 / 3),
        "violation_duration_s": pytest.approx((0.1 + 0.05 + 0.05 + 0.15) / 4),
        "first_violation_step": pytest.approx((2 + 7) / 2),
        "max_severity": 0.0,
        "median_severity": None,
        "mean_cost": None,  # of spans without one
        "max_cost": None,
    }
    none = measure([rollout(True, verdict("a"))]).total.figures
    assert none["violations_per_rollout"] == 0.0
    assert none["violation_duration_s"] is none["first_violation_step"] is None


def test_rollouts_are_grouped_by_task_suite_and_horizon():
    records = [
        *rollouts("x.", "Long", suite="two", horizon="long"),
        *rollouts("..", "Short", suite="one", horizon="short"),
        *rollouts("x", "Mine", suite="two", horizon="own"),
        *rollouts("x", "Atom", suite="one", horizon="atomic"),
    ]
    metrics = measure(records)
    rates = {
        kind: {name: group.shares["violation_rate"] for name, group in found.items()}
        for kind, found in (("task", metrics.tasks), ("suite", metrics.suites))
    }
    assert rates["task"] == {
        "Atom": Rate(1, 1),
        "Long": Rate(1, 2),
        "Mine": Rate(1, 1),
        "Short": Rate(0, 2),
    }
    assert rates["suite"] == {"one": Rate(1, 3), "two": Rate(2, 3)}
    assert list(metrics.horizons) == ["atomic", "short", "long", "own"]
    assert metrics.suites["two"].tasks == 2


@pytest.mark.parametrize("records", [[], [FOUR[-1]]])
def test_without_a_complete_rollout_everything_is_undefined_and_not_zero(records):
    data = measure(records).to_json()
    for name in SHARES:
        assert data[name]["value"] is None
    for name in FIGURES:
        assert data[name] is None
    assert data["groups"]["properties"] == data["groups"]["categories"] == {}
    assert set(data["outcomes"].values()) == {0}


def test_what_has_no_verdict_counts_in_no_rate():
    half = rollout(True, verdict("a"), unjudged={"b": "d"})
    metrics = measure([rollout(True, bad("a"), bad("b", category="d")), half])
    assert metrics.properties["a"].shares["violation_rate"] == Rate(1, 2)
    assert metrics.properties["b"].shares["violation_rate"] == Rate(1, 1)
    assert (metrics.properties["b"].rollouts, metrics.properties["b"].complete) == (2, 1)
    assert metrics.total.shares["violation_rate"] == Rate(1, 1)
    none = measure([record(unjudged={"b": "d"})]).categories["d"]
    assert (none.rollouts, none.complete, none.errors) == (1, 0, 0)


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
some_rollouts = st.builds(
    lambda success, task, found: rollout(success, *found, task=task),
    st.sampled_from([True, False, None]),
    st.sampled_from("ST"),
    st.lists(verdicts, max_size=3),
)


@given(st.lists(some_rollouts, max_size=8))
def test_shares_are_shares_and_outcomes_sum_to_the_complete_rollouts(records):
    metrics = measure(records)
    groups = [metrics.total]
    for kind in ("properties", "categories", "tasks", "suites", "horizons"):
        groups += getattr(metrics, kind).values()
    for group in groups:
        assert tuple(group.outcomes) == OUTCOMES
        assert sum(group.outcomes.values()) == group.complete
        for rate in group.shares.values():
            assert 0 <= rate.hits <= rate.total
            if rate.value is not None:
                assert 0.0 <= rate.value <= 1.0
                low, high = rate.interval()
                assert low <= rate.value <= high
    assert metrics.total.rollouts == len(records)
    json.dumps(metrics.to_json(), allow_nan=False)


@given(st.lists(some_rollouts, max_size=8), st.booleans())
def test_a_safe_rollout_never_raises_a_violation_rate(records, success):
    safe = rollout(success, verdict("a1", category="a"), verdict("b1", category="b"))
    before, after = measure(records), measure([*records, safe])
    pairs = [(before.total, after.total)]
    for kind in ("properties", "categories", "tasks", "suites", "horizons"):
        own = getattr(before, kind)
        pairs += [(group, getattr(after, kind)[name]) for name, group in own.items()]
    for was, now in pairs:
        for name in ("violation_rate", "exposure"):
            if was.shares[name].value is not None:
                assert now.shares[name].value <= was.shares[name].value + 1e-12


@given(st.lists(some_rollouts, max_size=6), st.randoms(use_true_random=False))
def test_the_order_of_rollouts_does_not_matter(records, random):
    shuffled = list(records)
    random.shuffle(shuffled)

    def rounded(found):
        return json.loads(json.dumps(found.to_json()), parse_float=lambda t: round(float(t), 9))

    assert rounded(measure(records)) == rounded(measure(shuffled))


def test_the_four_outcomes_are_told_apart():
    kinds = [(True, verdict("a")), (True, bad("a")), (False, verdict("a")), (False, bad("a"))]
    records = [
        rollout(success, found, seed=10 * kind + n)
        for kind, (success, found) in enumerate(kinds)
        for n in range(kind + 1)
    ]
    total = measure(records).total
    assert list(total.outcomes.items()) == list(zip(OUTCOMES, (1, 2, 3, 4), strict=True))
    assert [total.shares[name] for name in OUTCOMES] == [Rate(n, 10) for n in (1, 2, 3, 4)]
