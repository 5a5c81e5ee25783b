"""Compiles a formula to a DFA: explores its residuals and merges equivalent ones."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from pytest_safemanip.ltlf.bdd import Bdd
from pytest_safemanip.ltlf.dfa import Dfa, StateClass
from pytest_safemanip.ltlf.errors import FormulaError
from pytest_safemanip.ltlf.formula import Formula, atoms_of, check_depth, is_bounded
from pytest_safemanip.ltlf.parser import parse
from pytest_safemanip.ltlf.progression import Progression
from pytest_safemanip.ltlf.residuals import readable_residuals

Table = npt.NDArray[np.int32]

_MAX_NODES = 500_000  # decision diagrams are also held to a size, about 200 MB
_CLOCKED_STATES = 1 << 14
_FAR = 1 << 30
_MAX_ENTRIES = 1 << 22  # and so is the table before minimisation, 16 MB


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits at which compilation stops with an error.

    Attributes:
        atoms: number of atoms; the table has 2 ** atoms columns.
        states: number of states before minimisation.
        seconds: wall-clock time.
    """

    atoms: int = 12
    states: int = 4096
    seconds: float = 10.0


def compile_formula(
    formula: str | Formula,
    *,
    atoms: Sequence[str] | None = None,
    cache: bool = True,
    limits: Limits | None = None,
    dt: float | None = None,
) -> Dfa:
    """Compile a formula to its minimal automaton.

    Args:
        formula: text, or a tree.
        atoms: the atoms in the order of their bits, which may be more than occur in the formula;
            by default those that occur, sorted.
        cache: give the same automaton again for the same formula and atoms, within this process.
            Nothing is kept on disk: compiling is faster than reading a file would be.
        limits: where to stop; by default as `Limits`, with four times the states for bounds.
        dt: control period in seconds, which a formula with bounds needs; it changes no other.

    Raises:
        FormulaError: the text is no formula, an atom of it is missing from `atoms`, or a limit is
            exceeded; the message says which.
    """
    tree = parse(formula) if isinstance(formula, str) else formula
    check_depth(tree)
    occurring = atoms_of(tree)
    names = occurring if atoms is None else tuple(atoms)
    if limits is None:
        limits = Limits(states=_CLOCKED_STATES) if is_bounded(tree) else Limits()
    missing = [name for name in occurring if name not in names]
    if missing:
        raise FormulaError(f"atom {missing[0]!r} occurs in the formula but not in the list given")
    if len(set(names)) < len(names):
        raise FormulaError(f"an atom is listed twice: {', '.join(names)}")
    if len(names) > limits.atoms:
        raise FormulaError(f"{len(names)} atoms; the limit is {limits.atoms} (limit 'atoms')")
    period = dt if is_bounded(tree) else None
    if period is not None and not (math.isfinite(period) and period > 0):
        raise FormulaError(f"control period dt: expected a positive number, found {period!r}")
    return (_compile_once if cache else _compile)(tree, names, limits, period)


def _compile(
    formula: Formula, atoms: tuple[str, ...], limits: Limits, dt: float | None = None
) -> Dfa:
    budget = _Budget(limits, len(atoms), formula, dt)
    progression = Progression(atoms, Bdd(budget.grow), dt)
    try:
        raw = _explore(progression, progression.residual(formula), budget, clocks=dt is not None)
    except RecursionError:
        raise FormulaError(f"too many obligations are open at once{budget.remedy}") from None
    wide, accepting, members = _number(raw, _merge(raw, budget))
    wide.setflags(write=False)
    table, standing = wide[:, : 1 << len(atoms)], wide[:, 1 << len(atoms) :]
    accepting.setflags(write=False)
    merged = [[raw.residuals[number] for number in block] for block in members]
    residuals = readable_residuals(
        formula, progression, merged, table, accepting, budget.check_time
    )
    classes = tuple(_classes(table, accepting))
    rows = tuple(map(tuple, table.tolist()))
    return Dfa(
        formula, atoms, table, accepting, classes, residuals, rows, dt, standing if dt else None
    )


_compile_once = lru_cache(maxsize=1024)(_compile)


class _Budget:
    """Time and memory that one compilation may use."""

    def __init__(self, limits: Limits, atoms: int, formula: Formula, dt: float | None) -> None:
        self.limits = limits
        self.remedy = ""
        self.clocks = dt is not None
        if dt is not None:
            self.remedy = (
                f"; the clocks of '{formula}' count steps of {dt:g} s: shorten the bounds, begin "
                "them at 0, or split the conjunction into properties of one bound each"
            )
        self.states = min(limits.states, _MAX_ENTRIES >> atoms)
        self.nodes = 0
        self.until = time.monotonic() + limits.seconds

    def grow(self) -> None:
        """Account for one more node of a decision diagram."""
        self.nodes += 1
        if self.nodes > _MAX_NODES:
            raise FormulaError(f"the formula needs more than {_MAX_NODES} decision nodes")
        if self.nodes % 256 == 0:
            self.check_time()

    def check_states(self, count: int) -> None:
        """Raise on more states than allowed."""
        if count > self.states:
            raise FormulaError(
                f"the automaton has more than {self.states} states before minimisation "
                f"(limit 'states', or the size of the table){self.remedy}"
            )

    def check_time(self) -> None:
        """Raise after the time allowed."""
        if time.monotonic() > self.until:
            raise FormulaError(
                f"compiling took more than {self.limits.seconds:g} s (limit 'seconds'){self.remedy}"
            )


