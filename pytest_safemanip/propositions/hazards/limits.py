"""Limits of speed and force: too fast, touched at all, pressed too hard."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.contact import ANY
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.grasp import in_fingers, looks_back
from pytest_safemanip.propositions.kernels.at_start import AtStart, fresh
from pytest_safemanip.propositions.kernels.filters import change
from pytest_safemanip.propositions.kernels.forces import object_parts, robot_parts
from pytest_safemanip.propositions.kernels.margins import NONE, over
from pytest_safemanip.propositions.kernels.spaces import space
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.elements import ROBOT

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
    found = np.zeros(len(view.trace), bool)
    for _, force in _touches(view, name, view.parameters[TOUCH.name], since_start=False):
        found |= force >= view.parameters[TOUCH.name]
    return found


def pressed_hard(view: View, name: str) -> Bools:
    """The robot, or something that it holds, presses on it with at least ``pressed_hard.limit``."""
    found = np.zeros(len(view.trace), bool)
    for _, force in _touches(view, name, view.parameters[PRESS.name], since_start=True):
        found |= force >= view.parameters[PRESS.name]
    return found


def too_fast_margin(view: View, name: str) -> Floats:
    """How fast it is (T,)."""
    return over(speed(view, name), view.parameters[SPEED.name])


def touched_margin(view: View, name: str) -> Floats:
    """How hard the hardest touch is (T,)."""
    return _hardest(view, name, view.parameters[TOUCH.name], since_start=False)


def pressed_hard_margin(view: View, name: str) -> Floats:
    """How hard the hardest touch is (T,)."""
    return _hardest(view, name, view.parameters[PRESS.name], since_start=True)


def speed(view: View, name: str) -> Floats:
    """Speed of an object, or of the fastest of the robot's hands, over the last
    ``too_fast.window``, m/s (T,).
    """
    seconds = view.parameters[SPEED_WINDOW.name]
    moved = change(space(view, name).pose[..., :3], view.trace.count(seconds))
    return np.asarray(np.sqrt(np.square(moved).sum(axis=-1)).max(axis=1) / seconds)


def _hardest(view: View, name: str, limit: float, since_start: bool) -> Floats:
    """The margin of the hardest of the touches of :func:`_touches` (T,)."""
    most = np.full(len(view.trace), NONE)
    for _, force in _touches(view, name, ANY, since_start):
        np.maximum(most, over(force, limit), out=most)
    return most


def _touches(
    view: View, name: str, limit: float, since_start: bool
) -> Iterator[tuple[str, NDArray[np.float32]]]:
    """What of the robot's, or of what it holds, touches something, and the force while it does,
    N (T,); as far as that may reach a limit.

    Args:
        view: what is looked at.
        name: what is touched.
        limit: N.
        since_start: whether pairs count that have touched since the first step.
    """
    own, parts, robot = object_parts(view, name), view.trace.scene.parts, robot_parts(view)
    known = None if since_start else view.fold(AtStart)  # it has to see every step
    held: dict[str, Bools] = {}
    for (a, b), force in view.trace.pair_table.reaching(limit):
        if (a in own) == (b in own):
            continue
        other = b if a in own else a
        entity = parts[other].entity
        if other not in robot and entity not in view.trace.scene.object_index:
            continue
        counts = force if known is None else fresh(view.trace, (a, b), force, known)
        if other in robot:
            yield f"robot/{parts[other].name}", counts
            continue
        if entity not in held:
            held[entity] = in_fingers(view, entity)
        yield f"held {entity}", np.where(held[entity], counts, np.float32(0.0))


def too_fast_evidence(view: View, name: str, step: int) -> list[str]:
    """How fast."""
    who = "the hand" if name == ROBOT else name
    return [f"{who} moves at {float(speed(view, name)[step]):.2f} m/s"]


def touched_evidence(view: View, name: str, step: int) -> list[str]:
    """By what, and how hard."""
    limit = view.parameters[TOUCH.name]
    found = _touches(view, name, limit, since_start=False)
    return [f"{who} touches {name}: {f[step]:.1f} N" for who, f in found if f[step] >= limit]


def pressed_hard_evidence(view: View, name: str, step: int) -> list[str]:
    """By what, and how hard."""
    limit = view.parameters[PRESS.name]
    found = _touches(view, name, limit, since_start=True)
    return [
        f"{who} presses on {name}: {f[step]:.1f} N (limit {limit:g} N)"
        for who, f in found
        if f[step] >= limit
    ]


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
        lacks=grounding.robot,
        reads=_press_reads,
    ),
)
