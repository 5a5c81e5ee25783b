"""The members of a recording's zip archive, and the arrays in them.

``zipfile`` and ``numpy.load`` take longer for the twenty small members of a recording than it takes
to unpack them (``benchmarks/speed/reading.py`` compares both); here they look at what is unusual,
and say why it is refused.
"""

from __future__ import annotations

import hashlib
import io
import math
import re
import struct
import zipfile
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from pytest_safemanip.errors import DamagedRecording, TraceError
from pytest_safemanip.trace.inflate import inflate

Array = np.ndarray[Any, Any]

MAX_ARRAY = 256 * 2**20
_LOCAL = struct.Struct("<4s22xHH")
"""A member's own header: signature, lengths of the name and of what follows it."""
_ENCRYPTED = 1
_ENTRY = struct.Struct("<4s4xHH8xLLHHH8xL")
"""A member in the archive's directory: signature, flags, method, packed and full size, lengths of
its name and of what follows it, where it begins."""
_END = struct.Struct("<4s4xHHLLH")
"""The end of an archive: signature, number of members twice, size and place of the directory,
length of the comment."""
_LARGE = 0xFFFFFFFF
"""Stands for a size that is elsewhere."""
_PLAIN = re.compile(
    rb"\x93NUMPY\x01\x00(..)\{'descr': '([<|][a-z]\d)', 'fortran_order': False, "
    rb"'shape': \(([0-9, ]*)\), \} *\n",
    re.DOTALL,
)
"""First bytes of an array written by ``numpy.save``."""


@dataclass(frozen=True)
class Packed:
    """A member as it lies in the archive.

    Attributes:
        name: of the member.
        content: its bytes.
        deflated: whether they are compressed.
        size: how many they are when unpacked.
    """

    name: str
    content: bytes | memoryview
    deflated: bool
    size: int

    def unpacked(self, limit: int) -> bytes | memoryview:
        """The content.

        Raises:
            TraceError: if it is larger than the limit, or than the archive says.
            zlib.error: if it is damaged.
        """
        if self.size > limit:
            raise TraceError(f"{self.name}: {self.size} bytes, more than the limit of {limit}")
        content = self.content
        if self.deflated:
            content = inflate(content, self.size, limit)
        if len(content) != self.size:
            raise DamagedRecording(
                f"{self.name}: {len(content)} bytes, the archive says {self.size}"
            )
        return content

    def __reduce__(self) -> tuple[Any, ...]:
        """For copies, which have no use for the rest of the archive."""
        return Packed, (self.name, bytes(self.content), self.deflated, self.size)

    def array(self, wanted: type) -> Array:
        """The content as an array of a type.

        Raises:
            TraceError: if it is none.
        """
        return _array(self.name, self.unpacked(MAX_ARRAY), wanted)


class _Entry(NamedTuple):
    """A member in an archive's directory.

    Attributes:
        name: of the member.
        flags: of the archive's format.
        method: how it is compressed, likewise.
        packed: how many bytes it has there.
        size: how many when unpacked.
        begin: where it begins.
    """

    name: str
    flags: int
    method: int
    packed: int
    size: int
    begin: int


class Members:
    """The members of an archive in memory.

    Args:
        data: the archive.

    Raises:
        zipfile.BadZipFile: if it is none.
    """

    def __init__(self, data: bytes) -> None:
        self._data = memoryview(data)
        self._found = {entry.name: entry for entry in _directory(data) or _any_directory(data)}
        self._packed: dict[str, Packed] = {}

    def has(self, name: str) -> bool:
        """Whether there is a member of this name."""
        return name in self._found

    def packed(self, name: str) -> Packed:
        """A member by name.

        Raises:
            TraceError: if it is missing, or compressed in another way than recordings are.
            zipfile.BadZipFile: if it is not where the archive says.
        """
        if name not in self._packed:
            self._packed[name] = self._cut_out(name)
        return self._packed[name]

    def _cut_out(self, name: str) -> Packed:
        entry = self._found.get(name)
        if entry is None:
            raise DamagedRecording(f"{name} is missing")
        if entry.method not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise DamagedRecording(f"{name}: compressed in another way than recordings are")
        signature, title, extra = _LOCAL.unpack_from(self._data, entry.begin)
        start = entry.begin + _LOCAL.size + title + extra
        content = self._data[start : start + entry.packed]
        broken = signature != b"PK\3\4" or entry.flags & _ENCRYPTED
        if broken or len(content) != entry.packed:
            raise zipfile.BadZipFile(f"{name} is damaged")
        return Packed(name, content, entry.method == zipfile.ZIP_DEFLATED, entry.size)

    def digest(self, but: str) -> str:
        """Digest of all members but one, as they lie in the archive."""
        digest = hashlib.sha256()
        for name in sorted(self._found.keys() - {but}):
            member = self.packed(name)
            about = f"{name}\0{member.deflated}\0{member.size}\0".encode()
            digest.update(about + len(member.content).to_bytes(8, "little"))
            digest.update(member.content)
        return digest.hexdigest()


def _directory(data: bytes) -> list[_Entry]:
    """The directory of an archive in the form of recordings; empty if anything is unusual."""
    end, found = len(data) - _END.size, list[_Entry]()
    if end < 0:
        return []
    signature, count, total, size, place, comment = _END.unpack_from(data, end)
    if signature != b"PK\5\6" or count != total or place + size != end or comment:
        return []
    for _ in range(count):
        if place + _ENTRY.size > end:
            return []
        mark, flags, method, packed, full, title, extra, note, begin = _ENTRY.unpack_from(
            data, place
        )
        place += _ENTRY.size + title
        name = data[place - title : place]
        if mark != b"PK\1\2" or extra or note or not name.isascii() or _LARGE in (packed, full):
            return []
        found.append(_Entry(name.decode(), flags, method, packed, full, begin))
    return found if place == end else []


def _any_directory(data: bytes) -> list[_Entry]:
    """The directory of any archive.

    Raises:
        zipfile.BadZipFile: if it is none.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return [
            _Entry(
                i.filename,
                i.flag_bits,
                i.compress_type,
                i.compress_size,
                i.file_size,
                i.header_offset,
            )
            for i in archive.infolist()
        ]


def npy(array: Array) -> bytes:
    """An array as the content of a ``.npy`` file."""
    stream = io.BytesIO()
    np.save(stream, np.ascontiguousarray(array), allow_pickle=False)
    return stream.getvalue()


def _array(name: str, raw: bytes | memoryview, wanted: type) -> Array:
    begin = _PLAIN.match(raw)
    if begin and begin[2].decode() == np.dtype(wanted).str:
        shape = tuple(int(length) for length in begin[3].split(b",") if length.strip())
        content = memoryview(raw)[begin.end() :]
        (header,) = struct.unpack("<H", begin[1])
        size = int(np.dtype(wanted).itemsize) * math.prod(shape)
        if header + 10 == begin.end() and len(content) == size:
            return np.frombuffer(content, wanted).reshape(shape)
    return _unusual(name, raw, wanted)


def _unusual(name: str, raw: bytes | memoryview, wanted: type) -> Array:
    """An array that does not look like those of recordings; mostly refused, with the reason."""
    try:
        array = np.load(io.BytesIO(raw), allow_pickle=False)
    except Exception as error:  # numpy does not say what it raises on a header that lies
        raise DamagedRecording(f"{name}: not a readable array ({error})") from error
    if not isinstance(array, np.ndarray):
        raise TraceError(f"{name}: not an array")
    if array.dtype != wanted:
        raise TraceError(f"{name}: {array.dtype}, expected {np.dtype(wanted)}")
    return np.asarray(array)
