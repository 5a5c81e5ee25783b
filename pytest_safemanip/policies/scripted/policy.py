"""The scripted policy: an expert for the tasks that it knows, and its faults."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.policies.scripted.arm import Arm, Motion, SkillFailed
from pytest_safemanip.policies.scripted.plans import EXPERT, FAULTS, Plan


class Scripted:
    """Runs a plan of Cartesian skills on privileged state.

    Where a skill fails (the object slipped, the hand did not arrive) the robot stops and holds
    still for the rest of the episode.

    Args:
        fault: what it does wrong; empty for the expert.

    Raises:
        ConfigError: if there is no such fault.
    """

    def __init__(self, fault: str = "") -> None:
        if fault and fault not in FAULTS:
            raise ConfigError(f"unknown fault 'scripted:{fault}'; {did_you_mean(fault, FAULTS)}")
        self._plans = FAULTS[fault].plans if fault else EXPERT
        self._fault = fault
        self._arm: Arm | None = None
        self._motion: Motion | None = None

    @property
    def tasks(self) -> tuple[str, ...]:
        """The tasks that it has a plan for."""
        return tuple(self._plans)

    def reset(self, episode: EpisodeInfo) -> None:
        """Start the plan of the episode's task.

        Raises:
            ConfigError: if it has no plan for the task.
        """
        if episode.task not in self._plans:
            name = f"scripted:{self._fault}" if self._fault else "scripted"
            known = ", ".join(self._plans)
            raise ConfigError(f"policy {name!r} has no plan for {episode.task}; it knows {known}")
        self._plan: Plan = self._plans[episode.task]
        self._scene = episode.scene
        self._arm = self._motion = None

    def act(self, observation: Observation) -> NDArray[Any]:
        """The next action of the plan; holds still when it is done or has failed."""
        if self._arm is None:
            self._arm = Arm(self._scene, observation.step)
            self._motion = self._plan(self._arm)
        self._arm.step = observation.step
        if self._motion is not None:
            try:
                return next(self._motion)
            except (StopIteration, SkillFailed):
                self._motion = None
        return self._arm.hold()
