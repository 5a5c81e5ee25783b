"""The steps of a trace that show a violation: where something changes; the rest is omitted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from pytest_safemanip.ltlf.dfa import Dfa, StateClass
from pytest_safemanip.ltlf.letters import BoolArray, pack
from pytest_safemanip.ltlf.verdicts import InstanceVerdict, Violation


@dataclass(frozen=True, slots=True)
class Row:
    """A step that is shown.

    Attributes:
        step: its number.
        values: values of the excerpt's atoms.
        state: the automaton's state after it.
        unsafe: whether it is unsafe.
        note: the residual after it, `-` for nothing but what the formula always asks; or why it is
            unsafe.
    """

    step: int
    values: tuple[bool, ...]
    state: int
    unsafe: bool
    note: str


@dataclass(frozen=True, slots=True)
class OmittedSteps:
    """Steps at which nothing changes that matters in the state they start from."""

    first: int
    last: int


@dataclass(frozen=True, slots=True)
class Excerpt:
    """Rows and omitted steps from just before an obligation opened until its violation ended.

    Attributes:
        atoms: the atoms that are shown: those that matter in a state of these steps.
        items: rows and omitted steps in the order of their steps.
        focus: position among the items of the first unsafe step.
    """

    atoms: tuple[str, ...]
    items: tuple[Row | OmittedSteps, ...]
    focus: int

    def lines(self, max_lines: int) -> list[str]:
        """The excerpt as a table in plain text.

        Args:
            max_lines: number of lines, the heading included, that are not exceeded; at least 5.
        """
        heading = f"{'step':>6}  {''.join(f'{atom}  ' for atom in self.atoms)}residual"
        return [heading, *self._fitted(max(max_lines, 5) - 1)]

    def _fitted(self, room: int) -> list[str]:
        lines = [self._line(item) for item in self.items]
        if len(lines) <= room:
            return lines
        head = room // 4
        rest = room - head - 2  # two lines say what is left out
        start = max(head, min(self.focus - rest // 2, len(lines) - rest))
        end = start + rest
        return (
            lines[:head]
            + [f"{'...':>6}  {start - head} lines left out"] * (start > head)
            + lines[start:end]
            + [f"{'...':>6}  {len(lines) - end} lines left out"] * (end < len(lines))
        )

    def _line(self, item: Row | OmittedSteps) -> str:
        if isinstance(item, OmittedSteps):
            count = item.last - item.first + 1
            return f"{'...':>6}  {count} step{'s' if count > 1 else ''} without a relevant change"
        shown = zip(self.atoms, item.values, strict=True)
        marks = "".join(("1" if value else ".").center(len(atom)) + "  " for atom, value in shown)
        return f"{item.step:>6}  {marks}{item.note}"


def excerpt(
    dfa: Dfa, values: BoolArray, verdict: InstanceVerdict, violation: Violation, opened: int
) -> Excerpt:
    """Cut the steps of a violation out of a trace.

    Args:
        dfa: the property's automaton.
        values: bool[T, atoms of the automaton].
        verdict: the verdict on the instance.
        violation: one of its violations.
        opened: the step that opened the obligation.
    """
    steps = range(max(opened - 1, 0), min(violation.last + 2, len(values)))
    mattering = _mattering(dfa)
    states: list[int] = verdict.states.tolist()
    unsafe: list[bool] = verdict.unsafe.tolist()
    matters = [mattering[states[step - 1] if step else 0] for step in steps]
    bits = [bit for bit in range(len(dfa.atoms)) if any(m >> bit & 1 for m in matters)]
    letters: list[int] = pack(values).tolist()
    items: list[Row | OmittedSteps] = []
    focus = 0
    for step, mask in zip(steps, matters, strict=True):
        changed = step == steps[0] or (
            (letters[step] ^ letters[step - 1]) & mask
            or unsafe[step] != unsafe[step - 1]
            or dfa.outlines[states[step]] != dfa.outlines[states[step - 1]]
        )
        if step == violation.first:
            focus = len(items)
        elif not changed:
            _omit(items, step)
            continue
        shown = tuple(bool(letters[step] >> bit & 1) for bit in bits)
        late = "STILL OPEN" if violation.at_end else "OVERDUE"
        note = _note(dfa, states[step], late if unsafe[step] else "")
        items.append(Row(step, shown, states[step], unsafe[step], note))
    return Excerpt(tuple(dfa.atoms[bit] for bit in bits), tuple(items), focus)


@lru_cache(maxsize=256)
def _mattering(dfa: Dfa) -> list[int]:
    """For each state the atoms, as a bitmask, that its successor depends on."""
    table = dfa.table
    letters = np.arange(table.shape[1])
    found = [0] * len(dfa)
    for bit in range(len(dfa.atoms)):
        for state in np.flatnonzero((table != table[:, letters ^ 1 << bit]).any(axis=1)).tolist():
            found[state] |= 1 << bit
    # After a bad prefix the monitor starts again, if the profile lets it.
    return [
        found[0] if state_class is StateClass.FALSE else mask
        for mask, state_class in zip(found, dfa.classes, strict=True)
    ]


def _omit(items: list[Row | OmittedSteps], step: int) -> None:
    above = items[-1]
    if isinstance(above, OmittedSteps):
        items[-1] = OmittedSteps(above.first, step)
    else:
        items.append(OmittedSteps(step, step))


def _note(dfa: Dfa, state: int, late: str) -> str:
    if dfa.classes[state] is StateClass.FALSE:
        return "BAD PREFIX"
    residual = "-" if dfa.idle(state) else str(dfa.residuals[state])
    return f"{late}: {residual}" if late else residual
