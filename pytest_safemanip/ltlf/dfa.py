"""The deterministic automaton of a formula, as a dense table, and its use on single traces."""

from __future__ import annotations

import enum
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from pytest_safemanip.ltlf.formula import Always, Constant, Formula, conjuncts
from pytest_safemanip.ltlf.letters import letter_of, letters_of

_BOUND = re.compile(r"\[[^]]*\]")
Step = Mapping[str, bool] | int  # one step of a trace: values by atom, or a letter


class StateClass(enum.Enum):
    """Truth of the formula after a prefix that leads to a state (RV-LTL's four values)."""

    TRUE = "true"  # accepted, however it goes on
    CURRENTLY_TRUE = "currently true"  # accepted if it ended here; can still fail
    CURRENTLY_FALSE = "currently false"  # not accepted if it ended here; can still be met
    FALSE = "false"  # a bad prefix: not accepted, however it goes on


@dataclass(frozen=True, eq=False)
class Dfa:
    """A minimal, complete, deterministic automaton over non-empty finite traces.

    A letter is a bitmask: bit i is the value of `atoms[i]`. States are numbered in the order in
    which a breadth-first search from the initial state 0 meets them, smaller letters first, so two
    formulas with the same language over the same atoms have the same tables.

    Attributes:
        formula: what was compiled.
        atoms: names of the atoms, bit 0 first.
        table: int32[states, 2 ** atoms], the next state; read-only.
        accepting: bool[states], whether the trace that led here is accepted; read-only. The
            initial state, where nothing was read, counts only as far as a step leads back to it.
        classes: the class of each state.
        residuals: what each state still asks of the steps to come. State 0 has the formula itself;
            elsewhere a `G` at the top, which is never done, is left out if there is something
            else to say.
        rows: the table once more, for loops in Python, where it is three times as fast.
        dt: control period in seconds that bounds were converted with; None without bounds.
        standing: as `table`, for steps at which the clocks of bounds stand; None without
            bounds, and then it is the table.
    """

    formula: Formula
    atoms: tuple[str, ...]
    table: npt.NDArray[np.int32]
    accepting: npt.NDArray[np.bool_]
    classes: tuple[StateClass, ...]
    residuals: tuple[Formula, ...]
    rows: tuple[tuple[int, ...], ...] = field(repr=False)
    dt: float | None = None
    standing: npt.NDArray[np.int32] | None = field(default=None, repr=False)

    @cached_property
    def standing_rows(self) -> tuple[tuple[int, ...], ...]:
        """The rows for steps at which the clocks of bounds stand."""
        return self.rows if self.standing is None else tuple(map(tuple, self.standing.tolist()))

    def __len__(self) -> int:
        """The number of states."""
        return len(self.classes)

    @cached_property
    def outlines(self) -> tuple[str, ...]:
        """Of each state what is the same in all that only a clock sets apart from it."""
        if self.dt is None:
            return tuple(map(str, range(len(self))))
        return tuple(
            kind.value + _BOUND.sub("", str(owed))
            for kind, owed in zip(self.classes, self.residuals, strict=True)
        )

    @cached_property
    def text(self) -> str:
        """The formula, printed."""
        return str(self.formula)

    def idle(self, state: int) -> bool:
        """Whether a state owes nothing but what a `G` at the top asks of every step."""
        accepted = self.classes[state] in (StateClass.TRUE, StateClass.CURRENTLY_TRUE)
        return accepted and all(
            isinstance(part, Always | Constant) for part in conjuncts(self.residuals[state])
        )

    def letter(self, step: Step) -> int:
        """The bitmask of one step.

        Raises:
            TraceError: an atom is unknown or missing, a value is not a boolean, or a bitmask has
                bits that no atom owns.
        """
        return letter_of(step, self.atoms)

    def states(self, trace: Sequence[Step] | npt.NDArray[np.bool_]) -> list[int]:
        """The state after each step.

        Args:
            trace: the steps as mappings or letters, or as an array bool[T, atoms]; at least one.

        Raises:
            TraceError: the trace is empty, or a step is not as `letter` wants it; the message
                names the step.
        """
        state, visited = 0, []
        for letter in letters_of(trace, self.atoms):
            state = self.rows[state][letter]
            visited.append(state)
        return visited

    def accepts(self, trace: Sequence[Step] | npt.NDArray[np.bool_]) -> bool:
        """Whether the trace satisfies the formula.

        Args:
            trace: as for `states`.

        Raises:
            TraceError: as for `states`.
        """
        return bool(self.accepting[self.states(trace)[-1]])

    def stepper(self) -> Callable[[int], StateClass]:
        """A function to call with each letter as it comes; it answers with the class reached.

        The fastest way to watch one property live: letters are not checked beyond their range.
        """
        rows, classes, state = self.rows, self.classes, 0

        def step(letter: int) -> StateClass:
            nonlocal state
            state = rows[state][letter]
            return classes[state]

        return step
