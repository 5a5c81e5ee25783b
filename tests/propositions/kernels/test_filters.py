from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.propositions.kernels import filters

MEANING = {
    "majority": lambda past, count: sum(past[-count:]) > count / 2,
    "held": lambda past, count: len(past) >= count and all(past[-count:]),
    "recently": lambda past, count: any(past[-count:]),
    "rising": lambda past, _: len(past) > 1 and past[-1] and not past[-2],
    "falling": lambda past, _: len(past) > 1 and past[-2] and not past[-1],
}


@pytest.mark.parametrize("name", MEANING)
@given(values=st.lists(st.booleans(), max_size=20), count=st.integers(1, 12))
def test_a_filter_means_the_same_at_every_step_and_looks_only_back(name, values, count):
    wide = name in ("majority", "held", "recently")
    found = getattr(filters, name)(np.array(values, bool), *([count] if wide else []))
    assert found.dtype == np.bool_
    assert found.tolist() == [MEANING[name](values[: t + 1], count) for t in range(len(values))]


@given(values=st.lists(st.booleans(), max_size=20), count=st.integers(1, 12))
def test_the_newest_true_step_is_the_one_within_the_window(values, count):
    wanted = [
        max((k for k in range(max(0, t - count + 1), t + 1) if values[k]), default=-1)
        for t in range(len(values))
    ]
    assert filters.last_true(np.array(values, bool), count).tolist() == wanted


@given(st.data())
def test_a_flicker_shorter_than_half_the_window_makes_no_edge(data):
    count = data.draw(st.integers(1, 12))
    flicker = data.draw(st.integers(0, count // 2))
    at = data.draw(st.integers(count, 30))
    values = np.zeros(60, bool)
    values[at : at + flicker] = True
    assert not filters.majority(values, count).any()
    if flicker < count / 2:
        # The dropout as well: a window of even length breaks a tie towards false.
        assert filters.majority(~values, count)[count - 1 :].all()


@pytest.mark.parametrize(
    ("count", "wanted"),
    [
        # From the first of so many steps to the last; before there are that many, from the very
        # first. Moved by 0, 1, 0, 4 and 0 mm; less than 4 mm is still.
        (1, [True] * 5),
        (2, [True, True, True, False, True]),
        (3, [True, True, True, False, False]),
        (4, [True, True, True, False, False]),
    ],
)
def test_still_is_what_moved_less_than_a_limit_over_the_last_steps(count, wanted):
    places = np.zeros((5, 2, 3))
    places[:, 0, 1] = (0.0, 1.0, 1.0, 5.0, 5.0)
    found = filters.still(places, count, 4.0)
    assert found[:, 0].tolist() == wanted
    assert found[:, 1].all()


def test_still_compares_the_two_ends_in_space():
    # There and back again is still; 3 and 4 m to two sides are 5 m.
    places = np.array([(0.0, 0.0, 0.0), (9.0, 0.0, 0.0), (0.0, 0.0, 0.0), (3.0, 4.0, 0.0)])
    assert filters.still(places, 3, 5.0).tolist() == [True, False, True, False]
    assert filters.still(places, 2, 5.001).tolist() == [True, False, False, True]
