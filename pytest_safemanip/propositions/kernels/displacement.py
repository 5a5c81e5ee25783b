"""Displacement of objects since they were last at rest, outside the hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools, Parameter
from pytest_safemanip.propositions.grasp import pressed
from pytest_safemanip.propositions.kernels.filters import still
from pytest_safemanip.propositions.kernels.interiors import centres
from pytest_safemanip.propositions.view import View

REST_WINDOW = Parameter("contained.window", "s", 0.25, "as for settled")
REST_DRIFT = Parameter(
    "contained.drift", "m", 0.005, "2 cm/s, the speed that settled allows, for 0.25 s"
)

_FAR = 1e3
"""Farther than anything is carried, m."""

Floats = NDArray[np.float64]


class DisplacementSinceRest:
    """The largest displacement of objects since they were last at rest while the hand was empty.

    It is 1 km for an object that has not been at rest yet, as one held from the first step on.

    Args:
        view: gives scene and parameters.
    """

    def __init__(self, view: View) -> None:
        self._count = view.trace.count(view.parameters[REST_WINDOW.name])
        bodies = len(view.trace.scene.bodies)
        self._origin, self._most = np.zeros((bodies, 3)), np.full(bodies, _FAR)
        self._before: Floats | None = None

    def advance(self, view: View) -> Floats:
        """The largest displacements after each of the next steps, m (T, N)."""
        places = centres(view)
        if self._before is None:
            self._before = np.repeat(places[:1], self._count - 1, axis=0)
        known = np.concatenate((self._before, places))
        self._before = known[len(places) :]
        rests = still(known, self._count, view.parameters[REST_DRIFT.name])[self._count - 1 :]
        at_rest = rests & ~_holding(view)[:, None]
        newest = np.where(at_rest, np.arange(1, len(places) + 1)[:, None], 0)
        newest = np.maximum.accumulate(newest)
        origin = np.concatenate((self._origin[None], places))[newest, np.arange(len(self._origin))]
        away = np.minimum(np.linalg.norm(places - origin, axis=-1), _FAR)
        away = np.where(newest > 0, away, np.maximum(away, self._most))
        most = _largest_since(at_rest, away)
        self._origin, self._most = origin[-1], most[-1]
        return most


def _largest_since(at_rest: Bools, away: Floats) -> Floats:
    """The running maximum of the displacement, m (T, N); 0 while an object is at rest.

    Args:
        at_rest: whether the object is at rest (T, N).
        away: its displacement from where it last was, m (T, N).
    """
    most = np.zeros_like(away)
    outside = np.ones((at_rest.shape[1], 1), bool)
    edges = np.diff(np.concatenate((outside, at_rest.T, outside), axis=1).astype(np.int8))
    starts, stops = np.argwhere(edges < 0).tolist(), np.argwhere(edges > 0).tolist()
    for (body, first), (_, stop) in zip(starts, stops, strict=True):
        most[first:stop, body] = np.maximum.accumulate(away[first:stop, body])
    return most


def _holding(view: View) -> Bools:
    """Whether the hand holds anything, or closes on it (T,)."""
    holds = np.zeros(len(view.trace), bool)
    for body in view.trace.scene.bodies:
        holds |= pressed(view, body.entity) | view("obj_grasped", body.entity)
    return holds
