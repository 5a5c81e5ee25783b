"""Contacts at every physics substep: a knock between two control steps is seen."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.sim.robocasa.parts import PartTable
from pytest_safemanip.trace.steps import Contacts


class ContactSampler:
    """Collects the contacts of one control period.

    Call :meth:`sample` after each physics substep, when contacts and forces belong together, and
    :meth:`take` once at the end. Reading changes nothing in the simulation.

    Args:
        model: a ``mujoco.MjModel`` with elliptic friction cones.
        table: which geom is which part.
    """

    def __init__(self, model: Any, table: PartTable) -> None:
        if model.opt.cone != mujoco.mjtCone.mjCONE_ELLIPTIC:
            raise RolloutError("contact forces are read for elliptic friction cones only")
        self._part = table.of_geom
        self._matters = table.matters
        self._count = len(table.parts)
        self._samples: list[tuple[NDArray[Any], ...]] = []

    def sample(self, data: Any) -> None:
        """Read the contacts of the substep that just ran."""
        contact = data.contact
        # Copies: the next substep overwrites them. What they mean waits until the step's end.
        self._samples.append(
            (
                contact.geom.copy(),
                contact.efc_address.copy(),
                data.efc_force.copy(),
                contact.pos.copy(),
                contact.frame[:, :3].copy(),
            )
        )

    def take(self) -> Contacts:
        """The contacts of the control period; starts the next one."""
        samples, self._samples = self._samples, []
        if not samples:
            return Contacts.empty()
        sub, pair, force, position, normal = self._joined(samples)
        if len(sub) == 0:
            return Contacts.empty()
        order = pair[:, 0] <= pair[:, 1]
        low, high = np.where(order[:, None], pair, pair[:, ::-1]).T
        normal = np.where(order[:, None], normal, -normal)
        unique, member = np.unique(low.astype(np.int64) * self._count + high, return_inverse=True)
        total = np.zeros((len(unique), len(samples)))
        np.add.at(total, (member, sub), force)
        peak, peak_at = total.max(axis=1), total.argmax(axis=1)
        last = (sub == len(samples) - 1) & (force > 0)
        lasting = np.zeros(len(unique), bool)
        lasting[member[last]] = True
        brief = _strongest(member, sub, force, ~lasting & (peak > 0), peak_at)
        rows = np.concatenate((np.flatnonzero(last), brief))
        rows = rows[np.lexsort((rows, member[rows]))]
        return Contacts(
            step=np.zeros(len(rows), np.int32),
            a=low[rows].astype(np.int32),
            b=high[rows].astype(np.int32),
            force=np.where(last[rows], force[rows], 0.0).astype(np.float32),
            peak=peak[member[rows]].astype(np.float32),
            position=position[rows].astype(np.float32),
            normal=normal[rows].astype(np.float32),
        )

    def _joined(self, samples: list[tuple[NDArray[Any], ...]]) -> tuple[NDArray[Any], ...]:
        """Substep, pair of parts, force, place and normal of each contact that matters."""
        sub = np.repeat(np.arange(len(samples)), [len(s[0]) for s in samples])
        geom, address, position, normal = (
            np.concatenate([s[k] for s in samples]) for k in (0, 1, 3, 4)
        )
        pair = self._part[geom]
        keep = (address >= 0) & (pair >= 0).all(axis=1) & self._matters[pair[:, 0], pair[:, 1]]
        # With elliptic cones the first constraint row of a contact is its normal force.
        offset = np.cumsum([0, *(len(s[2]) for s in samples[:-1])])
        force = np.concatenate([s[2] for s in samples])
        row = (address + offset[sub])[keep]
        return sub[keep], pair[keep], force[row], position[keep], normal[keep]


def _strongest(
    member: NDArray[Any],
    sub: NDArray[Any],
    force: NDArray[Any],
    wanted: NDArray[np.bool_],
    at: NDArray[Any],
) -> NDArray[np.intp]:
    """For each wanted pair, the row of its strongest point in the substep of its peak."""
    rows = [
        max(np.flatnonzero((member == pair) & (sub == at[pair])), key=lambda row: force[row])
        for pair in np.flatnonzero(wanted)
    ]
    return np.array(rows, np.intp)
