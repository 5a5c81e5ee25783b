"""Small traces that keep a property and that break it, for people to look at."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice, pairwise, product

from pytest_safemanip.ltlf import Dfa, StateClass
from pytest_safemanip.ltlf.formula import Bounded, subformulas
from pytest_safemanip.ltlf.letters import truth_table
from pytest_safemanip.spec.properties import Property

LONGEST = 7
"""Steps of an example."""
MOST = 20_000
"""Traces that are looked at."""


@dataclass(frozen=True, slots=True)
class Examples:
    """Traces of a property; a step is the atoms that hold at it.

    Attributes:
        dt: seconds from step to step.
        kept: traces that put the property to the test and keep to it.
        broken: traces that do not.
        decided: whether these violate it; otherwise they leave it open, for what it waits for may
            always come later.
    """

    dt: float
    kept: tuple[tuple[frozenset[str], ...], ...]
    broken: tuple[tuple[frozenset[str], ...], ...]
    decided: bool


def examples(prop: Property, number: int = 3) -> Examples:
    """The shortest trace, and others in which more happens.

    Args:
        prop: the property.
        number: how many of either kind.
    """
    bounds = [n.bound.high for n in subformulas(prop.formula) if isinstance(n, Bounded)]
    dt = min((b for b in bounds if b > 0), default=2.0) / 2
    dfa = prop.dfa(dt=dt)
    tested = truth_table(prop.trigger, dfa.atoms) if prop.trigger is not None else None
    every = range(1 << len(dfa.atoms))
    few = [letter for letter in every if letter.bit_count() <= 1]
    for alphabet, stutter in ((few, bool(bounds)), (few, True), (list(every), True)):
        found: dict[StateClass, list[tuple[int, ...]]] = {kind: [] for kind in StateClass}
        for letters in _traces(alphabet, stutter):
            path = [dfa.classes[state] for state in dfa.states(letters)]
            was_tested = tested is None or any(tested[letter] for letter in letters)
            if was_tested and StateClass.FALSE not in path[:-1]:
                found[path[-1]].append(letters)
        kept = sorted(found[StateClass.TRUE] + found[StateClass.CURRENTLY_TRUE], key=len)
        broken = found[StateClass.FALSE] or found[StateClass.CURRENTLY_FALSE]
        if min(len(kept), len(broken)) >= number:
            break
    return Examples(
        dt,
        _named(dfa, _chosen(kept, number)),
        _named(dfa, _chosen(broken, number)),
        bool(found[StateClass.FALSE]),
    )


def _chosen(traces: list[tuple[int, ...]], number: int) -> list[tuple[int, ...]]:
    """The shortest, and those with the most different steps; at the first step something holds."""
    if not traces:
        return []
    first, *others = sorted(traces, key=lambda trace: (trace[0] == 0, len(trace)))
    others.sort(key=lambda trace: (trace[0] == 0, -len({*trace} - {0}), len(trace), 0 in trace))
    return [first, *others[: number - 1]]


def _traces(alphabet: list[int], stutter: bool) -> Iterator[tuple[int, ...]]:
    """Traces, short ones first; without bounds the same step twice says no more than once."""
    every = (product(alphabet, repeat=length) for length in range(1, LONGEST + 1))
    for trace in islice(chain.from_iterable(every), MOST):
        if stutter or all(a != b for a, b in pairwise(trace)):
            yield trace


def _named(dfa: Dfa, traces: list[tuple[int, ...]]) -> tuple[tuple[frozenset[str], ...], ...]:
    return tuple(
        tuple(
            frozenset(atom for bit, atom in enumerate(dfa.atoms) if letter >> bit & 1)
            for letter in trace
        )
        for trace in traces
    )
