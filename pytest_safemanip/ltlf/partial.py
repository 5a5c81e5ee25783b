"""A property watched where some atoms are not known at some steps: three-valued verdicts.

A monitor keeps what its state may be, given all values that the unknown atoms may have had. What
holds in all of these is known; what holds in some is not.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from pytest_safemanip.errors import TraceError
from pytest_safemanip.ltlf.dfa import StateClass
from pytest_safemanip.ltlf.robustness.prediction import Atoms, Prediction, predictor_of
from pytest_safemanip.ltlf.rules import Rules
from pytest_safemanip.ltlf.verdicts import Outcome

Known = bool | None
"""A truth value; None if it is not known."""
UNKNOWN = "UNKNOWN"


class PartialStep(NamedTuple):
    """Verdict on one instance after a step.

    Attributes:
        state_class: of the automaton's state; None if it may be in states of several classes.
        unsafe: whether the step is unsafe: a bad prefix, or an obligation that is overdue.
    """

    state_class: StateClass | None
    unsafe: Known

    @property
    def label(self) -> str:
        """The class in words, or UNKNOWN."""
        return UNKNOWN if self.state_class is None else self.state_class.value


@dataclass(frozen=True, slots=True)
class PartialVerdict:
    """The verdict on one instance over the steps so far.

    Attributes:
        instance: whose.
        outcome: how it ended; None if that is not known.
        vacuous: whether the trigger held at no step.
        unsafe: of each step, whether it is.
    """

    instance: Hashable
    outcome: Outcome | None
    vacuous: Known
    unsafe: tuple[Known, ...]

    @property
    def label(self) -> str:
        """VIOLATED, UNRESOLVED, VACUOUS, SATISFIED or UNKNOWN."""
        if self.outcome is None or (self.outcome is Outcome.SATISFIED and self.vacuous is None):
            return UNKNOWN
        if self.outcome is Outcome.SATISFIED and self.vacuous:
            return "VACUOUS"
        return self.outcome.name


class _Run(NamedTuple):
    """Where one way to fill in the unknown has led.

    Attributes:
        state: of the automaton.
        open_steps: counted steps since it was last accepting, up to one more than are allowed.
        violated: whether a step was unsafe.
        triggered: whether the trigger held.
    """

    state: int = 0
    open_steps: int = 0
    violated: bool = False
    triggered: bool = False


class PartialMonitor:
    """Watches one property for all its instances, atoms of which may be unknown.

    With all of them known it says what :class:`~pytest_safemanip.ltlf.Monitor` says. Otherwise a
    verdict is known exactly if it is the same whatever the unknown atoms were, each at each step on
    its own.

    Args:
        rules: of the property.
        instances: names of the instances.
    """

    def __init__(self, rules: Rules, instances: Sequence[Hashable]) -> None:
        self._rules, self._instances = rules, tuple(instances)
        self._runs = [{_Run()} for _ in self._instances]
        self._unsafe: list[list[Known]] = [[] for _ in self._instances]
        self._acting = True
        limit = rules.deadline_steps
        self._most = 0 if limit is None else limit + 1

    def step(
        self, letters: Sequence[int], unknown: Sequence[int], acting: bool = True
    ) -> list[PartialStep]:
        """Read one step.

        Args:
            letters: for each instance a bit for each atom; what stands where one is unknown does
                not matter.
            unknown: for each instance a bit for each atom that is.
            acting: False in the settle tail.

        Raises:
            TraceError: if the robot acts again after it stopped.
        """
        if acting and not self._acting:
            raise TraceError("the robot acts after it stopped; the settle tail ends the trace")
        self._acting = acting
        counted = acting or self._rules.clock_runs_in_tail
        found = []
        for number, (letter, open_atoms) in enumerate(zip(letters, unknown, strict=True)):
            possible = list(_completions(letter, open_atoms))
            runs = {self._next(run, one, counted) for run in self._runs[number] for one in possible}
            self._runs[number] = {run for run, _ in runs}
            unsafe = _agreed(bad for _, bad in runs)
            classes = {self._rules.dfa.classes[run.state] for run, _ in runs}
            self._unsafe[number].append(unsafe)
            found.append(PartialStep(classes.pop() if len(classes) == 1 else None, unsafe))
        return found

    def predict(self, order: Sequence[int], atoms: Sequence[Atoms]) -> list[Prediction]:
        """What is expected of each instance, see :class:`~pytest_safemanip.ltlf.Monitor`: the least
        urgent of what is expected of the states that it may be in.
        """
        predictor = predictor_of(self._rules, tuple(order))
        found = []
        for runs, one in zip(self._runs, atoms, strict=True):
            ways = {(run.state, run.open_steps) for run in runs}
            each = [predictor.predict(state, steps, one) for state, steps in ways]
            found.append(max(each, key=lambda p: (p.last_chance, p.violation)))
        return found

    def verdicts(self) -> list[PartialVerdict]:
        """The verdicts if the trace ended with the last step.

        Raises:
            TraceError: if no step was read.
        """
        if self._unsafe and not self._unsafe[0]:
            raise TraceError("no step was read: a trace has at least one")
        return list(map(self._verdict, self._instances, self._runs, self._unsafe))

    def _next(self, run: _Run, letter: int, counted: bool) -> tuple[_Run, bool]:
        """Where a letter leads, and whether the step is unsafe."""
        rules = self._rules
        state = (rules.rows if counted else rules.rows_standing)[run.state][letter]
        waiting = 0 if rules.is_closed[state] else min(run.open_steps + counted, self._most)
        overdue = rules.deadline_steps is not None and waiting > rules.deadline_steps
        unsafe = rules.is_bad[state] or overdue
        triggered = run.triggered or rules.triggers is None or rules.triggers[letter]
        return _Run(state, waiting, run.violated or unsafe, triggered), unsafe

    def _verdict(
        self, instance: Hashable, runs: set[_Run], unsafe: Sequence[Known]
    ) -> PartialVerdict:
        outcomes = {self._outcome(run) for run in runs}
        outcome = outcomes.pop() if len(outcomes) == 1 else None
        *before, last = unsafe
        if self._rules.end_decides(not self._acting):
            last = _agreed(self._unsafe_at_end(run) for run in runs)
        vacuous = _agreed(not run.triggered for run in runs)
        return PartialVerdict(instance, outcome, vacuous, (*before, last))

    def _unsafe_at_end(self, run: _Run) -> bool:
        """Whether a last step is unsafe where what is open then is not met any more."""
        return self._rules.is_bad[run.state] or not self._rules.is_closed[run.state]

    def _outcome(self, run: _Run) -> Outcome:
        is_open = not self._rules.is_closed[run.state]
        if run.violated or (is_open and self._rules.end_decides(not self._acting)):
            return Outcome.VIOLATED
        return Outcome.UNRESOLVED if is_open else Outcome.SATISFIED


def label(verdicts: Iterable[PartialVerdict]) -> str:
    """The verdict on a property, from those on its instances: VIOLATED if one of them surely is,
    else UNKNOWN if any is.
    """
    found = {verdict.label for verdict in verdicts}
    order = ("VIOLATED", UNKNOWN, "UNRESOLVED", "SATISFIED", "VACUOUS")
    return next(name for name in order if name in found)


def _completions(letter: int, unknown: int) -> Iterator[int]:
    """The letters that one may be, some of whose atoms are not known."""
    known, some = letter & ~unknown, unknown
    while some:
        yield known | some
        some = (some - 1) & unknown
    yield known


def _agreed(values: Iterable[bool]) -> Known:
    """What all of some values are; None if they differ."""
    found = set(values)
    return found.pop() if len(found) == 1 else None
