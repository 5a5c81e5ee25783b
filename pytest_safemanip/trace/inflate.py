"""Decompresses with a bound on the output."""

from __future__ import annotations

import zlib

_Damaged: type[Exception]
try:
    from isal import igzip_lib, isal_zlib
except ImportError:  # there is none for this processor: zlib takes twice as long
    _decompress, _Damaged = zlib.decompress, zlib.error
else:
    _decompress = isal_zlib.decompress
    _Damaged = igzip_lib.IsalError  # type: ignore[assignment]  # its stub calls it an instance

_MOST = 1032
"""A byte never unpacks to more."""


def inflate(content: bytes | memoryview, size: int, limit: int) -> bytes:
    """The decompressed content, cut off after ``size + 1`` bytes.

    Args:
        content: a raw deflate stream.
        size: how many bytes it should unpack to.
        limit: how many bytes may be unpacked at all, at least ``size``.

    Raises:
        zlib.error: if it is damaged.
    """
    if _MOST * len(content) > limit:  # this takes longer, and stops in time
        return zlib.decompressobj(-zlib.MAX_WBITS).decompress(content, size + 1)
    try:
        return _decompress(content, -zlib.MAX_WBITS, size + 1)
    except _Damaged as error:
        raise zlib.error(str(error)) from error
