"""The robosuite backend, in the process that calls it."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, TaskError, did_you_mean
from pytest_safemanip.sim.backend import BackendSpec, Provenance, Request, Start
from pytest_safemanip.sim.mujoco.description import Description
from pytest_safemanip.sim.mujoco.probe import Probe
from pytest_safemanip.sim.mujoco.simulation import Simulation
from pytest_safemanip.sim.mujoco.stability import check_stable
from pytest_safemanip.sim.robosuite import environment
from pytest_safemanip.sim.robosuite.observing import Observer
from pytest_safemanip.sim.robosuite.robots import arms_of, declare, robots_in
from pytest_safemanip.sim.robosuite.tasks import TASKS
from pytest_safemanip.sim.robosuite.things import layout
from pytest_safemanip.trace.steps import Step


class RobosuiteBackend(Simulation):
    """Runs robosuite's own environments, one episode at a time.

    Args:
        robots: the robots that are chosen.
        provenance: what decides the content of the recordings.
        gl: how to draw observations: ``egl``, ``osmesa``, or anything else for what there is.

    Raises:
        ConfigError: if robosuite is not installed.
    """

    def __init__(self, robots: Sequence[str], provenance: Provenance, gl: str) -> None:
        super().__init__(provenance, gl)
        environment.load()
        self._robots, self._spec = robots, declare(robots)

    @property
    def spec(self) -> BackendSpec:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        return self._spec

    def reset(self, request: Request) -> Start:
        """Make a fresh environment: what ran before leaves no trace in it.

        Raises:
            ConfigError: if robosuite has no such task.
            TaskError: if something is staged.
        """
        if request.task not in TASKS:
            hint = did_you_mean(request.task, TASKS)
            raise ConfigError(f"robosuite has no task {request.task!r}; {hint}")
        if request.changes or request.object_groups:
            raise TaskError("in robosuite nothing can be staged")
        self._drop_observer()
        task = TASKS[request.task]
        robots = robots_in(task, self._robots)
        arms = arms_of(task, robots)
        self._env = env = environment.make(request, robots)
        declared = self._spec.in_task(request.task)
        self._cameras = declared.cameras
        model, data = env.sim.model._model, env.sim.data._data
        known = layout(
            model,
            robots,
            arms,
            declared.robot.actions.entries,
            float(env.control_timestep),
            str(getattr(env, "obj_to_use", None) or ""),
        )
        self._probe = probe = Probe.of(model, data, known)
        gc.collect()  # the environment before refers to itself
        return Start(
            scene=probe.scene,
            step=probe.read(),
            instruction=task.instruction,
            horizon=task.horizon,
            fingerprint=probe.fingerprint(),
            patches=environment.PATCHES,
        )

    def step(self, action: NDArray[np.float64]) -> Step:
        """Run one control period, as ``env.step(action)`` does, without its observations."""
        env = self._running("step")
        env.timestep += 1
        for substep in range(int(env.control_timestep / env.model_timestep)):
            env.sim.step1()
            env._pre_action(action, substep == 0)
            env.sim.step2()
            self._probe.sample()
        env.cur_time += env.control_timestep
        env._post_action(action)
        self._end_pushes()
        check_stable(env.sim.data._data)
        return self._probe.read(action, success=bool(env._check_success()))

    @property
    def _description(self) -> Description:
        return self._probe.description

    def _make_observer(self, env: Any, context: Any) -> Observer:
        return Observer(env, context, self._cameras)
