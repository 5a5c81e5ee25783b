"""What a skill may do in more than one way: it asks, and a search decides."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

T = TypeVar("T")

GRASP = "way to grasp"
"""What is chosen of how something is held."""


@dataclass
class Choices:
    """Decisions for one try of a skill.

    Attributes:
        decided: which option is taken, by what is chosen; the first one, the usual, where nothing
            is said.
        asked: the prices of the options there were, by what was chosen, in the order of asking.
    """

    decided: Mapping[str, int] = field(default_factory=dict)
    asked: dict[str, Sequence[int]] = field(default_factory=dict)

    def choose(self, what: str, options: Sequence[T], prices: Sequence[int] = ()) -> T:
        """One of some options, the same each time within a try.

        Args:
            what: is chosen, in a few words.
            options: the cheapest first.
            prices: of each; that of an option is tried after all that are cheaper. Unless said
                otherwise, each costs 1 more than the one before it.
        """
        self.asked.setdefault(what, prices or range(len(options)))
        return options[min(self.decided.get(what, 0), len(options) - 1)]

    def __str__(self) -> str:
        return ", ".join(f"{what} {number}" for what, number in self.decided.items()) or "usual"


class Alternatives:
    """All that a skill can choose, the cheapest first: few choices that are not usual.

    To be iterated while a skill is tried with what comes: what it asks for is known only then.

    Args:
        others: of a skill's choices that are other than usual at a time.
    """

    def __init__(self, others: int) -> None:
        self._others = others
        self._waiting: list[tuple[int, int, dict[str, int]]] = [(0, 0, {})]
        self._count = 0
        self._first = ""

    def __iter__(self) -> Iterator[Choices]:
        while self._waiting:
            waiting = min(self._waiting, key=self._rank)
            self._waiting.remove(waiting)
            choices = Choices(waiting[-1])
            yield choices
            self._branch(choices)

    def prefer(self, what: str) -> None:
        """Try the other options of a choice before all others."""
        self._first = what

    def _rank(self, waiting: tuple[int, int, dict[str, int]]) -> tuple[int, bool, int, int]:
        price, count, decided = waiting
        return len(decided), self._first not in decided, price, count

    def _branch(self, tried: Choices) -> None:
        """Note what can be decided differently from something that was tried."""
        asked = list(tried.asked.items())
        last = list(tried.decided)[-1] if tried.decided else ""
        names = [what for what, _ in asked]
        if last in names:
            number = tried.decided[last]
            if number + 1 < len(tried.asked[last]):
                self._push({**tried.decided, last: number + 1}, tried.asked)
        if len(tried.decided) == self._others:
            return
        start = names.index(last) + 1 if last in names else 0
        for what, prices in asked[start:]:
            if what not in tried.decided and len(prices) > 1:
                self._push({**tried.decided, what: 1}, tried.asked)

    def _push(self, decided: dict[str, int], asked: Mapping[str, Sequence[int]]) -> None:
        self._count += 1
        price = sum(_price(asked.get(what, ()), number) for what, number in decided.items())
        self._waiting.append((price, self._count, decided))


def _price(prices: Sequence[int], number: int) -> int:
    """Of an option, which a try may not have asked for: another decision came before it."""
    return prices[number] if number < len(prices) else number
