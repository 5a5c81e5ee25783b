"""Where everything solid is at a step: for what lies below an object, or around it."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import Array, corners
from pytest_safemanip.trace.kinematics import carried


def solids(
    view: View,
    name: str,
    step: int,
    near: tuple[Array, float],
    only: Collection[str] | None = None,
) -> list[tuple[str, Array, int]]:
    """Owner and box corners (8, 3) of everything solid but one object and the robot, and the number
    of the surface; of an object its own, from -1 down.

    Args:
        view: what is looked at.
        name: the object that is left out.
        step: when.
        near: a place (3,) and metres: what is further away to the side may be left out.
        only: entities to keep; None keeps all.
    """
    scene, found = view.trace.scene, []
    surfaces = view.shared(_surfaces)
    place, reach = near
    apart = np.hypot(*(surfaces.centre - place[:2]).T)
    for index in np.flatnonzero(apart <= surfaces.reach + reach):
        owner = scene.surfaces[index].entity
        if only is None or owner in only:
            moves = scene.surfaces[index].joint
            box = _moved(view, int(index), step) if moves else surfaces.boxes[index]
            found.append((owner, box, int(index)))
    for index, body in enumerate(scene.bodies):
        if body.entity != name and (only is None or body.entity in only):
            found.append((body.entity, body_corners(view)[step, index], -1 - index))
    return found


def pace(view: View, surface: int) -> tuple[int, float]:
    """The joint that moves a surface, -1 without one, and the most that a point of the surface
    moves while it opens by 1, m.
    """
    scene = view.trace.scene
    item = scene.surfaces[surface]
    if not item.joint:
        return -1, 0.0
    number = scene.joint_index[item.joint]
    joint = scene.joints[number]
    if joint.kind == "slide":
        return number, joint.travel
    arm = math.dist(item.pose[:3], joint.anchor) + math.hypot(*item.half)
    return number, joint.travel * arm


@pointwise
def body_corners(view: View) -> Array:
    """Box corners of all objects (T, N, 8, 3)."""
    bodies = view.trace.scene.bodies
    half, centre = (
        np.array([getattr(body, name) for body in bodies], float).reshape(-1, 1, 3)
        for name in ("half", "centre")
    )
    return corners(view.trace.steps.object_pose, half, centre)


@dataclass(frozen=True)
class _Surfaces:
    """All surfaces of a scene.

    Attributes:
        boxes: corners at openness 0 (S, 8, 3).
        centre: horizontal place at openness 0 (S, 2).
        reach: how far from there, horizontally, they can ever be (S,).
    """

    boxes: Array
    centre: Array
    reach: NDArray[np.float64]


def _surfaces(view: View) -> _Surfaces:
    scene = view.trace.scene
    poses = np.array([surface.pose for surface in scene.surfaces], float).reshape(-1, 7)
    halves = np.array([surface.half for surface in scene.surfaces], float).reshape(-1, 3)
    ways = [
        _way(scene.joints[scene.joint_index[surface.joint]], pose) if surface.joint else 0.0
        for surface, pose in zip(scene.surfaces, poses, strict=True)
    ]
    reach = np.linalg.norm(halves, axis=1) + np.array(ways)
    return _Surfaces(corners(poses, halves[:, None]), poses[:, :2], reach)


def _way(joint: Joint, pose: Array) -> float:
    """How far a joint can take a pose, at twice its range, m."""
    if joint.kind == "slide":
        return 2.0 * joint.travel
    return 2.0 * float(np.linalg.norm(pose[:3] - np.array(joint.anchor)))


def _moved(view: View, index: int, step: int) -> Array:
    """Box corners of a surface that a joint moves, at a step (8, 3)."""
    scene = view.trace.scene
    surface = scene.surfaces[index]
    joint = scene.joint_index[surface.joint]
    openness = view.trace.steps.joint[step : step + 1, joint, 0]
    pose = carried(scene.joints[joint], np.asarray(surface.pose), openness)
    found: Array = corners(pose, surface.half)[0]
    return found
