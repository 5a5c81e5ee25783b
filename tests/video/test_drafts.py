"""Drafts of the real scene: quicker, and not to be told from the pictures of policies by eye."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.robocasa.rendering.light_meshes import lighten
from pytest_safemanip.sim.robocasa.rendering.thinning import COARSEST, KEPT_WHOLE, thin_meshes
from pytest_safemanip.video.imaging import open_studio
from tests.sim.rendering.test_observing import require


def ball(rings: int) -> mujoco.MjModel:
    """A sphere of many faces, and a cube."""
    around, up = np.meshgrid(
        np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False), np.linspace(0.01, np.pi - 0.01, rings)
    )
    points = 0.1 * np.stack(
        [np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=-1
    )
    spec = mujoco.MjSpec()
    n = 2 * rings
    quads = [
        (r * n + c, (r + 1) * n + c, (r + 1) * n + (c + 1) % n, r * n + (c + 1) % n)
        for r in range(rings - 1)
        for c in range(n)
    ]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    spec.add_mesh(name="ball", uservert=points.ravel(), userface=np.array(faces).ravel())
    spec.add_mesh(name="cube", uservert=CUBE)
    for mesh in ("ball", "cube"):
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh)
    return spec.compile()


CUBE = [x for n in range(8) for x in (0.1 * (n & 1), 0.05 * (n & 2), 0.025 * (n & 4))]


def test_fine_meshes_get_coarser_and_stay_where_they_are() -> None:
    model = ball(60)
    first, number = int(model.mesh_faceadr[0]), int(model.mesh_facenum[0])
    cube = model.mesh_face[model.mesh_faceadr[1] :].copy()
    assert number > 4 * KEPT_WHOLE
    thin_meshes(model)
    left = int(model.mesh_facenum[0])
    assert 100 < left <= KEPT_WHOLE
    faces = model.mesh_face[first : first + left]
    corners = model.mesh_vert[faces]  # the ball's come first
    assert (np.abs(np.linalg.norm(corners, axis=-1) - 0.1) < 1e-3).all()
    assert (np.diff(np.sort(faces, axis=1), axis=1) > 0).all(), "no face without an area"
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert 0.9 < area.sum() / 2 / (4 * np.pi * 0.1**2) < 1.02, "no hole in it"
    np.testing.assert_array_equal(model.mesh_face[model.mesh_faceadr[1] :], cube)


def obj_file(path: Path, rings: int) -> Path:
    """The sphere as a file, coloured by a texture, off the origin."""
    model = ball(rings)
    count = int(model.mesh_vertnum[0])
    corners = model.mesh_vert[:count]
    lines = [f"v {x + 1:.9f} {y:.9f} {z:.9f}" for x, y, z in corners]
    lines += [f"vt {0.5 + 4 * y:.6f} {0.5 + 4 * z:.6f}" for _, y, z in corners]
    faces = model.mesh_face[: model.mesh_facenum[0]] + 1
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in faces]
    path.write_text("\n".join(lines))
    return path


def test_large_files_of_meshes_are_thinned_once_and_stay_where_they_are(tmp_path: Path) -> None:
    path = obj_file(tmp_path / "ball.obj", 60)
    geom = '<geom type="mesh" mesh="ball" pos="0 0 1" quat="1 1 0 0"/>'
    xml = f'''<mujoco><asset><mesh name="ball" file="{path}" scale="2 1 -1"/></asset>
        <worldbody>{geom}</worldbody></mujoco>'''
    cache = tmp_path / "cache"
    light = lighten(xml, cache)
    (kept,) = cache.iterdir()
    before, after = (mujoco.MjModel.from_xml_string(text) for text in (xml, light))
    assert before.mesh_facenum[0] > 4 * after.mesh_facenum[0]
    for axis in range(3):
        for end in (np.min, np.max):
            assert end(placed(before)[:, axis]) == pytest.approx(
                end(placed(after)[:, axis]), abs=0.01
            )
    places = placed(after)[after.mesh_face.ravel()]
    np.testing.assert_allclose(
        after.mesh_texcoord[after.mesh_facetexcoord.ravel()],
        np.stack([0.5 + 4 * (places[:, 2] - 1), 0.5 - 4 * places[:, 1]], axis=1),
        atol=4 * COARSEST,
    )
    written = kept.stat().st_mtime_ns
    assert lighten(xml, cache) == light
    assert kept.stat().st_mtime_ns == written


def placed(model: mujoco.MjModel) -> NDArray[np.float64]:
    """The corners of the only geom's mesh, in the world (V, 3)."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return np.asarray(model.mesh_vert @ data.geom_xmat[0].reshape(3, 3).T + data.geom_xpos[0])


def test_a_draft_looks_like_the_picture_and_what_did_not_move_is_not_drawn_again() -> None:
    require("osmesa")
    request = Request("OpenDrawer", 0, "compact", kitchen="small")
    views = {}
    for draft in (False, True):
        studio = open_studio("primitive", 64, draft)
        with studio.visit(request) as shot:
            start = shot._data.qpos.copy()
            views[draft] = {camera: shot.take(camera) for camera in ("room", "close", "wrist")}
            arm = start.copy()
            arm[shot._model.joint("robot0_joint2").qposadr] += 0.2
            shot.pose(arm)
            same = [shot.take(camera) is views[draft][camera] for camera in views[draft]]
            # The near view is without the robot.
            assert same == [False, draft, False]
            shot.pose(start)
            for camera, picture in views[draft].items():
                np.testing.assert_array_equal(shot.take(camera), picture)
            shot._model.geom_group[shot._robot] = 5  # not drawn
            bare = {camera: shot._draw(camera) for camera in views[draft]}
        studio.close()
    for camera in ("room", "wrist"):
        off = np.abs(coarse(views[False][camera]) - coarse(views[True][camera]))
        gone = np.abs(coarse(views[False][camera]) - coarse(bare[camera]))
        assert off.mean() < gone.mean() / 2, f"{camera}: as different as without the robot"


def coarse(picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Without the edges, which antialiasing changes."""
    return np.asarray(picture.reshape(8, 8, 8, 8, 3).mean(axis=(1, 3)))
