"""Disturbances of what the policy sees. What scripts ask the simulator stays true."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.policies.base import Observation
from pytest_safemanip.rollouts.disturbances.definition import Begun, Effect
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.steps import Step

Seen = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class DroppedFrames:
    """Some observations do not arrive: the policy sees the last one that did. The first does.

    Attributes:
        share: of those that the policy would look at, from 0 to 1; chance decides which.
    """

    share: float

    def begin(self, begun: Begun) -> Effect:
        """See :class:`~pytest_safemanip.rollouts.disturbances.definition.Disturbance`."""
        return _Drops(self.share, begun)


class _Drops(Effect):
    def __init__(self, share: float, begun: Begun) -> None:
        self._share, self._random = share, begun.random
        self._last: tuple[Step, Callable[[], Seen]] | None = None

    def seen(self, observation: Observation) -> Observation:
        dropped = self._random.random() < self._share
        if self._last is None or not dropped:
            self._last = observation.step, _once(observation.look)
        step, look = self._last
        return replace(observation, step=step, look=look)


def _once(look: Callable[[], Seen]) -> Callable[[], Seen]:
    """Looks once, when it is first asked to: a picture of the moment, as it stays."""
    taken: list[Seen] = []

    def again() -> Seen:
        if not taken:
            taken.append(look())
        return {name: array.copy() for name, array in taken[0].items()}

    return again


@dataclass(frozen=True)
class Calibration:
    """The hand is not where the policy takes it to be, whether it is told by the simulator's state
    or by the robot's own.

    Attributes:
        offset: from where it is to where it seems, along the base's forward, left and up
            directions (3,), m.
    """

    offset: tuple[float, float, float]

    def begin(self, begun: Begun) -> Effect:
        """See :class:`~pytest_safemanip.rollouts.disturbances.definition.Disturbance`."""
        return _Miscalibrated(self.offset, begun.hand_position)


class _Miscalibrated(Effect):
    def __init__(self, offset: tuple[float, float, float], key: str) -> None:
        self._offset, self._key = np.array(offset), key

    def seen(self, observation: Observation) -> Observation:
        step, look, key = observation.step, observation.look, self._key
        frame = matrix(np.asarray(step.base_pose[3:], np.float64))
        poses = step.eef_poses.copy()
        poses[:, :3] += (frame @ self._offset).astype(poses.dtype)

        def shifted() -> Seen:
            found = dict(look())
            if key:
                found[key] = (found[key] + self._offset).astype(found[key].dtype)
            return found

        return replace(observation, step=replace(step, eef_poses=poses), look=shifted)
