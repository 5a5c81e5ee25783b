from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import betabinom, binom, binomtest, norm, t

from pytest_safemanip.metrics.statistics.intervals import (
    anytime,
    below,
    clustered,
    evidence,
    wilson,
)


@pytest.mark.parametrize(
    ("hits", "total", "low", "high"),
    [
        # Newcombe 1998, table I, method 3: Wilson without continuity correction.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_the_interval_is_the_published_one(hits, total, low, high):
    assert wilson(hits, total) == pytest.approx((low, high), abs=5e-5)


cases = st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))
confidences = st.sampled_from([0.8, 0.9, 0.95, 0.99])


@given(cases, confidences)
def test_scipy_gives_the_same_interval(case, confidence):
    wanted = binomtest(*case).proportion_ci(confidence, method="wilson")
    assert wilson(*case, confidence) == pytest.approx((wanted.low, wanted.high), abs=1e-9)


@given(st.integers(1, 500), confidences)
def test_scipy_gives_the_same_bound_after_no_hit(total, confidence):
    wanted = binomtest(0, total, alternative="less").proportion_ci(confidence, method="exact")
    assert below(total, confidence) == pytest.approx(wanted.high)


@given(cases)
def test_the_interval_holds_the_rate_within_zero_and_one(case):
    hits, total = case
    low, high = wilson(hits, total)
    assert 0.0 <= low <= hits / total <= high <= 1.0
    assert low < high


@given(cases)
def test_hits_and_misses_are_treated_alike(case):
    hits, total = case
    for interval in (wilson, anytime):
        low, high = interval(hits, total)
        assert interval(total - hits, total) == pytest.approx((1 - high, 1 - low))


@given(cases)
def test_more_trials_or_less_confidence_make_it_narrower(case):
    hits, total = case

    def width(bounds):
        return bounds[1] - bounds[0]

    assert width(wilson(4 * hits, 4 * total)) < width(wilson(hits, total))
    assert width(wilson(hits, total, 0.8)) < width(wilson(hits, total))


@given(cases, st.integers(1, 9))
def test_it_does_not_matter_how_many_hits_are_written_as_shares(case, parts):
    """Means of values in [0, 1] have the interval of hits and misses with the same mean."""
    hits, total = case
    assert wilson(sum([hits / parts] * parts), total) == pytest.approx(wilson(hits, total))


def test_two_tasks_at_least():
    assert clustered([]) is None
    assert clustered([(3, 10)]) is None
    assert clustered([(3, 10), (0, 0)]) is None
    assert clustered([(3, 10), (4, 10)]) is not None


tasks = st.lists(
    st.integers(1, 30).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))),
    min_size=2,
    max_size=12,
)


@given(tasks, confidences)
def test_tasks_like_these_are_never_better_known_than_these_tasks(found, confidence):
    hits, total = (sum(column) for column in zip(*found, strict=True))
    low, high = clustered(found, confidence)
    narrow = wilson(hits, total, confidence)
    assert low <= narrow[0] + 1e-12
    assert high >= narrow[1] - 1e-12


@given(tasks)
def test_order_and_empty_tasks_do_not_matter(found):
    assert clustered([(0, 0), *reversed(found)]) == pytest.approx(clustered(found))


def test_a_task_without_spread_says_no_more_than_one_rollout():
    # Nothing is known about how tasks differ where none has a hit.
    assert clustered([(0, 50)] * 5) == pytest.approx(wilson(0, 5))


def drawn(random, icc, mean, tasks, rollouts):
    """Hits of tasks whose rates are spread so that rollouts of one correlate by ``icc``."""
    weight = 1 / icc - 1
    rates = random.beta(mean * weight, (1 - mean) * weight, size=tasks)
    return [(int(hits), rollouts) for hits in random.binomial(rollouts, rates)]


def covered(interval, mean, runs):
    found = [interval(run) for run in runs]
    return np.mean([low <= mean <= high for low, high in found])


def test_tasks_like_these_are_covered_where_pooled_rollouts_miss():
    """50 tasks of 50 rollouts whose rates differ as those of the paper do."""
    random = np.random.default_rng(1)
    runs = [drawn(random, 0.33, 0.3, 50, 50) for _ in range(2000)]
    assert 0.93 <= covered(clustered, 0.3, runs) <= 0.97
    pooled = covered(lambda run: wilson(sum(h for h, _ in run), 2500), 0.3, runs)
    assert 0.32 <= pooled <= 0.40


@pytest.mark.parametrize("mean", [0.01, 0.05])
@pytest.mark.parametrize("count", [5, 20, 50])
def test_rare_hits_in_few_tasks_are_covered_too(mean, count):
    random = np.random.default_rng(2)
    runs = [drawn(random, 0.33, mean, count, 10) for _ in range(1000)]
    assert covered(clustered, mean, runs) >= 0.93


