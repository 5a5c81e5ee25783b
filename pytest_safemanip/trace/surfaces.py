"""The solid pieces of a scene as arrays: there are hundreds, and most are never read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.trace.elements import Surface

Floats = NDArray[np.float64]


class Surfaces(Sequence[Surface]):
    """Surfaces, one after the other or all at once.

    Args:
        entities: whose they are (S,).
        joints: keys of the joints that move them, empty if none does (S,).
        half: half extents (S, 3), m.
        pose: centres at openness 0, world frame (S, 7).

    Raises:
        ValueError: if there are not as many of each.
    """

    def __init__(
        self, entities: Sequence[str], joints: Sequence[str], half: Floats, pose: Floats
    ) -> None:
        size = len(entities)
        if len(joints) != size or half.shape != (size, 3) or pose.shape != (size, 7):
            raise ValueError(
                f"{size} entities, {len(joints)} joints, half {half.shape}, pose {pose.shape}"
            )
        self.entities, self.joints = tuple(entities), tuple(joints)
        self.half, self.pose = half, pose

    @classmethod
    def of(cls, surfaces: Iterable[Surface]) -> Surfaces:
        """These surfaces."""
        if isinstance(surfaces, Surfaces):
            return surfaces
        items = tuple(surfaces)
        half, pose = (
            np.array([getattr(s, name) for s in items], float).reshape(-1, size)
            for name, size in (("half", 3), ("pose", 7))
        )
        return cls([s.entity for s in items], [s.joint for s in items], half, pose)

    def __len__(self) -> int:
        return len(self.entities)

    @overload
    def __getitem__(self, index: int) -> Surface: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Surface, ...]: ...

    def __getitem__(self, index: int | slice) -> Surface | tuple[Surface, ...]:
        if isinstance(index, slice):
            return tuple(self[i] for i in range(*index.indices(len(self))))
        half, pose = self.half[index].tolist(), self.pose[index].tolist()
        return Surface(self.entities[index], self.joints[index], tuple(half), tuple(pose))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and tuple(self) == tuple(other)

    __hash__ = None  # type: ignore[assignment]

    def columns(self) -> dict[str, Any]:
        """The fields, each with its values; see :func:`~.elements.columns`."""
        return {
            "entity": self.entities,
            "joint": self.joints,
            "half": self.half,
            "pose": self.pose,
        }
