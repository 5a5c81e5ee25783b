"""What an episode says of each of its steps, whoever simulates it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.mujoco.describing import describe
from pytest_safemanip.sim.mujoco.description import Description, Read
from pytest_safemanip.sim.mujoco.layout import Layout
from pytest_safemanip.sim.mujoco.reading import Reader
from pytest_safemanip.trace.elements import Switch
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step

Action = NDArray[np.float64]


class Probe:
    """Reads the steps of a simulation that somebody else steps; changes no bit of it.

    Args:
        model: its ``MjModel``.
        data: its ``MjData``.
        reader: of its steps.
        commands: what an action tells the grippers (G,).

    Attributes:
        scene: the static part of the episode.
        commands: what an action tells the grippers (G,).
    """

    def __init__(
        self, model: Any, data: Any, reader: Reader, commands: Callable[[Action], Action]
    ) -> None:
        self._data, self._reader, self.commands = data, reader, commands
        self._sampler = ContactSampler(model, reader.description.table)
        self._sampled = False
        self.scene: Scene = reader.description.scene

    @classmethod
    def of(
        cls,
        model: Any,
        data: Any,
        layout: Layout,
        switches: Sequence[tuple[Switch, Read]] = (),
    ) -> Probe:
        """A probe of a model whose layout is known.

        Raises:
            ConfigError: if the layout names what the model does not have.
        """
        places = {entry.name: place for place, entry in enumerate(layout.actions)}
        hands = [hand.spec for hand in layout.robot.hands]

        def commands(action: Action) -> Action:
            if len(action) != len(places):
                raise ConfigError(
                    f"an action has {len(places)} entries ({', '.join(places)}); found one of "
                    f"{len(action)}"
                )
            told = (s.command(float(action[places[s.entry]])) if s.entry else 0.0 for s in hands)
            return np.fromiter(told, float)

        reader = Reader(model, data, lambda at: describe(model, at, layout, switches))
        return cls(model, data, reader, commands)

    def sample(self) -> None:
        """Take in the contacts of a physics substep that just ran."""
        self._sampler.sample(self._data)
        self._sampled = True

    def read(self, action: Action | None = None, success: bool = False) -> Step:
        """The step of a control period, with the contacts of the substeps that were sampled; if
        none was, those that there are now.

        Args:
            action: what led to it (A,); None for the state after reset.
            success: whether the task's own check holds.
        """
        if not self._sampled:
            self.sample()
        self._sampled = False
        told = None if action is None else self.commands(action)
        return self._reader.read(success, self._sampler.take(), told)

    @property
    def description(self) -> Description:
        """The scene, and where its moving parts are read."""
        return self._reader.description

    def fingerprint(self) -> str:
        """Digest of the state as it is now."""
        return self._reader.fingerprint()
