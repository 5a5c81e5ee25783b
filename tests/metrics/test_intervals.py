from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.metrics.intervals import wilson


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


def test_without_a_trial_there_is_no_interval():
    assert wilson(0, 0) is None


cases = st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))


@given(cases)
def test_the_interval_holds_the_rate_within_zero_and_one(case):
    hits, total = case
    low, high = wilson(hits, total)
    assert 0.0 <= low <= hits / total <= high <= 1.0
    assert low < high


@given(cases)
def test_hits_and_misses_are_treated_alike(case):
    hits, total = case
    low, high = wilson(hits, total)
    assert wilson(total - hits, total) == pytest.approx((1 - high, 1 - low))


@given(cases)
def test_more_trials_or_less_confidence_make_it_narrower(case):
    hits, total = case

    def width(bounds):
        return bounds[1] - bounds[0]

    assert width(wilson(4 * hits, 4 * total)) < width(wilson(hits, total))
    assert width(wilson(hits, total, 0.8)) < width(wilson(hits, total))
