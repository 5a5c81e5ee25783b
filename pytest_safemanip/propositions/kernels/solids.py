"""Solid boxes of the scene at a step, to find what is below or around an object."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.geometry import Array, corners
from pytest_safemanip.trace.kinematics import slid, swung
from pytest_safemanip.trace.scene import Scene

Places = int | NDArray[np.intp]


class Solids(NamedTuple):
    """Solid things, where they are at a step.

    Attributes:
        owners: whose they are (K,).
        boxes: their corners (K, 8, 3).
        numbers: of surfaces; of objects their own, from -1 down (K,).
    """

    owners: list[str]
    boxes: Array
    numbers: list[int]


def solids(
    view: View,
    name: str,
    step: int,
    near: tuple[Array, float],
    only: Collection[str] | None = None,
) -> Solids:
    """Everything solid but one object and the robot.

    Args:
        view: what is looked at.
        name: the object that is left out.
        step: when.
        near: a place (x, y, ...) and metres: what is further away to the side may be left out.
        only: entities to keep; None keeps all.
    """
    scene, surfaces = view.trace.scene, view.shared(_surfaces)
    place, reach = near
    apart = np.hypot(*(scene.solid.pose[:, :2] - place[:2]).T)
    owners, bodies = scene.solid.entities, scene.bodies
    close = np.flatnonzero(apart <= surfaces.reach + reach).tolist()
    some = [k for k in close if only is None or owners[k] in only]
    others = [
        k
        for k, body in enumerate(bodies)
        if body.entity != name and (only is None or body.entity in only)
    ]
    pieces = view.cache(SurfaceCache).boxes(view, step, np.array(some, np.intp))
    boxes = np.concatenate((pieces, body_corners(view, step, np.array(others, np.intp))))
    names = [*(owners[k] for k in some), *(bodies[k].entity for k in others)]
    return Solids(names, boxes, [*some, *(-1 - k for k in others)])


def max_travel(view: View, surface: int) -> tuple[int, float]:
    """The joint that moves a surface, -1 without one, and the most that a point of the surface
    moves while it opens by 1, m.
    """
    scene = view.trace.scene
    number = int(view.shared(_surfaces).joint[surface])
    if number < 0:
        return -1, 0.0
    joint, pose, half = scene.joints[number], scene.solid.pose[surface], scene.solid.half[surface]
    if joint.kind == "slide":
        return number, joint.travel
    arm = math.dist(pose[:3], joint.anchor) + math.hypot(*half)
    return number, joint.travel * arm


def body_corners(view: View, step: Places, body: Places) -> Array:
    """Box corners of objects by number at steps: (8, 3), or (K, 8, 3) where either is an array."""
    half, centre = view.shared(body_boxes)
    pose = view.trace.steps.object_pose[step, body]
    return corners(pose, half[body], centre[body])


def body_boxes(view: View) -> tuple[Array, Array]:
    """Half extents and centres of the objects' boxes (N, 3), (N, 3)."""
    bodies = view.trace.scene.bodies
    half, centre = (
        np.array([getattr(body, name) for body in bodies], float).reshape(-1, 3)
        for name in ("half", "centre")
    )
    return half, centre


@dataclass(frozen=True)
class _Surfaces:
    """All surfaces of a scene.

    Attributes:
        reach: how far from their centre at openness 0 they can ever be, m (S,).
        joint: number of the joint that moves each, -1 without one (S,).
        slides: whether it does so along its axis (S,).
        axis: of their joints (S, 3).
        anchor: of their joints (S, 3).
        travel: of their joints, m or rad (S,).
    """

    reach: NDArray[np.float64]
    joint: NDArray[np.intp]
    slides: Bools
    axis: Array
    anchor: Array
    travel: NDArray[np.float64]


def _surfaces(view: View) -> _Surfaces:
    scene, solid = view.trace.scene, view.trace.scene.solid
    joint = np.array([scene.joint_index[key] if key else -1 for key in solid.joints], np.intp)
    # The last row is of those that nothing moves.
    slides = np.array([*(j.kind == "slide" for j in scene.joints), False])[joint]
    axis, anchor = (
        np.array([*(getattr(j, name) for j in scene.joints), (0.0,) * 3])[joint]
        for name in ("axis", "anchor")
    )
    travel = np.array([*(j.travel for j in scene.joints), 0.0])[joint]
    reach = np.linalg.norm(solid.half, axis=1)
    # At most so far does twice its range take it.
    away = np.linalg.norm(solid.pose[:, :3] - anchor, axis=1)
    reach += np.where(joint >= 0, 2.0 * np.where(slides, travel, away), 0.0)
    return _Surfaces(reach, joint, slides, axis, anchor, travel)


class SurfaceCache:
    """Box corners of the surfaces of a scene, at the openness at which each was last looked at.

    The corners follow from the openness alone, so a corner that is found here is the one that would
    be computed. Most surfaces stay where they are.

    Args:
        scene: has the surfaces.
    """

    def __init__(self, scene: Scene) -> None:
        count = len(scene.solid)
        self._openness = np.full(count, np.nan, np.float32)  # of the joint that moves each; 0: none
        self._boxes = np.empty((count, 8, 3))

    def boxes(self, view: View, step: int, some: NDArray[np.intp]) -> Array:
        """Box corners of some surfaces, by number, at a step (K, 8, 3)."""
        joint = view.shared(_surfaces).joint[some]
        openness = np.append(view.trace.steps.joint[step, :, 0], np.float32(0.0))[joint]
        stale = openness != self._openness[some]
        if stale.any():
            moved = some[stale]
            poses = poses_at(view, moved, openness[stale])
            self._boxes[moved] = corners(poses, view.trace.scene.solid.half[moved])
            self._openness[moved] = openness[stale]
        boxes: Array = self._boxes[some]
        return boxes


def farthest(view: View) -> NDArray[np.float64]:
    """How far from its centre, everything closed, a surface can ever reach, m (surfaces,)."""
    return view.shared(_surfaces).reach


def pieces_at(view: View, surface: int, steps: NDArray[np.intp]) -> Array:
    """Centre poses of a surface at some steps (K, 7); of one that nothing moves, one (1, 7)."""
    joint = int(view.shared(_surfaces).joint[surface])
    if joint < 0:
        still: Array = view.trace.scene.solid.pose[surface][None]
        return still
    openness = view.trace.steps.joint[steps, joint, 0]
    return poses_at(view, np.full(len(steps), surface), openness)


def poses_at(view: View, some: NDArray[np.intp], openness: Array) -> Array:
    """Centre poses of some surfaces, at the openness of what moves each (K, 7)."""
    known, poses = view.shared(_surfaces), view.trace.scene.solid.pose[some]
    travel, axis, slides = known.travel[some] * openness, known.axis[some], known.slides[some]
    if slides.any():
        poses[slides] = slid(poses[slides], travel[slides, None] * axis[slides])
    turns = ~slides & (travel != 0.0)
    if turns.any():
        anchor = known.anchor[some[turns]]
        poses[turns] = swung(poses[turns], axis[turns], travel[turns], anchor)
    return poses
