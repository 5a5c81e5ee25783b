"""Enclosures that take one item at a time: what is in them, and what is put in."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.propositions.definition import Bools, Parameter, Proposition
from pytest_safemanip.propositions.enclosure import TOLERANCE
from pytest_safemanip.propositions.filters import held, rising, still
from pytest_safemanip.propositions.interiors import (
    centre_within,
    corners_inside,
    inside,
    interiors,
    place_in,
)
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
    occupied = np.zeros(len(view.trace), bool)
    for body in view.trace.scene.bodies:
        occupied |= _rests(view, body.entity, fixture)
    return occupied


def insert_item(view: View, fixture: str) -> Bools:
    """A held object enters the fixture at this step: its first corner comes inside by more than
    ``enclosure.tolerance``.
    """
    depth, entered = -view.parameters["enclosure.tolerance"], np.zeros(len(view.trace), bool)
    for body in view.trace.scene.bodies:
        entering = rising(corners_inside(view, body.entity, fixture, depth).any(axis=-1))
        entered |= entering & view("obj_grasped", body.entity)
    return entered


def enclosure_cleared(view: View, fixture: str) -> Bools:
    """For ``enclosure_cleared.window``, the centre of no object's box is inside the fixture."""
    occupied = np.zeros(len(view.trace), bool)
    for body in view.trace.scene.bodies:
        occupied |= centre_within(view, body.entity, fixture)
    return held(~occupied, view.trace.count(view.parameters["enclosure_cleared.window"]))


def insert_item_evidence(view: View, fixture: str, step: int) -> list[str]:
    """What was inside when the next item came."""
    return [f"{name} is inside {fixture}" for name in inside(view, fixture, step)]


def _rests(view: View, name: str, fixture: str) -> Bools:
    """Whether one object rests inside the fixture (T,)."""
    p, rests = view.parameters, np.zeros(len(view.trace), bool)
    count = view.trace.count(p["item_in_enclosure.window"])
    for number, (_, half) in enumerate(interiors(view, fixture)):
        place = place_in(view, name, fixture, number)
        within = (np.abs(place) <= half).all(axis=1)
        rests |= still(place, count, p["item_in_enclosure.drift"]) & held(within, count)
    return rests & ~view("obj_grasped", name)


PROPOSITIONS = (
    Proposition(
        "item_in_enclosure",
        ("fixture",),
        lambda p: max(p["item_in_enclosure.window"], p["obj_grasped.window"]),
        (REST_WINDOW, REST_DRIFT),
        item_in_enclosure,
    ),
    Proposition(
        "insert_item",
        ("fixture",),
        lambda p: p["obj_grasped.window"],
        (TOLERANCE,),
        insert_item,
        act=True,
        evidence=insert_item_evidence,
    ),
    Proposition(
        "enclosure_cleared",
        ("fixture",),
        lambda p: p["enclosure_cleared.window"],
        (CLEAR_WINDOW,),
        enclosure_cleared,
    ),
)
