"""Laws that every proposition obeys, whatever happens in a recording.

A law is checked on a recording that :func:`~pytest_safemanip.fuzz.recordings` gives, with further
choices drawn by Hypothesis.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from pytest_safemanip.errors import JudgementError, TraceError
from pytest_safemanip.fuzz import changes
from pytest_safemanip.fuzz.invalid import invalid
from pytest_safemanip.fuzz.margins import margins
from pytest_safemanip.fuzz.steps import causal, online, part, window
from pytest_safemanip.fuzz.timing import flickering, lasting_states, near
from pytest_safemanip.fuzz.trial import Draw, LawBroken, Trial
from pytest_safemanip.fuzz.unobserved import unobserved
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.trace.recording import Recording

_SEEDS = st.integers(0, 2**16)


@dataclass(frozen=True)
class Law:
    """A law that propositions obey.

    Attributes:
        name: part of node ids.
        says: the law, for people.
        check: raises LawBroken, or whatever the proposition raises.
        concerns: which propositions it is about.
    """

    name: str
    says: str
    check: Callable[[Trial, Draw], None]
    concerns: Callable[[Proposition], bool] = lambda _: True


def _total(trial: Trial, draw: Draw) -> None:
    for arguments in trial.calls:
        trial.values(arguments)


def _rewritten(
    change: Callable[..., Recording], where: str, named: Callable[[str], str] = str
) -> Callable[[Trial, Draw], None]:
    """A law: values do not change when the recording is rewritten by ``change``."""

    def check(trial: Trial, draw: Draw) -> None:
        other = trial.on(change(trial.recording, np.random.default_rng(draw(_SEEDS))))
        for arguments in trial.calls:
            names = tuple(
                name if kind == "skill" else named(name)
                for kind, name in zip(trial.proposition.arguments, arguments, strict=True)
            )
            trial.expect(arguments, other(names), trial.values(arguments), where)

    return check


def _motion(trial: Trial, draw: Draw) -> None:
    angle = draw(st.sampled_from((math.pi / 2, 0.0, 0.3, 2.0)))
    shift = draw(st.sampled_from(((0.0, 0.0, 0.0), (1.7, -2.3, 0.6))))
    other = trial.on(changes.elsewhere(trial.recording, angle, shift))
    where = f"when the scene is turned by {angle:.2f} rad and moved by {shift} m"
    for arguments in trial.calls:
        trial.expect(arguments, other(arguments), trial.values(arguments), where)


def _stranger(trial: Trial, draw: Draw) -> None:
    other, where = (
        trial.on(changes.with_stranger(trial.recording)),
        "with one more object 100 m away",
    )
    for arguments in trial.calls:
        trial.expect(arguments, other(arguments), trial.values(arguments), where)


def _force(trial: Trial, draw: Draw) -> None:
    """Along rising thresholds values are gained, or lost, but not both."""
    for parameter in _thresholds(trial.proposition):
        default = trial.parameters[parameter]
        scales = (0.1, 0.5, 1.0, 2.0, 10.0)
        chosen = [
            trial.on(trial.recording, {**trial.parameters, parameter: scale * default})
            for scale in scales
        ]
        for arguments in trial.calls:
            rows = np.array([values(arguments) for values in chosen])
            gained = (rows[1:] & ~rows[:-1]).any(axis=0)
            lost = (rows[:-1] & ~rows[1:]).any(axis=0)
            if gained.any() and lost.any():
                step = int(np.argmax(gained | lost))
                why = f"as {parameter} grows, it becomes true at some steps and false at others"
                raise LawBroken(why, arguments, step, trial.values(arguments))


def _flicker(trial: Trial, draw: Draw) -> None:
    debounce = trial.proposition.debounce
    if debounce is None:
        return
    count = trial.count(debounce(trial.parameters))
    steady, flicker = (trial.on(recording) for recording in flickering(trial, draw, count))
    for arguments in trial.calls:
        found, wanted = flicker(arguments), steady(arguments)
        differ = np.flatnonzero(found != wanted)
        if len(differ):
            why = (
                f"{bool(wanted[differ[0]])} while nothing changes, {bool(found[differ[0]])} when "
                f"contacts flicker for less than half of {count} steps"
            )
            raise LawBroken(why, arguments, int(differ[0]))


def _rate(trial: Trial, draw: Draw) -> None:
    coarse, fine = lasting_states(trial)
    at_once, twice = trial.on(coarse), trial.on(fine)
    for arguments in trial.calls:
        values, pairs = at_once(arguments), twice(arguments).reshape(-1, 2)
        wrong = (values & ~near(pairs.any(axis=1))) | (pairs.any(axis=1) & ~near(values))
        if not trial.proposition.act:
            wrong |= ~values & ~near(~pairs.all(axis=1))
        if wrong.any():
            step = int(np.argmax(wrong))
            why = (
                f"{bool(values[step])} at {step * coarse.scene.control_period:.2f} s, but not at "
                "twice the control rate"
            )
            raise LawBroken(why, arguments, step)


def _numbers(trial: Trial, draw: Draw) -> None:
    what, other = invalid(trial.recording, draw)
    for arguments in trial.calls:
        with np.errstate(invalid="raise", divide="raise"):
            try:
                trial.on(trial.recording)(arguments)
            except (FloatingPointError, JudgementError) as error:
                found = error.__cause__ if isinstance(error, JudgementError) else error
                if not isinstance(found, FloatingPointError):
                    raise
                why = f"computes with an invalid number although the recording has none: {found}"
                raise LawBroken(why, arguments) from found
        try:
            trial.on(other)(arguments)
        except TraceError:
            continue
        raise LawBroken(f"evaluates a recording with {what}", arguments)


def _thresholds(proposition: Proposition) -> list[str]:
    """Its force parameters; none for an act, whose step moves with the threshold."""
    if proposition.act:
        return []
    return [parameter.name for parameter in proposition.parameters if parameter.unit == "N"]


LAWS = (
    Law("total", "it has a boolean value at every step of any recording", _total),
    Law("causal", "a value does not depend on later steps", causal),
    Law("window", "a value depends on the steps of its window only", window),
    Law("online", "step by step it has the same values as on the whole recording", online),
    Law(
        "part",
        "asked for some steps only, it has the same values there, and others keep theirs",
        part,
        lambda proposition: proposition.sparse,
    ),
    Law(
        "margin",
        "its margin has the sign of its value, and depends on no other steps than that",
        margins,
        lambda proposition: proposition.margin is not None,
    ),
    Law(
        "permutation",
        "names and order of entities and contacts do not matter",
        _rewritten(changes.renamed, "with other names and in another order", changes.other_name),
    ),
    Law(
        "swap",
        "it does not matter which side of a contact is named first",
        _rewritten(changes.swapped_sides, "with the sides of contacts swapped"),
    ),
    Law(
        "sign",
        "q and -q are the same rotation",
        _rewritten(changes.negated_quaternions, "with -q for some q"),
    ),
    Law("motion", "where the scene stands and how it is turned does not matter", _motion),
    Law("stranger", "an object far away does not matter", _stranger),
    Law(
        "force",
        "as a force threshold grows, values change in one direction",
        _force,
        lambda proposition: bool(_thresholds(proposition)),
    ),
    Law(
        "flicker",
        "contacts that flicker for less than half of its debounce do not matter",
        _flicker,
        lambda proposition: proposition.debounce is not None,
    ),
    Law(
        "rate",
        "twice the control rate gives the same within a control period, where a vote has three",
        _rate,
    ),
    Law(
        "unobserved",
        "what was not observed does not matter for a value that is known nevertheless",
        unobserved,
    ),
    Law("numbers", "an invalid number raises TraceError, and none is computed", _numbers),
)
"""All of them."""


def laws_of(proposition: Proposition) -> list[Law]:
    """The laws that a proposition has to obey."""
    return [law for law in LAWS if law.concerns(proposition) and law.name not in proposition.exempt]
