"""Recordings that differ in time alone: contacts that flicker, another control rate."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np
from hypothesis import strategies as st

from pytest_safemanip.fuzz.changes import lasting, with_steps
from pytest_safemanip.fuzz.film import of_length
from pytest_safemanip.fuzz.recordings import contacts
from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.steps import Contacts

if TYPE_CHECKING:
    from pytest_safemanip.fuzz.trial import Draw, Trial

MAX_STATES = 5
VOTE = 3
"""Control periods in a vote, at least: of two, one lost to rounding is half of it."""


def flickering(trial: Trial, draw: Draw, count: int) -> tuple[Recording, Recording]:
    """A state that lasts, and the same with other contacts for less than half of ``count`` steps.

    Only what begins after a window of steadiness is a flicker.
    """
    counts = np.bincount(trial.recording.steps.contacts.step, minlength=1)
    busiest = int(np.argmax(counts[: trial.recording.acting]))
    step = draw(st.just(busiest) | st.integers(0, trial.recording.acting - 1))
    state = of_length(trial.recording, step, step + 1)
    before = window_steps(trial) + 2
    steady = lasting(state, 2 * before + count, state.scene.control_period)
    longest = (count - 1) // 2
    if longest == 0:
        return steady, steady
    brief = draw(st.integers(1, longest))
    other = draw(contacts(state.scene, brief))
    rows = steady.steps.contacts
    kept = [rows.window(0, before), other, rows.window(before + brief, len(steady.steps))]
    starts = (0, before, before + brief)
    moved = [
        dataclasses.replace(part, step=part.step + np.int32(start))
        for part, start in zip(kept, starts, strict=True)
    ]
    columns = {
        field.name: np.concatenate([getattr(part, field.name) for part in moved])
        for field in dataclasses.fields(Contacts)
    }
    return steady, with_steps(steady, contacts=Contacts(**columns))


def lasting_states(trial: Trial) -> tuple[Recording, Recording]:
    """The first states of a recording, each lasting longer than all windows together, recorded at
    one control rate and at twice that rate. The first is high enough for a vote.
    """
    states = of_length(trial.recording, 0, min(len(trial.recording.steps), MAX_STATES))
    times, period = window_steps(trial) + 3, states.scene.control_period
    if debounce := trial.proposition.debounce:
        while round(debounce(trial.parameters) / period) < VOTE:
            times, period = 2 * times, period / 2
    return lasting(states, times, period), lasting(states, 2 * times, period / 2)


def window_steps(trial: Trial) -> int:
    """Length of a value's window in steps; for a fold, of its parameters' windows."""
    window = trial.proposition.seconds(trial.parameters)
    if math.isinf(window):
        units = {p.name for p in trial.proposition.parameters if p.unit == "s"}
        window = sum(trial.parameters[name] for name in units)
    return trial.count(window)


def near(values: Bools) -> Bools:
    """True where a value is true at the step or at one beside it."""
    padded = np.concatenate(([False], values, [False]))
    return np.asarray(padded[:-2] | padded[1:-1] | padded[2:])
