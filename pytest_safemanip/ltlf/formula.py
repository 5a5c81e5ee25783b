"""The syntax tree of LTLf formulas and its text form.

Nodes are immutable and hashable: two formulas are equal when they are written the same way.
`str()` prints with as few parentheses as the grammar allows, and parsing the text gives the same
tree again. The logic is that of De Giacomo and Vardi (2013), over finite, non-empty traces.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from pytest_safemanip.ltlf.errors import FormulaError
from pytest_safemanip.strategies import made_by

ROUNDING = 1e-9  # 0.3 s at 0.1 s a step is 3 steps, although 0.3 / 0.1 < 3 in binary
LONGEST = 86_400.0
"""Seconds of the longest bound or deadline, a day: longer than a rollout."""
MAX_DEPTH = 100  # of the tree; recursion over it stays far from Python's own limit

_ATOM = re.compile(r"[a-z_][a-z0-9_]*")
_RESERVED = frozenset({"true", "false", "last"})


@made_by("formulas")
@dataclass(frozen=True, slots=True)
class Formula:
    """Base of all nodes."""

    precedence: ClassVar[int] = 7  # leaves bind tightest

    @property
    def operands(self) -> tuple[Formula, ...]:
        """The direct subformulas, from left to right."""
        return ()


@dataclass(frozen=True, slots=True)
class Constant(Formula):
    """`true` or `false`."""

    value: bool

    def __str__(self) -> str:
        return "true" if self.value else "false"


@dataclass(frozen=True, slots=True)
class Last(Formula):
    """`last`: this is the last step of the trace."""

    def __str__(self) -> str:
        return "last"


@dataclass(frozen=True, slots=True)
class Atom(Formula):
    """An atomic proposition, `[a-z_][a-z0-9_]*` except the words `true`, `false` and `last`.

    Raises:
        FormulaError: the name is not of that form.
    """

    name: str

    def __post_init__(self) -> None:
        if self.name in _RESERVED or not _ATOM.fullmatch(self.name):
            raise FormulaError(
                f"{self.name!r} cannot name an atom: lower-case letters, digits and '_', "
                "not starting with a digit, and none of true, false, last"
            )

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class Unary(Formula):
    """A prefix operator and its operand."""

    operand: Formula
    symbol: ClassVar[str]
    precedence: ClassVar[int] = 6

    @property
    def operands(self) -> tuple[Formula, ...]:
        """The one operand."""
        return (self.operand,)

    def __str__(self) -> str:
        return self.written()

    def written(self, bound: str = "") -> str:
        """The text, with a bound after the operator."""
        inner = _in_parentheses(self.operand, self.operand.precedence < self.precedence)
        return self.symbol + bound + ("" if self.symbol == "!" else " ") + inner


@dataclass(frozen=True, slots=True)
class Binary(Formula):
    """An infix operator and its two operands."""

    left: Formula
    right: Formula
    symbol: ClassVar[str]
    right_associative: ClassVar[bool] = False

    @property
    def operands(self) -> tuple[Formula, ...]:
        """Left, right."""
        return (self.left, self.right)

    def __str__(self) -> str:
        return self.written()

    def written(self, bound: str = "") -> str:
        """The text, with a bound after the operator."""
        own, left, right = self.precedence, self.left.precedence, self.right.precedence
        left_open = left < own or (left == own and self.right_associative)
        right_open = right < own or (right == own and not self.right_associative)
        return (
            f"{_in_parentheses(self.left, left_open)} {self.symbol}{bound} "
            f"{_in_parentheses(self.right, right_open)}"
        )


class Not(Unary):
    """`!p`."""

    __slots__ = ()
    symbol = "!"


class Next(Unary):
    """`X p`: there is a next step, and p holds there (strong)."""

    __slots__ = ()
    symbol = "X"


class WeakNext(Unary):
    """`WX p`: p holds at the next step, if there is one."""

    __slots__ = ()
    symbol = "WX"


class Eventually(Unary):
    """`F p`: p holds at this or a later step."""

    __slots__ = ()
    symbol = "F"


class Always(Unary):
    """`G p`: p holds at this and every later step."""

    __slots__ = ()
    symbol = "G"


class Until(Binary):
    """`p U q`: q holds at some step, and p at every step before it."""

    __slots__ = ()
    symbol, precedence, right_associative = "U", 5, True


class WeakUntil(Binary):
    """`p W q`: `(p U q) | G p`."""

    __slots__ = ()
    symbol, precedence, right_associative = "W", 5, True


class Release(Binary):
    """`p R q`: q holds up to and including the first step where p holds, or to the end."""

    __slots__ = ()
    symbol, precedence, right_associative = "R", 5, True


@dataclass(frozen=True, slots=True)
class Bound:
    """The time that an operator speaks about, from `low` to `high` seconds after a step."""

    low: float
    high: float

    def __str__(self) -> str:
        return f"[<={self.high:.10g}]" if self.low == 0 else f"[{self.low:.10g},{self.high:.10g}]"

    def steps(self, dt: float) -> tuple[int, int]:
        """The first and the last step of it: rounded outwards, so that there is always one.

        Args:
            dt: control period in seconds.
        """
        low = math.floor(self.low / dt * (1 + ROUNDING))
        return low, math.ceil(self.high / dt * (1 - ROUNDING))


@dataclass(frozen=True, slots=True)
class Bounded(Formula):
    """An operator with a bound in seconds (MTL over finite traces), printed `F[<=5] p`.

    `F` and `U` are strong: what they wait for comes within the bound and before the trace ends.
    `G` asks of the steps within the bound only, and `p W[a,b] q` is `(p U[a,b] q) | G[<=b] p`.
    """

    core: Eventually | Always | Until | WeakUntil
    bound: Bound

    @property
    def operands(self) -> tuple[Formula, ...]:
        """Those of the operator."""
        return self.core.operands

    def __str__(self) -> str:
        return self.core.written(str(self.bound))


class BoundedPrefix(Bounded):
    """`F[a,b] p` and `G[a,b] p`."""

    __slots__ = ()
    precedence = 6


class BoundedInfix(Bounded):
    """`p U[a,b] q` and `p W[a,b] q`."""

    __slots__ = ()
    precedence = 5


def bounded(core: Eventually | Always | Until | WeakUntil, bound: Bound) -> Bounded:
    """An operator with a bound."""
    return (BoundedPrefix if isinstance(core, Unary) else BoundedInfix)(core, bound)


def is_bounded(formula: Formula) -> bool:
    """Whether some operator has a bound, so that the automaton depends on the control period."""
    return any(isinstance(node, Bounded) for node in subformulas(formula))


class And(Binary):
    """`p & q`."""

    __slots__ = ()
    symbol, precedence = "&", 4


class Or(Binary):
    """`p | q`."""

    __slots__ = ()
    symbol, precedence = "|", 3


class Implies(Binary):
    """`p -> q`, right-associative."""

    __slots__ = ()
    symbol, precedence, right_associative = "->", 2, True


class Iff(Binary):
    """`p <-> q`."""

    __slots__ = ()
    symbol, precedence = "<->", 1


def _in_parentheses(formula: Formula, needed: bool) -> str:
    return f"({formula})" if needed else str(formula)


def subformulas(formula: Formula) -> Iterator[Formula]:
    """The formula and everything inside it, from left to right, repetitions included."""
    stack = [formula]
    while stack:
        node = stack.pop()
        yield node
        stack.extend(reversed(node.operands))


def atoms_of(formula: Formula) -> tuple[str, ...]:
    """Names of the atoms that occur, sorted."""
    return tuple(sorted({node.name for node in subformulas(formula) if isinstance(node, Atom)}))


def is_propositional(formula: Formula) -> bool:
    """Whether the formula speaks about one step only: no temporal operator and no `last`."""
    propositional = (Constant, Atom, Not, And, Or, Implies, Iff)
    return all(isinstance(node, propositional) for node in subformulas(formula))


def conjuncts(formula: Formula) -> list[Formula]:
    """The parts of a conjunction; the formula alone if it is none."""
    if isinstance(formula, And):
        return conjuncts(formula.left) + conjuncts(formula.right)
    return [formula]


def check_depth(formula: Formula) -> None:
    """Refuse a tree that recursive code could not walk.

    Raises:
        FormulaError: the formula is nested deeper than `MAX_DEPTH`.
    """
    layer, depth = [formula], 0
    while layer:
        depth += 1
        if depth > MAX_DEPTH:
            raise FormulaError(f"formula nested more than {MAX_DEPTH} operators deep")
        layer = [operand for node in layer for operand in node.operands]
