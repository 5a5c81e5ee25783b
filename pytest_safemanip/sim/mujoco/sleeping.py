"""Leaves what lies still out of the physics, as MuJoCo's sleeping islands, and keeps its contacts.

In a kitchen nearly everything lies still nearly always. MuJoCo (from 3.4 on) puts a kinematic tree
to sleep that was slower than a tolerance for ten substeps, together with all that it touches, and
wakes it when something awake touches it or its state is written to. What sleeps vanishes from
``MjData.contact``, though it still stands where it stood and presses as it did: its contacts of
the substep in which it fell asleep hold until it wakes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

_FLAG = int(getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0))
"""0 where MuJoCo is too old to have it."""
TOLERANCE = 1e-5
"""Speed below which a tree is put to sleep, m/s; of what turns, at the mean size of its geoms.
A tenth of MuJoCo's own, for which as much sleeps in a kitchen: a minute's creep is under a mm."""


@dataclass(frozen=True)
class Points:
    """Contact points of one substep.

    Attributes:
        geom: ids of the two geoms (N, 2).
        active: whether they press, or are only within a margin (N,).
        force: normal forces, N (N,); 0 where they do not press.
        position: m (N, 3).
        normal: from the first geom to the second (N, 3).
    """

    geom: NDArray[np.int32]
    active: NDArray[np.bool_]
    force: NDArray[np.float64]
    position: NDArray[np.float64]
    normal: NDArray[np.float64]

    @classmethod
    def of(cls, data: Any, rows: NDArray[Any]) -> Points:
        """Some of those that MuJoCo lists now; with elliptic friction cones.

        Args:
            data: ``MjData``, when contacts and forces belong together.
            rows: which (K,), indices or booleans.
        """
        contact = data.contact
        address = contact.efc_address[rows]
        # With elliptic cones the first constraint row of a contact is its normal force.
        active = address >= 0
        force = np.zeros(len(address))
        force[active] = data.efc_force[address[active]]
        frame = contact.frame[rows]
        return cls(contact.geom[rows], active, force, contact.pos[rows], frame[:, :3])

    def joined(self, others: Points) -> Points:
        """These, and others after them."""
        pairs = zip(vars(self).values(), vars(others).values(), strict=True)
        return Points(*(np.concatenate(pair) for pair in pairs))

    def chosen(self, rows: NDArray[Any]) -> Points:
        """Some of these."""
        return Points(*(values[rows] for values in vars(self).values()))


NO_POINTS = Points(
    np.zeros((0, 2), np.int32), np.zeros(0, bool), np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3))
)


class Asleep:
    """What sleeps in a simulation.

    Args:
        model: its ``MjModel``.

    Attributes:
        contacts: those between what sleeps, and between it and what cannot move, that MuJoCo does
            not list.
    """

    def __init__(self, model: Any) -> None:
        self._model = model
        if _FLAG:
            model.opt.sleep_tolerance = TOLERANCE
        self._tree = model.body_treeid[model.geom_bodyid]  # -1: it cannot move
        self._known = np.ones(model.ntree, np.int32).tobytes()
        self.contacts = self._new = NO_POINTS

    @contextmanager
    def allowed(self) -> Iterator[None]:
        """Lets MuJoCo put trees to sleep meanwhile.

        Not for longer: what is computed in copies of the state in between is computed for all. What
        cannot move has to be where it is: MuJoCo does not look after it meanwhile.
        """
        self._model.opt.enableflags |= _FLAG
        try:
            yield
        finally:
            self._model.opt.enableflags &= ~_FLAG

    def pairs(self) -> list[list[int]]:
        """The pairs of geoms in :attr:`contacts`."""
        pairs: list[list[int]] = self.contacts.geom.tolist()
        return pairs

    def note(self, data: Any) -> None:
        """Look who sleeps after a substep; to be called after each one.

        Args:
            data: the live ``MjData``.
        """
        if not _FLAG:
            return
        known = data.tree_awake.tobytes()
        if known == self._known and self._new is NO_POINTS:
            return
        if self._new is not NO_POINTS:
            # When it fell asleep, MuJoCo still listed them.
            self.contacts, self._new = self.contacts.joined(self._new), NO_POINTS
        if known != self._known:
            self._known = known
            self._keep(data)

    def _keep(self, data: Any) -> None:
        awake = data.tree_awake.astype(bool)
        # What lies still in no tree counts as asleep; index -1 leads to it.
        asleep = np.append(~awake, True)
        listed = self._tree[data.contact.geom]
        new = asleep[listed].all(axis=1)
        # A tree that MuJoCo lists contacts of was awake in this substep: these are all it has.
        gone = np.append(awake, False)
        gone[listed[new]] = True
        gone[-1] = False
        if new.any():
            self._new = Points.of(data, new)
        kept = ~gone[self._tree[self.contacts.geom]].any(axis=1)
        if not kept.all():
            self.contacts = self.contacts.chosen(kept)
