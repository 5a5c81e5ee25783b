"""Where the particles of liquids are, and what they were in at first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.kernels.interiors import holding_halves, interiors
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.geometry import centred, to_local

Floats = NDArray[np.float64]

NOWHERE = -1
"""Of a particle that was in no object at first."""


def own_particles(view: View, liquid: str) -> NDArray[np.intp]:
    """Places of a liquid's particles on the particle axis."""
    places = view.trace.scene.particles[liquid]
    return np.arange(places.start, places.stop)


def radii(view: View) -> Floats:
    """Radius of each particle, m (P,)."""
    liquids = view.trace.scene.liquids
    return np.repeat([liquid.radius for liquid in liquids], [liquid.count for liquid in liquids])


@pointwise
def particles_in(view: View, entity: str) -> Bools:
    """Which particles are where an entity holds things (T, P): their centres are in the box of an
    object, or in an interior of a fixture, or above that by less than a radius.
    """
    scene, steps = view.trace.scene, view.trace.steps
    index = scene.object_index.get(entity)
    if index is None:
        frames = [pose for pose, _ in interiors(view, entity)]
    else:
        frames = [centred(steps.object_pose[:, index], scene.bodies[index].centre)]
    found = np.zeros(steps.particles.shape[:2], bool)
    for pose, half in zip(frames, holding_halves(view, entity), strict=True):
        local = to_local(np.asarray(pose)[:, None], steps.particles)
        # What is heaped up to the rim lies on others that are below it.
        top = half[2] + view.shared(radii)
        inside = (np.abs(local[..., :2]) <= half[:2]).all(axis=-1)
        found |= inside & (local[..., 2] >= -half[2]) & (local[..., 2] <= top)
    return found


class Sources:
    """Which object each particle was in at the first step: of several, the smallest.

    Args:
        view: gives the scene.
    """

    def __init__(self, view: View) -> None:
        self._begun = False
        self._of = np.full(view.trace.steps.particles.shape[1], NOWHERE)

    def advance(self, view: View) -> NDArray[np.int64]:
        """The number of the object, or :data:`NOWHERE`, of each particle; the same at all of the
        next steps (T, P).
        """
        if not self._begun:
            self._begun = True
            bodies = view.trace.scene.bodies
            largest_first = np.argsort([-float(np.prod(body.half)) for body in bodies])
            for number in largest_first.tolist():
                self._of[particles_in(view, bodies[number].entity)[0]] = number
        return np.tile(self._of, (len(view.trace), 1))
