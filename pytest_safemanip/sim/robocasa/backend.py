"""The RoboCasa365 backend, in the process that calls it."""

from __future__ import annotations

import gc
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.backend import BackendSpec, Provenance, Request, Start
from pytest_safemanip.sim.clearance import Clearance, Path
from pytest_safemanip.sim.mujoco import seeing
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.mujoco.description import Description
from pytest_safemanip.sim.mujoco.foresight import Foresight
from pytest_safemanip.sim.mujoco.simulation import Simulation
from pytest_safemanip.sim.mujoco.sleeping import Asleep
from pytest_safemanip.sim.mujoco.stability import check_stable
from pytest_safemanip.sim.robocasa import environment, loading
from pytest_safemanip.sim.robocasa.description import open_reader
from pytest_safemanip.sim.robocasa.foreseeing import open_foresight
from pytest_safemanip.sim.robocasa.observation import CAMERAS, WRIST
from pytest_safemanip.sim.robocasa.rendering.observing import Observer
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.sim.robocasa.staged import stage
from pytest_safemanip.sim.robocasa.stepping.exact import Stepper
from pytest_safemanip.sim.robocasa.stepping.fast import FastStepper
from pytest_safemanip.sim.staging import Cameras, Light
from pytest_safemanip.trace.steps import Contacts, Step


class RoboCasaBackend(Simulation):
    """Runs RoboCasa's own environments, one episode at a time.

    Args:
        assets_root: the folder that RoboCasa reads its assets from.
        provenance: what decides the content of the recordings.
        gl: how to draw observations: ``egl``, ``osmesa``, or anything else for what there is.

    Raises:
        ConfigError: if RoboCasa is not installed.
    """

    def __init__(self, assets_root: pathlib.Path, provenance: Provenance, gl: str) -> None:
        super().__init__(provenance, gl)
        self._assets_root = assets_root
        self._patches = loading.load(assets_root)
        self._foresight: Foresight | None = None

    @property
    def spec(self) -> BackendSpec:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        return SPEC

    def reset(self, request: Request) -> Start:
        """Make a fresh environment: what ran before leaves no trace in it."""
        self._drop_observer()
        self._foresight = None
        self._env = env = environment.make(request, self._assets_root)
        self._reader = open_reader(env)
        physical = [c for c in request.changes if not isinstance(c, Cameras | Light)]
        if physical:
            before = self._reader.read(False, Contacts.empty())
            check = stage(env, self._reader.description, before, physical)
            # What is fixed is described as it is now.
            self._reader = open_reader(env)
            check(self._reader.read(False, Contacts.empty()))
        seen = [key.removeprefix("video.") for key in CAMERAS if key != WRIST]
        seeing.change(env.sim.model._model, seen, request.changes)
        table = self._reader.description.table
        model = env.sim.model._model
        check_stable(env.sim.data._data)
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
        env = self._running("step")
        self._stepper.step(action)
        check_stable(env.sim.data._data)
        success = bool(env._check_success())
        commands = SPEC.robot.commands(action)
        self._end_pushes()
        return self._reader.read(success, self._sampler.take(), commands)

    def clearance(self, paths: Sequence[Path]) -> list[Clearance]:
        """See :class:`~pytest_safemanip.sim.clearance.Foresees`."""
        env = self._running("clearance")
        if self._foresight is None:
            self._foresight = open_foresight(env, self._reader.description)
        return [self._foresight.answer(path) for path in paths]

    @property
    def _description(self) -> Description:
        return self._reader.description

    def _make_observer(self, env: Any, context: Any) -> Observer:
        return Observer(env, context)

    def _contacts_now(self) -> Contacts:
        """The contacts that hold right after reset, from the last substep of settling."""
        self._sampler.sample(self._env.sim.data._data)
        return self._sampler.take()
