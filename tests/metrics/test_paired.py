from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom, multivariate_normal, norm

from pytest_safemanip.metrics.statistics.paired import (
    Pairs,
    benjamini_hochberg,
    detectable,
    holm,
    mcnemar,
    newcombe,
    power,
)

counts = st.integers(0, 40)
pairs = st.builds(Pairs, counts, counts, counts, counts).filter(lambda found: found.total > 0)


def test_the_published_example():
    """Bronchial hyperresponsiveness before and after (Fagerland, Lydersen and Laake 2013, 2014)."""
    found = Pairs(both=1, fixed=1, regressed=7, neither=12)
    assert 2 * mcnemar(found) == pytest.approx(0.0391, abs=5e-5)
    assert newcombe(found, 0.95) == pytest.approx((0.026, 0.507), abs=5e-4)


@pytest.mark.parametrize(
    ("table", "interval"),
    [
        # Newcombe 1998, table II, method 10.
        (Pairs(36, 2, 12, 0), (0.0569, 0.3404)),
        (Pairs(0, 2, 12, 36), (0.0569, 0.3404)),
    ],
)
def test_the_published_intervals(table, interval):
    assert newcombe(table, 0.95) == pytest.approx(interval, abs=5e-5)


@settings(deadline=None)
@given(pairs)
def test_half_the_probability_of_the_exact_test_lies_at_the_value_itself(found):
    """Against the exact two-sided p value of statsmodels."""
    from statsmodels.stats.contingency_tables import mcnemar as statsmodels_mcnemar  # slow

    table = [[found.both, found.fixed], [found.regressed, found.neither]]
    exact = statsmodels_mcnemar(table, exact=True).pvalue
    few, changed = min(found.fixed, found.regressed), found.fixed + found.regressed
    if found.fixed == found.regressed:
        assert mcnemar(found) == pytest.approx(0.5)
    else:
        mid = exact - binom.pmf(few, changed, 0.5)
        smaller = min(mcnemar(found), mcnemar(_turned(found)))
        assert 2 * smaller == pytest.approx(mid, abs=1e-12)


@given(pairs)
def test_before_and_now_are_treated_alike(found):
    turned = _turned(found)
    low, high = newcombe(found)
    assert newcombe(turned) == pytest.approx((-high, -low))
    assert mcnemar(found) + mcnemar(turned) == pytest.approx(1.0)
    assert low <= found.difference <= high
    assert -1.0 <= low <= high <= 1.0


@settings(deadline=None, max_examples=10)  # statsmodels takes its time
@given(st.lists(st.floats(0, 1), min_size=1, max_size=12))
def test_statsmodels_adjusts_p_values_in_the_same_way(values):
    from statsmodels.stats.multitest import multipletests

    assert holm(values) == pytest.approx(multipletests(values, method="holm")[1])
    assert benjamini_hochberg(values) == pytest.approx(multipletests(values, method="fdr_bh")[1])


def regression(before, now, correlation):
    """Shares of pairs that are fixed and regressed, for outcomes with a latent correlation."""
    thresholds = norm.ppf([before, now])
    both = multivariate_normal([0, 0], [[1, correlation], [correlation, 1]]).cdf(thresholds)
    return float(both), float(before - both), float(now - both)


@pytest.mark.parametrize(("number", "wanted"), [(50, 0.43), (200, 0.94), (500, 1.0)])
def test_a_regression_from_20_to_30_percent_is_found(number, wanted):
    """The power that was measured by simulation for pairs with a correlation of 0.7."""
    both, fixed, regressed = regression(0.2, 0.3, 0.7)
    assert power(number, fixed, regressed) == pytest.approx(wanted, abs=0.015)
    random = np.random.default_rng(6)
    shares = [both, fixed, regressed, 1 - both - fixed - regressed]
    drawn = random.multinomial(number, shares, size=1500)
    found = np.mean([mcnemar(Pairs(*map(int, row))) <= 0.05 for row in drawn])
    assert found == pytest.approx(wanted, abs=0.03)


def test_without_a_change_it_is_found_no_more_often_than_promised():
    random = np.random.default_rng(7)
    for number in (20, 50, 200):
        drawn = random.multinomial(number, [0.1, 0.1, 0.1, 0.7], size=4000)
        assert np.mean([mcnemar(Pairs(*map(int, row))) <= 0.05 for row in drawn]) <= 0.055


@given(pairs)
def test_what_is_detectable_is_detected(found):
    rise = detectable(found)
    noise = min(found.fixed, found.regressed) / found.total
    if rise is None:
        assert power(found.total, noise, 1 - noise) < 0.8
    else:
        assert 0 < rise <= 1
        assert power(found.total, noise, noise + rise) >= 0.8
        assert power(found.total, noise, noise + rise - 0.002) < 0.8


def test_more_pairs_show_smaller_rises_and_families_larger_ones():
    few, many = Pairs(5, 2, 3, 40), Pairs(50, 20, 30, 400)
    assert detectable(many) < detectable(few)
    assert detectable(few, 0.05 / 10) > detectable(few)
    assert detectable(Pairs(0, 0, 0, 2)) is None


def _turned(found):
    return replace(found, fixed=found.regressed, regressed=found.fixed)


@pytest.mark.parametrize(
    ("table", "correlation"),
    [
        # (ad - bc - n / 2) / sqrt of the product of the margins, 25 * 25 * 30 * 20; not below 0.
        (Pairs(20, 5, 10, 15), (300 - 50 - 25) / math.sqrt(25 * 25 * 30 * 20)),
        (Pairs(10, 9, 9, 10), 0.0),  # 100 - 81 is less than n / 2
        (Pairs(5, 10, 15, 20), (100 - 150) / math.sqrt(15 * 35 * 20 * 30)),  # below 0 as it is
        (Pairs(0, 0, 10, 30), 0.0),  # a margin is 0
    ],
)
def test_the_interval_of_the_difference_from_those_of_both_shares(table, correlation):
    """Newcombe's method 10 written out, with Wilson's intervals of statsmodels."""
    from statsmodels.stats.proportion import proportion_confint  # slow

    n = table.total
    low1, high1 = proportion_confint(table.both + table.regressed, n, 0.05, "wilson")
    low0, high0 = proportion_confint(table.both + table.fixed, n, 0.05, "wilson")
    now, before = (table.both + table.regressed) / n, (table.both + table.fixed) / n
    down, up = (
        math.sqrt(a * a - 2 * correlation * a * b + b * b)
        for a, b in ((now - low1, high0 - before), (high1 - now, before - low0))
    )
    wanted = (now - before - down, now - before + up)
    assert newcombe(table, 0.95) == pytest.approx(wanted, abs=1e-9)
