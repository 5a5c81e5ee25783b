"""Which values decided: few (step, atom) values that alone make a trace violate a property.

The question is answered on sets of automaton states. Fixing some atoms of a step and leaving the
others free leads from a set of states to a larger set; the values fixed suffice if every set stays
inside the states allowed at its step, for example {FALSE} at the step of a bad prefix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from pytest_safemanip.ltlf.dfa import Dfa

StateSet = int  # bit s is set if state s is in the set
Choice = tuple[int, StateSet, int]  # cost so far, the set before, the atoms fixed as a bitmask

_MAX_ATOMS = 6  # 2 ** atoms ways to fix a step
_MAX_WORK = 1_000_000  # about a second; beyond it the greedy search answers


@dataclass(frozen=True, slots=True)
class DecidingValue:
    """One deciding value: an atom at a step."""

    step: int
    atom: str
    value: bool


class Search:
    """Looks for few values of one trace that keep all traces sharing them in allowed states.

    Args:
        dfa: the automaton, read from its initial state.
        letters: the trace.
        allowed: for each step, the states allowed after it; the trace itself stays inside.
        running: the clocks of bounds stand after so many steps; None if they never do.
    """

    def __init__(
        self,
        dfa: Dfa,
        letters: Sequence[int],
        allowed: Sequence[StateSet],
        running: int | None = None,
    ) -> None:
        self.dfa = dfa
        self.letters = letters
        self.stands = [running is not None and step >= running for step in range(len(letters))]
        self.every_atom = (1 << len(dfa.atoms)) - 1
        self.sufficient = self._sufficient(allowed)

    def _sufficient(self, allowed: Sequence[StateSet]) -> list[StateSet]:
        """For each step, the states from which the rest of the trace stays in allowed ones."""
        found = list(allowed)
        for step in range(len(found) - 2, -1, -1):
            letter, after = self.letters[step + 1], found[step + 1]
            rows = self.dfa.standing_rows if self.stands[step + 1] else self.dfa.rows
            for state, row in enumerate(rows):
                if not after >> row[letter] & 1:
                    found[step] &= ~(1 << state)
        return found

    def greedy(self) -> list[int]:
        """The atoms to fix at each step, as bitmasks: none of them can be left out.

        Values are dropped from the first step to the last, so that late ones are kept.
        """
        states, kept = 1, []
        for letter, goal, stands in zip(self.letters, self.sufficient, self.stands, strict=True):
            fixed = self.every_atom
            for bit in range(len(self.dfa.atoms)):
                fewer = fixed & ~(1 << bit)
                if not image(self.dfa, states, letter, fewer, stands) & ~goal:
                    fixed = fewer
            states = image(self.dfa, states, letter, fixed, stands)
            kept.append(fixed)
        return kept

    def smallest(self) -> list[int] | None:
        """As `greedy`, with the fewest values possible; None if there is too much to try."""
        if len(self.dfa.atoms) > _MAX_ATOMS:
            return None
        options: dict[tuple[StateSet, int, StateSet, bool], tuple[tuple[int, StateSet], ...]] = {}
        layers: list[dict[StateSet, Choice]] = [{1: (0, 0, 0)}]
        work = 0
        settled: tuple[int, StateSet, bool] | None = None
        for letter, goal, stands in zip(self.letters, self.sufficient, self.stands, strict=True):
            if settled == (letter, goal, stands):  # one more such step costs all of them the same
                layers.append(layers[-1])
                continue
            layer: dict[StateSet, Choice] = {}
            for states, (cost, _, _) in layers[-1].items():
                key = (states, letter, goal, stands)
                if key not in options:
                    options[key] = _options(self.dfa, *key)
                    work += self.every_atom + 1
                for fixed, after in options[key]:
                    total = cost + fixed.bit_count()
                    if after not in layer or total < layer[after][0]:
                        layer[after] = (total, states, fixed)
            layers.append(_undominated(layer))
            settled = (letter, goal, stands) if _like(layers[-1], layers[-2]) else None
            work += len(layer) ** 2
            if work > _MAX_WORK:
                return None
        return _trace_back(layers)


def image(dfa: Dfa, states: StateSet, letter: int, fixed: int, stands: bool = False) -> StateSet:
    """States reached from a set when only the fixed atoms of a letter are known."""
    found, state = 0, 0
    while states >> state:
        if states >> state & 1:
            found |= _image(dfa, state, letter & fixed, fixed, stands)
        state += 1
    return found


# The same few questions come with every violation of a property.
@lru_cache(maxsize=65536)
def _image(dfa: Dfa, state: int, values: int, fixed: int, stands: bool) -> StateSet:
    found, row = 0, (dfa.standing_rows if stands else dfa.rows)[state]
    for letter, successor in enumerate(row):
        if letter & fixed == values:
            found |= 1 << successor
    return found


@lru_cache(maxsize=65536)
def _options(
    dfa: Dfa, states: StateSet, letter: int, goal: StateSet, stands: bool
) -> tuple[tuple[int, StateSet], ...]:
    """Ways to fix atoms that stay inside the goal: the fewest atoms for each set reached."""
    best: dict[StateSet, int] = {}
    for fixed in sorted(range(1 << len(dfa.atoms)), key=int.bit_count):
        after = image(dfa, states, letter, fixed, stands)
        if not after & ~goal:
            best.setdefault(after, fixed)
    return tuple((fixed, after) for after, fixed in best.items())


def _undominated(layer: dict[StateSet, Choice]) -> dict[StateSet, Choice]:
    """The sets that contain no other one of the same or lower cost."""
    kept: dict[StateSet, Choice] = {}
    for states, choice in sorted(layer.items(), key=lambda item: (item[1][0], item[0].bit_count())):
        if not any(other & ~states == 0 for other in kept):
            kept[states] = choice
    return kept


def _like(layer: dict[StateSet, Choice], before: dict[StateSet, Choice]) -> bool:
    """Whether the same sets are reached, in the same order and with the same costs between them."""
    return [*layer] == [*before] and len(
        {layer[states][0] - before[states][0] for states in layer}
    ) < 2


def _trace_back(layers: list[dict[StateSet, Choice]]) -> list[int]:
    states = min(layers[-1], key=lambda states: layers[-1][states][0])
    chosen = []
    for layer in reversed(layers[1:]):
        _, states, fixed = layer[states]
        chosen.append(fixed)
    return chosen[::-1]
