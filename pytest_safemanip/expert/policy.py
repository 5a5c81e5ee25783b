"""The scripted policy: an expert for the tasks that it knows, and its faults."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.expert.digest import plan_digest
from pytest_safemanip.expert.faults.library import find
from pytest_safemanip.expert.robot.arm import Arm, Motion, Plan, SkillFailed
from pytest_safemanip.expert.tasks.plans import EXPERT
from pytest_safemanip.expert.tasks.search import PATIENCE
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.provenance import source_digest
from pytest_safemanip.sim.staging import Staging
from pytest_safemanip.trace.hazard import Hazard


class Scripted:
    """Runs a plan of Cartesian skills on privileged state.

    Where a skill fails (the object slipped, the hand did not arrive) the robot stops and holds
    still.

    Args:
        fault: what it does wrong, an event of a family with its number (``slip@0.03``); empty for
            the expert.

    Attributes:
        failure: why a skill failed; empty if none did.

    Raises:
        ConfigError: if there is no such fault.
    """

    def __init__(self, fault: str = "") -> None:
        self._fault = find(fault) if fault else None
        self._plans = self._fault.plans if self._fault else EXPERT
        self._name = f"scripted:{fault}" if fault else "scripted"
        self._arm: Arm | None = None
        self._motion: Motion | None = None
        self._idle = 0
        self.failure = ""

    @property
    def tasks(self) -> tuple[str, ...]:
        """The tasks that it has a plan for."""
        return tuple(self._plans)

    @property
    def fingerprint(self) -> str:
        """Digest of all the code and the plans."""
        return source_digest("expert")

    def fingerprint_in(self, task: str) -> str:
        """Digest of the plan of one task and of the code that it stands on."""
        return plan_digest(task, self._fault.name if self._fault else "")

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

    def staging(self, task: str) -> Staging:
        """What its fault wants otherwise in the episodes of a task."""
        return self._fault.staging.get(task, Staging()) if self._fault else Staging()

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
