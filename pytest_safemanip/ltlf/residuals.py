"""A short formula for each state: what is still pending there.

A state of the minimal automaton stands for several residuals with the same language. The shortest
of their normal forms is taken and stripped of everything that the language does not need.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import reduce

import numpy as np
import numpy.typing as npt

from pytest_safemanip.ltlf.bdd import FALSE, TRUE, Cube
from pytest_safemanip.ltlf.errors import FormulaError
from pytest_safemanip.ltlf.formula import (
    Always,
    And,
    Constant,
    Formula,
    Iff,
    Not,
    Or,
    conjuncts,
    subformulas,
)
from pytest_safemanip.ltlf.progression import Progression

_MAX_CANDIDATES = 4  # residuals of one state that are written out to find the shortest
_MAX_STATES = 64  # automata up to this size get that, and their residuals simplified by language
_MAX_LITERALS = 16  # likewise normal forms
_MAX_CUBES = 32  # longer normal forms give way to nested decisions
_MAX_OPERATORS = 2000  # in those


def readable_residuals(
    formula: Formula,
    progression: Progression,
    members: list[list[int]],
    table: npt.NDArray[np.int32],
    accepting: npt.NDArray[np.bool_],
    check_time: Callable[[], None],
) -> tuple[Formula, ...]:
    """The residual of each state of a minimal automaton.

    Args:
        formula: what was compiled; also the residual of state 0.
        progression: where the residuals live.
        members: for each state, the residuals that were merged into it.
        table: int32[states, letters], the next state.
        accepting: bool[states].
        check_time: called for each state; raises when it is time to stop.

    Raises:
        FormulaError: a residual is too long to be written.
    """
    writer = _Writer(formula, progression, table, accepting)
    found = [formula]
    for state in range(1, len(members)):
        check_time()
        found.append(writer.shortest(state, members[state]))
    return tuple(found)


class _Writer:
    """Writes residuals of one formula as formulas."""

    def __init__(
        self,
        formula: Formula,
        progression: Progression,
        table: npt.NDArray[np.int32],
        accepting: npt.NDArray[np.bool_],
    ) -> None:
        self.progression = progression
        self.bdd = progression.bdd
        self.rows = table.tolist()
        self.accepting = accepting.tolist()
        # What `G` at the top asks of every step; it stays pending to the end of any trace.
        self.standing: dict[int, Formula] = {
            progression.residual(part): part
            for part in conjuncts(formula)
            if isinstance(part, Always)
        }

    def shortest(self, state: int, residuals: list[int]) -> Formula:
        """The shortest formula found for a state."""
        if all(successor == state for successor in self.rows[state]):
            return Constant(self.accepting[state])
        distinct = sorted(set(residuals), key=lambda f: (len(self._literals(f)), f))
        candidates = _MAX_CANDIDATES if len(self.rows) <= _MAX_STATES else 1
        return min((self._write(f, state) for f in distinct[:candidates]), key=_length)

    def _literals(self, residual: int) -> set[int]:
        """Levels of the variables that a residual depends on."""
        seen, stack = {FALSE, TRUE}, [residual]
        while stack:
            f = stack.pop()
            if f not in seen:
                seen.add(f)
                stack += (self.bdd.low[f], self.bdd.high[f])
        return {self.bdd.level[f] for f in seen if f not in (FALSE, TRUE)}

    def _write(self, residual: int, state: int) -> Formula:
        """The residual without the standing `G`s, unless they are all there is."""
        bdd = self.bdd
        pending, standing = residual, TRUE
        for variable in self.standing:
            level = bdd.level[variable]
            if bdd.given(pending, level, value=False) == FALSE:  # it implies the variable
                pending = bdd.given(pending, level, value=True)
                standing = bdd.both(standing, variable)
        if pending == TRUE and standing != TRUE:
            parts = self.standing.items()
            return reduce(And, (part for f, part in parts if bdd.both(f, standing) == standing))
        if pending in (FALSE, TRUE):  # there must be no further step, or any will do
            return Constant(pending == TRUE)
        forms = [
            _Form(self, cubes, inverted)
            for f, inverted in ((pending, False), (bdd.negation(pending), True))
            if (cubes := bdd.cover(f, _MAX_CUBES)) is not None
        ]
        if not forms:
            return self._decisions(pending)
        form = min(forms, key=lambda form: form.size())

        def same(candidate: _Form) -> bool:
            return self._same_language(bdd.both(candidate.function(), standing), state)

        if len(self.rows) <= _MAX_STATES and 1 < form.size() <= _MAX_LITERALS:
            form = form.stripped(same)
        return form.formula()

    def _decisions(self, residual: int) -> Formula:
        """The residual as its diagram has it: one obligation after the other."""
        bdd = self.bdd
        written: dict[int, Formula] = {FALSE: Constant(False), TRUE: Constant(True)}
        sizes = {FALSE: 1, TRUE: 1}

        def write(f: int) -> Formula:
            if f not in written:
                low, high = bdd.low[f], bdd.high[f]
                obligation = self.progression.obligation(bdd.level[f])
                if bdd.negation(low) == high:
                    written[f], sizes[f] = Iff(obligation, write(high)), sizes[high] + 2
                else:
                    yes, no = And(obligation, write(high)), And(Not(obligation), write(low))
                    written[f], sizes[f] = Or(yes, no), sizes[high] + sizes[low] + 5
                if sizes[f] > _MAX_OPERATORS:
                    raise FormulaError(
                        f"what a state owes takes more than {_MAX_OPERATORS} operators to write"
                    )
            return written[f]

        return write(residual)

    def _same_language(self, residual: int, state: int) -> bool:
        """Whether a residual accepts the same continuations as a state."""
        seen = {(residual, state)}
        stack = [(residual, state)]
        while stack:
            f, s = stack.pop()
            for (after, ends), t in zip(self.progression.successors(f), self.rows[s], strict=True):
                if ends != self.accepting[t]:
                    return False
                if (after, t) not in seen:
                    seen.add((after, t))
                    stack.append((after, t))
        return True


class _Form:
    """A disjunction of conjunctions, or the negation of one, read as a conjunction."""

    def __init__(self, writer: _Writer, cubes: Iterable[Cube], inverted: bool) -> None:
        self.writer = writer
        self.cubes = list(cubes)
        self.inverted = inverted

    def size(self) -> int:
        """Number of literals."""
        return sum(len(cube) for cube in self.cubes)

    def function(self) -> int:
        """The form as a decision diagram."""
        bdd = self.writer.bdd
        found = FALSE
        for cube in self.cubes:
            product = TRUE
            for level, positive in cube:
                variable = bdd.variable(level)
                product = bdd.both(product, variable if positive else bdd.negation(variable))
            found = bdd.either(found, product)
        return bdd.negation(found) if self.inverted else found

    def formula(self) -> Formula:
        """The form as a formula."""
        inner, outer = (Or, And) if self.inverted else (And, Or)
        clauses = ([self._literal(*literal) for literal in cube] for cube in self.cubes)
        return reduce(outer, (reduce(inner, clause) for clause in clauses))

    def _literal(self, level: int, positive: bool) -> Formula:
        obligation = self.writer.progression.obligation(level)
        return obligation if positive != self.inverted else Not(obligation)

    def _cube_length(self, cube: Cube) -> tuple[int, str]:
        return _length(_Form(self.writer, [cube], self.inverted).formula())

    def stripped(self, same: Callable[[_Form], bool]) -> _Form:
        """The form without redundant cubes, then literals; the longest are tried first."""
        form = self
        for cube in sorted(self.cubes, key=self._cube_length, reverse=True):
            rest = _Form(self.writer, [c for c in form.cubes if c != cube], self.inverted)
            if rest.cubes and same(rest):
                form = rest
        for cube in form.cubes:
            shorter = cube
            for literal in cube:
                fewer = tuple(x for x in shorter if x != literal)
                cubes = [fewer if c == shorter else c for c in form.cubes]
                candidate = _Form(self.writer, cubes, self.inverted)
                if fewer and same(candidate):
                    form, shorter = candidate, fewer
        return form


def _length(formula: Formula) -> tuple[int, str]:
    return sum(1 for _ in subformulas(formula)), str(formula)
