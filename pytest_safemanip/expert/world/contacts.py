"""What a held thing and the hand touch while they come down."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import ROBOT, Joint, Part

TOUCH_FORCE = 0.5
"""Force that shows that a load stands on something, N."""

LIFTS, BEARS = 0.3, 0.5
"""Vertical part of a contact's direction with which it carries what it presses on, and with which
that would not slip."""


def carriers(arm: Arm, thing: Thing) -> set[str]:
    """The entities that press on an object from below, but for the robot; what lies in it or on it
    does not.
    """
    below = {low.entity for _, up, low in _stacked(arm) if up.entity == thing.entity}
    return below - {ROBOT}


def borne_at(arm: Arm, thing: Thing) -> Array:
    """Where something presses on an object from below, not from aside, however gently, but for the
    robot (K, 3).
    """
    contacts = arm.step.contacts
    rows = [
        row
        for row, up, low in _stacked(arm, 0.0)
        if up.entity == thing.entity
        and low.entity != ROBOT
        and contacts.force[row] > 0.0
        and abs(contacts.normal[row, 2]) >= BEARS
    ]
    return np.asarray(contacts.position[rows], np.float64)


def touching(arm: Arm, thing: Thing) -> set[str]:
    """The entities that touch an object, however gently."""
    contacts, parts = arm.step.contacts, arm.scene.parts
    sides = zip(contacts.a.tolist(), contacts.b.tolist(), strict=True)
    pairs = [{parts[a].entity, parts[b].entity} for a, b in sides]
    return set().union(*(pair for pair in pairs if thing.entity in pair)) - {thing.entity}


def loads(arm: Arm, joint: Joint) -> set[str]:
    """The objects that lie on what a joint moves, or on what does."""
    stacked = list(_stacked(arm))
    found, more = set[str](), {up.entity for _, up, low in stacked if low.joint == joint.key}
    while more:
        found |= more
        more = {up.entity for _, up, low in stacked if low.entity in found} - found
    return found & set(arm.scene.object_index)


def _stacked(arm: Arm, force: float = TOUCH_FORCE) -> Iterator[tuple[int, Part, Part]]:
    """Contact points that carry, with a force at least: the row of each, the upper part and the
    lower.
    """
    contacts, parts = arm.step.contacts, arm.scene.parts
    for row in np.flatnonzero(contacts.force >= force).tolist():
        a, b, lift = parts[contacts.a[row]], parts[contacts.b[row]], contacts.normal[row, 2]
        if abs(lift) > LIFTS:
            yield (row, b, a) if lift > 0.0 else (row, a, b)


def supports(arm: Arm) -> dict[str, set[str]]:
    """The entities that an entity has leave to rest on, for each that a task lets rest on some."""
    if arm.permissions is None:
        return {}
    roles, found = arm.scene.roles, dict[str, set[str]]()
    for role, below in arm.permissions.supports.items():
        entities = {roles.get(name, name) for name in below}
        found.setdefault(roles.get(role, role), set()).update(entities)
    return found


def palm_meets(arm: Arm, thing: Thing) -> bool:
    """Whether the palm presses on anything but the object in the fingers: the rim of a bowl."""
    return bool(pressed_by(arm, "palm", TOUCH_FORCE) - {thing.entity})


def pressed_by(arm: Arm, part: str, force: float) -> set[str]:
    """The entities that parts of the robot press on.

    Args:
        arm: the arm.
        part: how the names of these parts begin.
        force: that one of the contact points carries at least, N.
    """
    return {other.entity for _, other, _ in _contacts_of(arm, part, force)} - {ROBOT}


def contact_force(arm: Arm, part: str, force: float) -> Array:
    """Net horizontal contact force on parts of the robot (2,), N.

    Args:
        arm: the arm.
        part: how the names of these parts begin.
        force: that a contact point carries at least, to count, N.
    """
    contacts, total = arm.step.contacts, np.zeros(2)
    for row, _, sense in _contacts_of(arm, part, force):
        total += sense * contacts.force[row] * contacts.normal[row, :2]
    return total


def _contacts_of(arm: Arm, part: str, force: float) -> Iterator[tuple[int, Part, float]]:
    """Contact points of parts of the robot: the row of each, the other part, and the sign with
    which its normal points to the robot's.
    """
    contacts, parts = arm.step.contacts, arm.scene.parts
    for row in np.flatnonzero(contacts.force >= force).tolist():
        a, b = parts[contacts.a[row]], parts[contacts.b[row]]
        for own, other, sense in ((a, b, -1.0), (b, a, 1.0)):
            if own.entity == ROBOT and own.name.startswith(part):
                yield row, other, sense
