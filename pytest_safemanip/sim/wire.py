"""Messages between the test process and the process that steps the simulator.

A message is a mapping of plain values and a set of named arrays: a length, a JSON header, the
arrays' raw bytes. No pickle; every size is bounded.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

MAX_HEADER = 8 * 2**20
MAX_PAYLOAD = 256 * 2**20
_LENGTHS = struct.Struct("<IQ")
_DTYPES = {"<f4": np.float32, "<f8": np.float64, "<i4": np.int32, "|u1": np.uint8, "|b1": np.bool_}


class WireError(Exception):
    """The other side closed the connection or sent something that is no message."""


@dataclass(frozen=True)
class Message:
    """A message.

    Attributes:
        values: plain builtins.
        arrays: float32, float64, int32, uint8 or bool.
    """

    values: Mapping[str, Any]
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)


def send(stream: IO[bytes], message: Message) -> None:
    """Write a message and flush.

    Raises:
        WireError: if the other side is gone.
    """
    arrays = {name: np.ascontiguousarray(array) for name, array in message.arrays.items()}
    layout = [(name, array.dtype.str, array.shape) for name, array in arrays.items()]
    header = json.dumps({"values": message.values, "arrays": layout}).encode()
    size = sum(array.nbytes for array in arrays.values())
    try:
        stream.write(_LENGTHS.pack(len(header), size))
        stream.write(header)
        for array in arrays.values():
            stream.write(array.tobytes())
        stream.flush()
    except (OSError, ValueError) as error:
        raise WireError(f"the connection is closed ({error})") from error


def receive(stream: IO[bytes]) -> Message:
    """Read a message.

    Raises:
        WireError: at the end of the stream, or if what came is no message.
    """
    header_size, size = _LENGTHS.unpack(_read(stream, _LENGTHS.size))
    if header_size > MAX_HEADER or size > MAX_PAYLOAD:
        raise WireError(f"a message of {header_size + size} bytes is over the limit")
    try:
        header = json.loads(_read(stream, header_size))
        layout = [(str(n), _DTYPES[d], tuple(map(int, s))) for n, d, s in header["arrays"]]
        values = dict(header["values"])
    except (ValueError, KeyError, TypeError) as error:
        raise WireError(f"not a message ({error})") from error
    payload = _read(stream, size)
    arrays, offset = {}, 0
    for name, dtype, shape in layout:
        count = math.prod(shape)
        end = offset + count * np.dtype(dtype).itemsize
        if count < 0 or end > size:
            raise WireError("not a message (an array is longer than its payload)")
        arrays[name] = np.frombuffer(payload, dtype, count, offset).reshape(shape)
        offset = end
    return Message(values, arrays)


def _read(stream: IO[bytes], size: int) -> bytes:
    try:
        data = stream.read(size)
    except (OSError, ValueError) as error:
        raise WireError(f"the connection is closed ({error})") from error
    if len(data) != size:
        raise WireError("the other side closed the connection")
    return data
