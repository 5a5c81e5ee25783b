"""Disturbances and their effects."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.policies.base import Observation
from pytest_safemanip.sim.backend import RobotSpec
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step

Action = NDArray[np.float64]
PushedBy = tuple[str, NDArray[np.float64]]
"""An entity and the force on it, world frame (3,), N."""


@dataclass(frozen=True)
class Begun:
    """An episode that begins, as disturbances know it.

    Attributes:
        scene: its static part.
        robot: what is told what.
        first: its first step.
        hand_position: which part of an observation's state is the hand's position in the base's
            frame; empty if none is.
        random: for whatever is random in one disturbance; the same in the same rollout.
    """

    scene: Scene
    robot: RobotSpec
    first: Step
    hand_position: str
    random: np.random.Generator

    def steps(self, seconds: float) -> int:
        """A time in control steps, rounded."""
        return round(seconds / self.scene.control_period)


class Effect:
    """What a disturbance does in one rollout: nothing, but for what it overrides.

    Attributes:
        until: the last control step at which something is still to come; whatever lasts for the
            whole rollout counts as come.
    """

    until = 0

    def seen(self, observation: Observation) -> Observation:
        """What the policy sees instead; asked once each time that it is to choose actions."""
        return observation

    def told(self, action: Action, index: int) -> Action:
        """What the robot is told instead (A,), at a control step, by its number from 0."""
        return action

    def left(self) -> Sequence[Action]:
        """What the robot is still told when the policy has ended."""
        return ()

    def pushes(self, index: int, step: Step) -> Iterable[PushedBy]:
        """What is pushed during a control period, from the state before it."""
        return ()


class Disturbance(Protocol):
    """A frozen dataclass of numbers, texts and tuples of them.

    One of your own has to be importable where rollouts are run: its class and values are part of
    what decides a recording.
    """

    def begin(self, begun: Begun) -> Effect:
        """Its effect in a rollout."""


def to_plain(disturbances: Iterable[Disturbance]) -> list[dict[str, Any]]:
    """Plain values, as in a key or a recording."""
    return [
        {"kind": type(own).__name__.lower(), **dataclasses.asdict(own)}  # type: ignore[call-overload]
        for own in disturbances
    ]
