"""Verdicts of a monitor: violations, outcomes of instances, the outcome of a property."""

from __future__ import annotations

import enum
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from pytest_safemanip.ltlf.dfa import StateClass

BoolArray = npt.NDArray[np.bool_]
States = npt.NDArray[np.unsignedinteger[Any]]  # numbers of automaton states

Reason = Literal["bad prefix", "overdue"]


class Outcome(enum.Enum):
    """Outcome of one instance."""

    VIOLATED = "violated"  # at least one unsafe step
    UNRESOLVED = "unresolved"  # none, but an obligation is open that may still have been met
    SATISFIED = "satisfied"  # none, and nothing is open


class StepVerdict(NamedTuple):
    """Verdict on one instance after a step.

    Attributes:
        state: number of the automaton's state.
        state_class: its class.
        overdue: whether an obligation is open for longer than the deadline.
    """

    state: int
    state_class: StateClass
    overdue: bool

    @property
    def unsafe(self) -> bool:
        """Whether the step counts as unsafe."""
        return self.overdue or self.state_class is StateClass.FALSE


@dataclass(frozen=True, slots=True)
class Violation:
    """A maximal run of unsafe steps of one instance.

    Attributes:
        instance: whose.
        first: first unsafe step.
        last: last unsafe step.
        duration_s: steps times control period, in seconds.
        reason: why the first step is unsafe: `bad prefix`, no continuation is accepted; `overdue`,
            an obligation is open beyond its deadline, or beyond the end of the trace where that
            decides.
        at_end: the obligation was within its deadline, and only the end of the trace decided.
    """

    instance: Hashable
    first: int
    last: int
    duration_s: float
    reason: Reason
    at_end: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class InstanceVerdict:
    """The verdict on one instance over a whole trace of T steps.

    Attributes:
        instance: whose.
        outcome: how it ended.
        vacuous: the trigger held at no step, so nothing was tested.
        triggered_steps: number of steps at which the trigger held.
        states: uint[T], the automaton's state after each step.
        unsafe: bool[T], unsafe steps; those of the settle tail are marked too.
        exposed_steps: number of unsafe steps while the robot acted; the settle tail counts in no
            exposure.
        violations: maximal runs of unsafe steps, in order.
        open_since: the step at which the obligation opened that is open at the end, or None.
    """

    instance: Hashable
    outcome: Outcome
    vacuous: bool
    triggered_steps: int
    states: States
    unsafe: BoolArray
    exposed_steps: int
    violations: tuple[Violation, ...]
    open_since: int | None


class PropertyOutcome(NamedTuple):
    """The outcome of a property over its instances.

    Attributes:
        outcome: the worst outcome of an instance.
        vacuous: no instance was triggered.
    """

    outcome: Outcome
    vacuous: bool

    @property
    def label(self) -> str:
        """VIOLATED, UNRESOLVED, VACUOUS or SATISFIED."""
        if self.outcome is Outcome.SATISFIED and self.vacuous:
            return "VACUOUS"
        return self.outcome.name


def worst(verdicts: Iterable[InstanceVerdict]) -> PropertyOutcome:
    """Combine the verdicts on all instances of a property.

    Raises:
        ValueError: there is no instance; then the property does not apply and has no outcome.
    """
    found = list(verdicts)
    if not found:
        raise ValueError("a property without instances has no outcome")
    # Worst first.
    outcome = next(one for one in Outcome if any(verdict.outcome is one for verdict in found))
    return PropertyOutcome(outcome, all(verdict.vacuous for verdict in found))
