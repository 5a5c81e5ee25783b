"""Laws about which steps a value depends on."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from pytest_safemanip.fuzz.changes import at_period
from pytest_safemanip.fuzz.film import of_length
from pytest_safemanip.fuzz.trial import Draw, LawBroken, Trial, calls
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.steps import ARRAYS

_SLOWER = (1, 1, 4, 16)
"""How many times as long a step takes: so that a recording of few steps has many seconds."""

_CUTS = 3
"""Places at which a recording is cut off, drawn, beside those where a value changes."""


def causal(trial: Trial, draw: Draw) -> None:
    """Values on a prefix of the recording equal those on all of it, at any control rate.

    What comes next matters most where a value changes, and just before something happens:
    recordings are cut off there.
    """
    period = draw(st.sampled_from(_SLOWER)) * trial.recording.scene.control_period
    trial = trial.instead(at_period(trial.recording, period))
    recording = trial.recording
    places = st.sampled_from(_changes(recording)) | st.integers(1, len(recording.steps))
    cuts = {draw(places): list(trial.calls) for _ in range(_CUTS)}
    for arguments in trial.calls:
        values = trial.values(arguments)
        changes = (np.flatnonzero(values[1:] != values[:-1]) + 1).tolist()
        for step in {*changes[:1], *changes[-1:]}:
            cuts.setdefault(step + 1, []).append(arguments)
    for stop, some in cuts.items():
        begun = trial.on(of_length(recording, 0, stop))
        for arguments in some:
            prefix, whole = begun(arguments), trial.values(arguments)
            trial.expect(arguments, prefix, whole[:stop], f"without the steps from {stop} on")


def _changes(recording: Recording) -> list[int]:
    """The steps at which something happens, and the one after the last."""
    steps, length, codes = recording.steps, len(recording.steps), recording.trace.pair_codes
    touching = [codes[slice(*steps.contacts.span(t, t + 1))].tolist() for t in range(length)]
    changed = np.array([t > 0 and touching[t] != touching[t - 1] for t in range(length)])
    for name in (*ARRAYS, "action"):
        array = getattr(steps, name)
        changed[1:] |= (array[1:] != array[:-1]).any(axis=tuple(range(1, array.ndim)))
    return [*np.flatnonzero(changed).tolist(), length]


def window(trial: Trial, draw: Draw) -> None:
    """Values depend on their window only: tried at a drawn, the first true and the last step."""
    last = len(trial.recording.steps) - 1
    drawn = draw(st.integers(0, last))
    for arguments in trial.calls:
        for step in {drawn, int(np.argmax(trial.values(arguments))), last}:
            _look_back(trial, arguments, step)


def _look_back(trial: Trial, arguments: tuple[str, ...], step: int) -> None:
    """Compare a value with that on the steps of its window alone."""
    seconds = trial.proposition.seconds(trial.parameters)
    count = step if math.isinf(seconds) else round(seconds / trial.recording.trace.dt)
    first = max(step - max(count, int(trial.proposition.act)), 0)
    recent = of_length(trial.recording, first, step + 1)
    if recent.steps.tail[0]:
        return
    found = trial.values(arguments).copy()
    found[step] = trial.on(recent)(arguments)[-1]
    where = f"without the steps before {first}, which are outside its window of {seconds:g} s"
    trial.expect(arguments, found, trial.values(arguments), where)


def online(trial: Trial, draw: Draw) -> None:
    """Values computed online equal those on the whole recording."""
    every = draw(st.integers(1, 7))
    found = trial.online(every)
    for number, arguments in enumerate(trial.calls):
        where = f"step by step, {every} at a time"
        trial.expect(arguments, found[:, number], trial.values(arguments), where)


def part(trial: Trial, draw: Draw) -> None:
    """Values at some steps in a row, asked for alone, are those on the whole recording; asking for
    them changes no value of any proposition.
    """
    length, name = len(trial.recording.steps), trial.proposition.name
    first = draw(st.integers(0, length - 1))
    stop = draw(st.integers(first + 1, length))
    view, untouched = trial.view(), trial.view()
    for arguments in trial.calls:
        found = trial.values(arguments).copy()
        found[first:stop] = view.part(name, *arguments, first=first, stop=stop)
        where = f"asked for steps {first} to {stop - 1} only"
        trial.expect(arguments, found, trial.values(arguments), where)
    for other in trial.catalogue.values():
        for arguments in calls(other, trial.binding, trial.recording.scene):
            call = (other.name, *arguments)
            differ = np.flatnonzero(view(*call) != untouched(*call))
            if len(differ):
                why = (
                    f"{other.name}({', '.join(arguments)}) is different at step {differ[0]} once "
                    f"{name} was asked for steps {first} to {stop - 1} only"
                )
                raise LawBroken(why, trial.calls[0], int(differ[0]), trial.values(trial.calls[0]))
