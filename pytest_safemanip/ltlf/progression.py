"""Formula progression: the residual of a formula after one step was read.

A residual is a Boolean function of obligations. An obligation is an atom or a temporal formula
that must hold from the next step on. Reading a step replaces every obligation by what it asks of
this step and of the rest, following the fixpoint expansions of the operators (Bacchus and Kabanza
2000; De Giacomo and Vardi 2013 for finite traces), for example `F p` by `p | (next: F p)`.
Residuals are kept as decision diagrams with the atoms of the step on top, so that one substitution
serves all letters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pytest_safemanip.ltlf.bdd import FALSE, TRUE, Bdd
from pytest_safemanip.ltlf.errors import FormulaError
from pytest_safemanip.ltlf.formula import (
    Always,
    And,
    Atom,
    Constant,
    Eventually,
    Formula,
    Iff,
    Implies,
    Last,
    Next,
    Not,
    Or,
    Release,
    Until,
    WeakNext,
    WeakUntil,
)

MAX_OBLIGATIONS = 128


class Progression:
    """Residuals of one formula and their successors.

    Args:
        atoms: names of the atoms; bit i of a letter is the value of `atoms[i]`.
        bdd: where the residuals live.
    """

    def __init__(self, atoms: Sequence[str], bdd: Bdd) -> None:
        self.bdd = bdd
        self.obligations: list[Formula] = []
        self._atom_levels = {name: level for level, name in enumerate(atoms)}
        self._obligation_levels: dict[Formula, int] = {}
        self._images: dict[tuple[bool, int], int] = {}
        self._memos: dict[bool, dict[int, int]] = {False: {}, True: {}}
        self._successors: dict[int, list[tuple[int, bool]]] = {}

    def residual(self, formula: Formula) -> int:
        """The residual that asks exactly `formula` of the steps to come."""
        return self._boolean(formula, self._pending)

    def obligation(self, level: int) -> Formula:
        """The obligation that a variable of a residual stands for."""
        return self.obligations[level - len(self._atom_levels)]

    def successors(self, residual: int) -> list[tuple[int, bool]]:
        """For each letter, the residual after it and whether the trace may end with it."""
        found = self._successors.get(residual)
        if found is None:
            rest, ends = ([self._after(residual, last)] for last in (False, True))
            for level in range(len(self._atom_levels)):  # appending the half where its bit is set
                rest = [self.bdd.cofactor(f, level, bit) for bit in (False, True) for f in rest]
                ends = [self.bdd.cofactor(f, level, bit) for bit in (False, True) for f in ends]
            found = [(f, end == TRUE) for f, end in zip(rest, ends, strict=True)]
            self._successors[residual] = found
        return found

    def _after(self, residual: int, last: bool) -> int:
        """The residual after one more step, as a function of that step's atoms too."""

        def image(level: int) -> int:
            key = (last, level)
            if key not in self._images:
                self._images[key] = self._expand(self.obligation(level), last)
            return self._images[key]

        return self.bdd.substitute(residual, image, self._memos[last])

    def _pending(self, obligation: Formula) -> int:
        """The variable that says: this atom or temporal formula holds from the next step on."""
        level = self._obligation_levels.get(obligation)
        if level is None:
            if len(self.obligations) == MAX_OBLIGATIONS:
                raise FormulaError(f"formula with more than {MAX_OBLIGATIONS} temporal operators")
            level = len(self._atom_levels) + len(self.obligations)
            self._obligation_levels[obligation] = level
            self.obligations.append(obligation)
        return self.bdd.variable(level)

    def _boolean(self, formula: Formula, leaf: Callable[[Formula], int]) -> int:
        """A Boolean combination of what `leaf` says about the atoms and temporal formulas."""
        bdd = self.bdd
        match formula:
            case Constant(value):
                return TRUE if value else FALSE
            case Not(p):
                return bdd.negation(self._boolean(p, leaf))
            case And(p, q):
                return bdd.both(self._boolean(p, leaf), self._boolean(q, leaf))
            case Or(p, q):
                return bdd.either(self._boolean(p, leaf), self._boolean(q, leaf))
            case Implies(p, q):
                return bdd.choice(self._boolean(p, leaf), self._boolean(q, leaf), TRUE)
            case Iff(p, q):
                right = self._boolean(q, leaf)
                return bdd.choice(self._boolean(p, leaf), right, bdd.negation(right))
        return leaf(formula)

    def _expand(self, formula: Formula, last: bool) -> int:
        """The formula unrolled by one step, as conditions on this step and on the rest."""
        bdd = self.bdd

        def leaf(part: Formula) -> int:
            match part:
                case Atom(name):
                    return bdd.variable(self._atom_levels[name])
                case Last():
                    return TRUE if last else FALSE
                case Next(p):
                    return FALSE if last else self.residual(p)
                case WeakNext(p):
                    return TRUE if last else self.residual(p)
                case Eventually(p):
                    rest = FALSE if last else self._pending(part)
                    return bdd.either(now(p), rest)
                case Always(p):
                    rest = TRUE if last else self._pending(part)
                    return bdd.both(now(p), rest)
                case Until(p, q):
                    rest = FALSE if last else self._pending(part)
                    return bdd.either(now(q), bdd.both(now(p), rest))
                case WeakUntil(p, q):
                    rest = TRUE if last else self._pending(part)
                    return bdd.either(now(q), bdd.both(now(p), rest))
                case Release(p, q):
                    rest = TRUE if last else self._pending(part)
                    return bdd.both(now(q), bdd.either(now(p), rest))
            raise AssertionError(f"no expansion for {type(part).__name__}")

        def now(part: Formula) -> int:
            return self._boolean(part, leaf)

        return now(formula)
