"""Many instances over a whole trace at once."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from pytest_safemanip.ltlf.letters import BoolArray, Letters
from pytest_safemanip.ltlf.rules import Rules
from pytest_safemanip.ltlf.verdicts import States

_FEW = 32  # below this many instances, Python loops beat an array operation per step


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """Verdicts as arrays over T steps and I instances.

    Attributes:
        states: uint[T, I], the automaton's state after each step.
        unsafe: bool[T, I], unsafe steps.
        violated: bool[I], whether there is one.
        at_end: bool[I], whether the last step is unsafe only because the trace ends there.
        open_since: int[I], the step at which the obligation opened that is open at the end; -1 if
            none is.
        triggered_steps: int[I], number of steps at which the trigger held.
    """

    states: States
    unsafe: BoolArray
    violated: BoolArray
    at_end: BoolArray
    open_since: npt.NDArray[np.int64]
    triggered_steps: npt.NDArray[np.int64]


def judge(rules: Rules, letters: Letters, acting: BoolArray) -> Judgement:
    """Run a monitor over whole traces.

    Args:
        rules: the property's rules.
        letters: uint[T, I].
        acting: bool[T], False in the settle tail.
    """
    steps, instances = letters.shape
    if rules.triggering is None:
        triggered = np.full(instances, steps)
    else:
        held = rules.triggering.among(letters)
        triggered = np.add.reduce(held, axis=0, dtype=np.uint32).astype(np.int64)
    counted = steps if rules.clock_runs_in_tail else int(np.count_nonzero(acting))
    if instances < _FEW:
        states, visited = _few_states(rules, letters, counted)
        if visited <= rules.calm:  # mostly nothing happens
            return _calm(states, triggered)
    else:
        states = _many_states(rules, letters, counted)
    opened, unsafe = rules.open.among(states), rules.unsafe.among(states)
    if rules.deadline_steps is not None:
        _mark_overdue(unsafe, opened, counted, rules.deadline_steps)
    at_end = opened[-1] & ~unsafe[-1] & rules.end_decides(not acting[-1])
    unsafe[-1] |= at_end
    violated = np.logical_or.reduce(unsafe, axis=0)
    return Judgement(states, unsafe, violated, at_end, _open_since(opened), triggered)


def _calm(states: States, triggered: npt.NDArray[np.int64]) -> Judgement:
    """The judgement on instances of which none ever has an open obligation or an unsafe step."""
    never = np.zeros(len(triggered), bool)
    unsafe = np.zeros(states.shape, bool)
    return Judgement(states, unsafe, never, never, np.full(len(triggered), -1), triggered)


def _few_states(rules: Rules, letters: Letters, counted: int) -> tuple[States, set[int]]:
    """The state of each instance after each step: uint[T, I]; and which there are.

    After the first `counted` steps clocks stand.
    """
    found, visited = np.empty(letters.shape, dtype=rules.state_type), set[int]()
    changes = letters[1:] != letters[:-1]
    if 0 < counted < len(letters) and rules.standing is not rules.table:
        changes[counted - 1] = True
    for instance in range(letters.shape[1]):
        column, states, state = letters[:, instance], found[:, instance], 0
        edges = [0, *(np.flatnonzero(changes[:, instance]) + 1).tolist(), len(column)]
        for letter, (begin, end) in zip(column[edges[:-1]].tolist(), pairwise(edges), strict=True):
            rows = rules.rows if begin < counted else rules.rows_standing
            # While the letter stays, so does the state, once it led to itself.
            for step in range(begin, end):
                before, state = state, rows[state][letter]
                states[step] = state
                visited.add(state)
                if state == before:
                    states[step:end] = state
                    break
    return found, visited


def _many_states(rules: Rules, letters: Letters, counted: int) -> States:
    """As :func:`_few_states`, with one array operation per step."""
    bits = len(rules.dfa.atoms)
    # Next states come shifted, so that a letter is put beside them without a multiplication.
    width = np.min_scalar_type((len(rules.dfa) << bits) - 1)
    shifted = (rules.table << bits).astype(width).ravel()
    standing = shifted
    if rules.standing is not rules.table:
        standing = (rules.standing << bits).astype(width).ravel()
    state = np.zeros(letters.shape[1], dtype=width)
    found = np.empty(letters.shape, dtype=width)
    place = np.empty(letters.shape[1], dtype=np.intp)
    for step, letter in enumerate(letters):
        np.bitwise_or(state, letter, out=place)
        state = found[step]
        # Nothing is out of range; but only "clip" writes into `state` without a buffer.
        (shifted if step < counted else standing).take(place, out=state, mode="clip")
    found >>= width.type(bits)
    return found.astype(rules.state_type, copy=False)


def _mark_overdue(unsafe: BoolArray, opened: BoolArray, counted: int, deadline_steps: int) -> None:
    """Mark where an obligation is open for more than so many of the first `counted` steps.

    After those the clock stands: what is overdue stays so until it is closed.
    """
    window = deadline_steps + 1
    late = np.count_nonzero(opened[:counted], axis=0) >= window
    if not late.any():
        return
    opened = opened[:, late]
    totals = np.cumsum(opened[:counted], axis=0, dtype=np.int32)
    overdue = np.zeros_like(opened)
    overdue[window - 1] = totals[window - 1] == window
    overdue[window:counted] = totals[window:] - totals[:-window] == window
    stays = np.logical_and.accumulate(opened[counted:], axis=0)
    overdue[counted:] = overdue[counted - 1] & stays
    unsafe[:, late] |= overdue


def _open_since(opened: BoolArray) -> npt.NDArray[np.int64]:
    """The first of the open steps that reach to the end, -1 without any: int[I]."""
    found = np.full(opened.shape[1], -1)
    still = np.flatnonzero(opened[-1])
    closed = ~opened[::-1, still]
    found[still] = np.where(closed.any(axis=0), len(opened) - closed.argmax(axis=0), 0)
    return found
