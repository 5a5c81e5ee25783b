"""Disturbances of what the robot is told."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.rollouts.disturbances.definition import Action, Begun, Effect

MEMORY_SECONDS = 0.17
"""In this time noise forgets all but 1/e of itself: an arm follows what lasts, and no more."""


@dataclass(frozen=True)
class ActionNoise:
    """Noise on every motion that the robot is told, Gaussian and correlated over 0.2 s.

    Attributes:
        size: its standard deviation, as a share of half of an entry's range.
    """

    size: float

    def begin(self, begun: Begun) -> Effect:
        """See :class:`~pytest_safemanip.rollouts.disturbances.definition.Disturbance`."""
        return _Noisy(self.size, begun)


class _Noisy(Effect):
    def __init__(self, size: float, begun: Begun) -> None:
        actions, self._random = begun.robot.actions, begun.random
        switched = {*actions.modes, *(g.entry for g in begun.robot.grippers)}
        moves = np.array([entry.name not in switched for entry in actions.entries])
        self._scale = size * 0.5 * (actions.high - actions.low) * moves
        self._memory = math.exp(-begun.scene.control_period / MEMORY_SECONDS)
        self._noise = self._random.normal(size=actions.size)

    def told(self, action: Action, index: int) -> Action:
        fresh = self._random.normal(size=len(action)) * math.sqrt(1.0 - self._memory**2)
        self._noise = self._memory * self._noise + fresh
        told: Action = action + self._scale * self._noise
        return told


@dataclass(frozen=True)
class Latency:
    """What the policy asks for is done later; until its first action the robot holds still.

    Attributes:
        seconds: how much later, rounded to control steps.
    """

    seconds: float

    def begin(self, begun: Begun) -> Effect:
        """See :class:`~pytest_safemanip.rollouts.disturbances.definition.Disturbance`."""
        return _Late(begun.steps(self.seconds), begun)


class _Late(Effect):
    def __init__(self, steps: int, begun: Begun) -> None:
        hold = begun.robot.actions.hold(())
        self._waiting = deque(hold.copy() for _ in range(steps))

    def told(self, action: Action, index: int) -> Action:
        self._waiting.append(action)
        return self._waiting.popleft()

    def left(self) -> Sequence[Action]:
        return tuple(self._waiting)


@dataclass(frozen=True)
class Slip:
    """Fingers that were told to close lose their hold once: they are told to open for a moment.

    Attributes:
        seconds: for how long, rounded to control steps.
        after: since they were told to close, s.
    """

    seconds: float
    after: float

    def begin(self, begun: Begun) -> Effect:
        """See :class:`~pytest_safemanip.rollouts.disturbances.definition.Disturbance`."""
        return _Slips(begun.steps(self.seconds), begun.steps(self.after), begun)


class _Slips(Effect):
    def __init__(self, steps: int, after: int, begun: Begun) -> None:
        actions = begun.robot.actions
        self._hands = [(g, actions.index(g.entry)) for g in begun.robot.grippers if g.entry]
        self._closed = [0] * len(self._hands)
        self._first, self._end = after + 1, after + 1 + steps

    def told(self, action: Action, index: int) -> Action:
        told = action.copy()
        for number, (hand, place) in enumerate(self._hands):
            closed = self._closed[number]
            if closed or hand.command(float(action[place])) > 0.0:
                self._closed[number] = closed = closed + 1
            if self._first <= closed < self._end:
                told[place] = hand.opens
        return told
