from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.fields import Fields

MOST = 2**53
"""The largest number up to which floating point knows all whole numbers."""


@pytest.mark.parametrize(
    ("value", "count", "number"),
    [
        (0, True, True),
        (1, True, True),
        (MOST, True, True),
        (MOST + 1, False, False),
        (-1, False, False),
        (0.0, False, True),
        (0.5, False, True),
        (-0.5, False, False),
        (True, False, False),
        ("1", False, False),
        (None, False, False),
        (float("nan"), False, False),
        (float("inf"), False, False),
    ],
)
def test_what_is_a_count_and_what_a_number(value, count, number):
    found = Fields("here", {"x": value})
    for read, fine in ((found.count, count), (found.number, number)):
        if fine:
            assert read("x") == value
        else:
            with pytest.raises(ConfigError, match=r"here.*x"):
                read("x")
