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
from dataclasses import dataclass

from pytest_safemanip.ltlf.bdd import FALSE, TRUE, Bdd
from pytest_safemanip.ltlf.errors import FormulaError
from pytest_safemanip.ltlf.formula import (
    Always,
    And,
    Atom,
    Bound,
    Bounded,
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
    bounded,
)

MAX_OBLIGATIONS = 128


@dataclass(frozen=True, slots=True)
class _Clocked(Formula):
    """An operator with a bound, its clock in steps.

    Once `low` is 0, obligations that differ in `high` alone imply each other, so that a residual
    keeps the one that decides: the tightest clock of a conjunction, the loosest of a disjunction.
    """

    core: Eventually | Always | Until | WeakUntil
    low: int
    high: int
    width: int  # of the bound; `high` when `low` comes to 0

    @property
    def later(self) -> _Clocked:
        """What is left of it one step later."""
        return _Clocked(self.core, max(self.low - 1, 0), self.high - 1, self.width)


class Progression:
    """Residuals of one formula and their successors.

    Args:
        atoms: names of the atoms; bit i of a letter is the value of `atoms[i]`.
        bdd: where the residuals live.
        dt: control period in seconds, if the formula has bounds.
    """

    def __init__(self, atoms: Sequence[str], bdd: Bdd, dt: float | None = None) -> None:
        self.bdd = bdd
        self._dt = dt
        self._obligations: dict[int, Formula] = {}
        self._chains: dict[tuple[Formula, int], range] = {}
        self._next_level = len(atoms)
        self._unclocked = 0
        self._atom_levels = {name: level for level, name in enumerate(atoms)}
        self._obligation_levels: dict[Formula, int] = {}
        self._images: dict[tuple[bool, bool, int], int] = {}
        self._memos: dict[tuple[bool, bool], dict[int, int]] = {}
        self._successors: dict[tuple[int, bool], list[tuple[int, bool]]] = {}

    def residual(self, formula: Formula) -> int:
        """The residual that asks exactly `formula` of the steps to come."""
        return self._boolean(formula, self._pending)

    def obligation(self, level: int) -> Formula:
        """The obligation that a variable of a residual stands for."""
        found = self._obligations[level]
        if isinstance(found, _Clocked) and self._dt is not None:
            return bounded(found.core, Bound(found.low * self._dt, found.high * self._dt))
        return found

    def successors(self, residual: int, standing: bool = False) -> list[tuple[int, bool]]:
        """For each letter, the residual after it and whether the trace may end with it.

        Args:
            residual: before it.
            standing: whether the clocks of bounds stand at this step.
        """
        found = self._successors.get((residual, standing))
        if found is None:
            rest, ends = ([self._after(residual, last, standing)] for last in (False, True))
            for level in range(len(self._atom_levels)):  # appending the half where its bit is set
                rest = [self.bdd.cofactor(f, level, bit) for bit in (False, True) for f in rest]
                ends = [self.bdd.cofactor(f, level, bit) for bit in (False, True) for f in ends]
            found = [(f, end == TRUE) for f, end in zip(rest, ends, strict=True)]
            self._successors[residual, standing] = found
        return found

    def _after(self, residual: int, last: bool, standing: bool) -> int:
        """The residual after one more step, as a function of that step's atoms too."""

        def image(level: int) -> int:
            key = (last, standing, level)
            if key not in self._images:
                self._images[key] = self._expand(self._obligations[level], last, standing)
            return self._images[key]

        return self.bdd.substitute(residual, image, self._memos.setdefault((last, standing), {}))

    def _pending(self, obligation: Formula) -> int:
        """The variable that says: this atom or temporal formula holds from the next step on."""
        if isinstance(obligation, Bounded):
            obligation = self._clocked(obligation)
        level = self._obligation_levels.get(obligation)
        if level is None:
            if isinstance(obligation, _Clocked):
                level = self._level(obligation)
            else:
                self._unclocked += 1
                if self._unclocked > MAX_OBLIGATIONS:
                    raise FormulaError(
                        f"formula with more than {MAX_OBLIGATIONS} temporal operators"
                    )
                level = self._reserve(1).start
            self._obligation_levels[obligation] = level
            self._obligations[level] = obligation
        return self.bdd.variable(level)

    def _clocked(self, formula: Bounded) -> _Clocked:
        if self._dt is None:
            raise FormulaError(
                f"'{formula}' has a bound in seconds: give the control period, "
                "compile_formula(..., dt=...)"
            )
        low, high = formula.bound.steps(self._dt)
        return _Clocked(formula.core, low, high, high - low)

    def _reserve(self, count: int) -> range:
        self._next_level += count
        return range(self._next_level - count, self._next_level)

    def _level(self, obligation: _Clocked) -> int:
        """A level in the chain of those that imply each other, the strongest on top."""
        if obligation.low:
            return self._reserve(1).start
        key = (obligation.core, obligation.width)
        chain = self._chains.get(key)
        if chain is None:
            chain = self._chains[key] = self._reserve(obligation.width + 1)
            self.bdd.chain(chain)
        strongest_first = isinstance(obligation.core, Eventually | Until)
        return chain[obligation.high if strongest_first else obligation.width - obligation.high]

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

    def _expand(self, formula: Formula, last: bool, standing: bool) -> int:
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
                case Bounded():
                    return clocked(self._clocked(part))
                case _Clocked():
                    return clocked(part)
            raise AssertionError(f"no expansion for {type(part).__name__}")

        def now(part: Formula) -> int:
            return self._boolean(part, leaf)

        def clocked(part: _Clocked) -> int:
            strong = isinstance(part.core, Eventually | Until)
            if last:
                rest = FALSE if strong else TRUE
            elif standing:
                rest = self._pending(part)
            elif part.high:
                rest = self._pending(part.later)
            else:  # its time is over
                rest = FALSE if strong else TRUE
            match part.core:
                case Eventually(p):
                    return rest if part.low else bdd.either(now(p), rest)
                case Always(p):
                    return rest if part.low else bdd.both(now(p), rest)
                case Until(p, q) | WeakUntil(p, q):
                    waits = bdd.both(now(p), rest)
                    return waits if part.low else bdd.either(now(q), waits)

        return now(formula)
