"""Edges and points: where a sharp object points."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.grounding import PLACE
from pytest_safemanip.propositions.kernels.margins import under
from pytest_safemanip.propositions.kernels.spaces import FARTHEST, called, space
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import Body
from pytest_safemanip.trace.geometry import Array, conjugate, rotate, to_local, to_world

DISTANCE = Parameter("points_at.distance", "m", 0.3, "a forearm: whoever moves meets it at once")
ANGLE = Parameter(
    "points_at.angle", "rad", float(np.deg2rad(20.0)), "as a hand wavers that holds a knife"
)
_EVEN = 0.05
"""Share of half its length that the centre of mass of an object may be from its middle, along it,
without saying which end is the heavier one."""
TOUCHING = 1e-3
"""What is nearer than this is straight ahead, m."""
ROUNDING = 1e-9
"""More than rounding errors, m or rad: at a limit they must not decide."""
_ROUNDS = 8
"""Of looking for the point of a box that is nearest to a line."""


def points_at(view: View, name: str, other: str) -> Bools:
    """The object's point is toward the other one: seen from the end of its longest side that is
    farther from its centre of mass (from either end, if that is in the middle), some of the other
    is within ``points_at.distance`` and ``points_at.angle`` of straight ahead.
    """
    p = view.parameters
    away, angle = _ahead(view, name, other, p[DISTANCE.name])
    return np.asarray(((away <= p[DISTANCE.name]) & (angle <= p[ANGLE.name])).any(axis=1))


def points_at_margin(view: View, name: str, other: str) -> Floats:
    """How near, or how straight ahead, whichever is less, for the end where that is most (T,)."""
    p = view.parameters
    away, angle = _ahead(view, name, other, p[DISTANCE.name])
    each = np.minimum(under(away, p[DISTANCE.name]), under(angle, p[ANGLE.name]))
    return np.asarray(each.max(axis=1))


def points_at_evidence(view: View, name: str, other: str, step: int) -> list[str]:
    """How far, and how straight."""
    away, angle = (
        found[step] for found in _ahead(view, name, other, view.parameters[DISTANCE.name])
    )
    best = int(np.argmin(angle))
    return [
        f"{name} points at {called(other)}: {100 * away[best]:.0f} cm ahead, "
        f"{np.rad2deg(angle[best]):.0f} degrees beside"
    ]


def ends(body: Body) -> Array:
    """The ends of a body that may be its point, in its own frame: place and direction (E, 2, 3)."""
    axis = int(np.argmax(body.half))
    way, reach = np.zeros(3), body.half[axis]
    way[axis] = 1.0
    off = (body.com[axis] - body.centre[axis]) / reach if reach else 0.0
    senses = (1.0, -1.0) if abs(off) < _EVEN else (-np.sign(off),)
    return np.array([(np.array(body.centre) + s * reach * way, s * way) for s in senses])


def _ahead(view: View, name: str, other: str, reach: float) -> tuple[Floats, Floats]:
    """Distance of another thing from each end of an object that may be its point, m (T, E), and the
    angle to straight ahead, rad (T, E): of that point of it which is nearest to the line ahead.
    """
    scene = view.trace.scene
    points = ends(scene.bodies[scene.object_index[name]])
    found = [_seen(view, name, other, k, reach) for k in range(len(points))]
    return (
        np.stack([each[:, 0] for each in found], axis=1),
        np.stack([each[:, 1] for each in found], axis=1),
    )


@pointwise
def _seen(view: View, name: str, other: str, end: int, reach: float) -> Floats:
    """Distance and angle of another thing from one end of an object (T, 2)."""
    scene, steps = view.trace.scene, view.trace.steps
    index = scene.object_index[name]
    point, way = ends(scene.bodies[index])[end]
    own = steps.object_pose[:, index]
    pose, half = space(view, other)
    shape = (len(steps), len(half), 3)
    # The frames of the boxes.
    tip = to_local(pose, to_world(own, point)[:, None])
    turn = conjugate(np.broadcast_to(pose[..., 3:], (*shape[:2], 4)))
    ahead = rotate(turn, np.broadcast_to(rotate(own[:, 3:], _each(way, own))[:, None], shape))
    there = _nearest_to_line(half, tip, ahead, reach) - tip
    away = np.sqrt(np.square(there).sum(axis=-1))
    cosine = np.divide(
        (there * ahead).sum(axis=-1), away, out=np.ones_like(away), where=away > TOUCHING + ROUNDING
    )
    angle = np.maximum(np.arccos(np.clip(cosine, -1.0, 1.0)) - ROUNDING, 0.0)
    away = np.maximum(away - ROUNDING, 0.0)
    far = np.where(away <= reach, angle, FARTHEST)
    best = np.argmin(far, axis=1)
    rows = np.arange(len(steps))
    return np.stack((away[rows, best], angle[rows, best]), axis=1)


def _each(way: Array, poses: Array) -> Array:
    return np.broadcast_to(way, (len(poses), 3))


def _nearest_to_line(half: Array, start: Array, way: Array, reach: float) -> Array:
    """The points of boxes (..., P, 3) that are nearest to lines from some points on, so long, all
    in the frames of the boxes. Where many of a box are equally near, for it runs along the line:
    the one next to half way.
    """
    near: Array = start + reach / 2.0 * way
    for _ in range(_ROUNDS):
        nearest = np.clip(near, -half, half)
        along = np.clip(((nearest - start) * way).sum(axis=-1), 0.0, reach)
        near = start + along[..., None] * way
    return nearest


def _reads(inputs: Inputs, name: str, other: str) -> Found:
    return inputs.poses(name) | inputs.space(other)


PROPOSITIONS = (
    Proposition(
        "points_at",
        ("object", PLACE),
        lambda _: 0.0,
        (DISTANCE, ANGLE),
        points_at,
        margin=points_at_margin,
        evidence=points_at_evidence,
        lacks=grounding.solid,
        reads=_reads,
        distinct=True,
    ),
)
