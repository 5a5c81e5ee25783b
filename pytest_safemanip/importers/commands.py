"""What a gripper was told, from how its fingers moved."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SURE = 0.1
"""Least change of a gripper's opening, within ``SURE_SECONDS``, that tells its command: fingers
that close on something rebound by less."""
SURE_SECONDS = 0.1
WIDE = 0.9
"""How open a gripper comes to be that is told to open, between its least and its widest."""
WIDE_SECONDS = 0.3


def infer_commands(times: Floats, opening: Floats) -> Floats:
    """The commands that a gripper must have had (T,): 1 to close, -1 to open.

    It was told to do what it did last: fingers that stand still close on something, or are open. It
    was told to open if it came to be as open as it ever was: what it holds may force it apart, too.

    Args:
        times: s (T,).
        opening: 0 closed, 1 open (T,).
    """
    commands = motion_of(times, opening)
    wide = opening.min() + WIDE * (opening.max() - opening.min())
    until = np.searchsorted(times, times + WIDE_SECONDS, side="right")
    for index in np.flatnonzero(commands < 0):
        if opening[index : until[index]].max() < wide:
            commands[index] = 0.0
    moved = np.flatnonzero(commands)
    if not len(moved):
        return np.full(len(times), -1.0)
    commands[0] = commands[0] or -commands[moved[0]]
    return keep_on(commands)


def motion_of(times: Floats, opening: Floats) -> Floats:
    """1 where a gripper surely closes, -1 where it opens, 0 elsewhere (T,)."""
    half = SURE_SECONDS / 2
    later = np.searchsorted(times, times + half, side="right") - 1
    before = np.searchsorted(times, times - half, side="left")
    change = opening[later] - opening[before]
    return np.where(change > SURE, -1.0, np.where(change < -SURE, 1.0, 0.0))


def keep_on(commands: Floats) -> Floats:
    """Commands in which 0 repeats the one before, and -1 is before the first."""
    known = np.where(commands != 0, np.arange(len(commands)), -1)
    last = np.maximum.accumulate(known)
    return np.where(last >= 0, np.sign(commands[last]), -1.0)
