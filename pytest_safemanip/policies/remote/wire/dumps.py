"""Writes failed requests and replies to disk, for debugging."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAX_DEPTH = 8
_numbers = itertools.count()


def dump(folder: Path, request: Mapping[str, Any], reply: Any) -> Path:
    """Write an exchange.

    Args:
        folder: is made if it does not exist.
        request: nested maps of arrays and plain values.
        reply: the same, or the raw bytes or text of what could not be decoded.

    Returns:
        A new ``.npz`` file; an array for each value, ``request/...`` and ``reply/...``. It loads
        without ``allow_pickle``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    arrays = dict(_flat("request", request, 0)) | dict(_flat("reply", reply, 0))
    while True:
        path = folder / f"policy-answer-{os.getpid()}-{next(_numbers)}.npz"
        try:
            with path.open("xb") as stream:
                np.savez_compressed(stream, **arrays)
        except FileExistsError:
            continue
        return path


def _flat(name: str, value: Any, depth: int) -> Iterator[tuple[str, NDArray[Any]]]:
    if isinstance(value, Mapping) and depth < MAX_DEPTH:
        for key, inner in value.items():
            # A slash would make folders in the archive, and one from a server could leave them.
            text = key.decode("ascii", "replace") if isinstance(key, bytes) else str(key)
            yield from _flat(f"{name}/{text.replace('/', '|')[:100]}", inner, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biufU":
        yield name, value
    elif isinstance(value, bytes):
        yield name, np.frombuffer(value, np.uint8)
    elif isinstance(value, (bool, int, float)) and abs(value) < 2**63:
        yield name, np.array(value)
    else:
        yield name, np.array(str(value).rstrip("\0"))
