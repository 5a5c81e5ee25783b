"""Contacts at every physics substep: a knock between two control steps is seen."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco.parts import PartTable
from pytest_safemanip.sim.mujoco.sleeping import NO_POINTS, Asleep, Points
from pytest_safemanip.trace.steps import SUSTAINED, Contacts


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
        self._part = table.of_geom
        self._pair, self._sign = _pairs(table)
        self._count = len(table.parts)
        self._asleep = asleep or Asleep(model)
        self._listed = _Listed(model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL)
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
        # Copies: the next substep overwrites them. What they mean waits until the step's end.
        self._listed.add(data)

    def take(self) -> Contacts:
        """The contacts of the control period; starts the next one."""
        carried, self._carried = self._carried, []
        if not carried:
            return Contacts.empty()
        listed = self._listed.take()
        still = not len(listed[1]) and all(points is carried[0] for points in carried)
        rested = self._rests[1] if still and self._rests[0] is carried[0] else 0
        self._rests = (carried[0], rested + len(carried)) if still else (None, 0)
        if rested < self._means.count:
            self._still = None, Contacts.empty()
            return self._contacts(*listed, carried)
        if carried[0] is not self._still[0]:
            self._still = carried[0], self._contacts(*listed, carried)
        return self._still[1]

    def _contacts(self, points: Points, sub: NDArray[Any], carried: list[Points]) -> Contacts:
        """The contacts of points that MuJoCo listed, each at a substep (N,), and of what slept at
        each substep.
        """
        sampled, end = self._sampled(points, sub), len(carried)
        held = self._held(carried)
        rows = sampled.and_those_of(held)
        unique, member = np.unique(rows.pair, return_inverse=True)
        count = len(sampled.force)
        cell = member[:count] * end + sampled.start
        total = np.bincount(cell, sampled.force, len(unique) * end).reshape(-1, end).astype(float)
        for block in held:
            own, count = slice(count, count + len(block.force)), count + len(block.force)
            pressing = np.bincount(member[own], block.force, len(unique))
            total[:, block.start[0] : block.stop[0]] += pressing[:, None]
        sustained = self._means.largest(unique, total)
        last = (rows.stop == end) & (rows.force > 0)
        chosen = np.flatnonzero(last)
        gone = total.max(axis=1, initial=0.0) > 0
        gone[member[chosen]] = False
        if gone.any():
            most = total.argmax(axis=1)
            brief = [rows.strongest(member == pair, most[pair]) for pair in np.flatnonzero(gone)]
            chosen = np.append(chosen, np.array(brief, np.intp))
        chosen = chosen[np.argsort(member[chosen], kind="stable")]
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

    def _sampled(self, points: Points, sub: NDArray[Any]) -> _Rows:
        """What MuJoCo listed, a row for each point and substep."""
        keep, pair, normal = self._meaning(points.geom, points.active, points.normal)
        sub = sub[keep]
        return _Rows(pair, points.force[keep], points.position[keep], normal, sub, sub + 1)

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
    ) -> tuple[NDArray[np.intp], NDArray[np.int64], NDArray[Any]]:
        """Which points matter, and of those the pair of parts and the normal between them."""
        one, other = self._part[geom].T
        pair = self._pair[one, other]
        keep = np.flatnonzero(active & (pair >= 0))
        return keep, pair[keep], self._sign[one[keep], other[keep], None] * normal[keep]


def _pairs(table: PartTable) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The number of each pair of parts, -1 for those that do not matter, and the sign that turns a
    normal from the first to the second into one from the lower to the higher ((P + 1, P + 1)
    each: index -1 is a geom that is no part).
    """
    count = len(table.parts)
    one, other = np.indices((count, count))
    pair = np.full((count + 1, count + 1), -1)
    low, high = np.minimum(one, other), np.maximum(one, other)
    pair[:count, :count] = np.where(table.matters, low * count + high, -1)
    sign = np.ones((count + 1, count + 1))
    sign[:count, :count] = np.where(one <= other, 1.0, -1.0)
    return pair, sign


