"""Steps that leave an automaton where it is, whatever the atoms say that were not looked up.

A property is put to the test by few atoms, those of its trigger. While none of its instances is,
the others decide nothing, and need not be evaluated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from pytest_safemanip.ltlf.letters import BoolArray, Letters, pack
from pytest_safemanip.ltlf.rules import Rules


class Quiet:
    """What is known of an automaton's way from the atoms of its trigger alone.

    Args:
        rules: the property's.

    Attributes:
        watched: the atoms that have to be known at every step: those that the trigger depends on;
            all of them if every step triggers.
        others: the rest.
    """

    def __init__(self, rules: Rules) -> None:
        atoms = range(len(rules.dfa.atoms))
        letters = np.arange(1 << len(atoms))
        trigger, flipped = rules.trigger, [letters ^ (1 << atom) for atom in atoms]
        matters = [trigger is None or bool((trigger != trigger[f]).any()) for f in flipped]
        self.watched = tuple(atom for atom in atoms if matters[atom])
        self.others = tuple(atom for atom in atoms if not matters[atom])
        stays = rules.table == np.arange(len(rules.dfa))[:, None]
        for atom in self.others:
            stays &= stays[:, flipped[atom]]
        # While an obligation is open, the other atoms say whether it is met.
        self._stays = stays & rules.closed[:, None]

    def keeps(self, state: int, letters: Letters) -> bool:
        """Whether a state that owes nothing is kept, whatever the other atoms are.

        Args:
            state: before some steps.
            letters: of the steps, with any values of the other atoms: uint[K].
        """
        return bool(self._stays[state, letters].all())


quiet_of = lru_cache(maxsize=1024)(Quiet)
"""Made once for the rules of a property."""


def gather(
    rules: Rules, states: Sequence[int], steps: int, value_of: Callable[[int, int], BoolArray]
) -> BoolArray:
    """Values of the atoms, looked up where a verdict may depend on them: bool[T, I, atoms].

    Where none does they are False.

    Args:
        rules: the property's.
        states: of the instances before the first step.
        steps: T.
        value_of: the values of an atom for an instance, both by number: bool[T].
    """
    quiet = quiet_of(rules)
    values = np.zeros((steps, len(states), len(rules.dfa.atoms)), bool)
    for instance, state in enumerate(states):
        own = values[:, instance]
        for atom in quiet.watched:
            own[:, atom] = value_of(instance, atom)
        if quiet.others and not quiet.keeps(state, pack(own)):
            for atom in quiet.others:
                own[:, atom] = value_of(instance, atom)
    return values
