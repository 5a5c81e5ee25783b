"""How near what moves with a robot is to everything else, by MuJoCo's own shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_EVERYWHERE = 1e3
_JOGS = 1e-4 * np.array([(0, 0, 0), (1, 0.6, 0.3), (-0.4, 1, 0.6), (0.5, -0.7, 1), (-1, -0.5, 0.2)])
"""Where a geom is set for MuJoCo to answer, m: 0, which it says of one in ten meshes beside a large
box that is apart from it, means that it failed; libccd does not, but invents depths of 10 cm."""


@dataclass(frozen=True)
class Near:
    """Two geoms that are near each other.

    Attributes:
        own: id of the one that moves.
        other: id of the other one.
        distance: between them, below 0 how deep they overlap, m.
        place: middle of the line between their nearest points (3,).
    """

    own: int
    other: int
    distance: float
    place: Floats


class Proximity:
    """Distances of some geoms from others that stand still meanwhile.

    Args:
        model: a ``mujoco.MjModel``.
        data: ``MjData`` with kinematics up to date.
        own: ids of the geoms that move (K,).
        others: ids of those that do not (W,).
        reach: distance within which they matter, m.
    """

    def __init__(
        self,
        model: Any,
        data: Any,
        own: NDArray[np.intp],
        others: NDArray[np.intp],
        reach: float,
    ) -> None:
        self._model, self._data, self._reach = model, data, reach
        self._own, self._others = own, others
        con, aff = model.geom_contype, model.geom_conaffinity
        meet = (con[own][:, None] & aff[others]) | (con[others] & aff[own][:, None])
        self._counts = meet != 0
        low, high = self._around(others)
        self._low, self._high = low - reach, high + reach
        self._line = np.empty(6)

    def permit(self, permitted: NDArray[np.bool_]) -> None:
        """Leave pairs out from now on (K, W)."""
        self._counts &= ~permitted

    def near(self) -> list[Near]:
        """The pairs that are near each other now."""
        low, high = self._around(self._own)
        apart = (low[:, None] > self._high).any(axis=2) | (high[:, None] < self._low).any(axis=2)
        found = []
        for i, j in np.argwhere(self._counts & ~apart).tolist():
            own, other = int(self._own[i]), int(self._others[j])
            distance = self._distance(own, other)
            if distance < self._reach:
                place = 0.5 * (self._line[:3] + self._line[3:])
                found.append(Near(own, other, distance, place))
        return found

    def _distance(self, own: int, other: int) -> float:
        data, where = self._data, self._data.geom_xpos[own]
        kept = where.copy()
        for jog in _JOGS:
            where[:] = kept + jog
            known = self._model, data, own, other, self._reach, self._line
            distance = float(mujoco.mj_geomDistance(*known))
            if distance != 0.0:
                break
        where[:] = kept
        return distance

    def _around(self, geoms: NDArray[np.intp]) -> tuple[Floats, Floats]:
        """Boxes around geoms along the world's axes: least and greatest coordinates (N, 3)."""
        model, data = self._model, self._data
        frames = data.geom_xmat[geoms].reshape(-1, 3, 3)
        box = model.geom_aabb[geoms]
        half = np.einsum("nij,nj->ni", np.abs(frames), box[:, 3:])
        half[model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_PLANE] = _EVERYWHERE
        middle = data.geom_xpos[geoms] + np.einsum("nij,nj->ni", frames, box[:, :3])
        return middle - half, middle + half
