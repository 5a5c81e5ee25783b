"""Boxes around the things of a kitchen: interiors, handles, moving parts, solid pieces."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.robocasa.parts import PartTable
from pytest_safemanip.trace.elements import Box, Surface, Vector
from pytest_safemanip.trace.geometry import CORNERS, rotate, to_local

LEAST_INTERIOR = 0.005
"""Half extent below which a region is no space that holds anything, m."""


def moving_box(model: Any, data: Any, body: int) -> tuple[Vector, Vector]:
    """Oriented box around the colliding geoms of a body and its descendants, in its own axes."""
    frame = np.concatenate((data.xpos[body], data.xquat[body]))
    collides = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    geoms = np.flatnonzero(collides & _below(model, body)[model.geom_bodyid])
    corners = [to_local(frame, _geom_corners(model, data, geom)) for geom in geoms]
    if not corners:
        return vector(frame), (0.0, 0.0, 0.0)
    points = np.concatenate(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    centre = frame[:3] + rotate(frame[3:], (low + high) / 2)
    return vector(np.concatenate((centre, frame[3:]))), vector((high - low) / 2)


def _below(model: Any, ancestor: int) -> NDArray[np.bool_]:
    """Whether each body is this one or moves with it (nbody,)."""
    below = [False] * model.nbody
    below[ancestor] = True
    parents = model.body_parentid.tolist()
    for body in range(ancestor + 1, model.nbody):  # MuJoCo numbers parents before children
        below[body] = below[parents[body]]
    return np.array(below)


def _geom_corners(model: Any, data: Any, geom: int) -> NDArray[np.float64]:
    centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    matrix = data.geom_xmat[geom].reshape(3, 3)
    corners: NDArray[np.float64] = (centre + CORNERS * half) @ matrix.T + data.geom_xpos[geom]
    return corners


def boxes(model: Any, env: Any, fixtures: list[str]) -> list[tuple[Box, int]]:
    """Interiors, handles and controls of the fixtures that play a role in the task."""
    boxes = []
    for name in fixtures:
        fixture = env.fixtures[name]
        for region in fixture.get_reset_region_names():
            geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, f"{name}_reg_{region}")
            # A counter's interior is a point: there is none.
            if geom >= 0 and min(_half(model, geom)) > LEAST_INTERIOR:
                boxes.append((Box(name, region, "interior", _half(model, geom)), geom))
        root = int(model.body_rootid[model.body(fixture.root_body).id])
        for geom in range(model.ngeom):
            body = int(model.geom_bodyid[geom])
            local = model.geom(geom).name.removeprefix(f"{name}_")
            if model.body_rootid[body] != root or model.geom_contype[geom] == 0:
                continue
            if local.endswith(("handle_handle", "handle_main")):
                boxes.append((Box(name, local, "handle", _half(model, geom)), geom))
            elif local.endswith(("button", "knob_main", "lever_handle")):
                boxes.append((Box(name, local, "control", _half(model, geom)), geom))
    return boxes


def _half(model: Any, geom: int) -> Vector:
    size = model.geom_size[geom]
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return vector((size[0], size[0], size[1]))
    return vector(size)


def gripper_box(model: Any, data: Any, eef_site: str) -> tuple[Vector, Vector]:
    """Box around hand and fingers in the end effector's frame, whatever the fingers' opening."""
    site = model.site(eef_site).id
    matrix = data.site_xmat[site].reshape(3, 3)
    corners = [
        (_geom_corners(model, data, geom) - data.site_xpos[site]) @ matrix
        for geom in range(model.ngeom)
        if model.geom(geom).name.startswith("gripper0_right_") and model.geom_contype[geom]
    ]
    points = np.concatenate(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    return vector((high - low) / 2), vector((high + low) / 2)


def surfaces(model: Any, data: Any, table: PartTable, owners: set[str]) -> list[Surface]:
    """The solid pieces of fixtures and room.

    Args:
        model: a ``mujoco.MjModel``.
        data: its kinematics with everything closed.
        table: which geom is whose.
        owners: the fixtures and the room.
    """
    surfaces = []
    for geom in np.flatnonzero(table.of_geom >= 0):
        part = table.parts[table.of_geom[geom]]
        if part.entity not in owners:
            continue
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, data.geom_xmat[geom])
        centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
        place = data.geom_xpos[geom] + rotate(quat, centre)
        pose = np.concatenate((place, quat))
        surfaces.append(Surface(part.entity, part.joint, vector(half), vector(pose)))
    return surfaces


def vector(values: Any) -> Vector:
    """Plain floats, rounded to what is written into a recording's header."""
    return tuple(round(float(v), 9) for v in values)
