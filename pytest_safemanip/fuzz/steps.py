"""Laws about which steps a value depends on."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from pytest_safemanip.fuzz.film import of_length
from pytest_safemanip.fuzz.trial import Draw, Trial


def causal(trial: Trial, draw: Draw) -> None:
    """On what has happened so far, a value is what it is on all of it."""
    stop = draw(st.integers(1, len(trial.recording.steps)))
    begun = trial.on(of_length(trial.recording, 0, stop))
    for arguments in trial.calls:
        prefix, whole = begun(arguments), trial.values(arguments)
        trial.expect(arguments, prefix, whole[:stop], f"without the steps from {stop} on")


def window(trial: Trial, draw: Draw) -> None:
    """At a step drawn, at the first one where it is true and at the last one of all."""
    last = len(trial.recording.steps) - 1
    drawn = draw(st.integers(0, last))
    for arguments in trial.calls:
        for step in {drawn, int(np.argmax(trial.values(arguments))), last}:
            _look_back(trial, arguments, step)


def _look_back(trial: Trial, arguments: tuple[str, ...], step: int) -> None:
    """Compare a value with that on the steps of its window alone."""
    seconds = trial.proposition.window(trial.parameters)
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
    """Step by step, some steps at a time, values are those on the whole recording."""
    every = draw(st.integers(1, 7))
    found = trial.online(every)
    for number, arguments in enumerate(trial.calls):
        where = f"step by step, {every} at a time"
        trial.expect(arguments, found[:, number], trial.values(arguments), where)


def part(trial: Trial, draw: Draw) -> None:
    """Values at some steps in a row, asked for alone, are those on the whole recording."""
    length = len(trial.recording.steps)
    first = draw(st.integers(0, length - 1))
    stop = draw(st.integers(first + 1, length))
    for arguments in trial.calls:
        found = trial.values(arguments).copy()
        found[first:stop] = trial.part(arguments, first, stop)
        where = f"asked for steps {first} to {stop - 1} only"
        trial.expect(arguments, found, trial.values(arguments), where)
