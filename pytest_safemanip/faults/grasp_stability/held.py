"""How firmly an object is held, and whether it stays where it was in the hand."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array, rotation_vector
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import matrix

SLID = 0.035
"""Way in the hand after which the fingers hold another end of an object, m."""
SWUNG = math.radians(30.0)
"""Turn in the hand after which an object hangs rather than is held."""
CARRYING = 0.2
"""Fingers that press a thing with less do not carry it: it falls past them, N."""


class Held:
    """How an object lies in the hand, compared with how it was when it was lifted."""

    def __init__(self, arm: Arm, thing: Thing) -> None:
        self._arm, self._thing = arm, thing
        self._start, self._where = self._now(), self._place()

    @property
    def slid(self) -> float:
        """How far it has moved in the hand, m."""
        return float(np.linalg.norm(self._place() - self._where))

    @property
    def swung(self) -> float:
        """How far it has turned in the hand, rad."""
        return float(np.linalg.norm(rotation_vector(self._now() @ self._start.T)))

    @property
    def carried(self) -> bool:
        """Whether the robot presses it: what was let go moves, but in no hand."""
        return _pressing(self._arm, self._thing.entity) > CARRYING

    def lost(self) -> bool:
        """Whether it is in the hand, but no longer as it was."""
        return self.carried and (self.slid > SLID or self.swung > SWUNG)

    def _now(self) -> Array:
        turned: Array = self._arm.rotation.T @ matrix(self._thing.pose[3:])
        return turned

    def _place(self) -> Array:
        place: Array = self._arm.rotation.T @ (self._thing.com - self._arm.position)
        return place


def ease(arm: Arm, notches: int, until: Callable[[], bool] = lambda: False) -> Motion:
    """Open the fingers by notches of 4 N each: they press, but less."""
    for _ in range(notches):
        if until():
            return
        yield from arm.open_by(1)
        yield from arm.wait(0.2)


def squeeze(arm: Arm, role: str) -> float:
    """Sum of the normal forces between the robot and an object in the newest control step, N."""
    return _pressing(arm, arm.scene.roles[role])


def _pressing(arm: Arm, name: str) -> float:
    """Sum of the normal forces between the robot and an object, N."""
    contacts, parts = arm.step.contacts, arm.scene.parts
    rows = zip(contacts.a.tolist(), contacts.b.tolist(), contacts.force.tolist(), strict=True)
    own = [f for a, b, f in rows if {parts[a].entity, parts[b].entity} == {ROBOT, name}]
    return float(sum(own))
