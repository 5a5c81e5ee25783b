"""Explains a violation: the pending obligation, the deciding values, an excerpt of the trace."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

from pytest_safemanip.errors import TraceError
from pytest_safemanip.ltlf.dfa import Dfa, StateClass
from pytest_safemanip.ltlf.excerpt import Excerpt, excerpt
from pytest_safemanip.ltlf.formula import Formula
from pytest_safemanip.ltlf.letters import BoolArray, check_values, pack
from pytest_safemanip.ltlf.verdicts import InstanceVerdict, Violation
from pytest_safemanip.ltlf.witness import DecidingValue, Search, StateSet


@dataclass(frozen=True, slots=True)
class PathStep:
    """A step that changed what is pending.

    Attributes:
        step: number of the step.
        state: the automaton's state after it.
        residual: what that state still asks of the steps to come.
    """

    step: int
    state: int
    residual: Formula


@dataclass(frozen=True, slots=True)
class Explanation:
    """Explanation of the first step of a violation.

    Attributes:
        violation: what is explained.
        started_at: the step where the monitor last started: 0, or the one after a bad prefix.
        opened_at: the step that opened the obligation; the unsafe step itself if nothing
            was pending before it.
        path: the steps from `opened_at` to the unsafe one at which the state changed, and both
            ends.
        deciding: values such that every trace that shares them from `started_at` on is violated
            at the unsafe step too, or before it. For a bad prefix that means a bad prefix; for an
            overdue obligation, that one is open from `opened_at` to the unsafe step or a bad
            prefix comes; where only the end decided, that the trace is not accepted there.
        smallest: no smaller set of values decides. If False, the search for that was too large,
            and the set is only such that none of its values can be left out.
        excerpt: the steps to look at.
        waited_s: seconds from `opened_at` to the unsafe step; None if the formula has no bound.
    """

    violation: Violation
    started_at: int
    opened_at: int
    path: tuple[PathStep, ...]
    deciding: tuple[DecidingValue, ...]
    smallest: bool
    excerpt: Excerpt
    waited_s: float | None = None

    def format(self, max_lines: int = 30) -> str:
        """The explanation as plain text.

        Args:
            max_lines: number of lines that are not exceeded; at least 10.
        """
        violation, unmet = self.violation, self.path[-1]
        if violation.reason == "bad prefix" and len(self.path) > 1:
            unmet = self.path[-2]
        when = f"{violation.reason} at step {violation.first}"
        if violation.at_end:
            when = f"still open at the last step {violation.first}, after which nothing can meet it"
        if self.opened_at < violation.first:
            when += f", pending since step {self.opened_at}: {unmet.residual}"
            if self.waited_s is not None:
                when += f", {self.waited_s:.10g} s over"
        decided = "; ".join(_ranges(self.deciding)) or "the formula alone"
        tail = textwrap.wrap(
            f"decided by {decided}",
            100,
            subsequent_indent=" " * 11,
            max_lines=4,
            placeholder=" ...",
            break_on_hyphens=False,
        )
        return "\n".join([when, *self.excerpt.lines(max_lines - 1 - len(tail)), *tail])


def explain(
    dfa: Dfa, values: BoolArray, verdict: InstanceVerdict, violation: Violation
) -> Explanation:
    """Explain the first step of a violation.

    Args:
        dfa: the property's automaton.
        values: bool[T, atoms], the values that the instance was judged by.
        verdict: the verdict on that instance.
        violation: one of its violations.

    Raises:
        TraceError: the arguments do not belong together.
    """
    check_values(values, (len(verdict.states), len(dfa.atoms)), dfa.atoms)
    if violation not in verdict.violations:
        raise TraceError(f"{violation} is none of the violations of {verdict.instance!r}")
    states: list[int] = verdict.states.tolist()
    end = violation.first
    bad = [state_class is StateClass.FALSE for state_class in dfa.classes]
    started = end
    while started > 0 and not bad[states[started - 1]]:
        started -= 1
    opened = _opened_at(dfa, states, started, violation)
    fixed, smallest = _deciding(dfa, values, states, started, opened, violation)
    deciding = tuple(
        DecidingValue(step, atom, bool(values[step, bit]))
        for step, mask in enumerate(fixed, start=started)
        for bit, atom in enumerate(dfa.atoms)
        if mask >> bit & 1
    )
    path = tuple(
        PathStep(step, states[step], dfa.residuals[states[step]])
        for step in range(opened, end + 1)
        if step in (opened, end) or states[step] != states[step - 1]
    )
    return Explanation(
        violation,
        started,
        opened,
        path,
        deciding,
        smallest,
        excerpt(dfa, values, verdict, violation, opened),
        None if dfa.dt is None else (end - opened) * dfa.dt,
    )


def _opened_at(dfa: Dfa, states: list[int], started: int, violation: Violation) -> int:
    """Go back over the steps that left something pending."""
    if violation.reason == "overdue":
        owing = [not accepted for accepted in dfa.accepting.tolist()]
    else:
        owing = [not dfa.idle(state) for state in range(len(dfa))]  # with `W` also while accepting
    opened = violation.first
    while opened > started and owing[states[opened - 1]]:
        opened -= 1
    return opened


def _deciding(
    dfa: Dfa,
    values: BoolArray,
    states: list[int],
    started: int,
    opened: int,
    violation: Violation,
) -> tuple[list[int], bool]:
    """The atoms to fix at each step from the start on, and whether no fewer would do."""
    end = violation.first
    bad: StateSet = 0
    rejecting: StateSet = 0
    for state, state_class in enumerate(dfa.classes):
        bad |= (state_class is StateClass.FALSE) << state
        rejecting |= (not dfa.accepting[state]) << state
    anything: StateSet = (1 << len(dfa)) - 1
    allowed = [anything] * (end + 1 - started)
    if violation.reason == "bad prefix":
        allowed[-1] = bad
    elif violation.at_end:
        allowed[-1] = rejecting
    else:
        for step in range(opened, end + 1):
            allowed[step - started] = rejecting
    letters = pack(values[started : end + 1]).tolist()
    visited = [0, *states[started : end + 1]]
    running = next(
        (k for k, x in enumerate(letters) if dfa.rows[visited[k]][x] != visited[k + 1]), None
    )
    search = Search(dfa, letters, allowed, running)
    found = search.smallest()
    return (search.greedy(), False) if found is None else (found, True)


def _ranges(deciding: tuple[DecidingValue, ...]) -> list[str]:
    """`a at 3`, `not b at 3-9`: deciding values with consecutive steps taken together."""
    runs: dict[tuple[str, bool], list[list[int]]] = {}
    for value in deciding:
        steps = runs.setdefault((value.atom, value.value), [])
        if steps and steps[-1][1] == value.step - 1:
            steps[-1][1] = value.step
        else:
            steps.append([value.step, value.step])
    found = []
    for (atom, truth), steps in sorted(runs.items(), key=lambda run: (run[1][0], not run[0][1])):
        spans = [str(a) if a == b else f"{a}-{b}" for a, b in steps]
        shown = ", ".join(spans[:4]) + (f" and {len(spans) - 4} more" if len(spans) > 4 else "")
        found.append(f"{'' if truth else 'not '}{atom} at {shown}")
    return found
