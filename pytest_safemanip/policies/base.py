"""The policy interface: for scripts, models on a server, and the user's own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from numpy.typing import NDArray

from pytest_safemanip.sim.backend import RobotSpec
from pytest_safemanip.sim.clearance import Clearance, Path, blind
from pytest_safemanip.sim.rehearsal import Rehearsal
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step


@dataclass(frozen=True)
class Permissions:
    """What a task gives its robot a reason to touch.

    Attributes:
        touch: the parts that the hand may touch, by role.
        supports: roles that an object may rest on, and touch while it is held, by its role.
    """

    touch: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    supports: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class EpisodeInfo:
    """Information about an episode, given to the policy at its start.

    Attributes:
        task: name of the task.
        seed: for whatever is random in the policy.
        instruction: the task's instruction, in words.
        horizon: control steps at most.
        scene: the static part of the scene: privileged knowledge, for scripts.
        robot: what the actions consist of, and the grippers that they command.
        sets: the sets that the task belongs to.
        permissions: what the task lets the robot touch: for a policy that ``reads_permissions``.
    """

    task: str
    seed: int
    instruction: str
    horizon: int
    scene: Scene
    robot: RobotSpec
    sets: tuple[str, ...] = ()
    permissions: Permissions | None = None


@dataclass(frozen=True)
class Observation:
    """Observation of one control step.

    Attributes:
        index: control steps so far.
        instruction: the task's instruction.
        step: the state of everything: privileged knowledge, for scripts.
        look: gives images and proprioception of the present step.
        instruction_key: where the instruction is in :meth:`gym`.
        clearance: says what would be touched on some ways from here, see
            :class:`~pytest_safemanip.sim.clearance.Foresees`: privileged knowledge, for scripts.
        rehearsal: tries control steps before they are taken, likewise; None where the simulator
            has no such service.
    """

    index: int
    instruction: str
    step: Step
    look: Callable[[], Mapping[str, NDArray[Any]]] = field(repr=False, compare=False)
    instruction_key: str = "instruction"
    clearance: Callable[[Sequence[Path]], list[Clearance]] = field(
        default=blind, repr=False, compare=False
    )
    rehearsal: Rehearsal | None = field(default=None, repr=False, compare=False)

    def gym(self) -> dict[str, Any]:
        """Images, state and instruction under the backend's names; the images are rendered now.

        Of ``robocasa`` they are those of its gym wrapper: ``video.robot0_agentview_left``,
        ``..._right`` and ``video.robot0_eye_in_hand`` (256, 256, 3) uint8; ``state.*`` float32;
        ``annotation.human.task_description``.

        Raises:
            ConfigError: if nothing can be rendered here; names what to install.
        """
        return {**self.look(), self.instruction_key: self.instruction}


class Policy(Protocol):
    """Chooses actions. One object serves one rollout at a time.

    Only ``act`` is required. It may also have, and they are used however it is named on the
    command line:

    ``reset(episode)``
        is called with an :class:`EpisodeInfo`, or with nothing, before each episode.
    ``done``
        True when it has nothing more to do, which ends the acting part unless the run goes on to
        the horizon.
    ``hazards``
        what it did wrong on purpose, as :class:`~pytest_safemanip.trace.hazard.Hazard`; kept in
        the recording, where no monitor sees it.
    ``failure``
        why it gave up, in one line; empty if it did not. Kept in the recording.
    ``close()``
        frees what it holds: after the rollout where a class or factory made it for one, at the end
        of the run where the object itself was given.

    Asked once, when the run is planned:

    ``fingerprint``
        text or a number that changes with what decides its actions beside its source code (weights,
        files that it reads). Recordings of earlier runs are used again while this and the source
        are the same; without it, never.
    ``fingerprint_in(task)``
        likewise of its actions in one task: a change that does not count there leaves the task's
        recordings as they are; without it, ``fingerprint``.
    ``tasks``
        names of the tasks that it can do; without it, all.
    ``scenes``, ``stepping``
        what it is run in and how it is simulated unless an option says otherwise: a family of
        scenes of the backend; ``exact`` or ``fast``.
    ``reads_permissions``
        whether it is told what the task lets it touch. Its recordings then belong to a task's
        permissions, too.
    ``staging(task)``
        what it wants otherwise in the episodes of a task, as
        :class:`~pytest_safemanip.sim.staging.Staging`.

    What takes no argument is an attribute, a property or a method.
    """

    def act(self, observation: Observation) -> NDArray[Any]:
        """The next actions.

        Returns:
            (A,) or a chunk (H, A) that is executed whole before the next call, in the order and
            the limits of :attr:`EpisodeInfo.robot`. What is outside is clipped.
        """


PolicyLike = Policy | Callable[..., Any] | str
"""What names or makes a policy: an object with ``act``, a function that is ``act`` itself, a class
or factory that is called once per rollout, or ``MODULE:ATTRIBUTE`` where one of them is.
"""
