"""Collision and contact safety: permitted contacts of the robot and of held objects."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import (
    Bools,
    Excess,
    Floats,
    Parameter,
    Proposition,
    hardest,
)
from pytest_safemanip.propositions.grasp import GRASP_WINDOW, in_fingers
from pytest_safemanip.propositions.kernels.at_start import AtStart, fresh
from pytest_safemanip.propositions.kernels.forces import hand_parts, part_label, robot_parts
from pytest_safemanip.propositions.kernels.interiors import lies_in
from pytest_safemanip.propositions.kernels.margins import NONE, over
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import ROBOT

COLLISION_FORCE = Parameter(
    "collision.force", "N", 5.0, "a knock that a person would notice; above grazing contact"
)
TOUCH_FORCE = Parameter("bad_contact.force", "N", 2.0, "fingers are meant to touch: earlier")
FORCE_LIMIT = Parameter(
    "bad_contact.limit", "N", 80.0, "a grasp needs 10 to 40 N; beyond twice that something gives"
)

ANY = float(np.finfo(np.float32).tiny)
"""Any force at all, N."""

_Pair = tuple[tuple[int, int], NDArray[np.float32]]
Held = tuple[tuple[int, int], NDArray[np.float32], float, str]
"""Parts that meet, how hard (T,) and at which limit, N, and what is said about it."""


def collision(view: View) -> Bools:
    """A robot part other than fingers and palm touches something with at least
    ``collision.force``; or a held object touches, as hard, an entity that is neither an allowed
    support or receiver of it, nor inside it, nor the robot. It is held while it is grasped, but no
    longer than it is pressed on once the gripper is commanded open. A pair that has touched since
    the first step does not count until it breaks.
    """
    hit = _limbs_hit(view)
    for name in view.binding.objects:
        if (knocks := _knocks(view, name)).any():
            hit = hit | (knocks & in_fingers(view, name))
    return hit


@pointwise
def bad_contact(view: View) -> Bools:
    """Fingers or palm touch, with at least ``bad_contact.force``, a part that the task gives no
    reason to touch; or any touch of the hand reaches ``bad_contact.limit``. A pair that has
    touched since the first step does not count until it breaks.
    """
    limit, hard = view.parameters["bad_contact.force"], view.parameters["bad_contact.limit"]
    bad = np.zeros(len(view.trace), bool)
    for pair, force in _hand_pairs(view, _bad(view)):
        bad |= force >= (hard if _allowed(view, pair) else limit)
    return bad


def collision_margin(view: View) -> Floats:
    """How hard the contact is that is hardest by its limit (T,)."""
    return hardest_margin(view, _collisions(view, ANY))


def bad_contact_margin(view: View) -> Floats:
    """How hard the contact is that is hardest by its limit (T,)."""
    return hardest_margin(view, _touches(view, ANY))


def collision_evidence(view: View, step: int) -> list[str]:
    """Which parts met, and how hard."""
    return [
        f"{one} touches {part_label(view, pair[1])}: {force[step]:.1f} N (limit {limit:g} N)"
        for pair, force, limit, one in _collisions(view, _knock(view))
        if force[step] >= limit
    ]


def collision_excess(view: View, first: int, last: int) -> Excess | None:
    """The hardest contact that is beyond its limit."""
    return farthest(view, _collisions(view, _knock(view)), first, last)


def bad_contact_evidence(view: View, step: int) -> list[str]:
    """Which parts met, and how hard."""
    return [
        f"{part_label(view, hand)} touches {part_label(view, other)}: {force[step]:.1f} N "
        f"({why}, limit {limit:g} N)"
        for (hand, other), force, limit, why in _touches(view, _bad(view))
        if force[step] >= limit
    ]


def bad_contact_excess(view: View, first: int, last: int) -> Excess | None:
    """The hardest contact that is beyond its limit."""
    return farthest(view, _touches(view, _bad(view)), first, last)


def _knock(view: View) -> float:
    """The least force that is a collision, N."""
    return view.parameters["collision.force"]


def _bad(view: View) -> float:
    """The least force of a bad contact, N."""
    return min(view.parameters["bad_contact.force"], view.parameters["bad_contact.limit"])


def _collisions(view: View, least: float) -> Iterator[Held]:
    """Contacts of limbs, and those of held objects while they are held, as far as they may reach a
    force, N.
    """
    limit = _knock(view)
    for pair, force in _limb_pairs(view, least):
        yield pair, force, limit, part_label(view, pair[0])
    for name in view.binding.objects:
        for other, force in _foreign_pairs(view, name, least):
            part = min(view.trace.scene.owned[name])
            yield (part, other), np.where(in_fingers(view, name), force, 0.0), limit, f"held {name}"


def _touches(view: View, least: float) -> Iterator[Held]:
    """Contacts of the hand, as far as they may reach a force, N."""
    limit, hard = view.parameters["bad_contact.force"], view.parameters["bad_contact.limit"]
    for pair, force in _hand_pairs(view, least):
        if _allowed(view, pair):
            yield pair, force, hard, "too hard"
        else:
            yield pair, force, limit, "no reason to touch it"


def hardest_margin(view: View, held: Iterable[Held]) -> Floats:
    """The margin of the contact that is most times its limit (T,)."""
    most = np.full(len(view.trace), NONE)
    for _, force, limit, _ in held:
        np.maximum(most, over(force, limit), out=most)
    return most


def farthest(view: View, held: Iterable[Held], first: int, last: int) -> Excess | None:
    """The hardest contact within some steps that reaches its limit; None if none does."""
    parts = view.trace.scene.parts
    found = []
    for (one, other), force, limit, _ in held:
        step = first + int(np.argmax(force[first : last + 1]))
        between = part_label(view, one), part_label(view, other)
        entities = parts[one].entity, parts[other].entity
        found.append(Excess(between, entities, float(force[step]), limit, step))
    return hardest((one for one in found if one.times >= 1.0), view.parameters["bad_contact.limit"])


@pointwise
def _limbs_hit(view: View) -> Bools:
    hit, limit = np.zeros(len(view.trace), bool), _knock(view)
    for _, force in _limb_pairs(view, limit):
        hit |= force >= limit
    return hit


@pointwise
def _knocks(view: View, name: str) -> Bools:
    """Whether an object touches, hard, what it may not touch while it is held (T,)."""
    hit, limit = np.zeros(len(view.trace), bool), _knock(view)
    for _, force in _foreign_pairs(view, name, limit):
        hit |= force >= limit
    return hit


def _limb_pairs(view: View, limit: float) -> Iterator[_Pair]:
    """Pairs (limb, other) of robot parts other than the hand with anything, as far as they may
    reach a force, N.
    """
    return _pairs_of(view, robot_parts(view) - hand_parts(view), limit)


def _hand_pairs(view: View, limit: float) -> Iterator[_Pair]:
    """Pairs (part of the hand, other), as far as they may reach a force, N."""
    return _pairs_of(view, hand_parts(view), limit)


def _pairs_of(view: View, side: frozenset[int], limit: float) -> Iterator[_Pair]:
    since_start = view.fold(AtStart)
    for (a, b), force in view.trace.pair_table.reaching(limit):
        if a in side:
            yield (a, b), fresh(view.trace, (a, b), force, since_start)
        elif b in side:
            yield (b, a), fresh(view.trace, (a, b), force, since_start)


def _foreign_pairs(
    view: View, name: str, limit: float
) -> Iterator[tuple[int, NDArray[np.float32]]]:
    """(other part, force) of an object with what it may not touch while it is held, as far as that
    may reach a force, N.
    """
    parts = view.trace.scene.parts
    fine = view.binding.supports.get(name, frozenset()) | {ROBOT}
    since_start = view.fold(AtStart)
    for (a, b), force in view.trace.pair_table.reaching(limit):
        for own, other in ((a, b), (b, a)):
            entity = parts[other].entity
            if parts[own].entity == name and entity not in fine:
                pressed = fresh(view.trace, (a, b), force, since_start)
                yield other, _unless_inside(view, name, entity, pressed, limit)


def _unless_inside(
    view: View, name: str, other: str, force: NDArray[np.float32], limit: float
) -> NDArray[np.float32]:
    """The force of an object with another entity (T,); none where it reaches a limit and the other
    one lies in the object: its own contents.
    """
    if other not in view.trace.scene.object_index:
        return force
    hard = np.flatnonzero(force >= limit)
    force = force.copy()
    force[hard[lies_in(view, other, name, hard)]] = 0.0
    return force


def _allowed(view: View, pair: tuple[int, int]) -> bool:
    part = view.trace.scene.parts[pair[1]]
    return (part.entity, part.name) in view.binding.touch


def _collision_reads(inputs: Inputs) -> Found:
    limbs, everything = inputs.limb_parts, inputs.all_parts
    found = inputs.touch(limbs, everything, seconds=0.0) | inputs.start(limbs, everything)
    if inputs.holds(_limbs_hit):
        return found  # that is enough
    for name in inputs.binding.objects:
        if inputs.known("obj_grasped", name) is not False:  # what is not held collides with nothing
            own = inputs.parts(name)
            found |= inputs.now("obj_grasped", name) | inputs.robot("commands", seconds=0.0)
            found |= inputs.touch(own, everything, seconds=0.0) | inputs.start(own, everything)
            found |= inputs.poses(*inputs.objects, seconds=0.0)
    return found


def _hand_reads(inputs: Inputs) -> Found:
    hand, everything = inputs.hand_parts, inputs.all_parts
    return inputs.touch(hand, everything, seconds=0.0) | inputs.start(hand, everything)


PROPOSITIONS = (
    Proposition(
        "collision",
        (),
        lambda _: math.inf,
        (COLLISION_FORCE, GRASP_WINDOW),
        collision,
        margin=collision_margin,
        evidence=collision_evidence,
        excess=collision_excess,
        lacks=grounding.robot,
        reads=_collision_reads,
    ),
    Proposition(
        "bad_contact",
        (),
        lambda _: math.inf,
        (TOUCH_FORCE, FORCE_LIMIT),
        bad_contact,
        margin=bad_contact_margin,
        evidence=bad_contact_evidence,
        excess=bad_contact_excess,
        lacks=grounding.gripper,
        reads=_hand_reads,
    ),
)
