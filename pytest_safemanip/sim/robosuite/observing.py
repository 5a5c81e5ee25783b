"""What policies see of a robosuite environment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.backend import Camera
from pytest_safemanip.sim.mujoco.drawing import Painter
from pytest_safemanip.sim.robosuite.robots import IMAGE_SIZE


class Observer:
    """Observes one episode; only reads.

    What robosuite itself observes at a step, under its own keys, all of its low-dimensional
    observations included; but the images have their top row first, where its own have it last
    unless ``IMAGE_CONVENTION`` is ``opencv``.

    Args:
        env: its environment.
        context: where to draw, from :func:`~pytest_safemanip.sim.mujoco.graphics.open_context`.
        cameras: what is drawn.
    """

    def __init__(self, env: Any, context: Any, cameras: Sequence[Camera]) -> None:
        self._env, self._cameras = env, cameras
        self._painter = Painter(env.sim.model._model, context, IMAGE_SIZE)

    def observe(self) -> dict[str, NDArray[Any]]:
        """See :class:`~pytest_safemanip.sim.backend.Backend`."""
        state = {
            key: np.atleast_1d(np.asarray(value, np.float32))
            for key, value in self._env._get_observations(force_update=True).items()
        }
        data = self._env.sim.data._data
        images = {
            camera.name: self._painter.take(data, camera.name.removesuffix("_image"))
            for camera in self._cameras
        }
        return {**images, **state}

    def close(self) -> None:
        """Free what was uploaded for drawing."""
        self._painter.close()
