"""Reads the extras of RoboCasa's datasets: no pickle, bounded, within the source."""

from __future__ import annotations

import gzip
import io
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.importers.lerobot.dataset import Dataset
from pytest_safemanip.lerobot.extras import AFTER, DATASET, EPISODE, META, MODEL, STATES
from pytest_safemanip.sim.mujoco.strangers import MOST_XML
from pytest_safemanip.trace.members import Members
from pytest_safemanip.trace.typed import shown

MOST_STATES = 256 * 2**20


def read_states(dataset: Dataset, index: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The states before each action, and those after the last one, which only this package writes:
    (N, S) and (K, S).

    Raises:
        TraceError: if they cannot be read.
    """
    name = f"{EPISODE.format(index=index)}/{STATES}"
    try:
        members = Members(dataset.read(name, MOST_STATES))
        states = members.packed("states.npy").array(np.float64)
        if states.ndim != 2:
            raise TraceError(f"states: shape {states.shape}, expected (N, S)")
        after = np.zeros((0, states.shape[1]))
        if members.has(f"{AFTER}.npy"):
            after = members.packed(f"{AFTER}.npy").array(np.float64)
        if after.ndim != 2 or after.shape[1] != states.shape[1]:
            raise TraceError(f"{AFTER}: shape {after.shape}, the states have {states.shape}")
    except (zipfile.BadZipFile, zlib.error, EOFError) as error:
        raise TraceError(f"{name}: not an archive of arrays, or a damaged one ({error})") from error
    except TraceError as error:
        raise TraceError(f"{name}: {error}") from error
    return states, after


def read_model(dataset: Dataset, index: int) -> str:
    """The XML of an episode's model.

    Raises:
        TraceError: if it cannot be read, or is larger than a model.
    """
    name = f"{EPISODE.format(index=index)}/{MODEL}"
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(dataset.read(name, MOST_XML))) as stream:
            content = stream.read(MOST_XML + 1)
        if len(content) > MOST_XML:
            raise TraceError(f"{name}: more than {MOST_XML} bytes when unpacked")
        return content.decode()
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise TraceError(f"{name}: not a packed text, or a damaged one ({error})") from error


def read_meta(dataset: Dataset, index: int) -> Any:
    """RoboCasa's description of an episode.

    Raises:
        TraceError: if it cannot be read.
    """
    return dataset.json(f"{EPISODE.format(index=index)}/{META}")


def read_task(dataset: Dataset) -> str:
    """The name of the environment that a dataset is of.

    Raises:
        TraceError: if it does not say so, or its actions are not RoboCasa's.
    """
    about = dataset.json(DATASET)
    arguments = about.get("env_args") if isinstance(about, Mapping) else None
    name = arguments.get("env_name") if isinstance(arguments, Mapping) else None
    if not isinstance(name, str) or not name.isidentifier():
        raise TraceError(f"{DATASET}: env_name must be the name of a task, found {shown(name)}")
    for key, value in _pairs(arguments):
        if (key == "control_delta" and value is False) or (
            key == "input_type" and value == "absolute"
        ):
            raise TraceError(
                f"{DATASET}: its actions are absolute ({key}: {value}); only RoboCasa's own, which "
                "are differences, can be simulated again"
            )
    return name


def _pairs(item: Any, depth: int = 0) -> Any:
    """All keys and values of nested mappings."""
    if isinstance(item, Mapping) and depth < 20:
        for key, value in item.items():
            yield key, value
            yield from _pairs(value, depth + 1)
