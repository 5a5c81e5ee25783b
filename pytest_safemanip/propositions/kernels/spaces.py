"""The boxes that things fill: objects, hands, the pieces of fixtures, zones; and how far apart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.binding import Zone
from pytest_safemanip.propositions.kernels.margins import NONE, over
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.distance import Boxes, footprint_gap, gap
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import Array, about, centred, corners, matrix
from pytest_safemanip.trace.kinematics import carried

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
UNSURE = 1e-6
"""Nearer to a limit than this no ball decides, m."""
FARTHEST = 1e3
"""Farther than anything is from anything, m."""


def called(name: str) -> str:
    """What evidence calls something that fills space."""
    return "the hand" if name == ROBOT else name


class Space(NamedTuple):
    """What something fills, as boxes over time.

    Attributes:
        pose: of their centres (T, K, 7); of what never moves, of one step (1, K, 7).
        half: half extents (K, 3), m.
    """

    pose: Array
    half: Array

    @property
    def radius(self) -> Array:
        """Of the balls around the boxes, m (K,)."""
        return np.asarray(np.sqrt(np.square(self.half).sum(axis=1)))


def space(view: View, name: str) -> Space:
    """What an object, the robot's hands, a fixture or a zone fill.

    Raises:
        TraceError: if it is nothing that fills space, as a fixture without a solid piece.
    """
    scene, steps = view.trace.scene, view.trace.steps
    if name in view.binding.zones:
        return _zone(view, view.binding.zones[name])
    if name == ROBOT:
        centres = [centred(steps.eef_poses[:, n], h.centre) for n, h in enumerate(scene.grippers)]
        if not centres:
            raise TraceError("the scene has no gripper")
        return Space(np.stack(centres, axis=1), np.array([hand.half for hand in scene.grippers]))
    index = scene.object_index.get(name)
    if index is None:
        return _pieces(view, name)
    body = scene.bodies[index]
    return Space(
        centred(steps.object_pose[:, index], body.centre)[:, None], np.array(body.half)[None]
    )


def _pieces(view: View, fixture: str) -> Space:
    """The solid pieces of a fixture, where its joints have them."""
    solid, joints = view.trace.scene.solid, view.trace.scene.joint_index
    still, moving = view.shared(_own_pieces, fixture)
    if not still and not moving:
        raise TraceError(f"{fixture!r} has no solid piece")
    fixed, length = solid.pose[still][None], len(view.trace)
    if not moving:
        return Space(fixed, solid.half[still])
    found = [np.broadcast_to(fixed, (length, len(still), 7))]
    for number in moving:
        joint = joints[solid.joints[number]]
        openness = view.trace.steps.joint[:, joint, 0]
        pose = np.broadcast_to(solid.pose[number], (length, 7))
        found.append(carried(view.trace.scene.joints[joint], pose, openness)[:, None])
    return Space(np.concatenate(found, axis=1), solid.half[[*still, *moving]])


def _own_pieces(view: View, fixture: str) -> tuple[list[int], list[int]]:
    """Numbers of the surfaces of a fixture: those that never move, and those that do."""
    solid = view.trace.scene.solid
    own = [k for k, entity in enumerate(solid.entities) if entity == fixture]
    return [k for k in own if not solid.joints[k]], [k for k in own if solid.joints[k]]


def _zone(view: View, zone: Zone) -> Space:
    """The box of a zone."""
    pose, half = _around(view, zone.around)
    grown = np.asarray(half, float) + zone.margin
    shift = np.array((0.0, 0.0, zone.above / 2.0))
    return Space(centred(pose, shift)[:, None], (grown + shift)[None])


def _around(view: View, name: str) -> tuple[Array, Array]:
    """The one box around an object or a fixture: poses (T, 7), or (1, 7), and half extents (3,)."""
    if name in view.trace.scene.object_index:
        pose, half = space(view, name)
        return pose[:, 0], half[0]
    return view.shared(_outline, name)


def _outline(view: View, fixture: str) -> tuple[Array, Array]:
    """The smallest upright box around the pieces of a fixture, everything closed: of those that
    stand like one of them, the one with the least base.
    """
    still, moving = view.shared(_own_pieces, fixture)
    pieces, solid = [*still, *moving], view.trace.scene.solid
    if not pieces:
        raise TraceError(f"{fixture!r} has no solid piece, so that no zone can be around it")
    points = corners(solid.pose[pieces], solid.half[pieces]).reshape(-1, 3)
    axes = matrix(solid.pose[pieces, 3:])
    level = axes[..., :2, :].transpose(0, 2, 1).reshape(-1, 2)
    level = level[np.linalg.norm(level, axis=1) > 0.5]  # edges that are level rather than upright
    found = [_upright(points, angle) for angle in np.arctan2(level[:, 1], level[:, 0])]
    pose, half = min(found, key=lambda box: round(float(box[1][0] * box[1][1]), 9))
    return pose[None], half


def _upright(points: Array, angle: float) -> tuple[Array, Array]:
    """Pose (7,) and half extents (3,) of the upright box around points (K, 3), turned by an angle
    about the vertical.
    """
    turn = about((0.0, 0.0, 1.0), angle)
    seen = points @ matrix(turn)
    low, high = seen.min(axis=0), seen.max(axis=0)
    return np.concatenate((matrix(turn) @ ((low + high) / 2.0), turn)), (high - low) / 2.0


class _Pairs(NamedTuple):
    """Pairs of boxes of two spaces, at all steps: balls around them are within a distance.

    Attributes:
        step: when (R,).
        one: boxes of the first space.
        other: of the second.
        rest: at each step, a lower bound of the distance of all other pairs, m (T,).
    """

    step: NDArray[np.intp]
    one: Boxes
    other: Boxes
    rest: Floats


def _pairs(view: View, first: Space, second: Space, within: float, level: bool) -> _Pairs:
    """Those whose balls are near each other; seen from above if they need only be so there."""
    length, axes = len(view.trace), 2 if level else 3
    away = first.pose[:, :, None, :axes] - second.pose[:, None, :, :axes]
    reach = first.radius[:, None] + second.radius
    apart = np.sqrt(np.square(away).sum(axis=-1)) - reach
    apart = np.broadcast_to(apart, (length, *apart.shape[1:]))
    close = apart < within
    step, own, its = np.nonzero(close)
    rest = np.where(close, np.inf, apart).min(axis=(1, 2))
    one, other = (
        Boxes.of(np.broadcast_to(s.pose, (length, *s.pose.shape[1:]))[step, k], s.half[k])
        for s, k in ((first, own), (second, its))
    )
    return _Pairs(step, one, other, rest)


@pointwise
def distance(view: View, one: str, other: str, within: float) -> Floats:
    """Distance between what two things fill, m (T,): negative where they overlap, by the least
    depth; beyond ``within`` at least that.
    """
    pairs = _pairs(view, space(view, one), space(view, other), within, level=False)
    found = np.minimum(pairs.rest, FARTHEST)
    if len(pairs.step):
        np.minimum.at(found, pairs.step, gap(pairs.one, pairs.other))
    return found


@pointwise
def nearer(view: View, one: str, other: str, limit: float) -> Bools:
    """Whether the :func:`distance` of two things is less than a limit (T,).

    What the balls in boxes and around them decide is not measured.
    """
    first, second = space(view, one), space(view, other)
    away = first.pose[:, :, None, :3] - second.pose[:, None, :, :3]
    apart = np.sqrt(np.square(away).sum(axis=-1))
    inner = first.half.min(axis=1)[:, None] + second.half.min(axis=1)
    found = np.broadcast_to((apart < limit + inner - UNSURE).any(axis=(1, 2)), (len(view.trace),))
    if found.all() or (apart - first.radius[:, None] - second.radius >= limit + UNSURE).all():
        return np.array(found)
    return np.asarray(distance(view, one, other, limit) < limit)


@pointwise
def reach_in(view: View, one: str, other: str) -> Floats:
    """How far boxes of one thing reach into those of another, m (T,): the least depth, negative
    for a distance.
    """
    return np.asarray(-distance(view, one, other, 0.0))


@pointwise
def reach_out(view: View, one: str, other: str) -> Floats:
    """How far the boxes of one thing stick out of the one box of another, m (T,); negative where
    they are inside.
    """
    first, second = space(view, one), space(view, other)
    length, count = len(view.trace), len(first.half)
    pose = np.broadcast_to(first.pose, (length, *first.pose.shape[1:])).reshape(-1, 7)
    around = np.broadcast_to(second.pose, (length, count, 7)).reshape(-1, 7)
    inner = Boxes.of(pose, np.tile(first.half, (length, 1)))
    outer = Boxes.of(around, np.broadcast_to(second.half, (len(pose), 3)))
    away, out = inner.centre - outer.centre, np.full(len(pose), -np.inf)
    for axis in range(3):
        normal = outer.axes[:, axis]
        shares = (np.abs((inner.axes * normal[:, None]).sum(axis=0)) * inner.half).sum(axis=0)
        along = np.abs((away * normal).sum(axis=0))
        np.maximum(out, along + shares - outer.half[axis], out=out)
    return np.asarray(out.reshape(length, count).max(axis=1))


@pointwise
def above_margin(
    view: View, one: str, other: str, overlap: float, slack: float, height: float
) -> Floats:
    """Margins of one thing being straight above another, and not in it (T,).

    Args:
        view: what is looked at.
        one: what may be above.
        other: what may be below.
        overlap: how far their footprints reach into each other at least, m.
        slack: how far the underside may be below the top of what is below, m.
        height: how far above it may be, m.
    """
    pairs = _pairs(view, space(view, one), space(view, other), -overlap, level=True)
    above, covered = np.full((2, len(view.trace)), NONE)
    if len(pairs.step):
        own, its = pairs.one, pairs.other
        shadow = over(-footprint_gap(own, its), overlap)
        under, top = own.centre[2] - own.rise, own.centre[2] + own.rise
        below, roof = its.centre[2] + its.rise, its.centre[2] - its.rise
        stands = np.minimum((under - below + slack) / slack, (below + height - under) / height)
        np.maximum.at(above, pairs.step, np.minimum(shadow, stands))
        # What is inside an appliance has a piece of it below and another one above.
        hangs = np.minimum(shadow, (roof - top + slack) / slack)
        np.maximum.at(covered, pairs.step, hangs)
    margin: Floats = np.minimum(above, -covered)
    return margin
