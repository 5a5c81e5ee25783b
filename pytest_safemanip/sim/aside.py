"""Puts the state of a simulator's process aside: a fork waits while a copy of it goes on.

A copy of the process has all that decides what comes next, in Python and in the physics, bit for
bit, and shares its memory until one of them writes.
"""

from __future__ import annotations

import ctypes
import gc
import os
import signal
from typing import Protocol, runtime_checkable

_BACK, _MOST = 100, 100
"""Exit status of a copy after which the process that waits goes on, and how many can wait: one more
for each process farther up that is to go on instead."""
_DIE_WITH_PARENT = 1
"""``PR_SET_PDEATHSIG`` of Linux."""


@runtime_checkable
class Draws(Protocol):
    """A backend that may hold what cannot be copied with a process: a GPU's memory."""

    def stop_drawing(self) -> None:
        """Free it; it is made again when it is asked for."""


def put_aside() -> bool:
    """Copy this process, and wait in it.

    Returns:
        True in the copy, which goes on; False in this process when somebody went back to it.

    Raises:
        OSError: if the process cannot be copied, for lack of memory.
    """
    waiting = os.getpid()
    copy = os.fork()
    if copy == 0:
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != waiting:
            os._exit(1)
        gc.freeze()  # else collecting garbage would write to all that is shared
        return True
    status = os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1])
    if status == _BACK:
        return False
    if status < 0:
        # What ended the simulator ends this process too: the one that asks sees how.
        if -status != signal.SIGKILL:
            signal.signal(-status, signal.SIG_DFL)
        os.kill(os.getpid(), -status)
    os._exit(status - 1 if _BACK < status <= _BACK + _MOST else status)


def go_back(levels: int) -> None:
    """End this copy, and go on in a process that waits: does not return.

    Args:
        levels: how many states are forgotten, 1 for the one that was put aside last.
    """
    if not 1 <= levels <= _MOST:
        raise ValueError(f"{levels} levels to go back, expected 1 to {_MOST}")
    os._exit(_BACK + levels - 1)
