"""A property's monitor over its instances: step by step, or over a whole trace."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field

import numpy as np

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.ltlf.batch import Judgement, judge
from pytest_safemanip.ltlf.dfa import Dfa, Step
from pytest_safemanip.ltlf.formula import Formula
from pytest_safemanip.ltlf.letters import BoolArray, Letters, check_values, pack, packed
from pytest_safemanip.ltlf.partial import PartialMonitor
from pytest_safemanip.ltlf.quiet import Values, gather
from pytest_safemanip.ltlf.robustness.prediction import Atoms, Prediction, predictor_of
from pytest_safemanip.ltlf.rules import DischargedBy, Profile, Rules, check_acting, rules_of
from pytest_safemanip.ltlf.verdicts import InstanceVerdict, StepVerdict


class Monitor:
    """Watches one property for all its instances.

    `step` is for live use and `run` for recorded traces; they give the same verdicts. `run` does
    not touch what `step` has seen.

    In the `timed` profile a step is unsafe when its trace is a bad prefix, after which the monitor
    restarts at the next step, or when an obligation is open for longer than the deadline. Time is
    counted from the last accepting step. In the settle tail, where the robot holds still, the
    clock stands if the robot has to meet the obligation; if physics has, the clock runs on and
    the last step decides. A trace without a tail is truncated: what is open within its deadline is
    unresolved, whoever has to meet it. In the `paper` profile the whole trace is accepted at its
    last step or violated (SafeManip, section 3); there is no deadline and no restart.

    Args:
        dfa: the property's automaton.
        instances: names of the instances, or how many there are.
        dt: control period in seconds.
        deadline_s: how long an obligation may be open, in seconds; None for no deadline. The
            `paper` profile has none.
        discharged_by: who has to meet the obligations.
        profile: the semantics.
        trigger: a propositional formula that says when the property is triggered; by
            default the antecedent of `G (a -> ...)`, or every step for other formulas.

    Raises:
        ConfigError: a value is out of range, or an instance is named twice.
    """

    def __init__(
        self,
        dfa: Dfa,
        instances: Sequence[Hashable] | int = 1,
        *,
        dt: float,
        deadline_s: float | None = None,
        discharged_by: DischargedBy = "robot",
        profile: Profile = "timed",
        trigger: Formula | None = None,
    ) -> None:
        names = range(instances) if isinstance(instances, int) else instances
        self.dfa = dfa
        self.instances: tuple[Hashable, ...] = tuple(names)
        if not self.instances:
            raise ConfigError("a monitor needs at least one instance")
        if len(set(self.instances)) < len(self.instances):
            raise ConfigError(f"an instance is named twice: {self.instances}")
        self._rules = rules_of(dfa, dt, deadline_s, discharged_by, profile, trigger)
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first step."""
        self._live = [Instance() for _ in self.instances]
        self._acting: list[bool] = []

    def step(self, values: Sequence[Step] | BoolArray, acting: bool = True) -> list[StepVerdict]:
        """Read one step.

        Args:
            values: for each instance its values by atom or as a bitmask; or bool[I, atoms].
            acting: False in the settle tail.

        Returns:
            What is known about each instance now.

        Raises:
            TraceError: values are missing, unknown, not boolean or not one per instance, or the
                robot acts again after it stopped.
        """
        return self._take([[letter] for letter in self._letters(values)], [acting])

    def steps(self, values: BoolArray | Letters, acting: Sequence[bool]) -> list[StepVerdict]:
        """Read some steps in a row, as `step` does one after the other, for less.

        Args:
            values: bool[K, I, atoms]; or letters, uint[K, I].
            acting: for each step, False in the settle tail.

        Returns:
            What is known about each instance after the last of them.

        Raises:
            TraceError: as for `step`, or there is no step.
        """
        letters = packed(values, len(self.instances), self.dfa.atoms)
        if len(acting) != len(values):
            raise TraceError(f"acting for {len(acting)} of {len(values)} steps")
        return self._take(letters.T.tolist(), acting)

    def gather(self, steps: int, value_of: Values) -> Letters:
        """Letters of the next steps, their atoms looked up where a verdict may depend on them.

        Where none does they may be False: the verdicts are the same as with all of them.

        Args:
            steps: how many.
            value_of: called with the numbers of an instance and of an atom, the first of some of
                the steps and one after the last: the values of the atom there, bool[K].

        Returns:
            uint[steps, I], for `steps` or for `run`.
        """
        return gather(self._rules, [live.state for live in self._live], steps, value_of)

    def at_fault(self, instance: int, letter: int) -> list[int]:
        """The atoms of which each alone could have kept the last step from being unsafe.

        Args:
            instance: its number.
            letter: what it read at the last step.
        """
        rules, live = self._rules, self._live[instance]
        counted = self._acting[-1] or rules.clock_runs_in_tail
        rows = rules.rows if counted else rules.rows_standing
        after = rows[live.states[-2] if len(live.states) > 1 else 0]
        unsafe = rules.is_bad if rules.is_bad[live.state] else [not c for c in rules.is_closed]
        return [k for k in range(len(self.dfa.atoms)) if not unsafe[after[letter ^ (1 << k)]]]

    def predict(self, order: Sequence[int], atoms: Sequence[Atoms]) -> list[Prediction]:
        """What is expected of each instance after the last step.

        Args:
            order: numbers of all atoms, those first that are cheap to look at.
            atoms: of each instance.
        """
        predictor = predictor_of(self._rules, tuple(order))
        return [
            predictor.predict(live.state, live.open_steps, one)
            for live, one in zip(self._live, atoms, strict=True)
        ]

    def partial(self) -> PartialMonitor:
        """A fresh monitor of the same property for steps at which not every atom is known."""
        return PartialMonitor(self._rules, self.instances)

    def verdicts(self) -> list[InstanceVerdict]:
        """The verdicts if the trace ended with the last step read.

        Raises:
            TraceError: no step was read.
        """
        if not self._acting:
            raise TraceError("no step was read: a trace has at least one")
        return [
            self._verdict(name, live) for name, live in zip(self.instances, self._live, strict=True)
        ]

    def judge(self, values: BoolArray | Letters, acting: BoolArray | None = None) -> Judgement:
        """Judge whole traces, for those who need arrays rather than objects.

        Args:
            values: bool[T, I, atoms]; or letters, uint[T, I].
            acting: bool[T], False in the settle tail; None if there is none.

        Raises:
            TraceError: an array has another shape or type, there is no step, or the robot acts
                again after it stopped.
        """
        letters = packed(values, len(self.instances), self.dfa.atoms)
        return judge(self._rules, letters, check_acting(acting, len(letters)))

    def run(
        self, values: BoolArray | Letters, acting: BoolArray | None = None
    ) -> list[InstanceVerdict]:
        """Judge whole traces: one verdict per instance.

        Args:
            values: as for `judge`.
            acting: as for `judge`.

        Raises:
            TraceError: as for `judge`.
        """
        letters = packed(values, len(self.instances), self.dfa.atoms)
        acting = check_acting(acting, len(letters))
        found = judge(self._rules, letters, acting)
        columns = zip(
            self.instances,
            np.ascontiguousarray(found.states.T),
            np.ascontiguousarray(found.unsafe.T),
            found.violated.tolist(),
            found.at_end.tolist(),
            found.open_since.tolist(),
            found.triggered_steps.tolist(),
            strict=True,
        )
        return [
            self._rules.verdict(
                name,
                states,
                unsafe,
                acting,
                violated=violated,
                at_end=at_end,
                open_since=None if open_since < 0 else open_since,
                triggered_steps=triggered,
            )
            for name, states, unsafe, violated, at_end, open_since, triggered in columns
        ]

    def _letters(self, values: Sequence[Step] | BoolArray) -> list[int]:
        if isinstance(values, np.ndarray):
            check_values(values, (len(self.instances), len(self.dfa.atoms)), self.dfa.atoms)
            packed: list[int] = pack(values).tolist()
            return packed
        if len(values) != len(self.instances):
            raise TraceError(f"{len(values)} values for {len(self.instances)} instances")
        letters = []
        for name, value in zip(self.instances, values, strict=True):
            try:
                letters.append(self.dfa.letter(value))
            except TraceError as error:
                raise TraceError(f"step {len(self._acting)}, instance {name!r}: {error}") from None
        return letters

    def _take(self, letters: list[list[int]], acting: Sequence[bool]) -> list[StepVerdict]:
        """Read steps: for each instance its letters."""
        before = self._acting[-1] if self._acting else True
        for step, acts in enumerate(acting, start=len(self._acting)):
            if acts and not before:
                raise TraceError(
                    f"the robot acts at step {step} after it stopped; "
                    "the settle tail ends the trace"
                )
            before = bool(acts)
        self._acting += map(bool, acting)
        counts = [acts or self._rules.clock_runs_in_tail for acts in acting]
        return [
            live.read(self._rules, column, counts)
            for live, column in zip(self._live, letters, strict=True)
        ]

    def _verdict(self, name: Hashable, live: Instance) -> InstanceVerdict:
        rules = self._rules
        unsafe = np.array(live.unsafe)
        settled = not self._acting[-1]
        at_end = rules.end_decides(settled) and live.open_since is not None and not live.unsafe[-1]
        unsafe[-1] |= at_end
        return rules.verdict(
            name,
            np.array(live.states, dtype=rules.state_type),
            unsafe,
            np.array(self._acting),
            violated=bool(unsafe.any()),
            at_end=at_end,
            open_since=live.open_since,
            triggered_steps=live.triggered_steps,
        )


