"""Displacement and lean of objects since the first step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.kernels.interiors import centres
from pytest_safemanip.propositions.kernels.support import carrying_rows, on_room
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.kinematics import carried

Floats = NDArray[np.float64]


class SinceStart:
    """How far objects are from where they were at the first step, and how much more they lean.

    What stood on a moving part of a fixture is expected where that part has taken it.

    Args:
        view: gives the scene.
    """

    def __init__(self, view: View) -> None:
        self._joints, self._begun = view.trace.scene.joints, False
        bodies = len(view.trace.scene.bodies)
        self._carrier = np.full(bodies, -1, np.intp)  # the joint below each object
        self._upright = np.zeros((bodies, 3))  # picks the axis of each that was most upright
        self._place, self._opened = np.zeros((bodies, 3)), np.zeros(len(self._joints))
        self._lean, self._floored = np.zeros(bodies), np.zeros(bodies)

    def advance(self, view: View) -> Floats:
        """Take in steps.

        Returns:
            After each, of each object: displacement, m; lean, rad; 1 if it lay on the floor at the
            first step, else 0 (T, N, 3).
        """
        places, joint = centres(view), view.trace.steps.joint[:, :, 0].astype(float)
        if not self._begun:
            self._start(view, places[0], joint[0])
        found = np.zeros((*places.shape[:2], 3))
        expected = np.broadcast_to(self._place, places.shape).copy()
        for body in np.flatnonzero(self._carrier >= 0).tolist():
            opened = joint[:, self._carrier[body]] - self._opened[self._carrier[body]]
            expected[:, body] = self._led(body, opened)
        away = places - expected
        found[..., 0] = np.sqrt(np.square(away).sum(axis=-1))
        found[..., 1] = np.maximum(self._leans(view) - self._lean, 0.0)
        found[..., 2] = self._floored
        return found

    def _start(self, view: View, places: Floats, joint: Floats) -> None:
        scene, self._begun = view.trace.scene, True
        self._place, self._opened = places.copy(), joint.copy()
        _, upper, below = carrying_rows(view, 0, 1)
        for body, part in zip(upper.tolist(), below.tolist(), strict=True):
            if scene.parts[part].joint:
                self._carrier[body] = scene.joint_index[scene.parts[part].joint]
        rises = _rises(view)[0]
        most = np.argmax(np.abs(rises), axis=-1)
        for body, axis in enumerate(most.tolist()):
            self._upright[body, axis] = np.sign(rises[body, axis])
        self._lean = self._leans(view)[0]
        self._floored = on_room(view)[0].astype(float)

    def _led(self, body: int, opened: Floats) -> Floats:
        """Where the joint below an object takes the middle of its box (T, 3)."""
        joint, place = self._joints[self._carrier[body]], self._place[body]
        pose = np.broadcast_to((*place, 1.0, 0.0, 0.0, 0.0), (len(opened), 7))
        return carried(joint, pose, opened)[:, :3]

    def _leans(self, view: View) -> Floats:
        """Angle of each object's axis to the vertical, rad (T, N)."""
        own = (_rises(view) * self._upright).sum(axis=-1)
        return np.asarray(np.arccos(np.clip(own, -1.0, 1.0)))


def _rises(view: View) -> Floats:
    """Vertical parts of the axes of all objects (T, N, 3)."""
    w, x, y, z = np.moveaxis(view.trace.steps.object_pose[..., 3:].astype(float), -1, 0)
    rises = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    return np.stack(rises, axis=-1)
