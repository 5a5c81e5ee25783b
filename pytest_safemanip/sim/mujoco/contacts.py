"""Contacts at every physics substep: a knock between two control steps is seen."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco.parts import PartTable
from pytest_safemanip.sim.mujoco.sleeping import Asleep, Points
from pytest_safemanip.trace.steps import SUSTAINED, Contacts

_Sample = tuple[NDArray[Any], ...]
_NO_ROWS = np.zeros((0, 3))


class ContactSampler:
    """Collects the contacts of one control period.

    Call :meth:`sample` after each physics substep, when contacts and forces belong together, and
    :meth:`take` once at the end. Reading changes nothing in the simulation.

    Args:
        model: a ``mujoco.MjModel``.
        table: which geom is which part.
        asleep: what sleeps, where that is allowed; its contacts are listed as they were last.
        seconds: over which forces are averaged, rounded to whole substeps.
    """

    def __init__(
        self,
        model: Any,
        table: PartTable,
        asleep: Asleep | None = None,
        seconds: float = SUSTAINED,
    ) -> None:
        self._pyramids = model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL
        self._part = table.of_geom
        self._matters = table.matters
        self._count = len(table.parts)
        self._asleep = asleep or Asleep(model)
        self._samples: list[_Sample | None] = []
        self._carried: list[Points] = []
        self._means = _RunningMeans(max(1, round(seconds / model.opt.timestep)))
        # The last period's, and what they were those of, where nothing else touched for so long
        # that all means are of them alone.
        self._still: tuple[Points | None, Contacts] = None, Contacts.empty()
        self._rests: tuple[Points | None, int] = None, 0
        self._known: tuple[Points, tuple[NDArray[Any], ...]] | None = None

    def sample(self, data: Any) -> None:
        """Read the contacts of the substep that just ran."""
        self._carried.append(self._asleep.contacts)
        if data.ncon == 0:
            self._samples.append(None)
            return
        contact = data.contact
        # Copies: the next substep overwrites them. What they mean waits until the step's end.
        self._samples.append(
            (
                contact.geom.copy(),
                contact.efc_address >= 0,
                normal_forces(contact, data.efc_force, self._pyramids),
                contact.pos.copy(),
                contact.frame[:, :3].copy(),
            )
        )

    def take(self) -> Contacts:
        """The contacts of the control period; starts the next one."""
        samples, self._samples = self._samples, []
        carried, self._carried = self._carried, []
        if not samples:
            return Contacts.empty()
        still = not any(samples) and all(points is carried[0] for points in carried)
        rested = self._rests[1] if still and self._rests[0] is carried[0] else 0
        self._rests = (carried[0], rested + len(carried)) if still else (None, 0)
        if rested < self._means.count:
            self._still = None, Contacts.empty()
            return self._contacts(samples, carried)
        if carried[0] is not self._still[0]:
            self._still = carried[0], self._contacts(samples, carried)
        return self._still[1]

    def _contacts(self, samples: list[_Sample | None], carried: list[Points]) -> Contacts:
        sampled = self._sampled(samples)
        held = self._held(carried)
        rows = sampled.and_those_of(held)
        end = len(samples)
        unique, member = np.unique(rows.pair, return_inverse=True)
        count = len(sampled.force)
        total = np.zeros((len(unique), end))
        np.add.at(total, (member[:count], sampled.start), sampled.force)
        for block in held:
            own, count = slice(count, count + len(block.force)), count + len(block.force)
            pressing = np.bincount(member[own], block.force, len(unique))
            total[:, block.start[0] : block.stop[0]] += pressing[:, None]
        sustained = self._means.largest(unique, total)
        most, most_at = total.max(axis=1, initial=0.0), total.argmax(axis=1)
        last = (rows.stop == end) & (rows.force > 0)
        lasting = np.zeros(len(unique), bool)
        lasting[member[last]] = True
        brief = [
            rows.strongest(member == pair, most_at[pair])
            for pair in np.flatnonzero(~lasting & (most > 0))
        ]
        chosen = np.append(np.flatnonzero(last), np.array(brief, np.intp))
        chosen = chosen[np.lexsort((chosen, member[chosen]))]
        low, high = np.divmod(rows.pair[chosen], self._count)
        return Contacts(
            step=np.zeros(len(chosen), np.int32),
            a=low.astype(np.int32),
            b=high.astype(np.int32),
            force=np.where(last[chosen], rows.force[chosen], 0.0).astype(np.float32),
            sustained=sustained[member[chosen]].astype(np.float32),
            position=rows.position[chosen].astype(np.float32),
            normal=rows.normal[chosen].astype(np.float32),
        )

    def _sampled(self, samples: list[_Sample | None]) -> _Rows:
        """What MuJoCo listed, a row for each point and substep."""
        found = [(sub, sample) for sub, sample in enumerate(samples) if sample is not None]
        if not found:
            none = np.zeros(0, np.int64)
            return _Rows(none, np.zeros(0), _NO_ROWS, _NO_ROWS, none, none)
        lengths = [len(sample[0]) for _, sample in found]
        sub = np.repeat([sub for sub, _ in found], lengths)
        geom, active, force, position, normal = map(
            np.concatenate, zip(*(sample for _, sample in found), strict=True)
        )
        keep, pair, normal = self._meaning(geom, active, normal)
        sub = sub[keep]
        return _Rows(pair, force[keep], position[keep], normal, sub, sub + 1)

    def _held(self, carried: list[Points]) -> list[_Rows]:
        """The contacts of what slept: a block for each run of substeps in which they stayed."""
        blocks, stop = [], 0
        for _, run in itertools.groupby(carried, key=id):
            start, stop = stop, stop + len(list(run))
            points = carried[start]
            if self._known is None or self._known[0] is not points:
                keep, pair, normal = self._meaning(points.geom, points.active, points.normal)
                self._known = points, (pair, points.force[keep], points.position[keep], normal)
            of_points = self._known[1]
            if len(of_points[0]):
                times = (np.full(len(of_points[0]), at) for at in (start, stop))
                blocks.append(_Rows(*of_points, *times))
        return blocks

    def _meaning(
        self, geom: NDArray[Any], active: NDArray[np.bool_], normal: NDArray[Any]
    ) -> tuple[NDArray[np.bool_], NDArray[np.int64], NDArray[Any]]:
        """Which points matter, and of those the pair of parts and the normal between them."""
        part = self._part[geom]
        keep = active & (part >= 0).all(axis=1) & self._matters[part[:, 0], part[:, 1]]
        part = part[keep].astype(np.int64)
        low, high = part.min(axis=1), part.max(axis=1)
        sign = np.where(part[:, :1] <= part[:, 1:], 1.0, -1.0)
        return keep, low * self._count + high, sign * normal[keep]


class _RunningMeans:
    """Means of the force of pairs over the last substeps, across the borders of control periods.

    What presses at the first substep of all has done so before.

    Args:
        count: number of substeps that a mean is over.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self._pairs: NDArray[np.int64] | None = None
        self._before = np.zeros((0, count - 1))

    def largest(self, pairs: NDArray[np.int64], force: NDArray[np.float64]) -> NDArray[np.float64]:
        """The largest mean of each pair that ends in a control period, N (P,).

        Args:
            pairs: their numbers, in order (P,).
            force: at each substep of the period, N (P, S).
        """
        known = pairs if self._pairs is None else np.union1d(pairs, self._pairs)
        own, before = np.searchsorted(known, pairs), self.count - 1
        whole = np.zeros((len(known), before + force.shape[1]))
        whole[own, before:] = force
        if self._pairs is None:
            whole[:, :before] = force[:, :1]
        else:
            whole[np.searchsorted(known, self._pairs), :before] = self._before
        sums = np.zeros((len(own), whole.shape[1] + 1))
        np.cumsum(whole[own], axis=1, out=sums[:, 1:])
        means = (sums[:, self.count :] - sums[:, : -self.count]) / self.count
        self._before = whole[:, force.shape[1] :]
        lasts = self._before.any(axis=1)
        self._pairs, self._before = known[lasts], self._before[lasts]
        # Differences of sums are off by rounding.
        largest: NDArray[np.float64] = means.max(axis=1, initial=0.0)
        return largest


