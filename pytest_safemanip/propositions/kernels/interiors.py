"""Positions of objects relative to containers: interiors of fixtures, boxes of objects.

Everything is computed for all objects at once: online, a call costs more than its arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.kernels.margins import within
from pytest_safemanip.propositions.kernels.solids import body_boxes
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.frames import (
    Frames,
    along,
    corners_within,
    depth_within,
    placed,
    rotation,
)
from pytest_safemanip.trace.geometry import centred, corners, to_local

Floats = NDArray[np.float64]
ROUNDING = 1e-6
"""Rounding error of float32 poses, m."""
DEEP = 0.01
"""How far below a vessel's rim the underside of what leans in it is at least, m: boxes are larger
than what is in them, and what stands on a rim is not in the vessel."""

Steps = NDArray[np.intp]


def interiors(view: View, fixture: str) -> list[tuple[NDArray[np.float32], Floats]]:
    """Poses over time (T, 7) and half extents (3,) of the fixture's interiors.

    Raises:
        TraceError: if it has none.
    """
    scene = view.trace.scene
    boxes = scene.boxes_of(fixture, "interior")
    if not boxes:
        raise TraceError(f"{fixture!r} has no interior")
    return [(view.trace.steps.box_pose[:, b], np.array(scene.boxes[b].half)) for b in boxes]


def holding_halves(view: View, entity: str) -> list[Floats]:
    """Half extents (3,) of where an entity holds things: the box of an object, or the interiors of
    a fixture.

    Raises:
        TraceError: if a fixture has no interior.
    """
    index = view.trace.scene.object_index.get(entity)
    if index is None:
        return [half for _, half in interiors(view, entity)]
    return [np.array(view.trace.scene.bodies[index].half)]


@pointwise
def seen_from(view: View, entity: str, number: int) -> Floats:
    """Centres of all objects' boxes, seen from where an entity holds things (T, N, 3).

    Args:
        view: what is looked at.
        entity: holds them.
        number: of the box among its :func:`holding_halves`.
    """
    trace = view.trace
    index = trace.scene.object_index.get(entity)
    if index is None:
        pose = interiors(view, entity)[number][0]
    else:
        own = trace.scene.bodies[index].centre
        pose = centred(trace.steps.object_pose[:, index], own).astype(np.float32)
    return seen_in(view, pose, centres)


def seen_in(view: View, pose: NDArray[np.float32], points: Callable[[View], Floats]) -> Floats:
    """Points as seen from poses (T, 7).

    Args:
        view: what is looked at.
        pose: where they are seen from.
        points: gives them, world frame (T, ..., 3), and depends on each step alone.
    """
    frames = Frames(pose)
    if frames.turn is None:
        return frames.local(points(view).T).T
    return frames.shifted(_along(view, points, frames.turn).T).T


@pointwise
def _along(view: View, points: Callable[[View], Floats], turn: bytes) -> Floats:
    """Points along the axes of frames (T, ..., 3): furniture stands in few directions."""
    return along(turn, points(view).T).T


def place_in(view: View, content: str, entity: str, number: int) -> Floats:
    """Centre of one object's box as :func:`seen_from` an entity (T, 3)."""
    return seen_from(view, entity, number)[:, view.trace.scene.object_index[content]]


@pointwise
def all_within(view: View, entity: str) -> Bools:
    """Whether the centres of all objects' boxes are where an entity holds things (T, N)."""
    within = np.zeros((len(view.trace), len(view.trace.scene.bodies)), bool)
    for number, half in enumerate(holding_halves(view, entity)):
        within |= (np.abs(seen_from(view, entity, number)) <= half).all(axis=-1)
    return within


@pointwise
def within_margin(view: View, entity: str) -> Floats:
    """Margins of the centres of all objects' boxes being where an entity holds things (T, N)."""
    halves = enumerate(holding_halves(view, entity))
    found = [within(seen_from(view, entity, number), half) for number, half in halves]
    return np.asarray(np.max(found, axis=0))


def centre_within(view: View, content: str, entity: str) -> Bools:
    """Whether the centre of an object's box is where an entity holds things (T,)."""
    return np.asarray(all_within(view, entity)[:, view.trace.scene.object_index[content]])


def lies_in(view: View, content: str, vessel: str, at: Steps) -> Bools:
    """Whether an object lies in another one at some steps (K,): the centre of its box is in the
    other's, or it leans in there, higher than the rim, but the middle of its underside is well
    below that.
    """
    scene, poses = view.trace.scene, view.trace.steps.object_pose
    own, other = (scene.object_index[name] for name in (content, vessel))
    body, box = scene.bodies[own], scene.bodies[other]
    points = corners(poses[at, own], body.half, body.centre)
    middle = points.mean(axis=1)
    under = middle.copy()
    under[:, 2] = points[..., 2].min(axis=1) + DEEP
    frame = centred(poses[at, other], box.centre)
    centre, foot = (to_local(frame, place) for place in (middle, under))
    # The corners of a round thing's box may be lower than the vessel that it lies in.
    leans = (np.abs(foot[:, :2]) <= box.half[:2]).all(axis=1) & (foot[:, 2] <= box.half[2])
    leans &= centre[:, 2] >= -box.half[2]
    return np.asarray((np.abs(centre) <= box.half).all(axis=1) | leans)


