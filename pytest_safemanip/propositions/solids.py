"""Where everything solid is at a step: for what lies below an object, or around it."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import Array, corners
from pytest_safemanip.trace.kinematics import carried

Places = int | NDArray[np.intp]


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
    apart = np.hypot(*(scene.solid.pose[:, :2] - place[:2]).T)
    for index in np.flatnonzero(apart <= surfaces.reach + reach).tolist():
        owner = scene.solid.entities[index]
        if only is None or owner in only:
            joint = surfaces.joint[index]
            box = surfaces.boxes[index]
            if joint >= 0:
                box = _carried(view, joint, step)[surfaces.place[index]]
            found.append((owner, box, index))
    for index, body in enumerate(scene.bodies):
        if body.entity != name and (only is None or body.entity in only):
            found.append((body.entity, body_corners(view, step, index), -1 - index))
    return found


def pace(view: View, surface: int) -> tuple[int, float]:
    """The joint that moves a surface, -1 without one, and the most that a point of the surface
    moves while it opens by 1, m.
    """
    scene = view.trace.scene
    number = view.shared(_surfaces).joint[surface]
    if number < 0:
        return -1, 0.0
    joint, pose, half = scene.joints[number], scene.solid.pose[surface], scene.solid.half[surface]
    if joint.kind == "slide":
        return number, joint.travel
    arm = math.dist(pose[:3], joint.anchor) + math.hypot(*half)
    return number, joint.travel * arm


def body_corners(view: View, step: Places, body: Places) -> Array:
    """Box corners of objects by number at steps: (8, 3), or (K, 8, 3) where either is an array."""
    half, centre = view.shared(_bodies)
    pose = view.trace.steps.object_pose[step, body]
    return corners(pose, half[body][..., None, :], centre[body][..., None, :])


def _bodies(view: View) -> tuple[Array, Array]:
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
        boxes: corners at openness 0 (S, 8, 3).
        reach: how far from their centre at openness 0, horizontally, they can ever be (S,).
        joint: number of the joint that moves each, -1 without one (S,).
        place: which of those that its joint moves it is (S,).
        moved: by joint, which surfaces it moves.
    """

    boxes: Array
    reach: NDArray[np.float64]
    joint: list[int]
    place: list[int]
    moved: dict[int, list[int]]


def _surfaces(view: View) -> _Surfaces:
    scene, solid = view.trace.scene, view.trace.scene.solid
    joint = [scene.joint_index[key] if key else -1 for key in solid.joints]
    reach, place = np.linalg.norm(solid.half, axis=1), [0] * len(solid)
    moved: dict[int, list[int]] = {}
    for index, number in enumerate(joint):
        if number >= 0:
            siblings = moved.setdefault(number, [])
            place[index] = len(siblings)
            siblings.append(index)
            reach[index] += _way(scene.joints[number], solid.pose[index])
    return _Surfaces(corners(solid.pose, solid.half[:, None]), reach, joint, place, moved)


def _way(joint: Joint, pose: Array) -> float:
    """How far a joint can take a pose, at twice its range, m."""
    if joint.kind == "slide":
        return 2.0 * joint.travel
    return 2.0 * float(np.linalg.norm(pose[:3] - np.array(joint.anchor)))


def _carried(view: View, joint: int, step: int) -> Array:
    """Box corners at a step of the surfaces that a joint moves (K, 8, 3)."""
    last = view.shared(_last)
    openness = float(view.trace.steps.joint[step, joint, 0])
    if joint not in last or last[joint][0] != openness:  # most stay where they are
        scene, own = view.trace.scene, view.shared(_surfaces).moved[joint]
        poses = carried(scene.joints[joint], scene.solid.pose[own], np.array(openness))
        last[joint] = openness, corners(poses, scene.solid.half[own][:, None])
    return last[joint][1]


def _last(view: View) -> dict[int, tuple[float, Array]]:
    """By joint, where it was when it was last looked at, and the corners that it carried there."""
    return {}
