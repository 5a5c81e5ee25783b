"""What a running environment is read by: found by what it is, or told."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.gym.taps import Taps
from pytest_safemanip.sim.mujoco.layout import Layout
from pytest_safemanip.sim.mujoco.probe import Action, Probe

OpenProbe = Callable[[Any, Taps], Probe]
"""Given an environment after its reset, and where to listen to it, what reads it."""


def source_of(env: Any, told: Layout | OpenProbe | None) -> Source:
    """Where the steps of an environment come from.

    Args:
        env: a Gymnasium environment.
        told: the layout of its MuJoCo model, or what opens a probe; None if it is one of RoboCasa,
            LIBERO or robosuite.

    Raises:
        ConfigError: if it is none of these.
    """
    if isinstance(told, Layout):
        return Source(env, open_layout(told))
    if told is not None:
        return Source(env, told)
    if _inner(env) is None:
        raise ConfigError(
            f"{type(env.unwrapped).__name__} is no environment of RoboCasa, LIBERO or robosuite: "
            "give its layout as SafetyMonitor(env, task, probe=LAYOUT), see docs/backends.md"
        )
    return Source(env, _of_robosuite)


class Source:
    """Reads an environment, episode by episode.

    Args:
        env: a Gymnasium environment.
        open_probe: opens what reads an episode.
    """

    def __init__(self, env: Any, open_probe: OpenProbe) -> None:
        self._env, self._open, self._taps = env, open_probe, Taps()

    def leave(self) -> None:
        """Leave the episode: listen to nothing any more."""
        self._taps.close()

    def open(self) -> Probe:
        """What reads the episode that the environment was reset to."""
        return self._open(self._env, self._taps)

    def action(self, action: Any) -> Action:
        """What the robot was told: what the environment behind all wrappers was, if it is heard."""
        told = action if self._taps.action is None else self._taps.action
        return np.asarray(told, float).ravel()


def open_layout(layout: Layout) -> OpenProbe:
    """A probe of an environment whose MuJoCo model has this layout."""

    def open_probe(env: Any, taps: Taps) -> Probe:
        base = env.unwrapped
        probe = Probe.of(base.model, base.data, layout)
        for part in (base, *vars(base).values()):
            if hasattr(part, "_step_mujoco_simulation"):  # Gymnasium's, for all substeps at once
                taps.replace(part, "_step_mujoco_simulation", _one_by_one(part, probe))
        return probe

    return open_probe


def _one_by_one(env: Any, probe: Probe) -> Callable[[Any, int], None]:
    step = env._step_mujoco_simulation

    def stepped(ctrl: Any, n_frames: int) -> None:
        for _ in range(n_frames):
            step(ctrl, 1)
            probe.sample()

    return stepped


def _layers(env: Any) -> Iterator[Any]:
    """An environment, and those that it wraps."""
    while env is not None:
        yield env
        env = vars(env).get("env", vars(env).get("_env"))


def _inner(env: Any) -> Any:
    """The robosuite environment behind all wrappers; None if there is none."""
    found = (layer for layer in _layers(env) if hasattr(layer, "control_timestep"))
    return next((layer for layer in found if hasattr(layer, "sim")), None)


def _of_robosuite(env: Any, taps: Taps) -> Probe:
    """A probe of an environment of RoboCasa, which is one of robosuite's."""
    from pytest_safemanip.sim.robocasa.description import open_reader
    from pytest_safemanip.sim.robocasa.robot import SPEC

    inner = _inner(env)
    model, data = inner.sim.model._model, inner.sim.data._data
    probe = Probe(model, data, open_reader(inner), SPEC.robot.commands)
    taps.before(inner, "step", taps.hear)
    for name in ("step", "step2"):
        taps.after(inner.sim, name, probe.sample)
    return probe
