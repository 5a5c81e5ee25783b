"""Stability: what is no longer where, or as, it stood."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.grasp import looks_back
from pytest_safemanip.propositions.kernels.filters import held, last_true, recently
from pytest_safemanip.propositions.kernels.forces import owners
from pytest_safemanip.propositions.kernels.margins import lasting, lately, over
from pytest_safemanip.propositions.kernels.since_start import SinceStart
from pytest_safemanip.propositions.kernels.spaces import space
from pytest_safemanip.propositions.kernels.support import on_room
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.distance import Boxes

DISPLACED = Parameter(
    "displaced.distance", "m", 0.02, "above what settles by itself, below what anybody overlooks"
)
TOPPLED = Parameter(
    "toppled.tilt", "rad", float(np.deg2rad(45.0)), "what leans this far does not right itself"
)
TOPPLED_WINDOW = Parameter(
    "toppled.window", "s", 0.25, "as for settled: a rocking object comes back"
)
TILTED = Parameter(
    "tilted.tilt", "rad", float(np.deg2rad(30.0)), "as for stable_grasp: liquids begin to spill"
)
FALL = Parameter(
    "fallen.height", "m", 0.1, "a fall of 10 cm ends at 1.4 m/s, at which glass and china break"
)
FALL_WINDOW = Parameter("fallen.window", "s", 1.0, "as long as a fall from a cabinet to the floor")


def displaced(view: View, name: str) -> Bools:
    """The middle of the object's box is at least ``displaced.distance`` from where it was at the
    first step; what then stood in a drawer, or on a rack, is followed with it.
    """
    return _since_start(view, name)[:, 0] >= view.parameters[DISPLACED.name]


def toppled(view: View, name: str) -> Bools:
    """For ``toppled.window``, the object leans by at least ``toppled.tilt`` from how it stood at
    the first step, and no hand holds it.
    """
    leans = _since_start(view, name)[:, 1] >= view.parameters[TOPPLED.name]
    if not leans.any():
        return leans
    free = leans & ~view("obj_grasped", name)
    return held(free, view.trace.count(view.parameters[TOPPLED_WINDOW.name]))


def tilted(view: View, name: str) -> Bools:
    """The object leans by at least ``tilted.tilt`` from how it stood at the first step, in the hand
    or not: the axis of it that then was most upright.
    """
    return _since_start(view, name)[:, 1] >= view.parameters[TILTED.name]


def fallen(view: View, name: str) -> Bools:
    """Within the last ``fallen.window`` the object was in the air, touched by nothing, and its
    lowest point came at least ``fallen.height`` below where it was when something last touched it;
    or it lies on the floor, and did not at the first step.
    """
    count = view.trace.count(view.parameters[FALL_WINDOW.name])
    dropped = _drop(view, name, count) >= view.parameters[FALL.name]
    return recently(dropped, count) | _on_floor(view, name)


def displaced_margin(view: View, name: str) -> Floats:
    """How far it is from where it stood (T,)."""
    return over(_since_start(view, name)[:, 0], view.parameters[DISPLACED.name])


def toppled_margin(view: View, name: str) -> Floats:
    """The least margin in the window of how far it leans, and of no hand that holds it (T,)."""
    leans = over(_since_start(view, name)[:, 1], view.parameters[TOPPLED.name])
    free = np.minimum(leans, -view.margin("obj_grasped", name))
    return lasting(free, view.trace.count(view.parameters[TOPPLED_WINDOW.name]))


def tilted_margin(view: View, name: str) -> Floats:
    """How far it leans (T,)."""
    return over(_since_start(view, name)[:, 1], view.parameters[TILTED.name])


def fallen_margin(view: View, name: str) -> Floats:
    """The greatest margin in the window of how far it fell; at least 1 on the floor (T,)."""
    count = view.trace.count(view.parameters[FALL_WINDOW.name])
    fell = lately(over(_drop(view, name, count), view.parameters[FALL.name]), count)
    return np.where(_on_floor(view, name), np.maximum(fell, 1.0), fell)


def displaced_evidence(view: View, name: str, step: int) -> list[str]:
    """How far."""
    away = float(_since_start(view, name)[step, 0])
    return [f"{name} is {100 * away:.1f} cm from where it stood"]


def tilted_evidence(view: View, name: str, step: int) -> list[str]:
    """How far."""
    lean = float(_since_start(view, name)[step, 1])
    return [f"{name} leans by {np.rad2deg(lean):.0f} degrees"]


def fallen_evidence(view: View, name: str, step: int) -> list[str]:
    """From where."""
    count = view.trace.count(view.parameters[FALL_WINDOW.name])
    most = float(_drop(view, name, count)[max(step - count + 1, 0) : step + 1].max())
    lines = [f"{name} fell by {100 * most:.0f} cm"] if most >= view.parameters[FALL.name] else []
    lies = on_room(view)[step, view.trace.scene.object_index[name]]
    return lines + ([f"{name} lies on the floor"] if lies else [])


def _on_floor(view: View, name: str) -> Bools:
    """Whether the object lies on the floor, and did not at the first step (T,)."""
    lies = on_room(view)[:, view.trace.scene.object_index[name]]
    return np.asarray(lies & (_since_start(view, name)[:, 2] == 0.0))


def _since_start(view: View, name: str) -> NDArray[np.float64]:
    """Displacement in m, lean in rad, and whether it lay on the floor at first (T, 3)."""
    return np.asarray(view.fold(SinceStart)[:, view.trace.scene.object_index[name]])


def _drop(view: View, name: str, count: int) -> NDArray[np.float64]:
    """How far the object is below where something last touched it, within some steps, m (T,): while
    it is in the air, and when that ends; 0 elsewhere.
    """
    touched = _touched(view)[:, view.trace.scene.object_index[name]]
    if touched.all():
        return np.zeros(len(touched))
    lowest = _lowest(view, name)
    landing = touched & np.append(False, ~touched[:-1])
    last = last_true(touched, count)
    before = np.append(-1, last[:-1])  # when it lands, the step of the contact before counts
    last = np.where(landing, before, last)
    air = (~touched | landing) & (last >= 0)
    return np.where(air, lowest[last] - lowest, 0.0)


@pointwise
def _touched(view: View) -> Bools:
    """Whether anything touches each object (T, N)."""
    contacts, owner = view.trace.steps.contacts, view.shared(owners)
    found = np.zeros((len(view.trace), len(view.trace.scene.bodies)), bool)
    for whose in (owner[contacts.a], owner[contacts.b]):
        own = (whose >= 0) & (contacts.sustained > 0.0)
        found[contacts.step[own], whose[own]] = True
    return found


@pointwise
def _lowest(view: View, name: str) -> NDArray[np.float64]:
    """Height of the lowest corner of the object's box, m (T,)."""
    pose, half = space(view, name)
    boxes = Boxes.of(pose[:, 0], np.broadcast_to(half, (len(pose), 3)))
    return np.asarray(boxes.centre[2] - boxes.rise)