@dataclass(frozen=True)
class _Rows:
    """Contact points between parts.

    Attributes:
        pair: of parts, as a number (N,).
        force: N (N,).
        position: m (N, 3).
        normal: from the pair's first part to its second (N, 3).
        start: the first substep that it is of (N,).
        stop: the first that it is not of any more (N,).
    """

    pair: NDArray[np.int64]
    force: NDArray[np.float64]
    position: NDArray[np.float64]
    normal: NDArray[np.float64]
    start: NDArray[np.int64]
    stop: NDArray[np.int64]

    def and_those_of(self, blocks: list[_Rows]) -> _Rows:
        """These rows, and others after them."""
        if not blocks:
            return self
        columns = zip(*(vars(rows).values() for rows in (self, *blocks)), strict=True)
        return _Rows(*map(np.concatenate, columns))

    def strongest(self, wanted: NDArray[np.bool_], at: int) -> int:
        """Of some, the one that presses most in a substep."""
        there = np.flatnonzero(wanted & (self.start <= at) & (at < self.stop))
        return int(there[self.force[there].argmax()])


def normal_forces(contact: Any, rows: NDArray[np.float64], pyramids: bool) -> NDArray[np.float64]:
    """Normal force of each contact point, N; 0 where it does not press (N,).

    Args:
        contact: MuJoCo's list of N contacts.
        rows: forces of the constraints, ``MjData.efc_force`` (R,).
        pyramids: whether friction cones are pyramids. Of an elliptic cone the first row is the
            normal force; of a pyramid it is the sum of its edges' rows
            (MuJoCo's documentation, Computation, "Friction cones").
    """
    address = contact.efc_address
    active = address >= 0
    first = address[active]
    force = np.zeros(len(address))
    if not pyramids:
        force[active] = rows[first]
        return force
    edges = np.where(contact.dim > 1, 2 * (contact.dim - 1), 1)[active]
    point = np.repeat(np.arange(len(first)), edges)
    begins = np.cumsum(edges) - edges
    row = first[point] + np.arange(len(point)) - begins[point]
    force[active] = np.bincount(point, rows[row], len(first))
    return force
