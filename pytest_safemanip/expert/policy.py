"""The scripted expert: it runs a plan for each task that it knows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, SkillFailed
from pytest_safemanip.expert.tasks.search import PATIENCE
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.trace.hazard import Hazard


class Expert:
    """Runs a plan of Cartesian skills on privileged state.

    Where a skill fails (the object slipped, the hand did not arrive) the robot stops and holds
    still.

    Args:
        plans: by task.
        name: what it is called.

    Attributes:
        failure: why a skill failed; empty if none did.
    """

    def __init__(self, plans: Mapping[str, Plan], name: str = "scripted") -> None:
        self._plans, self._name = plans, name
        self._arm: Arm | None = None
        self._motion: Motion | None = None
        self._idle = 0
        self.failure = ""

    @property
    def tasks(self) -> tuple[str, ...]:
        """The tasks that it has a plan for."""
        return tuple(self._plans)

    @property
    def done(self) -> bool:
        """Whether its plan is over."""
        return self._idle > PATIENCE

    @property
    def hazards(self) -> tuple[Hazard, ...]:
        """What it did wrong so far, in this episode."""
        return tuple(self._arm.truth.hazards) if self._arm else ()

    @property
    def reads_permissions(self) -> bool:
        """That it knows what a task lets it touch."""
        return True

    def reset(self, episode: EpisodeInfo) -> None:
        """Start the plan of the episode's task.

        Raises:
            ConfigError: if it has no plan for the task.
        """
        if episode.task not in self._plans:
            known = ", ".join(self._plans)
            raise ConfigError(
                f"policy {self._name!r} has no plan for {episode.task}; it knows {known}"
            )
        self._plan: Plan = self._plans[episode.task]
        self._scene, self._instruction = episode.scene, episode.instruction
        self._permissions = episode.permissions
        self._arm = self._motion = None
        self._idle = 0
        self.failure = ""

    def act(self, observation: Observation) -> NDArray[Any]:
        """The next action of the plan; holds still when it is done or has failed."""
        if self._arm is None:
            self._arm = Arm(self._scene, observation.step, self._instruction, observation.clearance)
            self._arm.rehearsal, self._arm.permissions = observation.rehearsal, self._permissions
            self._motion = self._plan(self._arm)
        else:
            self._arm.see(observation.step)
        self._arm.foresee = observation.clearance
        self._arm.truth.at(observation.index)
        if self._motion is not None:
            try:
                return next(self._motion)
            except StopIteration:
                self._motion = None
            except SkillFailed as error:
                self._motion, self.failure = None, str(error)
        self._idle += 1
        return self._arm.hold()
