"""The visible geoms of a recording's scene as meshes, moved by its joint positions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.looks import Look, simplified
from pytest_safemanip.sim.mujoco.drawing import VISUAL_GROUP
from pytest_safemanip.sim.robocasa import environment, loading
from pytest_safemanip.sim.robocasa.assets import Mode, prepare_assets
from pytest_safemanip.sim.robocasa.description import open_reader
from pytest_safemanip.sim.robocasa.parts import is_robot
from pytest_safemanip.sim.robocasa.rendering.studio import check_scene
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import CORNERS
from pytest_safemanip.trace.recording import Recording

MOST_TRIANGLES = 16_000
LEAST_ALPHA = 0.3
"""What is more transparent is left out: it is glass, or marks a region."""
AROUND, RINGS = 16, 8
"""Points of round geoms: around their axis, and along it."""

Floats = NDArray[np.float64]
Mesh = tuple[Floats, NDArray[np.int64]]


def read_looks(request: Request, recording: Recording, assets: Mode) -> list[Look]:
    """What the things of a recording look like; a process loads one set of assets only.

    Args:
        request: which episode the recording is of.
        recording: the rollout.
        assets: ``auto``, ``official`` or ``primitive``.

    Raises:
        ConfigError: if RoboCasa is not installed, or its scene is not that of the recording.
    """
    root = prepare_assets(loading.package_assets(), assets).root
    loading.load(root)
    env = environment.make(request, root)
    check_scene(open_reader(env).description.scene, recording.scene)
    model = env.sim.model._model
    data = mujoco.MjData(model)
    data.qpos[:] = recording.steps.qpos[0]
    mujoco.mj_kinematics(model, data)
    groups: dict[tuple[str, int, tuple[float, float, float]], list[Mesh]] = {}
    for geom, entity in _visible(model, _owners(model, env)):
        frame = int(model.body_weldid[model.geom_bodyid[geom]])
        key = (entity, frame, _colour(model, geom))
        groups.setdefault(key, []).append(_in_frame(model, data, geom, frame))
    meshes = simplified([_joined(own) for own in groups.values()], MOST_TRIANGLES)
    poses = _poses(model, data, recording, sorted({frame for _, frame, _ in groups}))
    return [
        Look(entity, colour, points, triangles, poses[frame])
        for (entity, frame, colour), (points, triangles) in zip(groups, meshes, strict=True)
        if len(triangles)
    ]


def _owners(model: Any, env: Any) -> Mapping[int, str]:
    """Entities by their root body."""
    bodies = {name: model.body(f.root_body).id for name, f in env.fixtures.items()}
    bodies |= {name: int(body) for name, body in env.obj_body_id.items()}
    owners = {int(model.body_rootid[body]): name for name, body in bodies.items()}
    roots = {int(root) for root in model.body_rootid}
    return owners | {root: ROBOT for root in roots if is_robot(model.body(root).name)}


def _visible(model: Any, owners: Mapping[int, str]) -> Iterator[tuple[int, str]]:
    """Geoms that are drawn, with whose they are."""
    for geom in range(model.ngeom):
        entity = owners.get(int(model.body_rootid[model.geom_bodyid[geom]]))
        material = int(model.geom_matid[geom])
        alpha = model.mat_rgba[material, 3] if material >= 0 else model.geom_rgba[geom, 3]
        if entity and model.geom_group[geom] == VISUAL_GROUP and alpha >= LEAST_ALPHA:
            yield geom, entity


def _colour(model: Any, geom: int) -> tuple[float, float, float]:
    """Of a geom; with a texture, in the mean."""
    material = int(model.geom_matid[geom])
    colour = np.array(model.geom_rgba[geom, :3], float)
    if material >= 0:
        colour = np.array(model.mat_rgba[material, :3], float)
        texture = int(model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB])
        if texture >= 0:
            channels = int(model.tex_nchannel[texture])
            size = int(model.tex_height[texture]) * int(model.tex_width[texture]) * channels
            begin = int(model.tex_adr[texture])
            pixels = model.tex_data[begin : begin + size].reshape(-1, channels)[:, :3]
            colour *= pixels.mean(axis=0) / 255.0
    red, green, blue = np.round(colour, 2).tolist()
    return red, green, blue


def _poses(model: Any, data: Any, recording: Recording, frames: list[int]) -> dict[int, Floats]:
    """Poses of bodies over the steps (T, 7), by body."""
    steps = recording.steps
    found = {frame: np.empty((len(steps), 7)) for frame in frames}
    for step in range(len(steps)):
        data.qpos[:] = steps.qpos[step]
        mujoco.mj_kinematics(model, data)
        for frame, poses in found.items():
            poses[step, :3], poses[step, 3:] = data.xpos[frame], data.xquat[frame]
    return found


def _in_frame(model: Any, data: Any, geom: int, frame: int) -> Mesh:
    """A geom's mesh in the frame of a body that it is fixed to."""
    points, triangles = _mesh(model, geom)
    world = points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    return (world - data.xpos[frame]) @ data.xmat[frame].reshape(3, 3), triangles


