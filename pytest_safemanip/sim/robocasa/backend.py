"""The RoboCasa365 backend, in the process that calls it."""

from __future__ import annotations

import gc
import pathlib
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.sim.backend import BackendSpec, Provenance, Request, Start
from pytest_safemanip.sim.clearance import Clearance, Path
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.mujoco.foresight import Foresight
from pytest_safemanip.sim.mujoco.sleeping import Asleep
from pytest_safemanip.sim.robocasa import environment, loading
from pytest_safemanip.sim.robocasa.description import open_reader
from pytest_safemanip.sim.robocasa.foreseeing import open_foresight
from pytest_safemanip.sim.robocasa.rendering import graphics
from pytest_safemanip.sim.robocasa.rendering.observing import Observer
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.sim.robocasa.staged import stage
from pytest_safemanip.sim.robocasa.stepping.exact import Stepper
from pytest_safemanip.sim.robocasa.stepping.fast import FastStepper
from pytest_safemanip.trace.steps import Contacts, Step


class RoboCasaBackend:
    """Runs RoboCasa's own environments, one episode at a time.

    Args:
        assets_root: the folder that RoboCasa reads its assets from.
        provenance: what decides the content of the recordings.
        gl: how to draw observations: ``egl``, ``osmesa``, or anything else for what there is.

    Raises:
        ConfigError: if RoboCasa is not installed.
    """

    def __init__(self, assets_root: pathlib.Path, provenance: Provenance, gl: str) -> None:
        self._provenance = provenance
        self._assets_root = assets_root
        self._patches = loading.load(assets_root)
        # MuJoCo would write its warnings to the screen and into a file in the working folder.
        mujoco.set_mju_user_warning(_ignore)
        self._env: Any = None
        self._gl = gl
        self._context: Any = None
        self._observer: Observer | None = None
        self._foresight: Foresight | None = None

    @property
    def spec(self) -> BackendSpec:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        return SPEC

    @property
    def provenance(self) -> Provenance:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        return self._provenance

    def reset(self, request: Request) -> Start:
        """Make a fresh environment: what ran before leaves no trace in it."""
        self._drop_observer()
        self._foresight = None
        self._env = env = environment.make(request, self._assets_root)
        self._reader = open_reader(env)
        if request.changes:
            before = self._reader.read(False, Contacts.empty())
            stage(env, self._reader.description, before, request.changes)
            # What is fixed is described as it is now.
            self._reader = open_reader(env)
        table = self._reader.description.table
        model = env.sim.model._model
        asleep = Asleep(model)
        self._sampler = ContactSampler(model, table, asleep)
        self._stepper = (
            FastStepper(env, self._sampler.sample, asleep)
            if request.stepping == "fast"
            else Stepper(env, self._sampler.sample)
        )
        # The environment before refers to itself. Left to Python, a dozen of them, 120 MB each,
        # would wait to be collected.
        gc.collect()
        return Start(
            scene=self._reader.description.scene,
            # Not asked at reset: some tasks' checks change their own state when they are called,
            # and RoboCasa's evaluation does not call them before the first step.
            step=self._reader.read(False, self._contacts_now()),
            instruction=environment.instruction(env),
            horizon=environment.horizon(request.task),
            fingerprint=self._reader.fingerprint(),
            patches=self._patches,
        )

    def step(self, action: NDArray[np.float64]) -> Step:
        """Run one control period.

        Success is asked once more after the fixtures updated, as RoboCasa's gym wrapper does.
        """
        if self._env is None:
            raise RolloutError("step before reset")
        self._stepper.step(action)
        success = bool(self._env._check_success())
        commands = SPEC.robot.commands(action)
        return self._reader.read(success, self._sampler.take(), commands)

    def observe(self) -> dict[str, NDArray[Any]]:
        """See :class:`~pytest_safemanip.sim.backend.Backend`.

        The first call of an episode uploads its meshes and textures.
        """
        if self._env is None:
            raise RolloutError("observe before reset")
        if self._context is None:
            self._context = graphics.open_context(self._gl)
        if self._observer is None:
            self._observer = Observer(self._env, self._context)
        return self._observer.observe()

    def clearance(self, paths: Sequence[Path]) -> list[Clearance]:
        """See :class:`~pytest_safemanip.sim.clearance.Foresees`."""
        if self._env is None:
            raise RolloutError("clearance before reset")
        if self._foresight is None:
            self._foresight = open_foresight(self._env, self._reader.description)
        return [self._foresight.answer(path) for path in paths]

    def close(self) -> None:
        """Drop the environment, and what draws it."""
        self._drop_observer()
        context, self._context = self._context, None
        if context is not None:
            context.free()
        self._env = None

    def _drop_observer(self) -> None:
        observer, self._observer = self._observer, None
        if observer is not None:
            observer.close()

    def _contacts_now(self) -> Contacts:
        """The contacts that hold right after reset, from the last substep of settling."""
        self._sampler.sample(self._env.sim.data._data)
        return self._sampler.take()


def _ignore(_message: str) -> None:
    """MuJoCo's solver warnings say nothing that the recorded state does not."""
