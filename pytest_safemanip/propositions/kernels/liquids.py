"""Where the particles of liquids are, and what they were in at first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.kernels.interiors import holding_halves, interiors
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.geometry import centred, to_local

Floats = NDArray[np.float64]


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
    steps = view.trace.steps
    found = np.zeros(steps.particles.shape[:2], bool)
    for pose, half in zip(holding_frames(view, entity), holding_halves(view, entity), strict=True):
        local = to_local(pose[:, None], steps.particles)
        # What is heaped up to the rim lies on others that are below it.
        top = half[2] + view.shared(radii)
        inside = (np.abs(local[..., :2]) <= half[:2]).all(axis=-1)
        found |= inside & (local[..., 2] >= -half[2]) & (local[..., 2] <= top)
    return found


def holding_frames(view: View, entity: str) -> list[Floats]:
    """Poses over time (T, 7) of where an entity holds things, as
    :func:`~.interiors.holding_halves` has their sizes.
    """
    scene, steps = view.trace.scene, view.trace.steps
    index = scene.object_index.get(entity)
    if index is None:
        return [np.asarray(pose, float) for pose, _ in interiors(view, entity)]
    return [centred(steps.object_pose[:, index], scene.bodies[index].centre)]


def share_in(view: View, liquid: str, entity: str) -> Floats:
    """Share of a liquid's particles that are where an entity holds things (T,)."""
    return np.asarray(particles_in(view, entity)[:, own_particles(view, liquid)].mean(axis=1))


def departed(view: View, liquid: str) -> Bools:
    """Which particles of a liquid are no longer in any object that they were in at the first step
    (T, K); those that were in none never left one.
    """
    own = own_particles(view, liquid)
    source = view.fold(Sources)[0][own]
    still_in = np.zeros((len(view.trace), len(own)), bool)
    for number in np.flatnonzero(source.any(axis=0)).tolist():
        entity = view.trace.scene.bodies[number].entity
        still_in |= source[:, number] & particles_in(view, entity)[:, own]
    return np.asarray(source.any(axis=1) & ~still_in)


def middle_of(view: View, liquid: str, which: Bools) -> Floats:
    """The middle of some of a liquid's particles, world frame, m (T, 3); where there are none, of
    all of them.
    """
    places = view.trace.steps.particles[:, own_particles(view, liquid)].astype(float)
    weight = np.where(which.any(axis=1)[:, None], which, True)[..., None]
    return np.asarray((places * weight).sum(axis=1) / weight.sum(axis=1))


class Sources:
    """Which objects each particle was in at the first step.

    Args:
        view: gives the scene.
    """

    def __init__(self, view: View) -> None:
        self._begun = False
        self._of = np.zeros(
            (view.trace.steps.particles.shape[1], len(view.trace.scene.bodies)), bool
        )

    def advance(self, view: View) -> Bools:
        """Whether each particle was in each object; the same at all of the next steps (T, P, N)."""
        if not self._begun:
            self._begun = True
            for number, body in enumerate(view.trace.scene.bodies):
                self._of[:, number] = particles_in(view, body.entity)[0]
        return np.broadcast_to(self._of, (len(view.trace), *self._of.shape))
