"""What a running environment is read by: found by what it is, or told."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
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
        told: the layout of its MuJoCo model, or what opens a probe; None for those of RoboCasa
            and robosuite.

    Raises:
        ConfigError: if it is none of these.
    """
    if isinstance(told, Layout):
        return Source(env, open_layout(told))
    if told is not None:
        return Source(env, told)
    if not _package(_inner(env)):
        raise ConfigError(
            f"{type(env.unwrapped).__name__} is no environment of {', '.join(_READ_BY)}: give its "
            "layout as SafetyMonitor(env, task, probe=LAYOUT), see docs/backends.md"
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
    # The last one: robosuite's own wrappers have all attributes of what they wrap.
    found = [layer for layer in _layers(env) if hasattr(layer, "control_timestep")]
    return found[-1] if found else None


def _package(inner: Any) -> str:
    """The package that an environment is from, robosuite last; empty if from none of these."""
    modules = {kind.__module__.partition(".")[0] for kind in type(inner).__mro__}
    return next((name for name in _READ_BY if name in modules), "")


def _of_robosuite(env: Any, taps: Taps) -> Probe:
    """A probe of an environment that robosuite's own loop steps."""
    inner = _inner(env)
    probe = _READ_BY[_package(inner)](inner)
    taps.before(inner, "step", taps.hear)
    for name in ("step", "step2"):
        if hasattr(inner.sim, name):
            taps.after(inner.sim, name, probe.sample)
    return probe


def _robocasa(inner: Any) -> Probe:
    from pytest_safemanip.sim.robocasa.description import open_reader
    from pytest_safemanip.sim.robocasa.robot import SPEC

    model, data = inner.sim.model._model, inner.sim.data._data
    return Probe(model, data, open_reader(inner), SPEC.robot.commands)


def _robosuite(inner: Any) -> Probe:
    from pytest_safemanip.sim.robosuite.robots import arms_of, declare
    from pytest_safemanip.sim.robosuite.tasks import TASKS
    from pytest_safemanip.sim.robosuite.things import layout

    task, robots = type(inner).__name__, [robot.name for robot in inner.robots]
    entries = declare(robots).in_task(task).robot.actions.entries
    if inner.action_dim != len(entries):
        raise ConfigError(
            f"{task}: actions of {inner.action_dim} entries, expected {len(entries)}: leave "
            "robosuite's default controllers"
        )
    model, data = inner.sim.model._model, inner.sim.data._data
    only = getattr(inner, "obj_to_use", None) or ""
    arms, period = arms_of(TASKS[task], robots), float(inner.control_timestep)
    return Probe.of(model, data, layout(model, robots, arms, entries, period, only))


_READ_BY: Mapping[str, Callable[[Any], Probe]] = {"robocasa": _robocasa, "robosuite": _robosuite}
"""What reads the environments of a package; where one builds on another, it comes first."""
