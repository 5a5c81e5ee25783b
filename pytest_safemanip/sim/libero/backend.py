"""The LIBERO backend, in the process that has LIBERO."""

from __future__ import annotations

import gc
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, RolloutError
from pytest_safemanip.sim.backend import Action, BackendSpec, Provenance, Request, Start
from pytest_safemanip.sim.libero import environment
from pytest_safemanip.sim.libero.bddl import load_problem
from pytest_safemanip.sim.libero.observing import Observer
from pytest_safemanip.sim.libero.robot import SPEC
from pytest_safemanip.sim.libero.scene import layout_of, switches_of
from pytest_safemanip.sim.libero.staged import stage
from pytest_safemanip.sim.libero.suites import TaskFiles
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.mujoco.describing import describe
from pytest_safemanip.sim.mujoco.reading import Reader
from pytest_safemanip.sim.robocasa.rendering import graphics
from pytest_safemanip.trace.steps import Step


class LiberoBackend:
    """Runs LIBERO's own environments, one episode at a time.

    Args:
        assets: the folder that LIBERO reads its assets from.
        tasks: files of each task.
        provenance: what decides the content of the recordings.
        gl: how to draw observations: ``egl``, ``osmesa``, or anything else for what there is.
    """

    def __init__(
        self, assets: Path, tasks: Mapping[str, TaskFiles], provenance: Provenance, gl: str
    ) -> None:
        self._tasks, self._provenance, self._gl = tasks, provenance, gl
        environment.load(assets)
        # MuJoCo would write its warnings to the screen and into a file in the working folder.
        mujoco.set_mju_user_warning(lambda _message: None)
        self._env: Any = None
        self._context: Any = None
        self._observer: Observer | None = None

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
        if request.task not in self._tasks:
            raise ConfigError(f"LIBERO has no task {request.task!r}")
        files = self._tasks[request.task]
        problem = load_problem(files.problem)
        self._env = env = environment.make(files.problem, problem.domain, request.seed)
        if files.states is not None:
            environment.set_initial_state(env, files.states, request.seed)
        environment.settle(env, environment.SETTLE_STEPS)
        model, data = env.sim.model._model, env.sim.data._data
        layout = layout_of(problem, model, data, 1.0 / environment.CONTROL_RATE)
        if request.changes:
            stage(env, layout, request.changes)
            environment.settle(env, environment.SETTLE_STEPS)
        switches = switches_of(problem, model, data)
        self._reader = Reader(model, data, lambda copy: describe(model, copy, layout, switches))
        self._sampler = ContactSampler(model, self._reader.description.table)
        self._sampler.sample(data)
        gc.collect()  # the environment before refers to itself
        return Start(
            scene=self._reader.description.scene,
            step=self._reader.read(False, self._sampler.take()),
            instruction=files.instruction,
            horizon=files.horizon,
            fingerprint=self._reader.fingerprint(),
        )

    def step(self, action: Action) -> Step:
        """Run one control period."""
        env = self._running("step")
        for _ in environment.substeps(env, action):
            self._sampler.sample(env.sim.data._data)
        env._post_process()
        success = bool(env._check_success())
        return self._reader.read(success, self._sampler.take(), SPEC.robot.commands(action))

    def observe(self) -> dict[str, NDArray[Any]]:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        env = self._running("observe")
        if self._context is None:
            self._context = graphics.open_context(self._gl)
        if self._observer is None:
            self._observer = Observer(env, self._context)
        return self._observer.observe()

    def close(self) -> None:
        """Drop the environment, and what draws it."""
        self._drop_observer()
        context, self._context = self._context, None
        if context is not None:
            context.free()
        self._env = None

    def _running(self, doing: str) -> Any:
        if self._env is None:
            raise RolloutError(f"{doing} before reset")
        return self._env

    def _drop_observer(self) -> None:
        observer, self._observer = self._observer, None
        if observer is not None:
            observer.close()
