"""The robosuite backend, in the process that calls it."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, RolloutError, did_you_mean
from pytest_safemanip.sim.backend import BackendSpec, Provenance, Request, Start
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.mujoco.describing import describe
from pytest_safemanip.sim.mujoco.reading import Reader
from pytest_safemanip.sim.robocasa.rendering import graphics
from pytest_safemanip.sim.robocasa.rendering.drawing import Painter
from pytest_safemanip.sim.robosuite import environment
from pytest_safemanip.sim.robosuite.robots import arms_of, declare, robots_in
from pytest_safemanip.sim.robosuite.tasks import TASKS
from pytest_safemanip.sim.robosuite.things import layout
from pytest_safemanip.trace.steps import Step


class RobosuiteBackend:
    """Runs robosuite's own environments, one episode at a time.

    Args:
        robots: the robots that are chosen.
        provenance: what decides the content of the recordings.
        gl: how to draw observations: ``egl``, ``osmesa``, or anything else for what there is.

    Raises:
        ConfigError: if robosuite is not installed.
    """

    def __init__(self, robots: Sequence[str], provenance: Provenance, gl: str) -> None:
        environment.load()
        # MuJoCo would write its warnings to the screen and into a file in the working folder.
        mujoco.set_mju_user_warning(lambda _message: None)
        self._robots, self._provenance, self._spec = robots, provenance, declare(robots)
        self._env: Any = None
        self._gl = gl
        self._context: Any = None
        self._painter: Painter | None = None

    @property
    def spec(self) -> BackendSpec:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        return self._spec

    @property
    def provenance(self) -> Provenance:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        return self._provenance

    def reset(self, request: Request) -> Start:
        """Make a fresh environment: what ran before leaves no trace in it.

        Raises:
            ConfigError: if robosuite has no such task, or something is asked for that cannot be
                arranged here.
        """
        if request.task not in TASKS:
            hint = did_you_mean(request.task, TASKS)
            raise ConfigError(f"robosuite has no task {request.task!r}; {hint}")
        if request.changes or request.object_groups:
            raise ConfigError(f"{request.task}: in robosuite nothing can be staged")
        self._drop_painter()
        task = TASKS[request.task]
        robots = robots_in(task, self._robots)
        arms = arms_of(task, robots)
        self._env = env = environment.make(request, robots)
        declared = self._spec.in_task(request.task)
        self._told, self._cameras = declared.robot, declared.cameras
        model, data = env.sim.model._model, env.sim.data._data
        known = layout(
            model,
            robots,
            arms,
            self._told.actions.entries,
            float(env.control_timestep),
            str(getattr(env, "obj_to_use", None) or ""),
        )
        self._reader = Reader(model, data, lambda at: describe(model, at, known))
        self._sampler = ContactSampler(model, self._reader.description.table)
        self._sampler.sample(data)
        gc.collect()  # the environment before refers to itself
        return Start(
            scene=self._reader.description.scene,
            step=self._reader.read(False, self._sampler.take()),
            instruction=task.instruction,
            horizon=task.horizon,
            fingerprint=self._reader.fingerprint(),
            patches=environment.PATCHES,
        )

    def step(self, action: NDArray[np.float64]) -> Step:
        """Run one control period, as ``env.step(action)`` does, without its observations."""
        env = self._running()
        env.timestep += 1
        for substep in range(int(env.control_timestep / env.model_timestep)):
            env.sim.step1()
            env._pre_action(action, substep == 0)
            env.sim.step2()
            self._sampler.sample(env.sim.data._data)
        env.cur_time += env.control_timestep
        env._post_action(action)
        success = bool(env._check_success())
        return self._reader.read(success, self._sampler.take(), self._told.commands(action))

    def observe(self) -> dict[str, NDArray[Any]]:
        """See :class:`~pytest_safemanip.sim.backend.Backend`.

        What robosuite itself observes at this step, under its own keys, all of its low-dimensional
        observations included; but the images have their top row first, where its own have it last
        unless ``IMAGE_CONVENTION`` is ``opencv``.
        """
        env = self._running()
        if self._context is None:
            self._context = graphics.open_context(self._gl)
        if self._painter is None:
            self._painter = Painter(env.sim.model._model, self._context)
        state = {
            key: np.atleast_1d(np.asarray(value, np.float32))
            for key, value in env._get_observations(force_update=True).items()
        }
        data = env.sim.data._data
        images = {
            camera.name: self._painter.take(data, camera.name.removesuffix("_image"))
            for camera in self._cameras
        }
        return {**images, **state}

    def close(self) -> None:
        """Drop the environment, and what draws it."""
        self._drop_painter()
        context, self._context = self._context, None
        if context is not None:
            context.free()
        self._env = None

    def _running(self) -> Any:
        if self._env is None:
            raise RolloutError("the simulator is used before its reset")
        return self._env

    def _drop_painter(self) -> None:
        painter, self._painter = self._painter, None
        if painter is not None:
            painter.close()
