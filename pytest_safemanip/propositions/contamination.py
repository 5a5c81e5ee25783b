"""Cross-contamination: what touched raw food, what it touches next, what washes it off.

Contamination spreads by contact, from body to body and over the touched spot of a surface, and
lasts until the body is washed. It is the one memory without a window: a fold over the whole trace.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.contact import hand_parts
from pytest_safemanip.propositions.definition import Bools, Parameter, Proposition, View
from pytest_safemanip.propositions.filters import held, rising
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import boxes_overlap, centred

FORCE = Parameter("contaminated.force", "N", 0.5, "as for a finger in a grasp")
WINDOW = Parameter("contaminated.window", "s", 0.1, "a graze of one control step leaves nothing")
SPOT = Parameter("contaminated.spot", "m", 0.05, "juice runs; a hand's width beside it is clean")
WASH = Parameter("sanitized.window", "s", 1.0, "a dip under the tap is no washing")

_Touches = dict[tuple[str, str], Bools]


def contaminated(view: View, carrier: str) -> Bools:
    """The carrier (the hand, or an object) is raw, or touched something raw or contaminated with
    ``contaminated.force`` for ``contaminated.window``, or a surface within ``contaminated.spot``
    of where such a thing touched it; and it was not sanitized since.
    """
    return view.shared(_spread)[carrier]


def clean_contact(view: View, carrier: str) -> Bools:
    """The carrier touches, with ``contaminated.force`` for ``contaminated.window``, something
    ready to eat, or a utensil or container that was clean before this touch.
    """
    touched = np.zeros(len(view.trace), bool)
    for _, values in _clean_contacts(view, carrier):
        touched |= values
    return touched


def sanitized(view: View, carrier: str) -> Bools:
    """For ``sanitized.window``, running water falls on the carrier: the box of the gripper or of
    the object reaches into the space that the water of an open tap falls through.
    """
    trace = view.trace
    half, centre, pose = trace.scene.gripper_half, trace.scene.gripper_centre, trace.steps.eef_pose
    if carrier != ROBOT:
        index = trace.scene.object_index[carrier]
        body = trace.scene.bodies[index]
        half, centre, pose = body.half, body.centre, trace.steps.object_pose[:, index]
    place = centred(pose, centre)
    wet = np.zeros(len(trace), bool)
    for box, running in _water(view):
        reach = float(np.linalg.norm(half)) + float(np.linalg.norm(trace.scene.boxes[box].half))
        water = trace.steps.box_pose[:, box]
        near = np.linalg.norm(place[:, :3] - water[:, :3], axis=1) < reach
        for step in np.flatnonzero(running & near & ~wet):
            wet[step] = boxes_overlap(
                place[step], half, water[step], trace.scene.boxes[box].half, 0.0
            )
    return held(wet, trace.count(view.parameters["sanitized.window"]))


def clean_contact_evidence(view: View, carrier: str, step: int) -> list[str]:
    """What is touched."""
    category = {e.name: e.category for e in view.trace.scene.entities}
    return [
        f"{'the hand' if carrier == ROBOT else carrier} touches {name} ({category[name]})"
        for name, values in _clean_contacts(view, carrier)
        if values[step]
    ]


def _clean_contacts(view: View, carrier: str) -> list[tuple[str, Bools]]:
    """What is touched that should stay clean, and when (T,)."""
    found, spread = [], view.shared(_spread)
    for (a, b), touch in view.shared(_touches).items():
        if carrier not in (a, b):
            continue
        name = b if carrier == a else a
        kinds = view.binding.attributes.get(name, frozenset())
        if "ready_to_eat" in kinds:
            found.append((name, touch))
        elif kinds & {"utensil", "container"}:
            dirty = _when_it_began(touch, spread[name], at_first="raw" in kinds)
            found.append((name, touch & ~dirty))
    return found


def _when_it_began(touch: Bools, state: Bools, at_first: bool) -> Bools:
    """Whether the state held before the present run of touching began (T,)."""
    before = np.concatenate(([at_first], state[:-1]))
    begin = np.maximum.accumulate(np.where(rising(touch), np.arange(len(touch)), 0))
    return np.asarray(before[begin])


def _water(view: View) -> list[tuple[int, Bools]]:
    """Boxes that water falls through, and when it runs (T,)."""
    scene, steps = view.trace.scene, view.trace.steps
    return [
        (box, steps.switch[:, k] == 1.0)
        for k, switch in enumerate(scene.switches)
        if switch.kind == "water"
        for box in scene.boxes_of(switch.entity, "water")
    ]


def _carrier_of(view: View) -> NDArray[np.intp]:
    """Which carrier each part belongs to, -1 for none: the hand is 0, objects follow."""
    scene, hand = view.trace.scene, hand_parts(view)
    return np.array(
        [
            0 if index in hand else scene.object_index.get(part.entity, -2) + 1
            for index, part in enumerate(scene.parts)
        ],
        np.intp,
    )


def _names(view: View) -> tuple[str, ...]:
    return (ROBOT, *(body.entity for body in view.trace.scene.bodies))


def _touches(view: View) -> _Touches:
    """When each pair of carriers touches, by their names."""
    names, carrier = _names(view), view.shared(_carrier_of)
    forces: dict[tuple[int, int], NDArray[np.float32]] = {}
    for (a, b), peak in view.trace.pair_table:
        pair = tuple(sorted((int(carrier[a]), int(carrier[b]))))
        if pair[0] >= 0 and pair[0] != pair[1]:
            key = (pair[0], pair[1])
            forces[key] = np.maximum(forces.get(key, peak), peak)
    return {(names[a], names[b]): _lasting(view, force) for (a, b), force in forces.items()}


def _lasting(view: View, force: NDArray[np.float32]) -> Bools:
    p = view.parameters
    return held(force >= p["contaminated.force"], view.trace.count(p["contaminated.window"]))


def _spread(view: View) -> dict[str, Bools]:
    """Whether each carrier is contaminated after each step (T,)."""
    names, length = _names(view), len(view.trace)
    raw = {n for n in names if "raw" in view.binding.attributes.get(n, frozenset())}
    found = {name: np.zeros(length, bool) for name in names}
    if not raw:
        return found
    washed = {name: view("sanitized", name) for name in names}
    touches, spots, dirty = view.shared(_touches), _Spots(view), set(raw)
    for step in range(length):
        dirty = raw | {name for name in dirty if not washed[name][step]}
        pairs = [pair for pair, touch in touches.items() if touch[step]]
        while True:
            reached = {n for pair in pairs if dirty & set(pair) for n in pair} - dirty
            reached |= spots.reach(step, dirty)
            if not reached:
                break
            dirty |= reached
        for name in dirty:
            found[name][step] = True
    return found


class _Spots:
    """Where surfaces were touched by something contaminated.

    A part that a joint moves, such as a door's handle, is one spot.
    """

    def __init__(self, view: View) -> None:
        scene, contacts = view.trace.scene, view.trace.steps.contacts
        carrier = view.shared(_carrier_of)
        lasts = np.zeros(len(contacts), bool)
        for pair, peak in view.trace.pair_table:
            rows = (np.minimum(contacts.a, contacts.b) == pair[0]) & (
                np.maximum(contacts.a, contacts.b) == pair[1]
            )
            lasts[rows] = _lasting(view, peak)[contacts.step[rows]]
        robot = np.array([part.entity == ROBOT for part in scene.parts])
        a, b = carrier[contacts.a], carrier[contacts.b]
        surface = np.where(a >= 0, contacts.b, contacts.a)
        rows = np.flatnonzero(lasts & ((a >= 0) != (b >= 0)) & ~robot[surface])
        moves = np.array([bool(part.joint) for part in scene.parts])
        self._radius = view.parameters["contaminated.spot"]
        self._names, self._step = _names(view), contacts.step[rows]
        self._carrier, self._surface = np.maximum(a, b)[rows], surface[rows]
        self._point = np.where(moves[self._surface][:, None], 0.0, contacts.position[rows])
        self._dirty = np.zeros(len(rows), bool)

    def reach(self, step: int, dirty: set[str]) -> set[str]:
        """Mark what the contaminated touch at a step; which others touch such a spot."""
        rows = range(*np.searchsorted(self._step, (step, step + 1)))
        clean = []
        for row in rows:
            if self._names[self._carrier[row]] in dirty:
                self._dirty[row] = True
            else:
                clean.append(row)
        return {self._names[self._carrier[row]] for row in clean if self._near(row)}

    def _near(self, row: int) -> bool:
        spots = self._point[self._dirty & (self._surface == self._surface[row])]
        return bool((np.linalg.norm(spots - self._point[row], axis=1) <= self._radius).any())


_FOLD = (FORCE, WINDOW, SPOT, WASH)

PROPOSITIONS = (
    Proposition("contaminated", ("tool",), lambda _: math.inf, _FOLD, contaminated),
    Proposition(
        "clean_contact",
        ("tool",),
        lambda _: math.inf,
        _FOLD,
        clean_contact,
        evidence=clean_contact_evidence,
    ),
    Proposition("sanitized", ("tool",), lambda p: p["sanitized.window"], (WASH,), sanitized),
)
