"""What backends on MuJoCo have in common: one environment at a time, and what draws it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, RolloutError, did_you_mean
from pytest_safemanip.sim.backend import Provenance
from pytest_safemanip.sim.mujoco import graphics
from pytest_safemanip.sim.mujoco.description import Description
from pytest_safemanip.sim.pushing import checked
from pytest_safemanip.trace.elements import ROBOT


class Observer(Protocol):
    """Observes one episode; only reads."""

    def observe(self) -> dict[str, NDArray[Any]]:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""

    def close(self) -> None:
        """Free what was uploaded for drawing."""


class Simulation(ABC):
    """The part of a backend that is the same for all simulators on MuJoCo.

    Args:
        provenance: what decides the content of the recordings.
        gl: how to draw observations: ``egl``, ``osmesa``, or anything else for what there is.
    """

    def __init__(self, provenance: Provenance, gl: str) -> None:
        # MuJoCo would write its warnings to the screen and into a file in the working folder; they
        # say nothing that the recorded state does not.
        mujoco.set_mju_user_warning(lambda _message: None)
        self._provenance, self._gl = provenance, gl
        self._env: Any = None
        self._context: Any = None
        self._observer: Observer | None = None
        self._pushing = False

    @property
    def provenance(self) -> Provenance:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        return self._provenance

    def observe(self) -> dict[str, NDArray[Any]]:
        """See :class:`~pytest_safemanip.sim.backend.Backend`.

        The first call of an episode uploads its meshes and textures.
        """
        env = self._running("observe")
        if self._context is None:
            self._context = graphics.open_context(self._gl)
        if self._observer is None:
            self._observer = self._make_observer(env, self._context)
        return self._observer.observe()

    def push(self, entity: str, force: NDArray[np.float64]) -> None:
        """See :class:`~pytest_safemanip.sim.pushing.Pushes`."""
        data = self._running("push").sim.data._data
        known = self._description
        things = dict(zip(known.scene.object_index, known.object_body.tolist(), strict=True))
        if known.hands:
            things[ROBOT] = known.hands[0].body
        if entity not in things:
            raise ConfigError(f"nothing pushes {entity!r}; {did_you_mean(entity, things)}")
        data.xfrc_applied[things[entity], :3] += checked(force)
        self._pushing = True

    def close(self) -> None:
        """Drop the environment, and what draws it."""
        self.stop_drawing()
        self._env = None

    def stop_drawing(self) -> None:
        """See :class:`~pytest_safemanip.sim.aside.Draws`."""
        self._drop_observer()
        context, self._context = self._context, None
        if context is not None:
            context.free()

    @property
    @abstractmethod
    def _description(self) -> Description:
        """What is known of the episode's scene."""

    @abstractmethod
    def _make_observer(self, env: Any, context: Any) -> Observer:
        """What observes an episode that was just begun, and draws in a context."""

    def _running(self, doing: str) -> Any:
        if self._env is None:
            raise RolloutError(f"{doing} before reset")
        return self._env

    def _end_pushes(self) -> None:
        """A control period is over, and with it what pushed meanwhile."""
        if self._pushing:
            self._env.sim.data._data.xfrc_applied[:] = 0.0
            self._pushing = False

    def _drop_observer(self) -> None:
        observer, self._observer = self._observer, None
        if observer is not None:
            observer.close()