@dataclass(slots=True)
class Instance:
    """State of the monitor of one instance while its trace is read step by step.

    Attributes:
        state: of the automaton, after the last step.
        open_steps: counted steps since it was last accepting.
        open_since: the step at which the obligation opened that is open now, or None.
        triggered_steps: steps at which the trigger held.
        states: after each step.
        unsafe: whether each step is.
    """

    state: int = 0
    open_steps: int = 0
    open_since: int | None = None
    triggered_steps: int = 0
    states: list[int] = field(default_factory=list)
    unsafe: list[bool] = field(default_factory=list)

    def read(self, rules: Rules, letters: Sequence[int], counts: Sequence[bool]) -> StepVerdict:
        """Take in some steps.

        Args:
            rules: of the property.
            letters: of the steps, at least one.
            counts: whether each counts for the deadline.

        Returns:
            What is known after the last of them.
        """
        limit = math.inf if rules.deadline_steps is None else rules.deadline_steps
        if not self._stays(rules, letters):
            state, closed, bad, triggers = self.state, rules.is_closed, rules.is_bad, rules.triggers
            running, standing = rules.rows, rules.rows_standing
            for letter, counted in zip(letters, counts, strict=True):
                state = (running if counted else standing)[state][letter]
                if closed[state]:
                    self.open_steps, self.open_since = 0, None
                else:
                    self.open_steps += counted
                    if self.open_since is None:
                        self.open_since = len(self.states)
                self.triggered_steps += triggers is None or triggers[letter]
                self.states.append(state)
                self.unsafe.append(bad[state] or self.open_steps > limit)
            self.state = state
        return StepVerdict(self.state, rules.dfa.classes[self.state], self.open_steps > limit)

    def _stays(self, rules: Rules, letters: Sequence[int]) -> bool:
        """Take in steps that are all alike and change nothing, as most are; whether they do not."""
        state, letter, steps = self.state, letters[0], len(letters)
        if not rules.is_closed[state] or rules.rows[state][letter] != state:
            return False
        if rules.rows_standing[state][letter] != state:
            return False
        if any(other != letter for other in letters):
            return False
        self.open_steps, self.open_since = 0, None
        self.triggered_steps += steps * (rules.triggers is None or rules.triggers[letter])
        self.states += [state] * steps
        self.unsafe += [rules.is_bad[state]] * steps
        return True
