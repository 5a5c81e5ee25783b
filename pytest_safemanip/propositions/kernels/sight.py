"""Lines of sight from cameras to objects, past boxes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.kernels.solids import body_boxes, farthest, pieces_at
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.distance import Boxes
from pytest_safemanip.trace.geometry import CORNERS, Array, centred, to_local, to_world

Steps = NDArray[np.intp]

SLACK = 1e-3
"""By how much a ball around a box is taken for larger, m: what is left out must be out of it."""
OUTWARD = 0.5
"""How far the points of a box that are looked for are out from its middle to its corners."""


def visible_share(view: View, name: str, steps: Steps) -> NDArray[np.float64]:
    """Share of an object's points that some camera sees, at some steps (K,)."""
    scene, index = view.trace.scene, view.trace.scene.object_index[name]
    body, poses = scene.bodies[index], view.trace.steps.camera_pose[steps]
    local = np.array(body.centre) + OUTWARD * np.vstack((np.zeros(3), CORNERS)) * body.half
    pose = view.trace.steps.object_pose[steps, index]
    points = to_world(pose[:, None], local)  # (K, 9, 3)
    seen = np.zeros(points.shape[:2], bool)
    for number, camera in enumerate(scene.cameras):
        eye = np.asarray(poses[:, number], float)
        there = to_local(eye[:, None], points)
        depth, reach = -there[..., 2], np.tan(camera.fov / 2.0)
        framed = (depth > 0.0) & (np.abs(there[..., 1]) < reach * depth)
        framed &= np.abs(there[..., 0]) < reach * camera.aspect * depth
        step, point = np.nonzero(framed & ~seen)
        if len(step):
            clear = _clear(view, name, steps[step], eye[step, :3], points[step, point])
            seen[step[clear], point[clear]] = True
    return np.asarray(seen.mean(axis=1))


def _clear(view: View, name: str, steps: Steps, eyes: Array, points: Array) -> Bools:
    """Whether nothing is between cameras and points (R,).

    Args:
        view: what is looked at.
        name: whose the points are.
        steps: when each is looked at (R,).
        eyes: where the cameras are (R, 3).
        points: where they look (R, 3).
    """
    clear = np.ones(len(steps), bool)
    half, centre = view.shared(body_boxes)
    for other, body in enumerate(view.trace.scene.bodies):
        if body.entity != name:
            pose = centred(view.trace.steps.object_pose[steps, other], centre[other])
            clear &= ~_blocks(pose, half[other], eyes, points)
    solid, passed = view.trace.scene.solid, _passed(view, eyes, points)
    for number in np.flatnonzero(passed.any(axis=1)).tolist():
        left = np.flatnonzero(clear & passed[number])
        if len(left):
            pose = pieces_at(view, number, steps[left])
            clear[left] = ~_blocks(pose, solid.half[number], eyes[left], points[left])
    return clear


def _passed(view: View, eyes: Array, points: Array) -> Bools:
    """Whether the way between eyes and points (R, 3) meets the ball that each solid piece of
    fixtures and room stays in, wherever a joint moves it: (pieces, R).
    """
    solid = view.trace.scene.solid
    way = points - eyes
    long = np.maximum(np.square(way).sum(axis=1), np.finfo(float).tiny)
    centre = solid.pose[:, None, :3].astype(float)
    along = np.clip(((centre - eyes) * way).sum(axis=-1) / long, 0.0, 1.0)
    apart = np.square(eyes + along[..., None] * way - centre).sum(axis=-1)
    reach = farthest(view) + SLACK
    return np.asarray(apart <= np.square(reach)[:, None])


def _blocks(pose: Array, half: Array, eyes: Array, points: Array) -> Bools:
    """Whether a box, at poses (R, 7), or (1, 7), is between eyes and points (R, 3), neither of
    which is in it (R,).
    """
    boxes = Boxes.of(pose, np.broadcast_to(half, (len(pose), 3)))
    enters, leaves = np.zeros(len(eyes)), np.ones(len(eyes))
    start, way = (eyes.T - boxes.centre), (points - eyes).T
    meets = np.ones(len(eyes), bool)
    for axis in range(3):
        normal, reach = boxes.axes[:, axis], boxes.half[axis]
        here = (start * normal).sum(axis=0)
        along = (way * normal).sum(axis=0)
        flat = np.abs(along) < 1e-12  # it goes along the faces: inside of both or of none
        meets &= ~flat | (np.abs(here) < reach)
        pace = np.where(flat, 1.0, along)
        one, other = (-reach - here) / pace, (reach - here) / pace
        enters = np.where(flat, enters, np.maximum(enters, np.minimum(one, other)))
        leaves = np.where(flat, leaves, np.minimum(leaves, np.maximum(one, other)))
    return meets & (enters < leaves) & (enters > 0.0) & (leaves < 1.0)