def inside(view: View, entity: str, step: int) -> list[str]:
    """Objects whose box's centre is where an entity holds things, at a step."""
    bodies, within = view.trace.scene.bodies, all_within(view, entity)[step]
    return [body.entity for body, is_inside in zip(bodies, within, strict=True) if is_inside]


@pointwise
def near(view: View, fixture: str, number: int) -> Bools:
    """Where an object's box may reach into an interior: a cube around its bounding sphere does, but
    for ``enclosure.tolerance`` (T, N).
    """
    limit = holding_halves(view, fixture)[number] + view.shared(_reach)[:, None]
    return np.asarray((np.abs(seen_from(view, fixture, number)) <= limit).all(axis=-1))


def _reach(view: View) -> Floats:
    """Distance within which an object may reach into an interior, m (N,)."""
    slack = view.parameters["enclosure.tolerance"] + ROUNDING
    return np.array([np.linalg.norm(body.half) + slack for body in view.trace.scene.bodies])


@pointwise
def entered(view: View, fixture: str, depth: float) -> Bools:
    """Whether some corner of each object's box is inside an interior, by more than a depth (T, N).

    Args:
        view: what is looked at.
        fixture: the enclosure.
        depth: m.
    """
    found = np.zeros((len(view.trace), len(view.trace.scene.bodies)), bool)
    for number in range(len(holding_halves(view, fixture))):
        step, body = np.nonzero(near(view, fixture, number))
        rows = step, body
        found[rows] |= _corners_inside(view, fixture, number, rows, -depth).any(axis=1)
    return found


def corners_inside(
    view: View, name: str, fixture: str, steps: Steps, slack: float, floor: bool = False
) -> Bools:
    """Which corners of an object's box are inside, for the interior that holds most of them (K, 8).

    Args:
        view: what is looked at.
        name: the object.
        fixture: the enclosure.
        steps: when (K,).
        slack: how far outside still counts as inside, m, at most ``enclosure.tolerance``; negative
            demands a depth.
        floor: whether corners below the floor count as on it if the box's centre is above it.
    """
    index, best = view.trace.scene.object_index[name], np.zeros((len(steps), 8), bool)
    for number in range(len(holding_halves(view, fixture))):
        where = np.flatnonzero(near(view, fixture, number)[steps, index])
        rows = steps[where], np.full(len(where), index)
        inside = _corners_inside(view, fixture, number, rows, slack, floor)
        more = np.count_nonzero(inside, axis=1) > np.count_nonzero(best[where], axis=1)
        best[where[more]] = inside[more]
    return best


def _corners_inside(
    view: View,
    fixture: str,
    number: int,
    rows: tuple[Steps, Steps],
    slack: float,
    floor: bool = False,
) -> Bools:
    """Which corners of boxes are inside one interior (K, 8), of objects by step and number (K,)."""
    if len(rows[0]) == 0:
        return np.zeros((0, 8), bool)
    return corners_within(*_boxes_in(view, fixture, number, rows, slack, floor))


def box_depth(
    view: View, name: str, fixture: str, steps: Steps, slack: float, floor: bool
) -> Floats:
    """How far inside an interior all corners of an object's box are, in the one that it is most
    inside of, m; negative outside (K,). The arguments are those of :func:`corners_inside`.
    """
    rows = steps, np.full(len(steps), view.trace.scene.object_index[name])
    found = [
        depth_within(*_boxes_in(view, fixture, number, rows, slack, floor))
        for number in range(len(holding_halves(view, fixture)))
    ]
    return np.asarray(np.max(found, axis=0))


def _boxes_in(
    view: View, fixture: str, number: int, rows: tuple[Steps, Steps], slack: float, floor: bool
) -> tuple[Floats, Floats, Floats, Bools]:
    """Boxes of objects by step and number (K,) as seen from one interior, which they may be outside
    of by a slack: centre, edges, limit and whether they lie on the floor.
    """
    step, body = rows
    pose, half = interiors(view, fixture)[number]
    sizes = view.shared(body_boxes)[0][body]
    edges = rotation(view.trace.steps.object_pose[step, body, 3:]) * sizes.T
    centre = np.ascontiguousarray(seen_from(view, fixture, number)[step, body].T)
    lying = (centre[2] > -half[2]) & floor
    return centre, Frames(pose[step]).turned(edges), half + slack, lying


@pointwise
def centres(view: View) -> Floats:
    """Centres of all objects' boxes (T, N, 3), stored as frames take them."""
    return placed(view.trace.steps.object_pose, view.shared(body_boxes)[1]).T
