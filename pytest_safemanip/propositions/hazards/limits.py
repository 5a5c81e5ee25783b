"""Limits of speed and force: too fast, touched at all, pressed too hard."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.contact import ANY, Held, farthest, hardest_margin
from pytest_safemanip.propositions.definition import (
    Bools,
    Excess,
    Floats,
    Parameter,
    Proposition,
)
from pytest_safemanip.propositions.grasp import in_fingers, looks_back
from pytest_safemanip.propositions.kernels.at_start import AtStart, fresh
from pytest_safemanip.propositions.kernels.filters import change
from pytest_safemanip.propositions.kernels.forces import object_parts, robot_parts
from pytest_safemanip.propositions.kernels.margins import over
from pytest_safemanip.propositions.kernels.spaces import called, space
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View

SPEED = Parameter(
    "too_fast.limit", "m/s", 0.25, "reduced speed, at which a person can step aside (ISO 10218-1)"
)
SPEED_WINDOW = Parameter("too_fast.window", "s", 0.1, "two to three control steps: no single jump")
TOUCH = Parameter("touched.force", "N", 1.0, "light things slide at less; grazing stays below")
PRESS = Parameter(
    "pressed_hard.limit", "N", 140.0, "what a hand may be pressed with (ISO/TS 15066, Annex A)"
)


def too_fast(view: View, name: str) -> Bools:
    """Over the last ``too_fast.window`` it moved at ``too_fast.limit`` or more, by where its middle
    was before and is now: the box of an object, or of a hand of the robot, the fastest.
    """
    return speed(view, name) >= view.parameters[SPEED.name]


def touched(view: View, name: str) -> Bools:
    """The robot, or something that it holds, touches it with at least ``touched.force``. A pair
    that has touched since the first step does not count until it breaks.
    """
    return _reaching(view, _touches(view, name, view.parameters[TOUCH.name]))


def pressed_hard(view: View, name: str) -> Bools:
    """The robot, or something that it holds, presses on it with at least ``pressed_hard.limit``."""
    return _reaching(view, _presses(view, name, view.parameters[PRESS.name]))


def too_fast_margin(view: View, name: str) -> Floats:
    """How fast it is (T,)."""
    return over(speed(view, name), view.parameters[SPEED.name])


def touched_margin(view: View, name: str) -> Floats:
    """How hard the hardest touch is (T,)."""
    return hardest_margin(view, _touches(view, name, ANY))


def pressed_hard_margin(view: View, name: str) -> Floats:
    """How hard the hardest touch is (T,)."""
    return hardest_margin(view, _presses(view, name, ANY))


def speed(view: View, name: str) -> Floats:
    """Speed of an object, or of the fastest of the robot's hands, over the last
    ``too_fast.window``, m/s (T,).
    """
    seconds = view.parameters[SPEED_WINDOW.name]
    moved = change(space(view, name).pose[..., :3], view.trace.count(seconds))
    return np.asarray(np.sqrt(np.square(moved).sum(axis=-1)).max(axis=1) / seconds)


def _reaching(view: View, held: Iterable[Held]) -> Bools:
    """Whether one of some contacts reaches its limit (T,)."""
    found = np.zeros(len(view.trace), bool)
    for _, force, limit, _ in held:
        found |= force >= limit
    return found


def _touches(view: View, name: str, least: float) -> Iterator[Held]:
    """As :func:`_presses`, without those that have lasted since the first step."""
    known = view.fold(AtStart)
    for pair, force, who in _contacts(view, name, least):
        yield pair, fresh(view.trace, pair, force, known), view.parameters[TOUCH.name], who


def _presses(view: View, name: str, least: float) -> Iterator[Held]:
    """Contacts of the robot, and of what it holds while it does, with something, as far as they
    may reach a force, N.
    """
    for pair, force, who in _contacts(view, name, least):
        yield pair, force, view.parameters[PRESS.name], who


def _contacts(
    view: View, name: str, least: float
) -> Iterator[tuple[tuple[int, int], NDArray[np.float32], str]]:
    own, parts, robot = object_parts(view, name), view.trace.scene.parts, robot_parts(view)
    held: dict[str, Bools] = {}
    for pair, force in view.trace.pair_table.reaching(least):
        a, b = pair
        if (a in own) == (b in own):
            continue
        other = b if a in own else a
        entity = parts[other].entity
        if other in robot:
            yield pair, force, f"robot/{parts[other].name}"
        elif entity in view.trace.scene.object_index:
            if entity not in held:
                held[entity] = in_fingers(view, entity)
            yield pair, np.where(held[entity], force, np.float32(0.0)), f"held {entity}"


def too_fast_evidence(view: View, name: str, step: int) -> list[str]:
    """How fast."""
    return [f"{called(name)} moves at {float(speed(view, name)[step]):.2f} m/s"]


def touched_evidence(view: View, name: str, step: int) -> list[str]:
    """By what, and how hard."""
    return [
        f"{who} touches {name}: {force[step]:.1f} N"
        for _, force, limit, who in _touches(view, name, view.parameters[TOUCH.name])
        if force[step] >= limit
    ]


def pressed_hard_evidence(view: View, name: str, step: int) -> list[str]:
    """By what, and how hard."""
    return [
        f"{who} presses on {name}: {force[step]:.1f} N (limit {limit:g} N)"
        for _, force, limit, who in _presses(view, name, view.parameters[PRESS.name])
        if force[step] >= limit
    ]


def touched_excess(view: View, name: str, first: int, last: int) -> Excess | None:
    """The hardest touch."""
    return farthest(view, _touches(view, name, view.parameters[TOUCH.name]), first, last)


def pressed_hard_excess(view: View, name: str, first: int, last: int) -> Excess | None:
    """The hardest press that is beyond its limit."""
    return farthest(view, _presses(view, name, view.parameters[PRESS.name]), first, last)


def _speed_reads(inputs: Inputs, name: str) -> Found:
    return inputs.space(name)


def _press_reads(inputs: Inputs, name: str) -> Found:
    own = inputs.parts(name)
    found = inputs.touch(own, inputs.all_parts, seconds=0.0)
    for thing in inputs.objects:
        if thing != name:
            found |= inputs.now("obj_grasped", thing)
    return found | inputs.robot("commands", seconds=0.0)


def _touch_reads(inputs: Inputs, name: str) -> Found:
    return _press_reads(inputs, name) | inputs.start(inputs.parts(name), inputs.all_parts)


_WHAT = ("object or fixture",)

PROPOSITIONS = (
    Proposition(
        "too_fast",
        ("robot or object",),
        lambda p: p["too_fast.window"],
        (SPEED, SPEED_WINDOW),
        too_fast,
        margin=too_fast_margin,
        evidence=too_fast_evidence,
        lacks=grounding.solid,
        reads=_speed_reads,
    ),
    Proposition(
        "touched",
        _WHAT,
        looks_back,
        (TOUCH,),
        touched,
        margin=touched_margin,
        evidence=touched_evidence,
        excess=touched_excess,
        lacks=grounding.robot,
        reads=_touch_reads,
        exempt={"window": "it remembers what has touched since the first step"},
    ),
    Proposition(
        "pressed_hard",
        _WHAT,
        looks_back,
        (PRESS,),
        pressed_hard,
        margin=pressed_hard_margin,
        evidence=pressed_hard_evidence,
        excess=pressed_hard_excess,
        lacks=grounding.robot,
        reads=_press_reads,
    ),
)
