"""The law of margins: each has the sign of its value, and depends on no other steps than that."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from pytest_safemanip.fuzz.steps import causal, online, window
from pytest_safemanip.fuzz.trial import Arguments, Draw, LawBroken, Trial
from pytest_safemanip.propositions.view import View, wrong_side

ROUNDING = 1e-9
"""Margins that differ by less are the same."""


def margins(trial: Trial, draw: Draw) -> None:
    """Margins have the sign of the values; on a prefix, in the window, online, and asked for at
    some steps only, they are the same.
    """
    view = trial.view()
    for arguments in trial.calls:
        values, found = trial.values(arguments), view.measure(trial.proposition, arguments)
        if len(wrong := wrong_side(values, found)):
            step = int(wrong[0])
            why = f"{bool(values[step])}, but its margin is {found[step]:g}"
            raise LawBroken(why, arguments, step, values)
    known = (trial.proposition, trial.recording, trial.catalogue, trial.parameters)
    remembers = "window" in trial.proposition.exempt
    for law in (causal, *(() if remembers else (window,)), online, _asked_in_part, _asked_late):
        law(_Margins(*known), draw)


class _Margins(Trial):
    """The margins of a proposition on a recording, in place of its values."""

    def look(self, view: View, arguments: Arguments) -> NDArray[Any]:
        return view.margin(self.proposition.name, *arguments)

    def online(self, every: int) -> NDArray[Any]:
        online, rows = self.watched(every), []
        steps = [lambda step=step: online.push(*step) for step in self.recording.steps]
        for evaluate in (*steps, online.flush):
            count = len(evaluate())
            if count:
                found = [online.margins(call, count)[-count:] for call in online.calls]
                rows.append(np.stack(found, axis=1))
        return np.concatenate(rows)

    def expect(
        self, arguments: Arguments, found: NDArray[Any], wanted: NDArray[Any], where: str
    ) -> None:
        differ = np.flatnonzero(~np.isclose(found, wanted, ROUNDING, ROUNDING))
        if len(differ):
            step = int(differ[0])
            why = f"margin {wanted[step]:g} on the recording, {found[step]:g} {where}"
            raise LawBroken(why, arguments, step, recording=self.recording)


def _asked_in_part(trial: Trial, draw: Draw) -> None:
    length, name = len(trial.recording.steps), trial.proposition.name
    first = draw(st.integers(0, length - 1))
    stop = draw(st.integers(first + 1, length))
    view = trial.view()
    for arguments in trial.calls:
        found = trial.values(arguments).copy()
        found[first:stop] = view.margin_part(name, *arguments, first=first, stop=stop)
        where = f"asked for steps {first} to {stop - 1} only"
        trial.expect(arguments, found, trial.values(arguments), where)


def _asked_late(trial: Trial, draw: Draw) -> None:
    """Online, the first margin that is asked for is that of the last step."""
    online = trial.watched(draw(st.integers(1, 7)))
    for step in trial.recording.steps:
        online.push(*step)
    online.flush()
    for call, arguments in zip(online.calls, trial.calls, strict=True):
        found = trial.values(arguments).copy()
        for newest in (online.margin(call), online.margins(call, 1)[-1]):
            found[-1] = newest
            trial.expect(arguments, found, trial.values(arguments), "online, asked for at the end")
