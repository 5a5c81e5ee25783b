"""Ring buffers: the newest steps of a running rollout, and the newest values of anything."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import ARRAYS, Contacts, Steps

Array = NDArray[Any]


class Ring:
    """The newest rows of an array.

    They lie side by side, so that a look back is a view and no copy.

    Attributes:
        kept: rows that are kept at least.
    """

    def __init__(self, kept: int) -> None:
        self.kept, self._stop = kept, 0
        self._rows: Array | None = None

    def extend(self, rows: Array) -> None:
        """Add rows (K, ...) at the end; the first ones say what kind all are."""
        if self._rows is None or self._stop + len(rows) > len(self._rows):
            self._rows = self._with_room(rows)
        stop = self._stop + len(rows)
        self._rows[self._stop : stop] = rows
        self._stop = stop

    def last(self, count: int) -> Array:
        """The newest rows (at most ``count``, ...), read-only."""
        if self._rows is None:
            raise ValueError("nothing was added yet")
        view = self._rows[max(self._stop - count, 0) : self._stop]
        view.flags.writeable = False
        return view

    def _with_room(self, new: Array) -> Array:
        """The rows that are kept, with room for more of them."""
        keep = new[:0] if self._rows is None else self.last(self.kept)
        size = max(2 * (max(self.kept, len(keep)) + len(new)), 64)
        rows = np.empty((size, *new.shape[1:]), keep.dtype)
        rows[: len(keep)] = keep
        self._stop = len(keep)
        return rows


class StepMemory:
    """The newest steps of a rollout.

    Args:
        scene: its static part.
        kept: steps that are kept at least.

    Attributes:
        count: steps taken in so far.
    """

    def __init__(self, scene: Scene, kept: int) -> None:
        self._kept, self.count = kept, 0
        names = (*ARRAYS, "action", "success", "tail")
        self._arrays = {name: Ring(kept) for name in names}
        self._columns = {f.name: Ring(0) for f in dataclasses.fields(Contacts)}
        self._rows: list[int] = []  # contact rows of each kept step
        for name, column in dataclasses.asdict(Contacts.empty()).items():
            self._columns[name].extend(column)

    @property
    def held(self) -> int:
        """Steps that can be looked back on."""
        return min(self.count, self._kept)

    def keep(self, count: int) -> None:
        """Keep so many steps at least from now on."""
        self._kept = max(self._kept, count)
        for ring in self._arrays.values():
            ring.kept = self._kept

    def extend(self, steps: Steps) -> None:
        """Take in steps."""
        for name, ring in self._arrays.items():
            ring.extend(getattr(steps, name))
        rows = steps.contacts
        kept = sum(self._rows)
        for name, ring in self._columns.items():
            column = getattr(rows, name)
            ring.kept = kept
            ring.extend(column + np.int32(self.count) if name == "step" else column)
        counts = np.bincount(rows.step, minlength=len(steps)).tolist()
        self._rows = [*self._rows, *counts][-self._kept :]
        self.count += len(steps)

    def last(self, count: int) -> Steps:
        """The newest steps (at most ``count``) as views."""
        count = min(count, self.held)
        arrays = {name: ring.last(count) for name, ring in self._arrays.items()}
        rows = sum(self._rows[-count:])
        columns = {name: ring.last(rows) for name, ring in self._columns.items()}
        columns["step"] = columns["step"] - np.int32(self.count - count)
        return Steps(**arrays, contacts=Contacts(**columns))
