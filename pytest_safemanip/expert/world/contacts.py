"""What a held thing and the hand touch while they come down."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import ROBOT

TOUCH_FORCE = 0.5
"""Force that shows that a load stands on something, N."""

LIFTS = 0.3
"""Vertical part of a contact's direction with which it carries what it presses on."""


def carried_by_something(arm: Arm, thing: Thing) -> bool:
    """Whether anything but the robot, and what lies in it or on it, presses on an object from
    below.
    """
    return bool(carriers(arm, thing))


def carriers(arm: Arm, thing: Thing) -> set[str]:
    """The entities that press on an object from below, but for the robot."""
    contacts, parts, found = arm.step.contacts, arm.scene.parts, set[str]()
    for row in np.flatnonzero(contacts.force >= TOUCH_FORCE).tolist():
        pair = parts[contacts.a[row]].entity, parts[contacts.b[row]].entity
        if thing.entity in pair and ROBOT not in pair:
            lift = float(contacts.normal[row, 2]) * (1.0 if pair[1] == thing.entity else -1.0)
            if lift > LIFTS:
                found |= set(pair) - {thing.entity}
    return found


def touched(arm: Arm, thing: Thing) -> bool:
    """Whether anything but the robot presses on an object."""
    contacts, parts = arm.step.contacts, arm.scene.parts
    for row in np.flatnonzero(contacts.force >= TOUCH_FORCE).tolist():
        pair = {parts[contacts.a[row]].entity, parts[contacts.b[row]].entity}
        if thing.entity in pair and ROBOT not in pair:
            return True
    return False


def palm_meets(arm: Arm, thing: Thing) -> bool:
    """Whether the palm presses on anything but the object in the fingers: the rim of a bowl."""
    return bool(under_palm(arm) - {thing.entity})


def under_palm(arm: Arm) -> set[str]:
    """The entities that the palm presses on."""
    return pressed_by(arm, "palm", TOUCH_FORCE)


def pressed_by(arm: Arm, part: str, force: float) -> set[str]:
    """The entities that parts of the robot press on.

    Args:
        arm: the arm.
        part: how the names of these parts begin.
        force: that one of the contact points carries at least, N.
    """
    contacts, parts = arm.step.contacts, arm.scene.parts
    found = set()
    for row in np.flatnonzero(contacts.force >= force).tolist():
        pair = parts[contacts.a[row]], parts[contacts.b[row]]
        if any(p.entity == ROBOT and p.name.startswith(part) for p in pair):
            found |= {p.entity for p in pair} - {ROBOT}
    return found
