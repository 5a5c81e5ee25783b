"""LIBERO's own environments: imported, made and reset, in the interpreter that has them."""

from __future__ import annotations

import importlib
import json
import os
import random
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from pytest_safemanip.decoding import torchfile
from pytest_safemanip.decoding.arrays import MAX_REPLY, DecodingError
from pytest_safemanip.errors import ConfigError, RolloutError
from pytest_safemanip.sim.libero.robot import still
from pytest_safemanip.sim.robocasa.patches.importing import quiet, robosuite_settings

CONTROL_RATE = 20
"""Hz, of LIBERO's evaluation."""
ATTEMPTS = 100
"""Tries to place the objects without an overlap; LIBERO itself tries for ever."""
SETTLE_STEPS = 10
"""Control periods before an episode begins, in which what was placed in the air falls: as the
public evaluations of openpi and OpenVLA do."""


def load(assets: Path) -> None:
    """Import LIBERO without its questions, its files in the home folder and its downloads.

    Args:
        assets: the folder that it reads its assets from.
    """
    folder = tempfile.mkdtemp(prefix="safemanip-libero-")
    places = dict.fromkeys(("benchmark_root", "bddl_files", "init_states", "datasets"), folder)
    config = Path(folder) / "config.yaml"
    config.write_text(json.dumps({**places, "assets": str(assets)}))
    os.environ["LIBERO_CONFIG_PATH"] = folder
    with quiet(), robosuite_settings():
        libero: Any = importlib.import_module("libero.libero")
        # Otherwise it asks a hub for what the folder of its package does not have.
        libero._assets_path_cache = str(assets)
        importlib.import_module("libero.libero.envs")
    os.environ["LIBERO_CONFIG_PATH"] = folder


def make(problem: Path, domain: str, seed: int) -> Any:
    """A fresh environment, its objects placed.

    Args:
        problem: BDDL file.
        domain: name of its class.
        seed: decides where things are placed.

    Raises:
        RolloutError: if the objects cannot be placed, or an asset is missing.
    """
    from libero.libero.envs import TASK_MAPPING
    from robosuite import load_controller_config
    from robosuite.utils.errors import RandomizationError

    if domain not in TASK_MAPPING:
        raise ConfigError(f"{problem}: LIBERO has no domain {domain!r}")
    random.seed(seed)
    np.random.seed(seed)
    for _ in range(ATTEMPTS):
        try:
            env = TASK_MAPPING[domain](
                str(problem),
                robots=["Panda"],
                controller_configs=load_controller_config(default_controller="OSC_POSE"),
                initialization_noise=None,
                use_camera_obs=False,
                has_renderer=False,
                has_offscreen_renderer=False,
                control_freq=CONTROL_RATE,
                ignore_done=True,
                hard_reset=False,
            )
            env.reset()
            return env
        except RandomizationError:
            continue
        except FileNotFoundError as error:
            raise RolloutError(
                f"LIBERO's assets were not downloaded in full: {error.filename} is missing"
            ) from error
    raise RolloutError(f"{problem}: no placement without an overlap in {ATTEMPTS} attempts")


def set_initial_state(env: Any, states: Path, seed: int) -> None:
    """Put the scene into one of the states that LIBERO's evaluation begins with.

    Args:
        env: a fresh environment.
        states: file with states (N, 1 + nq + nv): time, positions, velocities.
        seed: which of them; there are more seeds than states.

    Raises:
        ConfigError: if the file is wrong, or of another scene.
    """
    try:
        with states.open("rb") as file:
            found = torchfile.read(file.read(MAX_REPLY))
    except (OSError, DecodingError) as error:
        raise ConfigError(f"{states}: {error}") from error
    model = env.sim.model._model
    size = 1 + model.nq + model.nv
    if not isinstance(found, np.ndarray) or found.ndim != 2 or found.shape[1] != size:
        shape = getattr(found, "shape", type(found).__name__)
        raise ConfigError(f"{states}: expected states (N, {size}) of this scene, found {shape}")
    if not len(found) or not np.isfinite(found).all():
        raise ConfigError(f"{states}: no states, or not all of their numbers are finite")
    env.sim.set_state_from_flattened(found[seed % len(found)].astype(np.float64))
    env.sim.forward()


def settle(env: Any, steps: int) -> None:
    """Let the scene come to rest while the robot stands, its gripper open."""
    for _ in range(steps):
        for _substep in substeps(env, still(-1.0)):
            pass
    env._post_process()


def substeps(env: Any, action: Any) -> Any:
    """Run one control period as robosuite 1.4's own ``step`` does, without what only its
    observations and rewards need; gives control back after each physics substep.
    """
    for number in range(int(env.control_timestep / env.model_timestep)):
        env.sim.forward()
        env._pre_action(action, number == 0)
        env.sim.step()
        yield number
    env.cur_time += env.control_timestep