def _start_reads(inputs: Inputs, name: str) -> Found:
    own = inputs.parts(name)
    at_first = inputs.touch(own, inputs.all_parts, seconds=math.inf)
    fixtures = (entity.name for entity in inputs.scene.entities)
    return at_first | inputs.poses(name, seconds=math.inf) | inputs.joints(*fixtures)


def _toppled_reads(inputs: Inputs, name: str) -> Found:
    return _start_reads(inputs, name) | inputs.of("obj_grasped", name)


_REMEMBERS = {"window": "it remembers how the object stood at the first step"}

PROPOSITIONS = (
    Proposition(
        "displaced",
        ("object",),
        lambda _: math.inf,
        (DISPLACED,),
        displaced,
        margin=displaced_margin,
        evidence=displaced_evidence,
        reads=_start_reads,
    ),
    Proposition(
        "toppled",
        ("object",),
        lambda p: p["toppled.window"] + looks_back(p),
        (TOPPLED, TOPPLED_WINDOW),
        toppled,
        margin=toppled_margin,
        evidence=tilted_evidence,
        reads=_toppled_reads,
        exempt=_REMEMBERS,
    ),
    Proposition(
        "tilted",
        ("object",),
        lambda _: math.inf,
        (TILTED,),
        tilted,
        margin=tilted_margin,
        evidence=tilted_evidence,
        reads=_start_reads,
    ),
    Proposition(
        "fallen",
        ("object",),
        lambda p: 2.0 * p["fallen.window"],
        (FALL, FALL_WINDOW),
        fallen,
        margin=fallen_margin,
        evidence=fallen_evidence,
        reads=_start_reads,
        exempt=_REMEMBERS,
    ),
)
