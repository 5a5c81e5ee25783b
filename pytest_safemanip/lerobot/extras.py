"""What RoboCasa365's datasets have beside LeRobot's: states, models, descriptions of episodes."""

from __future__ import annotations

import gzip
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

EPISODE = "extras/episode_{index:06d}"
STATES, MODEL, META = "states.npz", "model.xml.gz", "ep_meta.json"
DATASET = "extras/dataset_meta.json"
ABOUT = "safemanip"
"""Key in an episode's description of what this package knows of it; RoboCasa leaves it alone."""
AFTER = "after"
"""Array beside RoboCasa's ``states``: the state after the last action, and the settle tail's."""


@dataclass(frozen=True)
class Extras:
    """The extras of an episode.

    Attributes:
        states: time, positions and velocities before each action (N, 1 + nq + nv).
        after: those after the last action, and of the settle tail (K, 1 + nq + nv).
        model: the model's XML.
        meta: RoboCasa's description of the episode.
        about: what this package knows of it.
    """

    states: NDArray[np.float64]
    after: NDArray[np.float64]
    model: str
    meta: Mapping[str, Any]
    about: Mapping[str, Any]


def write_episode(folder: Path, index: int, extras: Extras) -> None:
    """Write the extras of an episode of a dataset."""
    place = folder / EPISODE.format(index=index)
    place.mkdir(parents=True)
    np.savez_compressed(place / STATES, states=extras.states, **{AFTER: extras.after})
    with gzip.open(place / MODEL, "wb") as stream:
        stream.write(extras.model.encode())
    meta = {**extras.meta, ABOUT: dict(extras.about)}
    (place / META).write_text(json.dumps(meta, indent=4))


def write_dataset(folder: Path, env_args: Mapping[str, Any], total: int) -> None:
    """Write what RoboCasa's tools make the dataset's environment of.

    Args:
        folder: of the dataset.
        env_args: its name and arguments.
        total: number of steps.
    """
    text = json.dumps({"env_args": dict(env_args), "total": total}, indent=4)
    (folder / DATASET).write_text(text)
