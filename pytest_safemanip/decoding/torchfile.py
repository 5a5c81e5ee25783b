"""torch's file format without torch: written as ``torch.load`` reads it, read as data.

GR00T servers until mid 2025 speak it. They unpickle what they are sent, and so trust every client;
here, neither a request nor a reply is ever unpickled.
"""

from __future__ import annotations

import io
import pickle  # for writing only
import zipfile
from typing import Any

import numpy as np

from pytest_safemanip.decoding.arrays import MAX_REPLY, DecodingError
from pytest_safemanip.decoding.pickled import load_pickle
from pytest_safemanip.errors import printable

_MAGIC = 0x1950A86A20F9469CFC6C
_VERSION = 1001
_SYSTEM = {
    "protocol_version": _VERSION,
    "little_endian": True,
    "type_sizes": {"short": 2, "int": 4, "long": 4},
}


def write(value: Any) -> bytes:
    """Encode nested maps and lists of plain values and numpy arrays.

    It is the format before torch's zip files, which every ``torch.load`` still reads: five pickles,
    of a magic number, a version, the machine, the value, and the (no) tensors in it.
    """
    stream = io.BytesIO()
    for part in (_MAGIC, _VERSION, _SYSTEM):
        pickle.dump(part, stream, protocol=2)
    # Protocol 2 would double the size of images, protocol 5 is more than old servers promise.
    _ArrayPickler(stream, protocol=4).dump(value)
    pickle.dump([], stream, protocol=2)
    return stream.getvalue()


class _ArrayPickler(pickle.Pickler):
    """Pickles arrays by what exists under one name in numpy 1 and 2, and is writable there."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return np.ndarray, (value.shape, value.dtype.str, bytearray(value.tobytes()))
        return NotImplemented


def read(data: bytes) -> Any:
    """Decode what ``torch.save`` has written: values and numpy arrays, no tensors.

    Raises:
        DecodingError: if it is no such file, or has anything else in it.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            found = [e for e in archive.infolist() if e.filename.split("/")[1:] == ["data.pkl"]]
            if len(found) != 1:
                raise DecodingError("a zip file without torch's data.pkl")
            # torch does not compress; what is compressed can be a thousand times what arrived.
            if found[0].compress_type != zipfile.ZIP_STORED or found[0].file_size > MAX_REPLY:
                raise DecodingError("a torch file that is compressed, as torch's are not")
            content = archive.read(found[0])
    except DecodingError:
        raise
    except Exception as error:  # broken archives raise a dozen kinds
        raise DecodingError(
            f"not a torch file ({type(error).__name__}: {printable(str(error), 100)})"
        ) from error
    return load_pickle(content)
