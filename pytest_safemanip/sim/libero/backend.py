"""The LIBERO backend, in the process that has LIBERO."""

from __future__ import annotations

import gc
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.backend import Action, BackendSpec, Provenance, Request, Start
from pytest_safemanip.sim.libero import environment
from pytest_safemanip.sim.libero.bddl import load_problem
from pytest_safemanip.sim.libero.observing import Observer
from pytest_safemanip.sim.libero.robot import SPEC
from pytest_safemanip.sim.libero.scene import layout_of, switches_of
from pytest_safemanip.sim.libero.staged import stage
from pytest_safemanip.sim.libero.suites import TaskFiles
from pytest_safemanip.sim.mujoco.description import Description
from pytest_safemanip.sim.mujoco.probe import Probe
from pytest_safemanip.sim.mujoco.simulation import Simulation
from pytest_safemanip.sim.mujoco.stability import check_stable
from pytest_safemanip.trace.steps import Step


class LiberoBackend(Simulation):
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
        super().__init__(provenance, gl)
        environment.load(assets)
        self._tasks = tasks

    @property
    def spec(self) -> BackendSpec:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        return SPEC

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
        self._probe = probe = Probe.of(model, data, layout, switches_of(problem, model, data))
        gc.collect()  # the environment before refers to itself
        return Start(
            scene=probe.scene,
            step=probe.read(),
            instruction=files.instruction,
            horizon=files.horizon,
            fingerprint=probe.fingerprint(),
        )

    def step(self, action: Action) -> Step:
        """Run one control period."""
        env = self._running("step")
        for _ in environment.substeps(env, action):
            self._probe.sample()
        env._post_process()
        self._end_pushes()
        check_stable(env.sim.data._data)
        return self._probe.read(action, success=bool(env._check_success()))

    @property
    def _description(self) -> Description:
        return self._probe.description

    def _make_observer(self, env: Any, context: Any) -> Observer:
        return Observer(env, context)
