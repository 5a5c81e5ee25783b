"""Verdict rules on the states of an automaton, shared by the online and the batch monitor."""

from __future__ import annotations

import math
from collections.abc import Hashable
from functools import lru_cache
from typing import Literal

import numpy as np
import numpy.typing as npt

from pytest_safemanip.errors import ConfigError, TraceError, did_you_mean
from pytest_safemanip.ltlf.dfa import Dfa, StateClass
from pytest_safemanip.ltlf.formula import (
    ROUNDING,
    Always,
    Formula,
    Implies,
    atoms_of,
    is_propositional,
)
from pytest_safemanip.ltlf.letters import BoolArray, NumberSet, truth_table
from pytest_safemanip.ltlf.verdicts import InstanceVerdict, Outcome, States, Violation

Table = npt.NDArray[np.int32]
Profile = Literal["timed", "paper"]
DischargedBy = Literal["robot", "physics"]


class Rules:
    """One property's automaton with its deadline, re-arming, end rule and trigger.

    Attributes:
        table: next states, int32[states, letters]. In the timed profile a bad prefix is followed
            by a restart from the initial state, which is a change of one row.
        rows: the table for Python loops.
        standing: the table of settle tails in which the clocks of bounds stand, since the robot
            would have to meet the obligations; elsewhere `table` itself. Likewise `rows_standing`.
        state_type: the smallest unsigned integers that number the states.
        bad: bool[states], the state that says bad prefix.
        closed: bool[states], no obligation is open: accepting, or forgotten by the restart.
        deadline_steps: how many counted steps an obligation may be open; None without deadline.
        clock_runs_in_tail: whether the settle tail counts for the deadline.
        ends_accepting: whether a trace has to end without an open obligation, wherever it ends.
        trigger: bool[letters], or None if every step triggers.
        is_bad: `bad` for Python loops; likewise `is_closed` and `triggers`.
        open: the states that are not closed, `unsafe` those that are bad, `triggering` the letters
            that trigger, for looking through many of them; None if every step triggers.
        calm: the states in which nothing is open and nothing bad.

    Args:
        dfa: the automaton.
        dt: control period in seconds.
        deadline_s: how long an obligation may be open, in seconds.
        discharged_by: who has to meet the obligations.
        profile: `timed`, or `paper` for acceptance at the last step and nothing else.
        trigger: a propositional formula; by default the antecedent of `G (a -> ...)`.

    Raises:
        ConfigError: a number is not positive and finite, a name is unknown, or the trigger is not
            propositional over the automaton's atoms.
    """

    def __init__(
        self,
        dfa: Dfa,
        dt: float,
        deadline_s: float | None,
        discharged_by: DischargedBy,
        profile: Profile,
        trigger: Formula | None,
    ) -> None:
        _positive("control period dt", dt)
        if deadline_s is not None:
            _positive("deadline_s", deadline_s)
        _one_of("discharged_by", discharged_by, ("robot", "physics"))
        _one_of("profile", profile, ("timed", "paper"))
        timed = profile == "timed"
        self.dfa = dfa
        self.dt = dt
        self.bad = np.array([c is StateClass.FALSE for c in dfa.classes])
        self.closed = dfa.accepting | self.bad
        self.table = dfa.table
        if timed:
            self.table = self.table.copy()
            self.table[self.bad] = self.table[0]
        self.rows: tuple[tuple[int, ...], ...] = tuple(map(tuple, self.table.tolist()))
        self.rows_standing = self.rows
        self.standing: Table = self.table
        if timed and discharged_by == "robot" and dfa.standing is not None:
            self.standing = dfa.standing.copy()
            self.standing[self.bad] = self.standing[0]
            self.rows_standing = tuple(map(tuple, self.standing.tolist()))
        self.state_type = np.min_scalar_type(len(dfa) - 1)
        self.deadline_steps: int | None = None
        if timed and deadline_s is not None:
            self.deadline_steps = math.floor(deadline_s / dt * (1 + ROUNDING))
        self.clock_runs_in_tail = discharged_by == "physics"
        self.ends_accepting = not timed
        self.trigger = _trigger_table(dfa, trigger)
        self.is_bad: tuple[bool, ...] = tuple(self.bad.tolist())
        self.is_closed: tuple[bool, ...] = tuple(self.closed.tolist())
        self.open, self.unsafe = NumberSet(~self.closed), NumberSet(self.bad)
        self.triggering = None if self.trigger is None else NumberSet(self.trigger)
        self.calm = frozenset(np.flatnonzero(self.closed & ~self.bad).tolist())
        self.triggers: tuple[bool, ...] | None = None
        if self.trigger is not None:
            self.triggers = tuple(self.trigger.tolist())

    def end_decides(self, settled: bool) -> bool:
        """Whether an obligation that is open at the last step is a violation.

        Args:
            settled: whether that step is of a settle tail. Otherwise the trace is truncated, and
                what physics owes within its deadline stays open.
        """
        return self.ends_accepting or (self.clock_runs_in_tail and settled)

    def verdict(
        self,
        instance: Hashable,
        states: States,
        unsafe: BoolArray,
        acting: BoolArray,
        *,
        violated: bool,
        at_end: bool,
        open_since: int | None,
        triggered_steps: int,
    ) -> InstanceVerdict:
        """The verdict on one instance at the end of its trace.

        Args:
            instance: whose.
            states: uint[T], the state after each step.
            unsafe: bool[T], the unsafe steps.
            acting: bool[T], False in the settle tail.
            violated: whether any step is unsafe.
            at_end: whether the last step is unsafe only because the trace ends there.
            open_since: when the obligation opened that is open at the end, or None.
            triggered_steps: number of steps at which the trigger held.
        """
        outcome = Outcome.SATISFIED if open_since is None else Outcome.UNRESOLVED
        return InstanceVerdict(
            instance=instance,
            outcome=Outcome.VIOLATED if violated else outcome,
            vacuous=triggered_steps == 0,
            triggered_steps=triggered_steps,
            states=states,
            unsafe=unsafe,
            exposed_steps=int(np.count_nonzero(unsafe & acting)) if violated else 0,
            violations=self._violations(instance, states, unsafe, at_end) if violated else (),
            open_since=open_since,
        )

    def _violations(
        self, instance: Hashable, states: States, unsafe: BoolArray, at_end: bool
    ) -> tuple[Violation, ...]:
        edges = np.flatnonzero(np.diff(unsafe, prepend=False, append=False)).tolist()
        return tuple(
            Violation(
                instance=instance,
                first=first,
                last=end - 1,
                duration_s=(end - first) * self.dt,
                reason="bad prefix" if self.bad[states[first]] else "overdue",
                at_end=at_end and first == len(unsafe) - 1,
            )
            for first, end in zip(edges[::2], edges[1::2], strict=True)
        )


