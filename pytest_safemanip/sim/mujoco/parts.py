"""Maps MuJoCo's geoms to entities and their parts."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.trace.elements import Part

NO_PART = -1

NamePart = Callable[[int], tuple[Part, bool] | None]
"""Given a geom that collides: its part, and whether that can move; None if it is no entity's."""


@dataclass(frozen=True)
class PartTable:
    """Which part each geom belongs to.

    Attributes:
        parts: the scene's contact vocabulary.
        of_geom: part index of each geom, -1 for geoms that are no entity's (ngeom,).
        matters: whether a contact between two parts is recorded (P, P): not within an entity,
            and not between two things that cannot move.
    """

    parts: tuple[Part, ...]
    of_geom: NDArray[np.int32]
    matters: NDArray[np.bool_]


def build(model: Any, name_part: NamePart) -> PartTable:
    """Make the table.

    Args:
        model: a ``mujoco.MjModel``.
        name_part: names the parts of this kind of model.
    """
    index: dict[Part, int] = {}
    mobile: list[bool] = []
    of_geom = np.full(model.ngeom, NO_PART, np.int32)
    for geom in np.flatnonzero(collides(model)).tolist():
        named = name_part(geom)
        if named is None:
            continue
        part, moves = named
        if part not in index:
            index[part] = len(index)
            mobile.append(moves)
        of_geom[geom] = index[part]
    parts = tuple(index)
    entities = np.array([p.entity for p in parts])
    moving = np.array(mobile, bool)
    matters = (entities[:, None] != entities[None, :]) & (moving[:, None] | moving[None, :])
    return PartTable(parts, of_geom, matters)


def collides(model: Any) -> NDArray[np.bool_]:
    """Whether each geom can touch anything (ngeom,)."""
    found: NDArray[np.bool_] = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return found


def joint_of_body(model: Any, body: int, among: Collection[int] | None = None) -> int:
    """The hinge or slide joint that moves a body relative to its entity, or -1.

    Of several joints on one body the last counts: it is the one that is used (the faucet's
    on/off after its temperature).

    Args:
        model: a ``mujoco.MjModel``.
        body: its id.
        among: the joints that count, by id; None for all.
    """
    while body > 0:
        count, first = int(model.body_jntnum[body]), int(model.body_jntadr[body])
        for joint in range(first + count - 1, first - 1, -1):
            if model.jnt_type[joint] in (
                mujoco.mjtJoint.mjJNT_HINGE,
                mujoco.mjtJoint.mjJNT_SLIDE,
            ) and (among is None or joint in among):
                return joint
        body = int(model.body_parentid[body])
    return -1
