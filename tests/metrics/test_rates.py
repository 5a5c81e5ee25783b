from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.statistics.intervals import clustered, wilson


def test_a_rate_is_counted_by_task():
    rate = Rate.count([("b", 1), ("a", 0), ("b", 0), ("a", 1), ("b", 1)])
    assert (rate.hits, rate.total, rate.value) == (3, 5, 0.6)
    assert rate.tasks == {"a": (1, 2), "b": (2, 3)}


def test_without_a_case_it_is_undefined_and_not_zero():
    assert Rate.count([]).to_json() == {
        "hits": 0,
        "total": 0,
        "value": None,
        "wilson95": None,
        "clustered95": None,
        "below95": None,
    }


def test_a_rate_carries_counts_value_and_both_intervals():
    rate = Rate.count([("a", 0), ("a", 1), ("b", 0), ("b", 0)])
    found = rate.to_json()
    assert (found["hits"], found["total"], found["value"]) == (1, 4, 0.25)
    assert found["wilson95"] == list(wilson(1, 4))
    assert found["clustered95"] == list(clustered([(1, 2), (0, 2)]))
    assert found["below95"] is None


def test_the_rule_of_three_stands_beside_a_zero_only():
    assert Rate(0, 50).below == pytest.approx(0.0582, abs=5e-5)
    assert Rate(1, 50).below is None
    assert Rate(0, 0).below is None


@given(st.lists(st.tuples(st.sampled_from("abc"), st.floats(0, 1)), min_size=1, max_size=20))
def test_the_order_of_cases_does_not_matter(cases):
    one, other = Rate.count(cases), Rate.count(reversed(cases))
    assert one.hits == pytest.approx(other.hits)
    assert one.total == other.total == len(cases)
    assert sum(total for _, total in one.tasks.values()) == one.total
