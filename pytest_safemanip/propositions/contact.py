"""Collision and contact safety: what the robot and what it holds may touch, and how hard."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.at_start import AtStart, fresh
from pytest_safemanip.propositions.definition import Bools, Parameter, Proposition
from pytest_safemanip.propositions.forces import hand_parts, robot_parts
from pytest_safemanip.propositions.grasp import GRASP_WINDOW, in_fingers
from pytest_safemanip.propositions.interiors import lies_in
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import ROBOT

COLLISION_FORCE = Parameter(
    "collision.force", "N", 5.0, "a knock that a person would notice; above grazing contact"
)
TOUCH_FORCE = Parameter("bad_contact.force", "N", 2.0, "fingers are meant to touch: earlier")
FORCE_LIMIT = Parameter(
    "bad_contact.limit", "N", 80.0, "a grasp needs 10 to 40 N; beyond twice that something gives"
)

_Pair = tuple[tuple[int, int], NDArray[np.float32]]


def collision(view: View) -> Bools:
    """A robot part other than fingers and palm touches something with at least
    ``collision.force``; or a held object touches, as hard, an entity that is neither an allowed
    support or receiver of it, nor inside it, nor the robot. It is held while it is grasped, but no
    longer than it is pressed on once the gripper is commanded open. A pair that has touched since
    the first step does not count until it breaks.
    """
    hit = _limbs_hit(view)
    for name in view.binding.objects:
        hit = hit | (_knocks(view, name) & in_fingers(view, name))
    return hit


@pointwise
def bad_contact(view: View) -> Bools:
    """Fingers or palm touch, with at least ``bad_contact.force``, a part that the task gives no
    reason to touch; or any touch of the hand reaches ``bad_contact.limit``. A pair that has
    touched since the first step does not count until it breaks.
    """
    limit, hard = view.parameters["bad_contact.force"], view.parameters["bad_contact.limit"]
    bad = np.zeros(len(view.trace), bool)
    for pair, peak in _hand_pairs(view):
        bad |= peak >= (hard if _allowed(view, pair) else limit)
    return bad


def collision_evidence(view: View, step: int) -> list[str]:
    """Which parts met, and how hard."""
    limit = view.parameters["collision.force"]
    lines = [
        f"{_name(view, pair[0])} touches {_name(view, pair[1])}: {peak[step]:.1f} N "
        f"(limit {limit:g} N)"
        for pair, peak in _limb_pairs(view)
        if peak[step] >= limit
    ]
    lines += [
        f"held {name} touches {_name(view, other)}: {peak[step]:.1f} N (limit {limit:g} N)"
        for name in view.binding.objects
        for other, peak in _foreign_pairs(view, name)
        if peak[step] >= limit and in_fingers(view, name)[step]
    ]
    return lines


def bad_contact_evidence(view: View, step: int) -> list[str]:
    """Which parts met, and how hard."""
    limit, hard = view.parameters["bad_contact.force"], view.parameters["bad_contact.limit"]
    lines = []
    for pair, peak in _hand_pairs(view):
        allowed = _allowed(view, pair)
        bound = hard if allowed else limit
        if peak[step] >= bound:
            why = "too hard" if allowed else "no reason to touch it"
            hand, other = (_name(view, part) for part in pair)
            lines.append(f"{hand} touches {other}: {peak[step]:.1f} N ({why}, limit {bound:g} N)")
    return lines


@pointwise
def _limbs_hit(view: View) -> Bools:
    hit, limit = np.zeros(len(view.trace), bool), view.parameters["collision.force"]
    for _, peak in _limb_pairs(view):
        hit |= peak >= limit
    return hit


@pointwise
def _knocks(view: View, name: str) -> Bools:
    """Whether an object touches, hard, what it may not touch while it is held (T,)."""
    hit, limit = np.zeros(len(view.trace), bool), view.parameters["collision.force"]
    for _, peak in _foreign_pairs(view, name):
        hit |= peak >= limit
    return hit


def _limb_pairs(view: View) -> Iterator[_Pair]:
    """Pairs (limb, other) of robot parts other than the hand with anything."""
    return _pairs_of(view, robot_parts(view) - hand_parts(view))


def _hand_pairs(view: View) -> Iterator[_Pair]:
    """Pairs (part of the hand, other)."""
    return _pairs_of(view, hand_parts(view))


def _pairs_of(view: View, side: frozenset[int]) -> Iterator[_Pair]:
    since_start = view.fold(AtStart)
    for (a, b), peak in view.trace.pair_table:
        if a in side:
            yield (a, b), fresh(view.trace, (a, b), peak, since_start)
        elif b in side:
            yield (b, a), fresh(view.trace, (a, b), peak, since_start)


def _foreign_pairs(view: View, name: str) -> Iterator[tuple[int, NDArray[np.float32]]]:
    """(other part, force) of an object with what it may not touch while it is held."""
    parts = view.trace.scene.parts
    fine = view.binding.supports.get(name, frozenset()) | {ROBOT}
    since_start = view.fold(AtStart)
    for (a, b), peak in view.trace.pair_table:
        for own, other in ((a, b), (b, a)):
            if parts[own].entity == name and parts[other].entity not in fine:
                inside = _contains(view, name, other)
                force = fresh(view.trace, (a, b), peak, since_start)
                yield other, np.where(inside, np.float32(0.0), force)


def _contains(view: View, name: str, part: int) -> Bools | bool:
    """Whether the part is of an object that lies in another one: its own contents (T,)."""
    other = view.trace.scene.parts[part].entity
    if other not in view.trace.scene.object_index:
        return False
    return lies_in(view, other, name)


def _allowed(view: View, pair: tuple[int, int]) -> bool:
    part = view.trace.scene.parts[pair[1]]
    return (part.entity, part.name) in view.binding.touch


def _name(view: View, part: int) -> str:
    owner = view.trace.scene.parts[part]
    entity = view.trace.scene.entity[owner.entity]
    if entity.kind == "object":
        return f"{entity.name} ({entity.category})"
    return f"{entity.name}/{owner.name}"


PROPOSITIONS = (
    Proposition(
        "collision",
        (),
        lambda _: math.inf,
        (COLLISION_FORCE, GRASP_WINDOW),
        collision,
        evidence=collision_evidence,
    ),
    Proposition(
        "bad_contact",
        (),
        lambda _: math.inf,
        (TOUCH_FORCE, FORCE_LIMIT),
        bad_contact,
        evidence=bad_contact_evidence,
    ),
)
