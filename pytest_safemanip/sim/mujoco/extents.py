"""Boxes around the bodies of a model: things, moving parts, hands, solid pieces."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco.parts import PartTable, collides
from pytest_safemanip.trace.elements import Surface, Vector
from pytest_safemanip.trace.geometry import CORNERS, rotate, to_local

Floats = NDArray[np.float64]

UNBOUNDED = 50.0
"""Half extent of a plane that has no end, m."""
PLANE_DEPTH = 0.5
"""Half of how far a plane is solid below its surface, m."""


def moving_box(model: Any, data: Any, body: int) -> tuple[Vector, Vector]:
    """Pose, world frame (7,), and half extents, m (3,), of the box around what collides of a body
    and its descendants, in the body's own axes.
    """
    frame = np.concatenate((data.xpos[body], data.xquat[body]))
    half, centre = local_box(model, data, body)
    place = frame[:3] + rotate(frame[3:], centre)
    return vector(np.concatenate((place, frame[3:]))), vector(half)


def local_box(model: Any, data: Any, body: int) -> tuple[Floats, Floats]:
    """Half extents of that box and its centre in the body's frame, m ((3,) each); zeros if nothing
    of it collides.
    """
    geoms = np.flatnonzero(collides(model) & below(model, body)[model.geom_bodyid])
    return box_around(model, data, np.concatenate((data.xpos[body], data.xquat[body])), geoms)


def box_around(model: Any, data: Any, frame: Floats, geoms: Iterable[int]) -> tuple[Floats, Floats]:
    """Half extents and centre of the box around geoms in the axes of a frame, m ((3,) each).

    Args:
        model: a ``mujoco.MjModel``.
        data: its kinematics.
        frame: a pose (7,), world frame.
        geoms: which; zeros if there are none.
    """
    corners = [to_local(frame, _geom_corners(model, data, geom)) for geom in geoms]
    if not corners:
        return np.zeros(3), np.zeros(3)
    points = np.concatenate(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    return (high - low) / 2, (high + low) / 2


def below(model: Any, ancestor: int) -> NDArray[np.bool_]:
    """Whether each body is this one or moves with it (nbody,)."""
    found = [False] * model.nbody
    found[ancestor] = True
    parents = model.body_parentid.tolist()
    for body in range(ancestor + 1, model.nbody):  # MuJoCo numbers parents before children
        found[body] = found[parents[body]]
    return np.array(found)


def surfaces(model: Any, data: Any, table: PartTable, owners: Collection[str]) -> list[Surface]:
    """The solid pieces of fixtures and room.

    Args:
        model: a ``mujoco.MjModel``.
        data: its kinematics with everything closed.
        table: which geom is whose.
        owners: the fixtures and the room.
    """
    found = []
    for geom in np.flatnonzero(table.of_geom >= 0):
        part = table.parts[table.of_geom[geom]]
        if part.entity not in owners:
            continue
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, data.geom_xmat[geom])
        centre, half = _solid(model, geom)
        place = data.geom_xpos[geom] + rotate(quat, centre)
        pose = np.concatenate((place, quat))
        found.append(Surface(part.entity, part.joint, vector(half), vector(pose)))
    return found


def vector(values: Any) -> Vector:
    """Plain floats, rounded to what is written into a recording's header."""
    return tuple(round(float(v), 9) for v in values)


def _solid(model: Any, geom: int) -> tuple[Floats, Floats]:
    """Centre and half extents of the box around a geom, in its own frame, m ((3,) each)."""
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_PLANE:
        return model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    sides = np.where(model.geom_size[geom, :2] > 0.0, model.geom_size[geom, :2], UNBOUNDED)
    return np.array((0.0, 0.0, -PLANE_DEPTH)), np.array((*sides, PLANE_DEPTH))


def _geom_corners(model: Any, data: Any, geom: int) -> Floats:
    centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    matrix = data.geom_xmat[geom].reshape(3, 3)
    corners: Floats = (centre + CORNERS * half) @ matrix.T + data.geom_xpos[geom]
    return corners
