"""Decodes arrays from untrusted bytes: few types, every size checked, always a copy."""

from __future__ import annotations

import io
import math
import re
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from pytest_safemanip.errors import printable

MAX_REPLY = 4 * 2**20
"""Bytes of a server's message. Chunks of actions are some kilobytes, and a message takes up to
sixty times its size once decoded: an empty list is one byte of msgpack.
"""
MAX_DIMENSIONS = 8
MAX_SIDE = 2**31

_NUMBERS = re.compile(r"[<>|=]?(?:[iu][1248]|f[248]|b1|\?)")
"""Booleans, integers and floats. Objects, structures and sub-arrays have no place in a reply, and
numpy builds object arrays over whatever bytes it is given."""


class DecodingError(ValueError):
    """A message violates the protocol."""


def number_type(name: Any) -> np.dtype[Any]:
    """A numeric type from its numpy name.

    Raises:
        DecodingError: if it is anything but a boolean, integer or float.
    """
    if isinstance(name, bytes):
        name = name.decode("ascii", "replace")
    if not isinstance(name, str) or not _NUMBERS.fullmatch(name):
        raise DecodingError(f"array type {printable(repr(name), 60)} is not a number's")
    return np.dtype(name)


def array_of(data: Any, dtype: Any, shape: Any) -> NDArray[Any]:
    """An array of its own from raw bytes in C order.

    Raises:
        DecodingError: if the type is no number's, or the bytes do not fill the shape.
    """
    kind = number_type(dtype)
    if not isinstance(data, bytes):
        raise DecodingError(f"array data is {type(data).__name__}, expected bytes")
    if (
        not isinstance(shape, (list, tuple))
        or len(shape) > MAX_DIMENSIONS
        or not all(type(n) is int and 0 <= n <= MAX_SIDE for n in shape)
    ):
        raise DecodingError(f"array shape {printable(repr(shape), 60)} is not one")
    if math.prod(shape) * kind.itemsize != len(data):
        raise DecodingError(f"{len(data)} bytes do not fill {kind.str} of shape {list(shape)}")
    native = np.frombuffer(data, kind).reshape(shape)
    return native.astype(kind.newbyteorder("="), copy=True)


def scalar_of(value: Any, dtype: Any) -> float | int | bool:
    """A plain number from one that was sent with its numpy type.

    Raises:
        DecodingError: if it is none.
    """
    number_type(dtype)
    if type(value) not in (bool, int, float):
        raise DecodingError(f"a number is {type(value).__name__}")
    return value  # type: ignore[no-any-return]


def npy_array(data: Any) -> NDArray[Any]:
    """An array from the bytes of a ``.npy`` file.

    The header is read by itself first: it must announce numbers, and no more than there are.

    Raises:
        DecodingError: if it is none.
    """
    if not isinstance(data, bytes):
        raise DecodingError(f"a .npy file is {type(data).__name__}, expected bytes")
    stream = io.BytesIO(data)
    try:
        reader: Any = npy
        readers = {(1, 0): reader.read_array_header_1_0, (2, 0): reader.read_array_header_2_0}
        shape, fortran, dtype = readers[reader.read_magic(stream)](stream)
    except Exception as error:  # numpy's parser raises SyntaxError, TypeError and others
        raise DecodingError(
            f"not a .npy file ({type(error).__name__}: {printable(str(error), 100)})"
        ) from error
    body = data[stream.tell() :]
    array = array_of(body, dtype.str, shape[::-1] if fortran else shape)
    return array.T if fortran else array


def npy_bytes(array: NDArray[Any]) -> bytes:
    """The bytes of a ``.npy`` file."""
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=False)
    return stream.getvalue()