def _joined(meshes: list[Mesh]) -> Mesh:
    begins = np.cumsum([0, *(len(points) for points, _ in meshes)])[:-1]
    triangles = [t + begin for (_, t), begin in zip(meshes, begins, strict=True)]
    return np.concatenate([points for points, _ in meshes]), np.concatenate(triangles)


def _mesh(model: Any, geom: int) -> Mesh:
    """A geom's mesh in its own frame; empty of planes and the like."""
    kind, size = int(model.geom_type[geom]), np.array(model.geom_size[geom], float)
    types = mujoco.mjtGeom
    if kind == types.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        triangles = model.mesh_face[face : face + faces].astype(np.int64)
        return model.mesh_vert[first : first + count].astype(float), triangles
    if kind == types.mjGEOM_BOX:
        return CORNERS * size, _BOX
    if kind in (types.mjGEOM_SPHERE, types.mjGEOM_ELLIPSOID):
        half = np.full(3, size[0]) if kind == types.mjGEOM_SPHERE else size
        angles = np.linspace(0.0, np.pi, RINGS + 1)
        return _lathe(np.sin(angles), -np.cos(angles), half)
    if kind == types.mjGEOM_CYLINDER:
        profile = np.array((0.0, 1.0, 1.0, 0.0)), np.array((-1.0, -1.0, 1.0, 1.0))
        return _lathe(*profile, np.array((size[0], size[0], size[1])))
    if kind == types.mjGEOM_CAPSULE:
        angles = np.linspace(0.0, np.pi, RINGS + 2)
        ends = np.where(angles < np.pi / 2, -size[1], size[1])
        radii, heights = size[0] * np.sin(angles), ends - size[0] * np.cos(angles)
        return _lathe(radii, heights, np.ones(3))
    return np.zeros((0, 3)), np.zeros((0, 3), np.int64)


_BOX = np.array(
    [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]
)  # fmt: skip
"""Triangles of the eight corners of a box, counter-clockwise from outside."""


def _lathe(radii: Floats, heights: Floats, half: Floats) -> Mesh:
    """A profile, from below upwards, turned about the z axis and stretched."""
    turn = np.arange(AROUND) * 2.0 * np.pi / AROUND
    ring = np.stack((np.cos(turn), np.sin(turn)), axis=1)
    points = np.concatenate(
        [
            np.column_stack((radius * ring, np.full(AROUND, height)))
            for radius, height in zip(radii, heights, strict=True)
        ]
    )
    here = np.arange(AROUND)
    after = (here + 1) % AROUND
    rows = AROUND * np.arange(len(radii) - 1)[:, None]
    low, low_after = rows + here, rows + after
    high, high_after = low + AROUND, low_after + AROUND
    one = np.stack((low, low_after, high_after), axis=-1).reshape(-1, 3)
    other = np.stack((low, high_after, high), axis=-1).reshape(-1, 3)
    return points * half, np.concatenate((one, other)).astype(np.int64)