@given(st.integers(0, 60), st.integers(1, 60), st.floats(0.05, 0.95))
def test_evidence_is_the_likelihood_ratio_of_the_mixture(hits, misses, value):
    total = hits + misses
    mixture = betabinom(total, 1, 1).pmf(hits)
    likelihood = binom(total, value).pmf(hits)
    assert np.exp(evidence(hits, total, value)) == pytest.approx(mixture / likelihood)


@given(st.integers(0, 200).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_anytime_interval_is_where_the_evidence_is_small(case):
    hits, total = case
    low, high = anytime(hits, total, 0.05)
    assert 0 <= low <= high <= 1
    if total:
        assert low <= hits / total <= high
        for bound, beyond in ((low, low - 1e-6), (high, high + 1e-6)):
            if 0 < bound < 1:
                assert evidence(hits, total, bound) == pytest.approx(np.log(20), abs=1e-6)
                assert evidence(hits, total, beyond) > np.log(20)


def test_looking_after_every_rollout_misses_no_more_often_than_promised():
    random = np.random.default_rng(3)
    for rate in (0.05, 0.3):
        hits = (random.random((1000, 200)) < rate).cumsum(axis=1)
        totals = np.arange(1, 201)
        ever = [
            any(
                evidence(int(h), int(n), rate) > np.log(20)
                for h, n in zip(row, totals, strict=True)
            )
            for row in hits
        ]
        assert np.mean(ever) <= 0.05
        # A fixed-n interval that is looked at as often misses six times as often as it says.
        peeked = [
            any(
                not wilson(int(h), int(n))[0] <= rate <= wilson(int(h), int(n))[1]
                for h, n in zip(row[9:], totals[9:], strict=True)
            )
            for row in hits[:300]
        ]
        assert np.mean(peeked) > 0.2


def test_rounds_of_tasks_with_different_rates_are_covered_as_well():
    random = np.random.default_rng(4)
    rates = np.array([0.0, 0.05, 0.1, 0.2, 0.9])
    hits = (random.random((1000, 60, 5)) < rates).sum(axis=2).cumsum(axis=1)
    totals = 5 * np.arange(1, 61)
    mean = rates.mean()
    ever = [
        any(evidence(int(h), int(n), mean) > np.log(20) for h, n in zip(row, totals, strict=True))
        for row in hits
    ]
    assert np.mean(ever) <= 0.05


@pytest.mark.parametrize("misses", [False, True])
@pytest.mark.parametrize(("telling", "student"), [(4, False), (5, True), (6, True)])
def test_with_hits_or_misses_in_five_tasks_their_spread_is_estimated(telling, student, misses):
    # Eight tasks of ten rollouts; so many of them have one that is unlike all others. By hand, with
    # the share p = telling / 80 or 1 - p: the variance of the ratio between tasks is
    # 8/7 / 80^2 times the sum of (h - 10 p)^2.
    tasks = [(10 - hit if misses else hit, 10) for hit in [1] * telling + [0] * (8 - telling)]
    share = telling / 80
    spread = (telling * (1 - 10 * share) ** 2 + (8 - telling) * (10 * share) ** 2) * 8 / 7 / 6400
    if student:
        effective, quantile = min(share * (1 - share) / spread, 80), t.ppf(0.975, 7)
    else:
        effective, quantile = min(share * (1 - share) / spread, 8), norm.ppf(0.975)
    weight = quantile**2 / effective
    centre = (share + weight / 2) / (1 + weight)
    half = quantile / (1 + weight) * np.sqrt((share * (1 - share) + weight / 4) / effective)
    wanted = (centre - half, centre + half)
    wanted = (1 - wanted[1], 1 - wanted[0]) if misses else wanted
    assert clustered(tasks) == pytest.approx(wanted, abs=1e-9)


def test_the_spread_between_tasks_is_that_of_a_sample_of_tasks():
    # Of six tasks with ten rollouts each 40 % are hits; tasks are off by -3, -2, -1, 0, 1 and 5:
    # 40 * 6/5 / 60^2 = 1/75. So 60 rollouts say what 0.4 * 0.6 * 75 = 18 independent ones would.
    found = clustered([(1, 10), (2, 10), (3, 10), (4, 10), (5, 10), (9, 10)])
    # Student's t with five degrees of freedom, in Wilson's interval of 7.2 hits in 18.
    weight = t.ppf(0.975, 5) ** 2 / 18
    half = t.ppf(0.975, 5) * np.sqrt((0.24 + weight / 4) / 18)
    wanted = [(0.4 + weight / 2 + way * half) / (1 + weight) for way in (-1, 1)]
    assert found == pytest.approx(wanted, abs=1e-9)
