"""Enclosures that take one item at a time: their content, and insertions."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import (
    MARGIN_BOUND,
    Bools,
    Floats,
    Parameter,
    Proposition,
)
from pytest_safemanip.propositions.enclosure import TOLERANCE
from pytest_safemanip.propositions.grasp import looks_back
from pytest_safemanip.propositions.kernels.filters import held, rising, still
from pytest_safemanip.propositions.kernels.interiors import (
    all_within,
    entered,
    holding_halves,
    inside,
    seen_from,
    within_margin,
)
from pytest_safemanip.propositions.kernels.margins import NONE, lasting, stillness, within
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View

REST_WINDOW = Parameter("item_in_enclosure.window", "s", 0.25, "as for settled")
REST_DRIFT = Parameter(
    "item_in_enclosure.drift", "m", 0.005, "2 cm/s, the speed that settled allows, for 0.25 s"
)
CLEAR_WINDOW = Parameter("enclosure_cleared.window", "s", 0.25, "what falls back in is not out")


def item_in_enclosure(view: View, fixture: str) -> Bools:
    """Some object rests inside the fixture: for ``item_in_enclosure.window`` the centre of its box
    is in the same interior, it moved less than ``item_in_enclosure.drift`` in it from the
    beginning of the window to its end, and the robot does not hold it.
    """
    occupied, rests = np.zeros(len(view.trace), bool), _rest_inside(view, fixture)
    for index in np.flatnonzero(rests.any(axis=0)):
        held_now = view("obj_grasped", view.trace.scene.bodies[index].entity)
        occupied |= rests[:, index] & ~held_now
    return occupied


def item_in_enclosure_margin(view: View, fixture: str) -> Floats:
    """The margin of the object that is nearest to resting there: the least in the window of how far
    inside its centre is, by half the width, of how still it is, and of not being held (T,).
    """
    p, bodies = view.parameters, view.trace.scene.bodies
    if not bodies:
        return np.full(len(view.trace), NONE)
    count, rests = view.trace.count(p["item_in_enclosure.window"]), []
    for number, half in enumerate(holding_halves(view, fixture)):
        place = seen_from(view, fixture, number)
        still_there = stillness(place, count, p["item_in_enclosure.drift"])
        rests.append(np.minimum(still_there, lasting(within(place, half), count)))
    grasped = np.stack([view.margin("obj_grasped", body.entity) for body in bodies], axis=1)
    return np.asarray(np.minimum(np.max(rests, axis=0), -grasped).max(axis=1))


def insert_item(view: View, fixture: str) -> Bools:
    """A held object enters the fixture at this step: its first corner comes inside by more than
    ``enclosure.tolerance``.
    """
    comes = np.zeros(len(view.trace), bool)
    entering = rising(entered(view, fixture, view.parameters["enclosure.tolerance"]))
    for index in np.flatnonzero(entering.any(axis=0)):
        comes |= entering[:, index] & view("obj_grasped", view.trace.scene.bodies[index].entity)
    return comes


def enclosure_cleared(view: View, fixture: str) -> Bools:
    """For ``enclosure_cleared.window``, the centre of no object's box is inside the fixture."""
    occupied = all_within(view, fixture).any(axis=1)
    return held(~occupied, view.trace.count(view.parameters["enclosure_cleared.window"]))


def enclosure_cleared_margin(view: View, fixture: str) -> Floats:
    """How far outside the object that is nearest to being inside has been in the window, by half
    the width of the enclosure (T,).
    """
    count = view.trace.count(view.parameters["enclosure_cleared.window"])
    nearest = within_margin(view, fixture).max(axis=1, initial=-np.inf)
    return lasting(np.minimum(-nearest, MARGIN_BOUND), count)


def insert_item_evidence(view: View, fixture: str, step: int) -> list[str]:
    """What was inside when the next item came."""
    return [f"{name} is inside {fixture}" for name in inside(view, fixture, step)]


def _rest_inside(view: View, fixture: str) -> Bools:
    """Whether each object rests inside the fixture, held or not (T, N)."""
    p, rests = view.parameters, np.zeros((len(view.trace), len(view.trace.scene.bodies)), bool)
    count = view.trace.count(p["item_in_enclosure.window"])
    for number, half in enumerate(holding_halves(view, fixture)):
        place = seen_from(view, fixture, number)
        within = held((np.abs(place) <= half).all(axis=-1), count)
        if within.any():
            rests |= within & still(place, count, p["item_in_enclosure.drift"])
    return rests


def _within_reads(inputs: Inputs, fixture: str) -> Found:
    return inputs.poses(*inputs.objects) | inputs.boxes(fixture)


def _item_reads(inputs: Inputs, fixture: str) -> Found:
    found = _within_reads(inputs, fixture)
    return found.union(*(inputs.of("obj_grasped", name) for name in inputs.objects))


PROPOSITIONS = (
    Proposition(
        "item_in_enclosure",
        ("fixture",),
        lambda p: max(p["item_in_enclosure.window"], looks_back(p)),
        (REST_WINDOW, REST_DRIFT),
        item_in_enclosure,
        margin=item_in_enclosure_margin,
        lacks=grounding.reached_interior,
        reads=_item_reads,
    ),
    Proposition(
        "insert_item",
        ("fixture",),
        looks_back,
        (TOLERANCE,),
        insert_item,
        act=True,
        no_margin="an edge: an item enters at this step or none does",
        evidence=insert_item_evidence,
        lacks=grounding.reached_interior,
        reads=_item_reads,
    ),
    Proposition(
        "enclosure_cleared",
        ("fixture",),
        lambda p: p["enclosure_cleared.window"],
        (CLEAR_WINDOW,),
        enclosure_cleared,
        margin=enclosure_cleared_margin,
        lacks=grounding.reached_interior,
        reads=_within_reads,
    ),
)