@dataclass(frozen=True, slots=True)
class _Raw:
    """The automaton before minimisation; state 0, the start, is entered by no step.

    A state is a residual together with whether the step that led to it may be the last.
    """

    residuals: list[int]
    accepting: npt.NDArray[np.bool_]  # that of state 0 means nothing
    table: Table


def _explore(progression: Progression, start: int, budget: _Budget, *, clocks: bool) -> _Raw:
    """All residuals; with clocks, each letter once more, for steps at which they stand."""
    numbers: dict[tuple[int, bool], int] = {}
    residuals, accepting = [start], [False]
    rows: list[list[int]] = []
    while len(rows) < len(residuals):
        budget.check_time()
        row = []
        after = progression.successors(residuals[len(rows)])
        if clocks:
            after = after + progression.successors(residuals[len(rows)], standing=True)
        for key in after:
            number = numbers.get(key)
            if number is None:
                number = numbers[key] = len(residuals)
                residuals.append(key[0])
                accepting.append(key[1])
                budget.check_states(len(residuals))
            row.append(number)
        rows.append(row)
    return _Raw(residuals, np.array(accepting), np.array(rows, dtype=np.int32))


def _merge(raw: _Raw, budget: _Budget) -> list[int]:
    """The block of each raw state: Moore's partition refinement.

    The start is left out, since nothing leads to it and its acceptance means nothing. In the end
    it joins a block that goes on alike (an accepting one, if there are two) or forms its own.
    """
    block = raw.accepting.astype(np.int32)
    if budget.clocks:  # else each round tells only one more step of a clock apart
        block = _signatures(raw)
    count = len(set(block[1:].tolist()))
    while True:
        budget.check_time()
        rows = [row.tobytes() for row in block[raw.table]]
        keys = dict.fromkeys(zip(block[1:].tolist(), rows[1:], strict=True))
        numbers = {key: number for number, key in enumerate(keys)}
        block[1:] = [numbers[key] for key in zip(block[1:].tolist(), rows[1:], strict=True)]
        if len(numbers) == count:
            break
        count = len(numbers)
    alike = [number for number, row in enumerate(rows) if number and row == rows[0]]
    alike.sort(key=lambda number: not raw.accepting[number])
    block[0] = block[alike[0]] if alike else count
    merged: list[int] = block.tolist()
    return merged


def _number(raw: _Raw, block: list[int]) -> tuple[Table, npt.NDArray[np.bool_], list[list[int]]]:
    """Number the blocks breadth first; give the table, acceptance and raw members of each."""
    members: dict[int, list[int]] = {}
    for number, b in enumerate(block):
        members.setdefault(b, []).append(number)
    # Any member has the block's row; the last is never the start, unless that is the only one.
    rows = {b: [block[i] for i in raw.table[m[-1]].tolist()] for b, m in members.items()}
    order = {block[0]: 0}
    queue = [block[0]]
    for b in queue:
        for successor in rows[b]:
            if successor not in order:
                order[successor] = len(order)
                queue.append(successor)
    table = np.array([[order[b] for b in rows[state]] for state in queue], dtype=np.int32)
    accepting = np.array([raw.accepting[members[state][-1]] for state in queue])
    return table, accepting, [members[state] for state in queue]


def _classes(table: Table, accepting: npt.NDArray[np.bool_]) -> list[StateClass]:
    """Class of each state; what is so in all that follow it is final."""
    maybe, never = _reaching(table, accepting), ~_reaching(table, ~accepting)
    final = {(True, True): StateClass.TRUE, (False, False): StateClass.FALSE}
    return [
        final.get((can, must))
        or (StateClass.CURRENTLY_TRUE if accepted else StateClass.CURRENTLY_FALSE)
        for can, must, accepted in zip(
            maybe.tolist(), never.tolist(), accepting.tolist(), strict=True
        )
    ]


def _reaching(table: Table, goal: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """The states after which one of some states comes, now or later: bool[states]."""
    return _distance(table, goal) < _FAR


def _signatures(raw: _Raw) -> Table:
    """Numbers by which states that differ are told apart, though not all: int32[states].

    Those of states that accept the same are equal: acceptance, and how soon all may be lost or won.
    """
    accepting = raw.accepting
    lost, won = (~_reaching(raw.table, goal) for goal in (accepting, ~accepting))
    rows = [accepting, _distance(raw.table, lost), _distance(raw.table, won)]
    _, numbers = np.unique(np.stack(rows), axis=1, return_inverse=True)
    found: Table = numbers.ravel().astype(np.int32)
    return found


def _distance(table: Table, goal: npt.NDArray[np.bool_]) -> Table:
    """In how few steps each state comes to one of some states; `_FAR` if never: int32[states]."""
    found = np.where(goal, 0, _FAR).astype(np.int32)
    while True:
        more = np.minimum(found, found[table].min(axis=1) + 1)
        if (more == found).all():
            return found
        found = more
