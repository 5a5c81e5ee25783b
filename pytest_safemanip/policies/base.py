"""What a policy is: one interface for scripts, models on a server, and the user's own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from numpy.typing import NDArray

from pytest_safemanip.sim.observation import INSTRUCTION
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step


@dataclass(frozen=True)
class EpisodeInfo:
    """What a policy is told when an episode starts.

    Attributes:
        task: name of the task.
        seed: for whatever is random in the policy.
        instruction: the task's instruction, in words.
        horizon: control steps at most.
        scene: the static part of the scene: privileged knowledge, for scripts.
        sets: the sets that the task belongs to.
    """

    task: str
    seed: int
    instruction: str
    horizon: int
    scene: Scene
    sets: tuple[str, ...] = ()


@dataclass(frozen=True)
class Observation:
    """What a policy sees when it is asked for actions.

    Attributes:
        index: control steps so far.
        instruction: the task's instruction.
        step: the state of everything: privileged knowledge, for scripts.
        look: gives images and proprioception of the present step.
    """

    index: int
    instruction: str
    step: Step
    look: Callable[[], Mapping[str, NDArray[Any]]] = field(repr=False, compare=False)

    def gym(self) -> dict[str, Any]:
        """What RoboCasa's gym wrapper gives, under its names; the images are rendered now.

        ``video.robot0_agentview_left``, ``..._right`` and ``video.robot0_eye_in_hand``
        (256, 256, 3) uint8; ``state.*`` float32; ``annotation.human.task_description``.

        Raises:
            ConfigError: if nothing can be rendered here; names what to install.
        """
        return {**self.look(), INSTRUCTION: self.instruction}


class Policy(Protocol):
    """Chooses actions. One object serves one rollout at a time.

    It may have two attributes more: ``done``, true when it has nothing more to do, which ends the
    acting part unless the run goes on to the horizon; and ``hazards``, what it did wrong on purpose
    (:class:`~pytest_safemanip.trace.hazard.Hazard`), which is kept in the recording.
    """

    def reset(self, episode: EpisodeInfo) -> None:
        """Forget everything; a new episode starts."""

    def act(self, observation: Observation) -> NDArray[Any]:
        """The next actions.

        Returns:
            (12,) or a chunk (H, 12) that is executed whole before the next call; robosuite's
            order, entries in [-1, 1] (:data:`pytest_safemanip.sim.backend.ACTION_SIZE`).
        """
