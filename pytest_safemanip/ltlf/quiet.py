"""Steps that leave an automaton where it is, whatever the atoms say that were not looked up.

A property is triggered by few atoms, those of its trigger. While none of its instances is,
the others decide nothing, and need not be evaluated. Nor need they while one atom that a bad prefix
needs is false, as `a` in `G !(a & b)`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import lru_cache, partial

import numpy as np

from pytest_safemanip.ltlf.letters import BoolArray, Letters, lifted, no_letters
from pytest_safemanip.ltlf.rules import Rules

FEW = 32
"""Steps that are looked up at first; then twice as many each time."""

Values = Callable[[int, int, int, int], BoolArray]
"""Called with the numbers of an instance and of an atom, a step and one after a later step: the
values at these steps, bool[K]."""


class Quiet:
    """What is known of an automaton's way from the atoms of its trigger alone.

    Args:
        rules: the property's.

    Attributes:
        watched: the atoms that have to be known at every step: those that the trigger depends on;
            if every step triggers, one that settles it while it is false, or else all of them.
        others: the rest.
    """

    def __init__(self, rules: Rules) -> None:
        atoms = range(len(rules.dfa.atoms))
        letters = np.arange(1 << len(atoms))
        self._flipped = [letters ^ (1 << atom) for atom in atoms]
        self._rules = rules
        self.watched = tuple(atoms)
        if rules.standing is rules.table:  # else whether the clocks stand is not known here
            self.watched = self._triggering() or self._settling() or self.watched
        self.others = tuple(atom for atom in atoms if atom not in self.watched)
        self._stays = self._staying(self.watched)

    def _triggering(self) -> tuple[int, ...]:
        """The atoms that the trigger depends on; none if every step triggers."""
        trigger = self._rules.trigger
        if trigger is None:
            return ()
        flips = enumerate(self._flipped)
        return tuple(atom for atom, flipped in flips if (trigger != trigger[flipped]).any())

    def _settling(self) -> tuple[int, ...]:
        """The first atom that, while it is false, keeps the automaton where it begins, whatever the
        others are; none if there is no such atom, or it is triggered by some letters only.
        """
        if self._rules.trigger is not None:
            return ()
        alone = ((atom,) for atom in range(len(self._flipped)))
        return next((atom for atom in alone if self._staying(atom)[0, 0]), ())

    def _staying(self, watched: Collection[int]) -> BoolArray:
        """Whether the automaton stays where it is, with no obligation open, whatever the atoms are
        that are not watched: bool[states, letters].
        """
        stays = self._rules.table == np.arange(len(self._rules.dfa))[:, None]
        for atom, flipped in enumerate(self._flipped):
            if atom not in watched:
                stays &= stays[:, flipped]
        # While an obligation is open, the other atoms say whether it is met.
        found: BoolArray = stays & self._rules.closed[:, None]
        return found

    def restless(self, states: Sequence[int], letters: Letters) -> list[int]:
        """The instances for which the other atoms may matter at some step.

        Args:
            states: of each before the first step.
            letters: with any values of the other atoms: uint[T, I].
        """
        stays = self._stays[np.array(states), letters].all(axis=0)
        found: list[int] = np.flatnonzero(~stays).tolist()
        return found

    def next(self, state: int, letters: Letters, first: int) -> int:
        """The first step that the other atoms may matter for; the number of steps if none is.

        Args:
            state: before step `first`.
            letters: of all steps, with any values of the other atoms: uint[T].
            first: where to begin.
        """
        stays = self._stays[state, letters[first:]]
        return len(letters) if stays.all() else first + int(np.argmin(stays))


quiet_of = lru_cache(maxsize=1024)(Quiet)
"""Made once for the rules of a property."""


def gather(rules: Rules, states: Sequence[int], steps: int, value_of: Values) -> Letters:
    """Letters of the next steps, their atoms looked up where a verdict may depend on them.

    Where none does they may be False.

    Args:
        rules: the property's.
        states: of the instances before the first step.
        steps: T.
        value_of: the values of an atom.

    Returns:
        uint[T, I].
    """
    quiet = quiet_of(rules)
    letters = no_letters((steps, len(states)), len(rules.dfa.atoms))
    for instance in range(len(states)):
        for atom in quiet.watched:
            letters[:, instance] |= lifted(value_of(instance, atom, 0, steps), atom, letters)
    if quiet.others:
        for instance in quiet.restless(states, letters):
            _look_up(rules, states[instance], letters[:, instance], partial(value_of, instance))
    return letters


def _look_up(
    rules: Rules, state: int, letters: Letters, value_of: Callable[[int, int, int], BoolArray]
) -> None:
    """Fill in the other atoms of an instance, whose letters lack them: uint[T]."""
    quiet, length = quiet_of(rules), FEW
    first = quiet.next(state, letters, 0)
    while first < len(letters):
        stop = min(first + length, len(letters))
        for atom in quiet.others:
            letters[first:stop] |= lifted(value_of(atom, first, stop), atom, letters)
        for letter in letters[first:stop].tolist():
            state = rules.rows[state][letter]
        first, length = quiet.next(state, letters, stop), 2 * length
