"""The policies with planted weaknesses that `benchmarks/search.py` searches."""

from __future__ import annotations

import pytest

from pytest_safemanip.search.dimension import NOTHING, Deviation
from pytest_safemanip.search.kinds.definition import Setting
from pytest_safemanip.search.trials import Trial
from tests.search.weaknesses import PROPERTY, WEAK

BEYOND = {"forward": 1.0, "left": 1.0, "turn": 3.0, "posture": 0.6}
"""What an episode as it is may lack of a size."""


def planted(weakness, left_out=""):
    """Its causes, but for one."""
    found = []
    for dimension in weakness.dimensions.own:
        size = weakness.causes.get(dimension.name)
        if size is None or dimension.name == left_out:
            continue
        if not isinstance(size, str):
            more = size + BEYOND[dimension.name] * (1.0 if size > 0.0 else -1.0)
            size = min(max(more, dimension.low), dimension.high)
        found.append((dimension.name, Setting(size)))
    return Deviation(tuple(found))


@pytest.mark.parametrize("weakness", WEAK, ids=lambda own: own.name)
def test_a_weakness_shows_in_its_combination_alone(weakness):
    tries = weakness.tries()
    alone = planted(weakness, left_out=next(iter(weakness.causes)))
    outcomes = [tries(Trial(0, own)) for own in (planted(weakness), alone, NOTHING)]
    assert [outcome.violates(PROPERTY) for outcome in outcomes] == [True, False, False]
    margins = [outcome.findings[PROPERTY].margin for outcome in outcomes]
    assert margins == sorted(margins)
