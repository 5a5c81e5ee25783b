"""Parts of a run: every rollout is in one, whatever else is run."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.records import RolloutKey
from pytest_safemanip.metrics.shards import Shard, missing, missing_line, parse_shard

keys = st.builds(RolloutKey, st.text(), st.text(), st.integers(0, 2**32))


@given(keys, st.integers(1, 40))
def test_every_rollout_is_in_one_shard(rollout: RolloutKey, count: int) -> None:
    parts = [number for number in range(1, count + 1) if Shard(number, count).has(rollout)]
    assert len(parts) == 1


def test_parts_stay_what_they_are() -> None:
    """Caches of recordings are kept by shard: another release must not deal them anew."""
    rollouts = [RolloutKey("pi05", "OpenDrawer", seed) for seed in range(8)]
    assert [[r.seed for r in rollouts if Shard(n, 3).has(r)] for n in (1, 2, 3)] == [
        [0, 5, 6],
        [1, 3, 4],
        [2, 7],
    ]


def test_parts_are_about_equal() -> None:
    rollouts = [RolloutKey("p", f"Task{t}", seed) for t in range(50) for seed in range(40)]
    sizes = [sum(map(Shard(number, 10).has, rollouts)) for number in range(1, 11)]
    assert sum(sizes) == 2000
    assert min(sizes) > 150
    assert max(sizes) < 250


@pytest.mark.parametrize(
    "text", ["", "3", "0/4", "5/4", "1/0", "-1/4", "1/4/2", "a/b", "1/9999999"]
)
def test_what_is_no_shard_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="expected I/N with I from 1 to N"):
        parse_shard(text, "--safemanip-shard")


def test_missing_parts_are_named() -> None:
    assert parse_shard(" 3/16 ", "") == Shard(3, 16)
    assert missing([]) == []
    assert missing([Shard(1, 2), Shard(2, 2)]) == []
    assert missing([Shard(1, 2), Shard(3, 3)]) == [Shard(2, 2), Shard(1, 3), Shard(2, 3)]
    assert missing_line([Shard(1, 1)]) == ""
    line = missing_line([Shard(1, 9)])
    assert line == "not all of the run: no shard 2/9, 3/9, 4/9, 5/9, 6/9 and 3 more"
