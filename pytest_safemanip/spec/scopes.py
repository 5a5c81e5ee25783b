"""Scopes of specification patterns: the stretches of a trace of which a formula is asked.

The scopes are those of Dwyer, Avrunin and Corbett (ICSE 1999). A stretch contains the step that
opens it and not the one that ends it. What opens a scope that is open already changes nothing, so
an event may be written as a condition that holds for many steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pytest_safemanip.ltlf.formula import (
    Always,
    And,
    Atom,
    Binary,
    Bounded,
    Constant,
    Eventually,
    Formula,
    Implies,
    Last,
    Next,
    Not,
    Or,
    Release,
    Unary,
    Until,
    WeakNext,
    WeakUntil,
    bounded,
)


@dataclass(frozen=True, slots=True)
class Scope:
    """A kind of stretch.

    Attributes:
        events: names of what opens and ends it, in the order of the arguments.
        says: which stretch, in terms of these.
        examples: traces for `absence(p)` there, as in :class:`~.patterns.Pattern`.
        build: the formula that asks another of these stretches, from (that formula, whether it
            holds from every step of a stretch if it holds from the first, the events).
        opens: when a stretch is open or about to be, so that there is something to ask; None:
            always.
    """

    events: str
    says: str
    examples: tuple[str, str, str]
    build: Callable[[Formula, bool, Sequence[Formula]], Formula]
    opens: Callable[[Sequence[Formula]], Formula] | None = None


def before(formula: Formula, end: Formula) -> Formula:
    """What a formula says of the trace that is cut off before the first step at which `end` holds.

    Where `end` holds at once nothing is left, and the formula says what LTLf says of no steps:
    something is not found, and everything holds.
    """
    going_on = Not(end)

    def inside(node: Formula) -> Formula:
        return before(node, end)

    match formula:
        case Constant() | Atom():
            return formula
        case Last():
            return WeakNext(end)
        case Bounded(core=Eventually(part), bound=bound):
            return bounded(Until(going_on, And(inside(part), going_on)), bound)
        case Bounded(core=Until(left, right), bound=bound):
            found = Until(And(inside(left), going_on), And(inside(right), going_on))
            return bounded(found, bound)
        case Bounded(core=Always(part), bound=bound):
            return Not(inside(bounded(Eventually(Not(part)), bound)))
        case Bounded(core=WeakUntil(left, right), bound=bound):
            always = bounded(Always(left), bound.__class__(0.0, bound.high))
            return Or(inside(bounded(Until(left, right), bound)), inside(always))
        case Next(part):
            return Next(And(going_on, inside(part)))
        case WeakNext(part):
            return WeakNext(Or(end, inside(part)))
        case Eventually(part):
            return Until(going_on, And(inside(part), going_on))
        case Always(part):
            return WeakUntil(inside(part), end)
        case Until(left, right):
            return Until(And(inside(left), going_on), And(inside(right), going_on))
        case WeakUntil(left, right):
            return WeakUntil(inside(left), Or(end, inside(right)))
        case Release(left, right):
            return WeakUntil(inside(right), Or(end, And(inside(left), inside(right))))
        case Unary(part) | Binary(part, _):
            return type(formula)(*map(inside, formula.operands))
    raise TypeError(f"no formula: {formula!r}")


def _before(formula: Formula, every: bool, events: Sequence[Formula]) -> Formula:
    (end,) = events
    return Implies(Eventually(end), before(formula, end))


def _after(formula: Formula, every: bool, events: Sequence[Formula]) -> Formula:
    (begin,) = events
    if every:
        return Always(Implies(begin, formula))
    return WeakUntil(Not(begin), And(begin, formula))


def _between(formula: Formula, every: bool, events: Sequence[Formula]) -> Formula:
    begin, end = events
    return _stretches(before(formula, end), every, begin, end, Eventually(end))


def _after_until(formula: Formula, every: bool, events: Sequence[Formula]) -> Formula:
    begin, end = events
    return _stretches(before(formula, end), every, begin, end, None)


def _stretches(
    asked: Formula, every: bool, begin: Formula, end: Formula, where: Formula | None
) -> Formula:
    """The formula at the first step of every stretch, where a condition holds there."""
    opening = And(begin, Not(end))
    if every:
        return Always(Implies(And(opening, where) if where else opening, asked))
    there = And(opening, Implies(where, asked) if where else asked)
    next_one = WeakUntil(Or(end, Not(begin)), there)
    return And(next_one, Always(Implies(end, next_one)))


def _first(events: Sequence[Formula]) -> Formula:
    return events[0]


def _opening(events: Sequence[Formula]) -> Formula:
    return And(events[0], Not(events[1]))


SCOPES = {
    "globally": Scope(
        "",
        "the whole rollout",
        ("- - -", "- p -", "p - -"),
        lambda formula, every, events: formula,
    ),
    "before": Scope(
        "r",
        "up to the first `r`; none if `r` never comes",
        ("- r p", "p - r", "p - -"),
        _before,
        _first,
    ),
    "after": Scope(
        "q", "from the first `q` to the end", ("p q -", "- q p", "p - -"), _after, _first
    ),
    "between": Scope(
        "q r",
        "from a `q` to the next `r`, if there is one; a further `q` on the way opens nothing",
        ("q - r p", "q p r -", "q p - -"),
        _between,
        _opening,
    ),
    "after_until": Scope(
        "q r",
        "from a `q` to the next `r`, or to the end; a further `q` on the way opens nothing",
        ("q - r p", "q p - -", "p r p -"),
        _after_until,
        _opening,
    ),
}
"""All scopes, by name."""
