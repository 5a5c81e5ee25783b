"""The policies with planted weaknesses that `benchmarks/searches/search.py` searches."""

from __future__ import annotations

import pytest

from pytest_safemanip.search.dimension import NOTHING
from pytest_safemanip.search.trials import Trial
from tests.search.weaknesses import PROPERTY, WEAK


@pytest.mark.parametrize("weakness", WEAK, ids=lambda own: own.name)
def test_a_weakness_shows_in_its_combination_alone(weakness):
    tries = weakness.tries()
    alone = weakness.planted(left_out=next(iter(weakness.causes)))
    outcomes = [tries(Trial(0, own)) for own in (weakness.planted(), alone, NOTHING)]
    assert [outcome.violates(PROPERTY) for outcome in outcomes] == [True, False, False]
    margins = [outcome.findings[PROPERTY].margin for outcome in outcomes]
    assert margins == sorted(margins)
