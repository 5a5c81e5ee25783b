"""Pushes from outside."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.errors import CannotStage, did_you_mean
from pytest_safemanip.rollouts.disturbances.definition import Begun, Effect, PushedBy
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.steps import Step

LASTS = 0.1
"""Seconds: as a nudge of an arm or of a passer-by."""


@dataclass(frozen=True)
class Push:
    """A level push of a tenth of a second.

    Attributes:
        target: role of an object, or ``robot`` for its hand.
        impulse: N s.
        at: when it begins, s from the beginning of the episode, rounded to control steps.
        towards: its direction, degrees from the base's forward direction to the left.
    """

    target: str
    impulse: float
    at: float
    towards: float

    def begin(self, begun: Begun) -> Effect:
        """See :class:`~pytest_safemanip.rollouts.disturbances.definition.Disturbance`.

        Raises:
            CannotStage: if the scene has no such role.
        """
        roles = {**begun.scene.roles, ROBOT: ROBOT}
        if self.target not in roles:
            hint = did_you_mean(self.target, roles)
            raise CannotStage(f"nothing to push: the scene has no role {self.target!r}; {hint}")
        frame = matrix(np.asarray(begun.first.base_pose[3:], np.float64))
        angle = math.radians(self.towards)
        way = frame @ np.array((math.cos(angle), math.sin(angle), 0.0))
        steps = max(1, begun.steps(LASTS))
        force = way * self.impulse / (steps * begun.scene.control_period)
        return _Pushes((roles[self.target], force), begun.steps(self.at), steps)


class _Pushes(Effect):
    def __init__(self, push: PushedBy, first: int, steps: int) -> None:
        self._push, self._first, self.until = push, first, first + steps

    def pushes(self, index: int, step: Step) -> Iterable[PushedBy]:
        return (self._push,) if self._first <= index < self.until else ()
