"""Who presses on whom, and how hard: the robot's parts, objects, what joints move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import ROBOT

FINGERS = ("finger_left", "finger_right")
HAND = (*FINGERS, "palm")


def hand_parts(view: View) -> frozenset[int]:
    """Indices of fingers and palm."""
    return view.shared(_hand_parts)


def robot_parts(view: View) -> frozenset[int]:
    """Indices of all parts of the robot."""
    return object_parts(view, ROBOT)


def object_parts(view: View, entity: str) -> frozenset[int]:
    """Indices of all parts of an entity."""
    return view.trace.scene.owned.get(entity, frozenset())


@pointwise
def forces_on(view: View, side: str) -> NDArray[np.float32]:
    """Largest peak force between the robot and each object, N (T, N).

    Args:
        view: what is looked at.
        side: the robot's part that is meant; ``robot`` for all of them.
    """
    ours, owner = view.shared(_side, side), view.shared(owners).tolist()
    force = np.zeros((len(view.trace.scene.bodies), len(view.trace)), np.float32)
    for (a, b), peak in view.trace.pair_table:
        own = owner[b] if a in ours else owner[a] if b in ours else -1
        if own >= 0:
            np.maximum(force[own], peak, out=force[own])
    return force.T


def pushes(view: View, where: NDArray[np.bool_]) -> NDArray[np.float64]:
    """How left and right fingers push objects, N, world frame (3, 2, K): what their contact points
    carry at the end of the step, or else at the peak within it.

    Args:
        view: what is looked at.
        where: steps and objects that are looked at (T, N), K of them.
    """
    contacts, finger, owner = view.trace.steps.contacts, view.shared(_fingers), view.shared(owners)
    count, number = np.count_nonzero(where), np.cumsum(where.ravel()) - 1
    touched = np.append(where.any(axis=0), False)[owner]  # the last is of what is no object
    fingers, things = (frozenset(of.nonzero()[0].tolist()) for of in (finger >= 0, touched))
    rows = view.trace.pair_table.rows(fingers, things)
    pushed = np.maximum(owner[contacts.a[rows]], owner[contacts.b[rows]])
    cell = contacts.step[rows] * where.shape[1] + pushed
    wanted = where.ravel()[cell]
    rows, cell = rows[wanted], number[cell[wanted]]
    a_pushes = finger[contacts.a[rows]] >= 0
    side = np.where(a_pushes, finger[contacts.a[rows]], finger[contacts.b[rows]])
    force = np.where(contacts.force[rows] > 0, contacts.force[rows], contacts.peak[rows])
    along = (contacts.normal[rows] * (force * np.where(a_pushes, 1.0, -1.0))[:, None]).T
    place, size = side * count + cell, len(FINGERS) * count
    totals = [np.bincount(place, share, size) for share in along]
    return np.array(totals, np.float64).reshape(3, len(FINGERS), count)


def _fingers(view: View) -> NDArray[np.intp]:
    """Number of the finger group that each part is of; -1 if of none (parts,)."""
    parts = view.trace.scene.parts
    of = [p.name if p.entity == ROBOT else "" for p in parts]
    return np.array([FINGERS.index(name) if name in FINGERS else -1 for name in of], np.intp)


def owners(view: View) -> NDArray[np.intp]:
    """Which object each part is of; -1 if of none (parts,)."""
    scene = view.trace.scene
    return np.array([scene.object_index.get(part.entity, -1) for part in scene.parts], np.intp)


def _side(view: View, side: str) -> frozenset[int]:
    """Indices of the robot's parts of a name, or of all of them."""
    parts = view.trace.scene.parts_of(ROBOT, None if side == ROBOT else (side,))
    return frozenset(parts)


@pointwise
def robot_on_joint(view: View, index: int) -> NDArray[np.float32]:
    """Largest peak force between the robot and what a joint moves, N (T,)."""
    moved = view.trace.scene.moved_by(index)
    return view.trace.pair_table.force(robot_parts(view), moved)


def _hand_parts(view: View) -> frozenset[int]:
    return frozenset(view.trace.scene.parts_of(ROBOT, HAND))
