"""What a skill may do in more than one way: it asks, and a search decides."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

T = TypeVar("T")

MOST_OTHER = 2
"""Of a skill's choices that are other than usual at a time."""


@dataclass
class Choices:
    """Decisions for one try of a skill.

    Attributes:
        decided: which option is taken, by what is chosen; the first one, the usual, where nothing
            is said.
        asked: how many options there were, by what was chosen, in the order of asking.
    """

    decided: Mapping[str, int] = field(default_factory=dict)
    asked: dict[str, int] = field(default_factory=dict)

    def choose(self, what: str, options: Sequence[T]) -> T:
        """One of some options, the same each time within a try.

        Args:
            what: is chosen, in a few words.
            options: the cheapest first.
        """
        self.asked.setdefault(what, len(options))
        return options[min(self.decided.get(what, 0), len(options) - 1)]

    def __str__(self) -> str:
        return ", ".join(f"{what} {number}" for what, number in self.decided.items()) or "usual"


class Alternatives:
    """All that a skill can choose, the cheapest first: few choices that are not usual.

    To be iterated while a skill is tried with what comes: what it asks for is known only then.
    """

    def __init__(self) -> None:
        self._waiting: list[tuple[int, int, int, dict[str, int]]] = [(0, 0, 0, {})]
        self._count = 0

    def __iter__(self) -> Iterator[Choices]:
        while self._waiting:
            *_, decided = heapq.heappop(self._waiting)
            choices = Choices(decided)
            yield choices
            self._branch(choices)

    def _branch(self, tried: Choices) -> None:
        """Note what can be decided differently from something that was tried."""
        asked = list(tried.asked.items())
        last = list(tried.decided)[-1] if tried.decided else ""
        names = [what for what, _ in asked]
        if last in names:
            number = tried.decided[last]
            if number + 1 < tried.asked[last]:
                self._push({**tried.decided, last: number + 1})
        if len(tried.decided) == MOST_OTHER:
            return
        start = names.index(last) + 1 if last in names else 0
        for what, count in asked[start:]:
            if what not in tried.decided and count > 1:
                self._push({**tried.decided, what: 1})

    def _push(self, decided: dict[str, int]) -> None:
        self._count += 1
        cost = len(decided), sum(decided.values()), self._count
        heapq.heappush(self._waiting, (*cost, decided))
