"""Where everything solid is at a step: for what lies below an object, or around it."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.geometry import Array, corners
from pytest_safemanip.trace.kinematics import carried


def solids(
    view: View, name: str, step: int, only: Collection[str] | None = None
) -> list[tuple[str, Array]]:
    """Box corners (8, 3) of everything solid but one object and the robot, with its entity.

    Args:
        view: what is looked at.
        name: the object that is left out.
        step: when.
        only: entities to keep; None keeps all.
    """
    scene = view.trace.scene
    found = [item for item in scene.fixed_surfaces if only is None or item[0] in only]
    for index, surface in enumerate(scene.surfaces):
        if surface.joint and (only is None or surface.entity in only):
            found.append((surface.entity, _surface(view, index)[step]))
    for index, body in enumerate(scene.bodies):
        if body.entity != name and (only is None or body.entity in only):
            found.append((body.entity, body_corners(view)[step, index]))
    return found


@pointwise
def _surface(view: View, index: int) -> Array:
    """Box corners of a surface that a joint carries (T, 8, 3)."""
    scene = view.trace.scene
    surface = scene.surfaces[index]
    joint = scene.joint_index[surface.joint]
    openness = view.trace.steps.joint[:, joint, 0]
    return corners(carried(scene.joints[joint], np.asarray(surface.pose), openness), surface.half)


@pointwise
def body_corners(view: View) -> Array:
    """Box corners of all objects (T, N, 8, 3)."""
    bodies = view.trace.scene.bodies
    half, centre = (
        np.array([getattr(body, name) for body in bodies], float).reshape(-1, 1, 3)
        for name in ("half", "centre")
    )
    return corners(view.trace.steps.object_pose, half, centre)
