"""Parses formulas, with errors that point at the column.

Seconds in brackets may follow `F`, `G`, `U` and `W`: `F[<=5] p`, `p U[1,3] q`.

Binding, from loose to tight: `<->`, `->` (right-associative), `|`, `&`, then `U` `W` `R`
(right-associative), then the prefix operators `!` `X` `WX` `F` `G`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NoReturn

from pytest_safemanip.ltlf.errors import FormulaError
from pytest_safemanip.ltlf.formula import (
    LONGEST,
    MAX_DEPTH,
    Always,
    And,
    Atom,
    Binary,
    Bound,
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
    Unary,
    Until,
    WeakNext,
    WeakUntil,
    bounded,
    check_depth,
)

MAX_TEXT = 10_000  # characters of one formula

_PREFIX: dict[str, type[Unary]] = {
    node.symbol: node for node in (Not, Next, WeakNext, Eventually, Always)
}
_INFIX: dict[str, type[Binary]] = {
    node.symbol: node for node in (Until, WeakUntil, Release, And, Or, Implies, Iff)
}
_BOUNDED = (Eventually, Always, Until, WeakUntil)
_LEAVES = {"true": Constant(True), "false": Constant(False), "last": Last()}
_ATOM = re.compile(r"[a-z_][a-z0-9_]*")
_TOKEN = re.compile(r"<->|->|[!&|()\[\],]|<=|>=|<|>|\d+(?:\.\d+)?(?!\w)|\w+")
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_SPACE = re.compile(r"\s*")


@dataclass(frozen=True, slots=True)
class _Token:
    text: str  # empty at the end of the formula
    offset: int  # characters before it

    def __str__(self) -> str:
        return repr(self.text) if self.text else "the end of the formula"


def parse(text: str) -> Formula:
    """Read a formula.

    Args:
        text: for example `G (released -> F settled)`.

    Raises:
        FormulaError: the text is no formula; the message names the column (and the line, if the
            text has several) and what was expected there.
    """
    if len(text) > MAX_TEXT:
        raise FormulaError(f"formula of {len(text)} characters; at most {MAX_TEXT} are read")
    formula = _Parser(text).formula()
    check_depth(formula)
    return formula


class _Parser:
    """Precedence climbing over one token of look-ahead."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.depth = 0
        self.last = _Token("", 0)
        self.token = self._read(0)

    def formula(self) -> Formula:
        """The whole text."""
        formula = self._infix(1)
        if self.token.text:
            self._fail(f"expected an operator or the end after {self.last}, found {self.token}")
        return formula

    def _infix(self, loosest: int) -> Formula:
        """A formula whose outermost infix operator binds at least as tightly as `loosest`."""
        self._descend()
        left = self._prefix()
        while (node := _INFIX.get(self.token.text)) and node.precedence >= loosest:
            self._advance()
            bound = self._bound(node)
            left = node(left, self._infix(node.precedence + (not node.right_associative)))
            if bound and isinstance(left, Until | WeakUntil):
                left = bounded(left, bound)
        self.depth -= 1
        return left

    def _prefix(self) -> Formula:
        self._descend()
        token = self.token
        if node := _PREFIX.get(token.text):
            self._advance()
            bound = self._bound(node)
            formula: Formula = node(self._prefix())
            if bound and isinstance(formula, Eventually | Always):
                formula = bounded(formula, bound)
        elif token.text == "(":
            self._advance()
            formula = self._infix(1)
            if self.token.text != ")":
                where = self._place(token.offset)
                self._fail(f"expected ')' for the '(' at {where}, found {self.token}")
            self._advance()
        else:
            formula = self._leaf()
        self.depth -= 1
        return formula

    def _bound(self, node: type[Formula]) -> Bound | None:
        """The seconds in brackets that may follow an operator."""
        if self.token.text != "[":
            return None
        if node not in _BOUNDED:
            self._fail(f"{self.last} takes no bound; F, G, U and W do")
        self._advance()
        if self.token.text in ("<", ">", ">="):
            self._fail(f"no bound begins with {self.token}; there are [<=5] and [1,3], in seconds")
        if self.token.text == "<=":
            self._advance()
            low, high = 0.0, self._seconds()
        else:
            low = self._seconds()
            self._expect(",")
            offset = self.token
            high = self._seconds()
            if high < low:
                self.token = offset
                self._fail(f"a bound that ends before it begins: [{low:g},{high:g}]")
        self._expect("]")
        return Bound(low, high)

    def _seconds(self) -> float:
        if not _NUMBER.fullmatch(self.token.text) or not self.token.text.isascii():
            self._fail(f"expected seconds, as in F[<=5] or F[1,3], found {self.token}")
        seconds = float(self.token.text)
        if seconds > LONGEST:
            self._fail(f"{self.token} seconds; at most {LONGEST:g}, a day")
        self._advance()
        return seconds

    def _expect(self, text: str) -> None:
        if self.token.text != text:
            self._fail(f"expected {text!r} after {self.last}, found {self.token}")
        self._advance()

    def _leaf(self) -> Formula:
        name = self.token.text
        if name not in _LEAVES and not _ATOM.fullmatch(name):
            after = f" after {self.last}" if self.last.text else ""
            self._fail(f"expected a formula{after}, found {self.token}{_hint(name)}")
        self._advance()
        return _LEAVES.get(name) or Atom(name)

    def _descend(self) -> None:
        # Parentheses leave no trace in the tree, so its depth limit does not bound them.
        self.depth += 1
        if self.depth > 4 * MAX_DEPTH:
            self._fail(f"nested too deeply; at most {MAX_DEPTH} operators inside each other")

    def _advance(self) -> None:
        self.last = self.token
        self.token = self._read(self.token.offset + len(self.token.text))

    def _read(self, offset: int) -> _Token:
        space = _SPACE.match(self.text, offset)
        offset = space.end() if space else offset
        match = _TOKEN.match(self.text, offset)
        if match is None and offset < len(self.text):
            self.token = _Token(self.text[offset], offset)
            self._fail(f"unknown character {self.token}")
        return _Token(match.group() if match else "", offset)

    def _fail(self, message: str) -> NoReturn:
        offset = self.token.offset
        raise FormulaError(f"{self._place(offset)}: {message}", self._column(offset))

    def _place(self, offset: int) -> str:
        line = self.text.count("\n", 0, offset) + 1
        column = f"column {self._column(offset)}"
        return column if "\n" not in self.text.strip("\n") else f"line {line}, {column}"

    def _column(self, offset: int) -> int:
        return offset - self.text.rfind("\n", 0, offset)


def _hint(name: str) -> str:
    """A hint about a rejected word."""
    if name in _INFIX:
        return "; an operator needs a formula on both sides"
    glued = re.match(r"(WX|[XFG])(?=[a-z_])", name)
    if glued:
        operator = glued.group()
        return f"; an operator ends at a space: '{operator} {name[len(operator) :]}'"
    if _ATOM.fullmatch(name.lower()):
        return "; atoms are written in lower case"
    return ""
