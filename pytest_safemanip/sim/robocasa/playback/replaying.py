"""Episodes of a dataset, simulated again one control period at a time from their own states.

A dataset has states and no forces, and its states know nothing of what RoboCasa remembers beside
them (whether a microwave runs). So each period begins at its state and is simulated with the action
that was taken there, by RoboCasa's own controllers; then the next state is put into its place.
"""

from __future__ import annotations

import functools
import gc
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError, RolloutError, TraceError, first_line
from pytest_safemanip.sim.backend import Start
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.mujoco.stability import check_stable
from pytest_safemanip.sim.robocasa import environment, loading, scenes
from pytest_safemanip.sim.robocasa.description import open_reader
from pytest_safemanip.sim.robocasa.patches import environments
from pytest_safemanip.sim.robocasa.playback import episode_meta, task_choices
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.sim.robocasa.stepping.exact import Controls
from pytest_safemanip.sim.robocasa.stepping.fast import LawStepper
from pytest_safemanip.trace.steps import Step

SEED = 0
"""Of what RoboCasa draws while it sets up an episode; all of it is replaced by what is stored."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StoredEpisode:
    """What a dataset has of an episode beside its table.

    Attributes:
        task: RoboCasa's name of it.
        meta: RoboCasa's description (``ep_meta.json``), as it was read.
        model: the model's XML, whose files are on this machine; see :mod:`.model_xml`.
        states: time, positions and velocities (N, 1 + nq + nv).
    """

    task: str
    meta: object
    model: str
    states: Floats


class Replay:
    """One episode, rebuilt as RoboCasa's own playback does it, and stepped from its states.

    Args:
        episode: as it was stored.
        assets_root: the folder that RoboCasa reads its assets from.

    Attributes:
        start: the episode as it begins.
        drift: farthest that an object came from its stored place within a period so far, m.

    Raises:
        TraceError: if what was stored is no episode, or wants files that are not there.
        ConfigError: if RoboCasa is not installed, or has no such task.
        RolloutError: if RoboCasa fails to set it up.
    """

    def __init__(self, episode: StoredEpisode, assets_root: Path) -> None:
        patches = loading.load(assets_root)
        gc.collect()  # the environment before refers to itself
        mujoco.set_mju_user_warning(_ignore)
        meta = episode_meta.checked(episode.meta, assets_root)
        kitchen = episode_meta.kitchen_of(dict(episode.meta))  # type: ignore[call-overload]
        self._env = env = _rebuilt(episode, meta, kitchen, assets_root)
        self._model, self._data = env.sim.model._model, env.sim.data._data
        self._states = _checked(episode.states, self._model)
        self._put(self._states[0])
        env.sim.forward()
        env.update_state()
        self._reader = open_reader(env)
        self._objects = self._reader.description.object_body
        self._sampler = ContactSampler(self._model, self._reader.description.table)
        self._stepper = LawStepper(env, self._sampler.sample)
        # Where the elbow is pulled to: the posture that the episode began in, not one drawn now.
        arm = env.robots[0].composite_controller.part_controllers["right"]
        arm.initial_joint = self._data.qpos[arm.qpos_index].copy()
        self._at, self.drift = 0, 0.0
        self._sampler.sample(self._data)
        self.start = Start(
            scene=self._reader.description.scene,
            step=self._reader.read(False, self._sampler.take()),
            instruction=str(meta.get("lang", "")),
            horizon=environment.horizon(episode.task),
            fingerprint=self._reader.fingerprint(),
            patches=patches,
        )

    def step(self, action: Floats) -> Step:
        """Simulate a control period from the present state; the next stored one takes its place,
        if there is one.

        Args:
            action: (12,), in RoboCasa's order and within its limits.

        Raises:
            RolloutError: if RoboCasa fails.
            TraceError: if physics comes to numbers that are not finite.
        """
        try:
            self._stepper.step(action)
            success = bool(self._env._check_success())
        except Exception as error:  # RoboCasa's code may raise anything
            raise RolloutError(
                f"RoboCasa fails in step {self._at + 1}: {first_line(error)}"
            ) from error
        check_stable(self._data)
        self._at += 1
        if self._at < len(self._states):
            reached = self._places()
            self._put(self._states[self._at])
            mujoco.mj_kinematics(self._model, self._scratch_of(self._states[self._at]))
            apart = np.linalg.norm(reached - self._scratch.xpos[self._objects], axis=1)
            self.drift = max(self.drift, float(apart.max(initial=0.0)))
        commands = SPEC.robot.commands(action)
        return self._reader.read(success, self._sampler.take(), commands)

    def _places(self) -> Floats:
        """Where the objects are (N, 3)."""
        scratch = self._scratch_of(None)
        mujoco.mj_kinematics(self._model, scratch)
        places: Floats = scratch.xpos[self._objects].copy()
        return places

    def _scratch_of(self, state: Floats | None) -> Any:
        """A copy with the positions of a state, or of the simulation."""
        if not hasattr(self, "_scratch"):
            self._scratch = mujoco.MjData(self._model)
        nq = self._model.nq
        self._scratch.qpos[:] = self._data.qpos if state is None else state[1 : 1 + nq]
        return self._scratch

    def _put(self, state: Floats) -> None:
        nq = self._model.nq
        self._data.qpos[:], self._data.qvel[:] = state[1 : 1 + nq], state[1 + nq :]


def _rebuilt(episode: StoredEpisode, meta: dict[str, Any], kitchen: str, assets_root: Path) -> Any:
    """An environment with the stored model, in the order of RoboCasa's own playback."""
    arguments = scenes.arguments("compact", assets_root, kitchen) if kitchen else {}
    env = environment.unset(episode.task, SEED, **arguments)
    env.set_ep_meta(meta)
    try:
        xml = functools.reduce(lambda text, edit: edit(text), env._xml_processors, episode.model)
        model = mujoco.MjModel.from_xml_string(xml)
        begins = mujoco.MjData(model)
        begins.qpos[:] = _checked(episode.states, model)[0, 1 : 1 + model.nq]
        mujoco.mj_kinematics(model, begins)
        with (
            environments.quick_settling(env, Controls),
            environments.stored_scene(env, model, begins),
        ):
            env.reset()
        env.sim.reset()
        task_choices.restore(env, meta.get(task_choices.KEY, {}))
    except (ConfigError, TraceError):
        raise
    except Exception as error:  # RoboCasa's code may raise anything
        raise RolloutError(f"RoboCasa cannot set up the episode: {first_line(error)}") from error
    return env


def _checked(states: Floats, model: Any) -> Floats:
    """The states, if they are of this model.

    Raises:
        TraceError: if they are not.
    """
    size = 1 + model.nq + model.nv
    if states.ndim != 2 or states.shape[1] != size or not len(states):
        raise TraceError(f"states: shape {states.shape}, the model has (N, {size})")
    if not np.isfinite(states).all():
        raise TraceError(
            f"states: not finite at step {int(np.argwhere(~np.isfinite(states))[0, 0])}"
        )
    return states


def _ignore(_message: str) -> None:
    """MuJoCo's solver warnings say nothing that the recorded state does not."""
