"""Where everything solid is at a step: for what lies below an object, or around it."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from pytest_safemanip.propositions.definition import View
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
    trace, scene = view.trace, view.trace.scene
    found = [item for item in scene.fixed_surfaces if only is None or item[0] in only]
    for surface in scene.surfaces:
        if surface.joint and (only is None or surface.entity in only):
            index = scene.joint_index[surface.joint]
            position = trace.steps.joint[step, index, 0]
            pose = carried(scene.joints[index], np.asarray(surface.pose), position)
            found.append((surface.entity, corners(pose, surface.half)))
    for index, body in enumerate(scene.bodies):
        if body.entity != name and (only is None or body.entity in only):
            pose = trace.steps.object_pose[step, index]
            found.append((body.entity, corners(pose, body.half, body.centre)))
    return found
