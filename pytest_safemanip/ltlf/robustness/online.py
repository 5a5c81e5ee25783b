"""Robustness of a trace while it is read: formula progression with numbers in place of truth.

What a prefix leaves open is a maximum of alternatives, each the minimum of a number and of what
some obligations will be worth from the next step on. Reading a step replaces every obligation by
what the fixpoint expansions of the operators ask of this step and of the rest, as in `progression`.
Since minimum and maximum distribute over each other, the result is exactly that on the whole trace,
at a cost that does not grow with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from pytest_safemanip.errors import TraceError, did_you_mean
from pytest_safemanip.ltlf.errors import FormulaError
from pytest_safemanip.ltlf.formula import (
    Always,
    And,
    Atom,
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
    atoms_of,
    is_bounded,
)
from pytest_safemanip.ltlf.robustness.offline import INFINITE

MAX_ALTERNATIVES = 4096
"""More than any formula needs whose clocks and operators can be told apart by a person."""


class _Owed(NamedTuple):
    """An obligation: what a formula, or its negation, is worth from the next step on.

    Attributes:
        formula: that is evaluated; the operator without its bound where there is a clock.
        positive: False for its negation.
        low: control periods until its bound begins; 0 without a bound.
        high: control periods until its bound ends; -1 without a bound.
    """

    formula: Formula
    positive: bool
    low: int = 0
    high: int = -1

    def implies(self, other: _Owed) -> bool:
        """Whether it is never worth more than another one."""
        if self == other:
            return True
        clocks = self.high >= 0 and other.high >= 0 and not self.low and not other.low
        if not clocks or self[:2] != other[:2]:
            return False
        soon = isinstance(self.formula, Eventually | Until) == self.positive
        return self.high <= other.high if soon else self.high >= other.high


_Clause = frozenset[_Owed]
_Alternatives = dict[_Clause, float]
"""The number of each alternative, by the obligations that it leaves open."""


class OnlineRobustness:
    """The robustness of a formula on the steps read so far, as if they were the whole trace.

    Args:
        formula: what is measured.
        dt: control period in seconds, if the formula has bounds.

    Raises:
        FormulaError: a bound without a control period.
    """

    def __init__(self, formula: Formula, dt: float | None = None) -> None:
        if dt is None and is_bounded(formula):
            raise FormulaError(f"'{formula}' has a bound in seconds: give the control period dt")
        self.formula, self.atoms = formula, atoms_of(formula)
        self._dt = 1.0 if dt is None else dt  # which only bounds ask for
        self._open: _Alternatives = {frozenset((_Owed(formula, True),)): INFINITE}

    def step(self, margins: Mapping[str, float], acting: bool = True) -> float:
        """Read a step; the robustness of the trace that ends with it.

        Args:
            margins: of each atom, positive where it is true.
            acting: whether the clocks of bounds run at this step.

        Raises:
            TraceError: an atom has no margin.
            FormulaError: too many clocks and operators wait for one another.
        """
        for name in self.atoms:
            if name not in margins:
                raise TraceError(f"atom {name!r} has no margin; {did_you_mean(name, margins)}")
        now = _Step(margins, acting, self._dt)
        ended = max(
            (min(number, min(map(now.end, owed), default=INFINITE))
             for owed, number in self._open.items()),
            default=-INFINITE,
        )  # fmt: skip
        rest: _Alternatives = {}
        for owed, number in self._open.items():
            found: _Alternatives = {frozenset(): number}
            for one in owed:
                found = _both(found, now.progress(one))
            rest = _either(rest, found)
        self._open = rest
        return ended


class _Step:
    """One step, and what it makes of obligations.

    Args:
        margins: of each atom.
        acting: whether clocks run.
        dt: control period in seconds.
    """

    def __init__(self, margins: Mapping[str, float], acting: bool, dt: float) -> None:
        self._margins, self._acting, self._dt = margins, acting, dt
        self._progressed: dict[_Owed, _Alternatives] = {}

    def end(self, owed: _Owed) -> float:
        """What an obligation is worth if this is the last step."""
        if owed.high >= 0:
            value = self._clocked_end(owed.formula, owed.low)
        else:
            value = self._at_end(owed.formula)
        return value if owed.positive else -value

    def progress(self, owed: _Owed) -> _Alternatives:
        """What an obligation asks of this step and of those after it."""
        if owed not in self._progressed:
            if owed.high >= 0:
                found = self._clocked(owed.formula, owed.positive, owed.low, owed.high)
            else:
                found = self._of(owed.formula, owed.positive)
            self._progressed[owed] = found
        return self._progressed[owed]

    def _at_end(self, formula: Formula) -> float:
        """The robustness of a formula on this step alone."""
        match formula:
            case Constant(value):
                return INFINITE if value else -INFINITE
            case Last() | WeakNext(_):
                return INFINITE
            case Next(_):
                return -INFINITE
            case Atom(name):
                return self._margins[name]
            case Not(p):
                return -self._at_end(p)
            case And(p, q):
                return min(self._at_end(p), self._at_end(q))
            case Or(p, q) | WeakUntil(p, q):
                return max(self._at_end(p), self._at_end(q))
            case Implies(p, q):
                return max(-self._at_end(p), self._at_end(q))
            case Iff(p, q):
                left, right = self._at_end(p), self._at_end(q)
                return min(max(-left, right), max(left, -right))
            case Eventually(p) | Always(p):
                return self._at_end(p)
            case Until(_, q) | Release(_, q):
                return self._at_end(q)
            case Bounded(core, bound):
                return self._clocked_end(core, bound.steps(self._dt)[0])
        raise AssertionError(f"no robustness of {type(formula).__name__}")

    def _clocked_end(self, core: Formula, low: int) -> float:
        """The robustness on this step alone of an operator whose bound begins after ``low``."""
        match core:
            case Eventually(_) | Until(_, _) if low:
                return -INFINITE
            case Always(_) if low:
                return INFINITE
            case WeakUntil(p, _) if low:
                return self._at_end(p)
        return self._at_end(core)

    def _of(self, formula: Formula, positive: bool) -> _Alternatives:
        """What a formula, or its negation, asks of this step and of those after it."""
        match formula:
            case Constant(value):
                return _certain if value == positive else {}
            case Last():
                return {} if positive else _certain
            case Atom(name):
                margin = self._margins[name]
                return {frozenset(): margin if positive else -margin}
            case Not(p):
                return self._of(p, not positive)
            case And(p, q):
                return _join(positive, self._of(p, positive), self._of(q, positive))
            case Or(p, q):
                return _join(not positive, self._of(p, positive), self._of(q, positive))
            case Implies(p, q):
                return _join(not positive, self._of(p, not positive), self._of(q, positive))
            case Iff(p, q):
                return self._of(And(Implies(p, q), Implies(q, p)), positive)
            case Next(p) | WeakNext(p):
                return {frozenset((_Owed(p, positive),)): INFINITE}
            case Bounded(core, bound):
                return self._clocked(core, positive, *bound.steps(self._dt))
        return self._unrolled(formula, positive, {frozenset((_Owed(formula, positive),)): INFINITE})

    def _clocked(self, core: Formula, positive: bool, low: int, high: int) -> _Alternatives:
        """The same of an operator with a bound."""
        if not self._acting:
            rest = {frozenset((_Owed(core, positive, low, high),)): INFINITE}
        elif high:
            later = _Owed(core, positive, max(low - 1, 0), high - 1)
            rest = {frozenset((later,)): INFINITE}
        else:  # its time is over
            strong = isinstance(core, Eventually | Until)
            rest = {} if strong == positive else _certain
        if not low:
            return self._unrolled(core, positive, rest)
        match core:
            case Until(p, _) | WeakUntil(p, _):
                return _join(positive, self._of(p, positive), rest)
        return rest

    def _unrolled(self, core: Formula, positive: bool, rest: _Alternatives) -> _Alternatives:
        """The fixpoint expansion of a temporal operator, given what is left of it."""
        match core:
            case Eventually(p):
                return _join(not positive, self._of(p, positive), rest)
            case Always(p):
                return _join(positive, self._of(p, positive), rest)
            case Until(p, q) | WeakUntil(p, q):
                waits = _join(positive, self._of(p, positive), rest)
                return _join(not positive, self._of(q, positive), waits)
            case Release(p, q):
                freed = _join(not positive, self._of(p, positive), rest)
                return _join(positive, self._of(q, positive), freed)
        raise AssertionError(f"no expansion for {type(core).__name__}")


_certain: _Alternatives = {frozenset(): INFINITE}


def _join(all_of: bool, one: _Alternatives, other: _Alternatives) -> _Alternatives:
    return _both(one, other) if all_of else _either(one, other)


def _either(one: _Alternatives, other: _Alternatives) -> _Alternatives:
    """The maximum of both."""
    return _reduced([*one.items(), *other.items()])


def _both(one: _Alternatives, other: _Alternatives) -> _Alternatives:
    """The minimum of both."""
    return _reduced(
        (_strongest(left | right), min(number, its))
        for left, number in one.items()
        for right, its in other.items()
    )


def _strongest(owed: _Clause) -> _Clause:
    """Without the obligations that others imply."""
    if len(owed) < 2 or all(one.high < 0 for one in owed):
        return owed
    return frozenset(
        one for one in owed if not any(other != one and other.implies(one) for other in owed)
    )


def _reduced(found: Iterable[tuple[_Clause, float]]) -> _Alternatives:
    """Without the alternatives that are never worth more than others.

    Raises:
        FormulaError: too many are left.
    """
    kept: _Alternatives = {}
    # The largest numbers first, and of these the fewest obligations: nothing later is above them.
    for owed, number in sorted(found, key=lambda item: (-item[1], len(item[0]))):
        if not any(_below(owed, other) for other in kept):
            kept[owed] = number
    if len(kept) > MAX_ALTERNATIVES:
        raise FormulaError(
            f"robustness online: more than {MAX_ALTERNATIVES} alternatives are open; "
            "use fewer bounds and operators inside one another"
        )
    return kept


def _below(owed: _Clause, other: _Clause) -> bool:
    """Whether all of some other obligations are implied by these."""
    return other <= owed or all(any(one.implies(wanted) for one in owed) for wanted in other)
