"""The monitor of one instance while its trace is read step by step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from pytest_safemanip.ltlf.rules import Rules
from pytest_safemanip.ltlf.verdicts import StepVerdict


@dataclass(slots=True)
class Instance:
    """State of the monitor of one instance, and its verdict so far.

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
            for letter, counted in zip(letters, counts, strict=True):
                state = rules.rows[state][letter]
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
        if any(other != letter for other in letters):
            return False
        self.open_steps, self.open_since = 0, None
        self.triggered_steps += steps * (rules.triggers is None or rules.triggers[letter])
        self.states += [state] * steps
        self.unsafe += [rules.is_bad[state]] * steps
        return True
