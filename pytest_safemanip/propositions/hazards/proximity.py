"""Proximity: what is near something, or above it, and what is carried over it."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.grasp import looks_back
from pytest_safemanip.propositions.grounding import PLACE
from pytest_safemanip.propositions.kernels.interiors import lies_in
from pytest_safemanip.propositions.kernels.margins import NONE, given, under
from pytest_safemanip.propositions.kernels.spaces import above_margin, called, distance, nearer
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View

NEAR = Parameter(
    "near.distance", "m", 0.1, "a hand's width: what radiates or drips reaches about as far"
)
OVERLAP = Parameter("above.overlap", "m", 0.01, "boxes are larger than what is in them")
SLACK = Parameter(
    "above.slack", "m", 0.01, "what stands on something sinks in by the solver's margin"
)
HEIGHT = Parameter(
    "above.height", "m", 1.0, "from a counter to a wall cabinet's top; higher, it hits elsewhere"
)


def near(view: View, one: str, other: str) -> Bools:
    """The distance between the two is less than ``near.distance``: of an object its box counts, of
    the robot the boxes of its hands, of a fixture its solid pieces where its joints have them, of a
    zone its box.
    """
    return nearer(view, one, other, view.parameters[NEAR.name])


def above(view: View, one: str, other: str) -> Bools:
    """The one is straight above the other: seen from above, a box of it reaches over one of the
    other's by more than ``above.overlap``, and its underside is no more than ``above.slack`` below
    the top of that one and less than ``above.height`` above it. What has another piece of it
    overhead is in it and not above it. Boxes are those of ``near``.
    """
    return above_it(view, one, other) > 0.0


def above_it(view: View, one: str, other: str) -> Floats:
    """How far the one is above the other, by the nearest of the limits (T,)."""
    p = view.parameters
    return above_margin(view, one, other, p[OVERLAP.name], p[SLACK.name], p[HEIGHT.name])


def near_margin(view: View, one: str, other: str) -> Floats:
    """How near (T,); beyond twice the limit by the balls around the boxes."""
    limit = view.parameters[NEAR.name]
    return under(distance(view, one, other, 2.0 * limit), limit)


def carried_over_margin(view: View, name: str, other: str) -> Floats:
    """The margin of what holds it most firmly, or of ``above`` where that is less (T,)."""
    held, steps = view.margin("obj_grasped", name), np.arange(len(view.trace))
    for body in view.trace.scene.bodies:
        vessel = body.entity
        if vessel not in (name, other) and (view.margin("obj_grasped", vessel) > NONE).any():
            inside = lies_in(view, name, vessel, steps)
            held = np.maximum(held, given(inside, view.margin("obj_grasped", vessel)))
    return np.minimum(held, view.margin("above", name, other))


def carried_over(view: View, name: str, other: str) -> Bools:
    """The robot holds the object, or something that it lies in, and it is ``above`` the other."""
    held = view("obj_grasped", name)
    for body in view.trace.scene.bodies:
        vessel = body.entity
        if vessel not in (name, other):
            steps = np.flatnonzero(view("obj_grasped", vessel) & ~held)
            if len(steps):
                held = held.copy()
                held[steps[lies_in(view, name, vessel, steps)]] = True
    return held & view("above", name, other) if held.any() else held


def near_evidence(view: View, one: str, other: str, step: int) -> list[str]:
    """How near."""
    found = float(distance(view, one, other, view.parameters[NEAR.name])[step])
    where = "reaches into" if found <= 0.0 else f"is {100 * found:.1f} cm from"
    return [f"{called(one)} {where} {called(other)}"]


def _reads(inputs: Inputs, one: str, other: str) -> Found:
    return inputs.space(one) | inputs.space(other)


def _carried_reads(inputs: Inputs, name: str, other: str) -> Found:
    found = inputs.space(other) | inputs.poses(*inputs.objects)
    return found.union(*(inputs.of("obj_grasped", thing) for thing in inputs.objects))


PROPOSITIONS = (
    Proposition(
        "near",
        (PLACE, PLACE),
        lambda _: 0.0,
        (NEAR,),
        near,
        margin=near_margin,
        evidence=near_evidence,
        lacks=grounding.solid,
        reads=_reads,
        distinct=True,
    ),
    Proposition(
        "above",
        (PLACE, PLACE),
        lambda _: 0.0,
        (OVERLAP, SLACK, HEIGHT),
        above,
        margin=above_it,
        lacks=grounding.solid,
        reads=_reads,
        distinct=True,
    ),
    Proposition(
        "carried_over",
        ("object", PLACE),
        looks_back,
        (OVERLAP, SLACK, HEIGHT),
        carried_over,
        margin=carried_over_margin,
        lacks=grounding.carried,
        reads=_carried_reads,
        distinct=True,
    ),
)
