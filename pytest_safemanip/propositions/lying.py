"""Where objects lay before the robot took them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools, Parameter
from pytest_safemanip.propositions.filters import still
from pytest_safemanip.propositions.grasp import pressed
from pytest_safemanip.propositions.interiors import centres
from pytest_safemanip.propositions.view import View

REST_WINDOW = Parameter("contained.window", "s", 0.25, "as for settled")
REST_DRIFT = Parameter(
    "contained.drift", "m", 0.005, "2 cm/s, the speed that settled allows, for 0.25 s"
)

_FAR = 1e3
"""Farther than anything is carried, m."""

Floats = NDArray[np.float64]


class Brought:
    """How far objects have been from where they last lay still while the hand held nothing.

    What the hand held when the trace began came from somewhere: from far away.

    Args:
        view: gives scene and parameters.
    """

    def __init__(self, view: View) -> None:
        self._count = view.trace.count(view.parameters[REST_WINDOW.name])
        bodies = len(view.trace.scene.bodies)
        self._lay, self._most = np.zeros((bodies, 3)), np.full(bodies, _FAR)
        self._before: Floats | None = None

    def advance(self, view: View) -> Floats:
        """Take in steps.

        Returns:
            After each, the farthest that each object has been from where it lay, m (T, N).
        """
        places = centres(view)
        if self._before is None:
            self._before = np.repeat(places[:1], self._count - 1, axis=0)
        known = np.concatenate((self._before, places))
        self._before = known[len(places) :]
        rests = still(known, self._count, view.parameters[REST_DRIFT.name])[self._count - 1 :]
        lies = rests & ~_holding(view)[:, None]
        newest = np.where(lies, np.arange(1, len(places) + 1)[:, None], 0)
        newest = np.maximum.accumulate(newest)
        lay = np.concatenate((self._lay[None], places))[newest, np.arange(len(self._lay))]
        away = np.minimum(np.linalg.norm(places - lay, axis=-1), _FAR)
        away = np.where(newest > 0, away, np.maximum(away, self._most))
        # The largest since it lay: those after a later rest are above all before it.
        most = np.maximum.accumulate(away + 2.0 * _FAR * newest) - 2.0 * _FAR * newest
        self._lay, self._most = lay[-1], most[-1]
        return np.asarray(most)


def _holding(view: View) -> Bools:
    """Whether the hand holds anything, or closes on it (T,)."""
    holds = np.zeros(len(view.trace), bool)
    for body in view.trace.scene.bodies:
        holds |= pressed(view, body.entity) | view("obj_grasped", body.entity)
    return holds
