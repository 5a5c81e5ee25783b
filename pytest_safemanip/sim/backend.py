"""What a simulator backend is: one interface, whatever runs behind it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.staging import Change
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step

ACTION_SIZE = 12
"""Length of an action vector.

In robosuite's order for the PandaOmron, every entry in [-1, 1]: end-effector position delta
[0:3] and rotation delta [3:6] in the base frame (1 is 5 cm and 0.5 rad), gripper [6] (1 closes),
base forward, side and yaw velocity [7:10], torso [10], mode [11] (above 0 the base moves and the
arm keeps its goal, else the arm moves).
"""


@dataclass(frozen=True)
class Request:
    """Which episode a backend is to set up.

    Attributes:
        task: the backend's own name of the task.
        seed: decides everything random in the episode.
        scenes: ``compact``, ``target`` or ``pretrain``.
        object_groups: for some of the task's objects, by role, the groups or categories to draw
            them from instead of the task's own.
        kitchen: which of the compact kitchens.
        changes: what stands elsewhere or is open when the episode begins.
        stepping: ``exact`` or ``fast``. ``exact`` is the simulator's own control loop, bit for
            bit; ``fast`` may evaluate it in another way, within a tolerance that the backend
            states. A backend with one way to step ignores it.
    """

    task: str
    seed: int
    scenes: str
    object_groups: Mapping[str, Sequence[str]] = field(default_factory=dict)
    kitchen: str = "small"
    changes: tuple[Change, ...] = ()
    stepping: str = "exact"


@dataclass(frozen=True)
class Start:
    """An episode that is ready to be stepped.

    Attributes:
        scene: its static part.
        step: the state after reset.
        instruction: what the policy is told.
        horizon: control steps that the task allows.
        fingerprint: digest of the start state; differs between seeds, equal for equal seeds.
    """

    scene: Scene
    step: Step
    instruction: str
    horizon: int
    fingerprint: str


@dataclass(frozen=True)
class Provenance:
    """What of a backend decides the content of a recording.

    Attributes:
        backend: its name.
        assets: ``official``, ``primitive`` or ``mixed``.
        versions: of the packages that move the physics.
        hashes: digests of its code and of its assets.
        description: one line for people; decides nothing.
    """

    backend: str
    assets: str
    versions: Mapping[str, str] = field(default_factory=dict)
    hashes: Mapping[str, str] = field(default_factory=dict)
    description: str = ""


@dataclass(frozen=True)
class Options:
    """What a user can choose about a backend.

    Attributes:
        assets: ``auto``, ``official`` or ``primitive``.
        logs: folder for what the simulator prints.
    """

    assets: Literal["auto", "official", "primitive"]
    logs: Path


class Backend(Protocol):
    """Runs episodes, one after the other.

    The same request gives the same episode, bit for bit, whatever ran before in the process.
    """

    @property
    def provenance(self) -> Provenance:
        """What decides the content of its recordings."""

    def reset(self, request: Request) -> Start:
        """Set up an episode.

        Raises:
            RolloutError: if the simulator fails.
        """

    def step(self, action: NDArray[np.float64]) -> Step:
        """Run one control period.

        Args:
            action: (12,), see :data:`ACTION_SIZE`.

        Raises:
            RolloutError: if the simulator fails.
        """

    def observe(self) -> Mapping[str, NDArray[Any]]:
        """What a camera policy sees of the present step, its instruction left out.

        Changes nothing in the simulation: with and without it, episodes are equal bit for bit.

        Returns:
            Images (256, 256, 3), uint8, and the parts of the state, float32, by the names in
            :mod:`pytest_safemanip.sim.observation`.

        Raises:
            ConfigError: if nothing can be rendered on this machine.
            RolloutError: if the simulator fails.
        """

    def close(self) -> None:
        """Free what it holds. May be called twice."""


Factory = Callable[[Options], Backend]
"""Makes a backend. Quick: what takes time waits for the first reset.

Raises ConfigError if something that it needs is missing.
"""
