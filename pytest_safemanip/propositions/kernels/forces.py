"""Contact forces between robot parts, objects and what joints move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import ROBOT

Parts = frozenset[int]


def hand_parts(view: View) -> Parts:
    """Indices of the fingers and palms of all grippers."""
    return view.shared(_hand_parts)


def finger_groups(view: View) -> tuple[tuple[Parts, ...], ...]:
    """Indices of the parts of each finger group of each gripper."""
    return view.shared(_finger_groups)


def robot_parts(view: View) -> Parts:
    """Indices of all parts of the robot."""
    return object_parts(view, ROBOT)


def object_parts(view: View, entity: str) -> Parts:
    """Indices of all parts of an entity."""
    return view.trace.scene.owned.get(entity, frozenset())


def part_label(view: View, part: int) -> str:
    """A part as evidence names it: an object with its category, else ``entity/part``."""
    owner = view.trace.scene.parts[part]
    entity = view.trace.scene.entity[owner.entity]
    if entity.kind == "object":
        return f"{entity.name} ({entity.category})"
    return f"{entity.name}/{owner.name}"


@pointwise
def forces_on(view: View, ours: Parts) -> NDArray[np.float32]:
    """Largest sustained force between some of the robot's parts and each object, N (T, N)."""
    owner = view.shared(owners).tolist()
    force = np.zeros((len(view.trace.scene.bodies), len(view.trace)), np.float32)
    for (a, b), pressed in view.trace.pair_table:
        own = owner[b] if a in ours else owner[a] if b in ours else -1
        if own >= 0:
            np.maximum(force[own], pressed, out=force[own])
    return force.T


def pushes(
    view: View, fingers: tuple[Parts, Parts], where: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """How two finger groups push objects, N, world frame (3, 2, K): what their contact points
    carry at the end of the step, or else sustained within it.

    Args:
        view: what is looked at.
        fingers: indices of the parts of both groups.
        where: steps and objects that are looked at (T, N), K of them.
    """
    contacts, owner = view.trace.steps.contacts, view.shared(owners)
    finger = view.shared(_group_of, fingers)
    count, number = np.count_nonzero(where), np.cumsum(where.ravel()) - 1
    touched = np.append(where.any(axis=0), False)[owner]  # the last is of what is no object
    things = frozenset(touched.nonzero()[0].tolist())
    rows = view.trace.pair_table.rows(fingers[0] | fingers[1], things)
    pushed = np.maximum(owner[contacts.a[rows]], owner[contacts.b[rows]])
    cell = contacts.step[rows] * where.shape[1] + pushed
    wanted = where.ravel()[cell]
    rows, cell = rows[wanted], number[cell[wanted]]
    a_pushes = finger[contacts.a[rows]] >= 0
    side = np.where(a_pushes, finger[contacts.a[rows]], finger[contacts.b[rows]])
    force = np.where(contacts.force[rows] > 0, contacts.force[rows], contacts.sustained[rows])
    along = (contacts.normal[rows] * (force * np.where(a_pushes, 1.0, -1.0))[:, None]).T
    place, size = side * count + cell, len(fingers) * count
    totals = [np.bincount(place, share, size) for share in along]
    return np.array(totals, np.float64).reshape(3, len(fingers), count)


def _group_of(view: View, fingers: tuple[Parts, ...]) -> NDArray[np.intp]:
    """Number of the finger group that each part is of; -1 if of none (parts,)."""
    group = np.full(len(view.trace.scene.parts), -1, np.intp)
    for number, parts in enumerate(fingers):
        group[list(parts)] = number
    return group


def owners(view: View) -> NDArray[np.intp]:
    """Which object each part is of; -1 if of none (parts,)."""
    scene = view.trace.scene
    return np.array([scene.object_index.get(part.entity, -1) for part in scene.parts], np.intp)


@pointwise
def robot_on_joint(view: View, index: int) -> NDArray[np.float32]:
    """Largest sustained force between the robot and what a joint moves, N (T,)."""
    moved = view.trace.scene.moved_by(index)
    return view.trace.pair_table.force(robot_parts(view), moved)


def _hand_parts(view: View) -> Parts:
    scene = view.trace.scene
    return frozenset(n for hand in scene.grippers for n in scene.parts_of(ROBOT, hand.parts))


def _finger_groups(view: View) -> tuple[tuple[Parts, ...], ...]:
    scene = view.trace.scene
    return tuple(
        tuple(frozenset(scene.parts_of(ROBOT, group)) for group in hand.fingers)
        for hand in scene.grippers
    )