class _Listed:
    """The contacts that MuJoCo listed at the substeps of a control period.

    Args:
        pyramids: see :func:`normal_forces`.
    """

    def __init__(self, pyramids: bool) -> None:
        self._pyramids = pyramids
        self._counts: list[int] = []
        self._forces: list[NDArray[np.float64]] = []
        self._size = 0
        self._geom, self._address, self._dim = (
            np.zeros((256, *width), np.int32) for width in ((2,), (), ())
        )
        self._position, self._normal = np.zeros((2, 256, 3))

    def add(self, data: Any) -> None:
        """Copy those of the substep that just ran."""
        count, start = data.ncon, self._size
        self._counts.append(count)
        if not count:
            return
        self._size = stop = start + count
        while stop > len(self._geom):
            self._grow()
        contact = data.contact
        self._geom[start:stop] = contact.geom
        self._position[start:stop] = contact.pos
        self._normal[start:stop] = contact.frame[:, :3]
        self._address[start:stop] = contact.efc_address
        if self._pyramids:
            self._dim[start:stop] = contact.dim
        self._forces.append(data.efc_force.copy())

    def take(self) -> tuple[Points, NDArray[np.int64]]:
        """All of them, and the substep that each is of (N,); begins again."""
        size, counts, forces = self._size, self._counts, self._forces
        self._size, self._counts, self._forces = 0, [], []
        sub = np.repeat(np.arange(len(counts)), counts)
        address = self._address[:size]
        active = address >= 0
        if not forces:
            return NO_POINTS, sub
        begins = np.cumsum([0, *map(len, forces)])[:-1]
        first = address + np.repeat(begins, [count for count in counts if count])
        force = np.zeros(size)
        force[active] = normal_forces(
            first[active], self._dim[:size][active], np.concatenate(forces), self._pyramids
        )
        return Points(
            self._geom[:size], active, force, self._position[:size], self._normal[:size]
        ), sub

    def _grow(self) -> None:
        for name in ("_geom", "_position", "_normal", "_address", "_dim"):
            setattr(self, name, np.concatenate((getattr(self, name),) * 2))


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
        if self._pairs is not None and np.array_equal(pairs, self._pairs):
            return self._of(np.concatenate((self._before, force), axis=1), pairs, force.shape[1])
        known = pairs if self._pairs is None else np.union1d(pairs, self._pairs)
        own, before = np.searchsorted(known, pairs), self.count - 1
        whole = np.zeros((len(known), before + force.shape[1]))
        whole[own, before:] = force
        if self._pairs is None:
            whole[:, :before] = force[:, :1]
        else:
            whole[np.searchsorted(known, self._pairs), :before] = self._before
        return self._of(whole, known, force.shape[1])[own]

    def _of(
        self, whole: NDArray[np.float64], pairs: NDArray[np.int64], substeps: int
    ) -> NDArray[np.float64]:
        """The largest mean of each pair, from its force at the last substeps of the periods before
        and at those of this one (P, count - 1 + substeps).
        """
        sums = np.zeros((len(whole), whole.shape[1] + 1))
        np.cumsum(whole, axis=1, out=sums[:, 1:])
        means = (sums[:, self.count :] - sums[:, : -self.count]) / self.count
        self._before = whole[:, substeps:]
        lasts = self._before.any(axis=1)
        self._pairs, self._before = pairs[lasts], self._before[lasts]
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


def normal_forces(
    address: NDArray[Any], dim: NDArray[Any], rows: NDArray[np.float64], pyramids: bool
) -> NDArray[np.float64]:
    """Normal force of contact points that press, N (N,).

    Args:
        address: of the first constraint row of each (N,).
        dim: of each, 1 without friction (N,).
        rows: forces of the constraints, ``MjData.efc_force`` (R,).
        pyramids: whether friction cones are pyramids. Of an elliptic cone the first row is the
            normal force; of a pyramid it is the sum of its edges' rows
            (MuJoCo's documentation, Computation, "Friction cones").
    """
    if not pyramids:
        found: NDArray[np.float64] = rows[address]
        return found
    edges = np.where(dim > 1, 2 * (dim - 1), 1)
    point = np.repeat(np.arange(len(address)), edges)
    begins = np.cumsum(edges) - edges
    row = address[point] + np.arange(len(point)) - begins[point]
    return np.bincount(point, rows[row], len(address)).astype(np.float64)
