"""msgpack with bounds, and the three ways in which servers put arrays into it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pytest_safemanip.decoding.arrays import (
    DecodingError,
    array_of,
    npy_array,
    npy_bytes,
    scalar_of,
)
from pytest_safemanip.errors import printable
from pytest_safemanip.policies.remote.library import need

MAX_ITEMS = 4096
"""Entries of one list or map: announced lengths are allocated before they are read."""
MAX_TEXT = 2**20

Hook = Callable[[dict[Any, Any]], Any]


def unpack(data: bytes, hook: Hook) -> Any:
    """Decode one message.

    Args:
        data: the whole message.
        hook: gets every map, innermost first, and gives what stands in its place.

    Raises:
        DecodingError: if it is no message, or one beyond the bounds.
    """
    try:
        return need("msgpack").unpackb(
            data,
            object_hook=hook,
            raw=False,
            strict_map_key=True,
            max_str_len=MAX_TEXT,
            max_bin_len=len(data),
            max_array_len=MAX_ITEMS,
            max_map_len=MAX_ITEMS,
            max_ext_len=0,
        )
    except DecodingError:
        raise
    except (ValueError, TypeError, RecursionError) as error:
        raise DecodingError(
            f"not msgpack ({type(error).__name__}: {printable(str(error), 100)})"
        ) from error


def pack(value: Any, default: Callable[[Any], Any]) -> bytes:
    """Encode one message; ``default`` says how arrays are put into it."""
    return bytes(need("msgpack").packb(value, default=default))


def openpi_array(value: Any) -> Any:
    """An array in openpi's way, or a numpy scalar: a map whose keys are bytes."""
    if isinstance(value, np.ndarray):
        return {
            b"__ndarray__": True,
            b"data": value.tobytes(),
            b"dtype": value.dtype.str,
            b"shape": value.shape,
        }
    if isinstance(value, np.generic):
        return {b"__npgeneric__": True, b"data": value.item(), b"dtype": value.dtype.str}
    return _refuse(value)


def from_openpi(found: Mapping[Any, Any]) -> Any:
    """The inverse of :func:`openpi_array`."""
    if b"__ndarray__" in found:
        return array_of(found.get(b"data"), found.get(b"dtype"), found.get(b"shape"))
    if b"__npgeneric__" in found:
        return scalar_of(found.get(b"data"), found.get(b"dtype"))
    return found


def groot_array(value: Any) -> Any:
    """An array in GR00T's way: a ``.npy`` file."""
    if isinstance(value, np.ndarray):
        return {"__ndarray_class__": True, "as_npy": npy_bytes(value)}
    return _refuse(value)


def from_groot(found: Mapping[Any, Any]) -> Any:
    """The inverse of :func:`groot_array`; a modality's description becomes a plain map."""
    if "__ndarray_class__" in found:
        return npy_array(found.get("as_npy"))
    if "__ModalityConfig_class__" in found:
        return {"as_json": found.get("as_json")}
    return found


def vlaeval_array(value: Any) -> Any:
    """An array in vla-eval's way, uncompressed: PNG costs 15 ms an image, loopback nothing."""
    if isinstance(value, np.ndarray):
        return {
            "__ndarray__": True,
            "data": value.tobytes(),
            "dtype": value.dtype.str,
            "shape": list(value.shape),
        }
    return _refuse(value)


def from_vlaeval(found: Mapping[Any, Any]) -> Any:
    """The inverse of :func:`vlaeval_array`."""
    if "__ndarray__" in found:
        return array_of(found.get("data"), found.get("dtype"), found.get("shape"))
    if "__image__" in found:
        raise DecodingError("a reply has an image in it")
    return found


def _refuse(value: Any) -> Any:
    raise TypeError(f"{type(value).__name__} cannot be sent")
