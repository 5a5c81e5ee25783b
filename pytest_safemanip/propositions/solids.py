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
    scene = view.trace.scene
    found = [item for item in scene.fixed_surfaces if only is None or item[0] in only]
    moving = view.shared(_Moving)
    for index, surface in enumerate(scene.surfaces):
        if surface.joint and (only is None or surface.entity in only):
            found.append((surface.entity, moving.surface(index)[step]))
    for index, body in enumerate(scene.bodies):
        if body.entity != name and (only is None or body.entity in only):
            found.append((body.entity, moving.body(index)[step]))
    return found


class _Moving:
    """Box corners (T, 8, 3) of what moves, each computed when it is first asked for."""

    def __init__(self, view: View) -> None:
        self._trace = view.trace
        self._known: dict[tuple[str, int], Array] = {}

    def surface(self, index: int) -> Array:
        if ("surface", index) not in self._known:
            scene = self._trace.scene
            surface = scene.surfaces[index]
            joint = scene.joint_index[surface.joint]
            openness = self._trace.steps.joint[:, joint, 0]
            pose = carried(scene.joints[joint], np.asarray(surface.pose), openness)
            self._known["surface", index] = corners(pose, surface.half)
        return self._known["surface", index]

    def body(self, index: int) -> Array:
        if ("body", index) not in self._known:
            body, poses = self._trace.scene.bodies[index], self._trace.steps.object_pose[:, index]
            self._known["body", index] = corners(poses, body.half, body.centre)
        return self._known["body", index]
