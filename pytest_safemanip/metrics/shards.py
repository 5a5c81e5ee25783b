"""A run in parts, one for each machine."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.records import RolloutKey

MAX_COUNT = 100_000
"""Sanity bound on the shards of one run."""


@dataclass(frozen=True, order=True)
class Shard:
    """One of several parts of a run.

    A rollout's part is decided by its policy, task and seed alone: it stays where it is when tasks,
    seeds or properties are added, and a cache of recordings stays useful. The price is that parts
    are equal on average only.

    Attributes:
        number: of the part, from 1.
        count: of all parts.
    """

    number: int
    count: int

    def has(self, rollout: RolloutKey) -> bool:
        """Whether a rollout belongs to this part."""
        text = "\0".join(map(str, rollout))
        digest = hashlib.sha256(text.encode()).digest()
        return int.from_bytes(digest[:8], "big") % self.count == self.number - 1

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"


def parse_shard(text: str, place: str) -> Shard:
    """A shard from ``3/16``.

    Args:
        text: the number and the count.
        place: what the text was given for.

    Raises:
        ConfigError: if it is none.
    """
    match = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text.strip(), re.ASCII)
    if match:
        shard = Shard(int(match[1]), int(match[2]))
        if 1 <= shard.number <= shard.count <= MAX_COUNT:
            return shard
    raise ConfigError(f"{place}: expected I/N with I from 1 to N, as in 3/16, found {text!r}")


def missing(shards: Iterable[Shard]) -> list[Shard]:
    """The parts that are not there, of each number of parts that a run was cut into."""
    there = set(shards)
    return [
        shard
        for count in sorted({shard.count for shard in there})
        for number in range(1, count + 1)
        if (shard := Shard(number, count)) not in there
    ]


def missing_line(shards: Iterable[Shard]) -> str:
    """The parts that are not there, in words; empty if all are."""
    gone = [str(shard) for shard in missing(shards)]
    if not gone:
        return ""
    more = f" and {len(gone) - 5} more" if len(gone) > 5 else ""
    return f"not all of the run: no shard {', '.join(gone[:5])}{more}"
