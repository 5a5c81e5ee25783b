"""Where objects are relative to the interiors of a fixture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.geometry import centred, corners, to_local, to_world

Interior = tuple[NDArray[np.float32], NDArray[np.float64]]


def interiors(view: View, fixture: str) -> list[Interior]:
    """Poses over time (T, 7) and half extents (3,) of the fixture's interiors.

    Raises:
        TraceError: if it has none.
    """
    scene = view.trace.scene
    boxes = scene.boxes_of(fixture, "interior")
    if not boxes:
        raise TraceError(f"{fixture!r} has no interior")
    return [(view.trace.steps.box_pose[:, b], np.array(scene.boxes[b].half)) for b in boxes]


def centres(view: View, index: int) -> NDArray[np.float64]:
    """Centre of an object's box over time (T, 3)."""
    body = view.trace.scene.bodies[index]
    return to_world(view.trace.steps.object_pose[:, index], body.centre)


def holding_boxes(view: View, entity: str) -> list[Interior]:
    """Where an entity holds things: the box of an object, or the interiors of a fixture.

    Raises:
        TraceError: if a fixture has no interior.
    """
    scene = view.trace.scene
    if entity not in scene.object_index:
        return interiors(view, entity)
    index = scene.object_index[entity]
    body = scene.bodies[index]
    pose = centred(view.trace.steps.object_pose[:, index], body.centre)
    return [(pose.astype(np.float32), np.array(body.half))]


@pointwise
def place_in(view: View, content: str, entity: str, number: int) -> NDArray[np.float64]:
    """Centre of an object's box, seen from where an entity holds things (T, 3).

    Args:
        view: what is looked at.
        content: the object.
        entity: holds it.
        number: of the box among its :func:`holding_boxes`.
    """
    box = holding_boxes(view, entity)[number]
    return to_local(box[0], centres(view, view.trace.scene.object_index[content]))


@pointwise
def centre_within(view: View, content: str, entity: str) -> Bools:
    """Whether the centre of an object's box is where an entity holds things (T,)."""
    within = np.zeros(len(view.trace), bool)
    for number, (_, half) in enumerate(holding_boxes(view, entity)):
        within |= (np.abs(place_in(view, content, entity, number)) <= half).all(axis=1)
    return within


def inside(view: View, entity: str, step: int) -> list[str]:
    """Objects whose box's centre is where an entity holds things, at a step."""
    bodies = view.trace.scene.bodies
    return [b.entity for b in bodies if centre_within(view, b.entity, entity)[step]]


@pointwise
def corners_inside(view: View, name: str, fixture: str, slack: float, floor: bool = False) -> Bools:
    """Which corners are inside, for the interior that holds most of them (T, 8).

    Args:
        view: what is looked at.
        name: the object.
        fixture: the enclosure.
        slack: how far outside still counts as inside, m; negative demands a depth.
        floor: whether corners below the floor count as on it if the box's centre is above it.
    """
    trace = view.trace
    index = trace.scene.object_index[name]
    body = trace.scene.bodies[index]
    points = corners(trace.steps.object_pose[:, index], body.half, body.centre)
    best = np.zeros((len(trace), 8), bool)
    for pose, half in interiors(view, fixture):
        local = to_local(pose[:, None], points)
        if floor:
            lying = (local[..., 2].mean(axis=1, keepdims=True) > -half[2]) & (local[..., 2] < 0)
            local[..., 2] = np.where(lying, 0.0, local[..., 2])
        inside = (np.abs(local) < half + slack).all(axis=-1)
        more = inside.sum(axis=1) > best.sum(axis=1)
        best[more] = inside[more]
    return best