rules_of = lru_cache(maxsize=1024, typed=True)(Rules)
"""Rules made once: they are the same in every rollout."""


def check_acting(acting: BoolArray | None, steps: int) -> BoolArray:
    """The steps at which the robot acted: bool[T].

    Args:
        acting: bool[T], False in the settle tail; None if there is none.
        steps: T.

    Raises:
        TraceError: another shape or type, or the steps where the robot holds still are no suffix.
    """
    if acting is None:
        return np.ones(steps, dtype=np.bool_)
    if not isinstance(acting, np.ndarray) or acting.dtype != np.bool_ or acting.shape != (steps,):
        found = np.asarray(acting)
        raise TraceError(
            f"acting: expected a boolean array of shape ({steps},), "
            f"found {found.dtype} of shape {found.shape}"
        )
    stopped = int(np.count_nonzero(acting))
    if not acting[:stopped].all():
        first = int(np.argmin(acting))
        again = first + int(np.argmax(acting[first:]))
        raise TraceError(
            f"the robot acts at step {again} after it stopped at step {first}; "
            "the settle tail ends the trace"
        )
    return acting


def _trigger_table(dfa: Dfa, trigger: Formula | None) -> BoolArray | None:
    if trigger is None:
        match dfa.formula:
            case Always(Implies(antecedent, _)) if is_propositional(antecedent):
                trigger = antecedent
            case _:
                return None
    if not is_propositional(trigger):
        raise ConfigError(f"trigger '{trigger}': expected a formula without temporal operators")
    for name in atoms_of(trigger):
        if name not in dfa.atoms:
            raise ConfigError(
                f"trigger '{trigger}': atom {name!r}; {did_you_mean(name, dfa.atoms)}"
            )
    return truth_table(trigger, dfa.atoms)


def _positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise ConfigError(f"{name}: expected a positive number of seconds, found {value!r}")


def _one_of(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise ConfigError(f"{name}: unknown {value!r}; {did_you_mean(value, known)}")
