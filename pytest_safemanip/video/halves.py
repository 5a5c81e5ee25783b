"""Drawing on two cores: every other picture is drawn by a fork of this process.

MuJoCo draws one picture at a time in a process, and setting up the scene takes longer than drawing
half of it: so the process is forked once the scene stands, and before it opens a GL context. It has
to be one that does nothing else: what locks other threads hold, they hold in the fork forever.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import signal
import warnings
from collections.abc import Callable, Iterator

import numpy as np

from pytest_safemanip.video.imaging import Image

FEWEST = 8
"""Pictures for which it is worth it."""
DEADLINE = 30.0
"""Seconds for a picture; the first one uploads the scene."""
AHEAD = 1 << 20
"""Bytes that the fork may be ahead; what the kernel allows everybody."""


def drawn(draw: Callable[[int], Image], shape: tuple[int, int, int], count: int) -> Iterator[Image]:
    """The pictures 0 to ``count - 1``, in order.

    Args:
        draw: draws one of them; has opened no GL context yet.
        shape: of a picture.
        count: how many there are.
    """
    if count < FEWEST or len(os.sched_getaffinity(0)) < 2:
        yield from map(draw, range(count))
        return
    reader, writer = os.pipe()
    with contextlib.suppress(OSError):  # it is slower without
        fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, AHEAD)
    with warnings.catch_warnings():
        # NumPy's idle threads are no danger: the fork waits for none of them.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        _give(draw, range(1, count, 2), reader, writer)
    os.close(writer)
    source = _Pipe(reader, int(np.prod(shape)))
    try:
        for number in range(count):
            found = source.read() if number % 2 else b""
            # Without the fork, if it was killed, all that is left is drawn here.
            yield np.frombuffer(found, np.uint8).reshape(shape) if found else draw(number)
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(reader)


class _Pipe:
    """Pictures from the fork.

    Args:
        reader: number of the pipe.
        size: of a picture, bytes.
    """

    def __init__(self, reader: int, size: int) -> None:
        self._reader, self._size = reader, size
        self._works = True

    def read(self) -> bytes:
        """The next picture; nothing once the fork has died or hangs."""
        found = bytearray()
        while self._works and len(found) < self._size:
            ready, _, _ = select.select([self._reader], [], [], DEADLINE)
            more = os.read(self._reader, self._size - len(found)) if ready else b""
            self._works = bool(more)
            found += more
        return bytes(found) if self._works else b""


def _give(draw: Callable[[int], Image], numbers: range, reader: int, writer: int) -> None:
    """What the fork does: it never returns, since all else is the business of the other."""
    try:
        os.close(reader)
        with open(writer, "wb") as target:
            for number in numbers:
                target.write(np.ascontiguousarray(draw(number)).data)
    finally:
        os._exit(0)
