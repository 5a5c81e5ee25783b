"""When a monitor is expected to find a step unsafe, given when its atoms are expected to change."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from pytest_safemanip.ltlf.letters import BoolArray
from pytest_safemanip.ltlf.rules import Rules

Cube = tuple[tuple[int, bool], ...]
"""Values of some atoms, by number; the others may have any."""


class Atoms(Protocol):
    """What is known about the atoms of an instance at the last step."""

    def value(self, atom: int) -> bool:
        """Its value; of an edge, which is over after its step, False."""

    def change(self, atom: int) -> float:
        """Seconds until it is expected to have the other value; inf if it is not."""


class Prediction(NamedTuple):
    """What is expected of an instance.

    Attributes:
        violation: seconds until a step is unsafe; inf if none is expected to be.
        last_chance: seconds until the robot can no longer prevent that. It is earlier where an
            obligation is about to open that physics has to meet: once something is let go, it
            falls.
        atoms: numbers of those that change, the one that decides when last.
    """

    violation: float
    last_chance: float
    atoms: tuple[int, ...] = ()


NOTHING = Prediction(math.inf, math.inf)


class Predictor:
    """Predictions for the instances of a property.

    Args:
        rules: of the property.
        order: numbers of its atoms, the cheapest to look at first: an atom is looked at only where
            those before it leave it open whether anything is to be expected.
    """

    def __init__(self, rules: Rules, order: tuple[int, ...]) -> None:
        self._rules, self._order = rules, order

    def predict(self, state: int, open_steps: int, atoms: Atoms) -> Prediction:
        """What is expected of an instance, one change of its state ahead.

        Args:
            state: of its automaton.
            open_steps: counted steps since it was last accepting.
            atoms: of the instance.
        """
        rules = self._rules
        if rules.is_bad[state]:
            return Prediction(0.0, 0.0)
        found = [self._bad(state, atoms)]
        if rules.deadline_steps is not None:
            if rules.is_closed[state]:
                found.append(self._opens(state, atoms))
            else:
                found.append(self._overdue(state, open_steps, atoms))
        return min(found, key=lambda one: (one.last_chance, one.violation))

    def _bad(self, state: int, atoms: Atoms) -> Prediction:
        """A step to a bad prefix."""
        best = NOTHING
        for cube in _cubes_to(self._rules, state, "bad", self._order):
            when, changed = _expected(cube, atoms)
            if when < best.violation:
                best = Prediction(when, when, changed)
        return best

    def _opens(self, state: int, atoms: Atoms) -> Prediction:
        """An obligation that opens, and that physics is not expected to meet in time."""
        rules, best = self._rules, NOTHING
        if not rules.clock_runs_in_tail:
            return best  # the robot can still meet it
        limit = (rules.deadline_steps or 0) * rules.dt
        for target in _open_after(rules, state):
            for cube in _cubes_to(rules, state, target, self._order):
                when, changed = _expected(cube, atoms)
                if when < best.last_chance and not self._met(target, limit, atoms, changed):
                    best = Prediction(when + limit, when, changed)
        return best

    def _overdue(self, state: int, open_steps: int, atoms: Atoms) -> Prediction:
        """An open obligation whose time runs out."""
        rules = self._rules
        left = max((rules.deadline_steps or 0) + 1 - open_steps, 0) * rules.dt
        met = rules.clock_runs_in_tail and self._met(state, left, atoms)
        return NOTHING if met else Prediction(left, left)

    def _met(self, state: int, limit: float, atoms: Atoms, changed: Sequence[int] = ()) -> bool:
        """Whether an obligation is expected to be met within some seconds, where some atoms have
        changed before, and stay as they then are.
        """
        for cube in _cubes_to(self._rules, state, "closed", self._order):
            if all(
                (atoms.value(k) != wanted)
                if k in changed
                else atoms.value(k) == wanted or atoms.change(k) <= limit
                for k, wanted in cube
            ):
                return True
        return False


predictor_of = lru_cache(maxsize=1024)(Predictor)
"""Made once for the rules of a property."""


def _expected(cube: Cube, atoms: Atoms) -> tuple[float, tuple[int, ...]]:
    """When all of some values are expected, and which atoms change for it; inf if never."""
    latest, changed = 0.0, []
    for k, wanted in cube:
        if atoms.value(k) != wanted:
            when = atoms.change(k)
            if when == math.inf:
                return when, ()
            changed.append((when, k))
            latest = max(latest, when)
    if any(atoms.change(k) <= latest for k, wanted in cube if atoms.value(k) == wanted):
        return math.inf, ()
    return latest, tuple(k for _, k in sorted(changed))


@lru_cache(maxsize=4096)
def _cubes_to(
    rules: Rules, state: int, target: int | str, order: tuple[int, ...]
) -> tuple[Cube, ...]:
    """Values of atoms that lead from a state to a bad one, to one in which nothing is open, or to
    the one of a number.
    """
    after = rules.table[state]
    if target == "bad":
        wanted = rules.bad[after]
    elif target == "closed":
        wanted = rules.closed[after]
    else:
        wanted = after == target
    return tuple(_cubes(wanted, order))


@lru_cache(maxsize=4096)
def _open_after(rules: Rules, state: int) -> tuple[int, ...]:
    """The states with an open obligation that can follow a state."""
    return tuple(int(q) for q in np.unique(rules.table[state]) if not rules.closed[q])


def _cubes(wanted: BoolArray, order: Sequence[int]) -> Iterator[Cube]:
    """Cubes that together are some letters, bool[2 ** atoms], by expansion along an order of the
    atoms (Shannon 1949).
    """
    if not wanted.any():
        return
    if wanted.all():
        yield ()
        return
    atom, *rest = order
    has = np.arange(len(wanted)) >> atom & 1 == 1
    without, with_it = wanted.copy(), wanted.copy()
    # Each half stands for both: the atom no longer matters in it.
    without[has], with_it[~has] = wanted[~has], wanted[has]
    if (without == with_it).all():
        yield from _cubes(wanted, rest)
        return
    for value, half in ((False, without), (True, with_it)):
        yield from (((atom, value), *cube) for cube in _cubes(half, rest))
