"""Supports of objects: the contacts below them, and their motion relative to these.

For all objects and some steps at once: a call costs more than its arithmetic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.kernels.forces import owners
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import angle_between, multiply, relative, to_world
from pytest_safemanip.trace.planar import hull_margin

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

UPWARD = 0.5
"""Vertical share of a contact normal from which it carries: 30 degrees from the horizontal up."""


@dataclass(frozen=True)
class Carried:
    """Objects that permitted supports carry: by object, then by step.

    Attributes:
        body: the object (G,).
        step: when (G,).
        first: where its contact points begin (G,).
        count: how many there are (G,).
        points: all contact points (R, 3).
        below: the part that carries, of each contact point (R,).
        level: mean height of the contact points, m (G,).
        com: centre of mass, world frame (G, 3).
        share: of the force that carries it, what comes from them, the robot's left out (G,).
    """

    body: Indices
    step: Indices
    first: Indices
    count: Indices
    points: NDArray[np.float32]
    below: Indices
    level: Floats
    com: Floats
    share: Floats

    def points_of(self, group: int) -> NDArray[np.float32]:
        """Contact points of one object at one step (K, 3)."""
        return self.points[self.first[group] : self.first[group] + self.count[group]]


def carrying_rows(view: View, first: int, stop: int) -> tuple[Indices, Indices, Indices]:
    """Contact rows that carry an object at some steps, the object, and the part below it
    (R,), (R,), (R,).
    """
    contacts, owner = view.trace.steps.contacts, view.shared(owners)
    begin, end = contacts.span(first, stop)
    up = contacts.normal[begin:end, 2]
    # The normal points from a to b: up if the lower side is a.
    rows = np.flatnonzero((np.abs(up) >= UPWARD) & (contacts.force[begin:end] > 0))
    rises, rows = up[rows] > 0, rows + begin
    a, b = contacts.a[rows], contacts.b[rows]
    upper, below = owner[np.where(rises, b, a)], np.where(rises, a, b)
    keep = np.flatnonzero((upper >= 0) & (owner[below] != upper))
    return rows[keep], upper[keep], below[keep]


def carried_objects(view: View, first: int, stop: int) -> Carried:
    """Who is carried by what may carry it, and where, at steps ``first`` to ``stop - 1``."""
    steps = view.trace.steps
    rows, body, below = carrying_rows(view, first, stop)
    at = steps.contacts.step[rows]
    permitted = view.shared(_permitted)[body, below] & ~_lost(view, body, below, at)
    share = _share(view, rows, permitted, view.shared(_robot)[below], (at - first, body))
    rows, body, below, at = rows[permitted], body[permitted], below[permitted], at[permitted]
    # They are in order of their steps, and stay so; small integers are sorted without comparing.
    order = np.argsort(body.astype(np.min_scalar_type(len(steps.object_pose[0]))), kind="stable")
    rows, body, below, at = rows[order], body[order], below[order], at[order]
    starts = (body[1:] != body[:-1]) | (at[1:] != at[:-1])
    begins = np.flatnonzero(np.concatenate((np.ones(len(rows[:1]), bool), starts)))
    count = np.append(begins[1:], len(rows)) - begins
    body, step = body[begins], at[begins]
    coms = np.array([b.com for b in view.trace.scene.bodies], float).reshape(-1, 3)
    points = steps.contacts.position[rows]
    return Carried(
        body=body,
        step=step,
        first=begins,
        count=count,
        points=points,
        below=below,
        level=np.add.reduceat(points[:, 2], begins, dtype=float) / count,
        com=to_world(steps.object_pose[step, body], coms[body]),
        share=share[step - first, body],
    )


def _share(
    view: View, rows: Indices, permitted: Bools, robot: Bools, cell: tuple[Indices, Indices]
) -> Floats:
    """How much of what carries each object comes from permitted supports (steps, N).

    Args:
        view: what is looked at.
        rows: contact points that carry (R,).
        permitted: which of them are on a permitted support (R,).
        robot: which of them are on the robot: they count for nothing (R,).
        cell: the step, counted from the first, and the object of each (R,), (R,).
    """
    contacts = view.trace.steps.contacts
    upward = np.abs(contacts.force[rows] * contacts.normal[rows, 2])
    shape = int(cell[0].max(initial=0)) + 1, len(view.trace.scene.bodies)
    place, size = np.ravel_multi_index(cell, shape), math.prod(shape)
    ours = np.bincount(place, np.where(permitted, upward, 0.0), size)
    others = np.bincount(place, np.where(permitted | robot, 0.0, upward), size)
    return np.divide(ours, ours + others, np.zeros(size), where=ours > 0.0).reshape(shape)


def margin_at(view: View, found: Carried, group: int) -> float:
    """Distance of the centre of mass inside the hull of its support points, m."""
    return hull_margin(found.points_of(group)[:, :2], found.com[group, :2])


def _permitted(view: View) -> Bools:
    """The parts that each object may rest on (N, parts)."""
    scene, supports = view.trace.scene, view.binding.supports
    rows = [
        [part.entity in supports.get(body.entity, ()) for part in scene.parts]
        for body in scene.bodies
    ]
    return np.array(rows, bool).reshape(len(scene.bodies), len(scene.parts))


def _lost(view: View, upper: Indices, below: Indices, at: Indices) -> Bools:
    """Where what carries an object lies on the floor itself, or on something that does (R,): what
    was let go onto a plate that fell down with it was not put down.
    """
    on_floor = view.shared(_room)[below] & ~view.shared(_permitted)[upper, below]
    result, carrier = np.zeros(len(below), bool), view.shared(owners)[below]
    if not on_floor.any():
        return result
    lost = np.zeros((len(view.trace), len(view.trace.scene.bodies)), bool)
    stacked, more = np.flatnonzero(carrier >= 0), on_floor
    while more.any():
        lost[at[more], upper[more]] = True
        result[stacked] = lost[at[stacked], carrier[stacked]]
        more = result & ~lost[at, upper]
    return result


@pointwise
def on_room(view: View) -> Bools:
    """Whether the floor carries each object (T, N)."""
    found = np.zeros((len(view.trace), len(view.trace.scene.bodies)), bool)
    rows, body, below = carrying_rows(view, 0, len(view.trace))
    lies = view.shared(_room)[below]
    found[view.trace.steps.contacts.step[rows[lies]], body[lies]] = True
    return found


def _robot(view: View) -> Bools:
    """Which parts are of the robot (parts,)."""
    return np.array([part.entity == ROBOT for part in view.trace.scene.parts], bool)


def _room(view: View) -> Bools:
    """Which parts are of the floor or a wall (parts,)."""
    scene = view.trace.scene
    return np.array([scene.entity[part.entity].kind == "room" for part in scene.parts], bool)


def motion(view: View, found: Carried, groups: Indices) -> tuple[Floats, Floats]:
    """Speed, m/s, and spin, rad/s, of some of the objects relative to what carries them: the
    farthest that they moved, and turned, since any step of the last ``settled.window``, by that
    window (groups,), (groups,). Of several things that carry it, that one counts relative to which
    an object moves most.
    """
    steps, seconds = view.trace.steps, view.parameters["settled.window"]
    speed, spin = np.zeros(len(groups)), np.zeros(len(groups))
    if not len(groups):
        return speed, spin
    length = found.count[groups]
    begins = np.cumsum(length) - length
    rows = np.repeat(found.first[groups] - begins, length) + np.arange(length.sum())
    step, body = np.repeat(found.step[groups], length), np.repeat(found.body[groups], length)
    for lag in range(1, view.trace.count(seconds) + 1):
        before = np.maximum(step - lag, 0)
        there = _carried_along(
            view, found.below[rows], steps.object_pose[before, body], before, step
        )
        now = steps.object_pose[step, body]
        moved = np.linalg.norm(now[:, :3] - there[:, :3], axis=1)
        turned = angle_between(there[:, 3:], now[:, 3:])
        np.maximum(speed, np.maximum.reduceat(moved, begins), out=speed)
        np.maximum(spin, np.maximum.reduceat(turned, begins), out=spin)
    return speed / seconds, spin / seconds


def _carried_along(
    view: View, below: Indices, pose: Floats, before: Indices, at: Indices
) -> Floats:
    """Where poses (R, 7) come to that lie still on the parts below them, from some steps (R,) to
    others (R,).
    """
    steps, owner = view.trace.steps, view.shared(owners)[below]
    joint, way = view.shared(_slides)
    slides, stacked = np.flatnonzero(joint[below] >= 0), np.flatnonzero(owner >= 0)
    there, moved_by = pose.astype(np.float64), below[slides]
    if len(slides):
        then, now = (steps.joint[t[slides], joint[moved_by], 0].astype(float) for t in (before, at))
        there[slides, :3] += way[moved_by] * (now - then)[:, None]
    if len(stacked):
        then, now = (steps.object_pose[t[stacked], owner[stacked]] for t in (before, at))
        lies = relative(then, there[stacked])
        there[stacked, :3] = to_world(now, lies[:, :3])
        there[stacked, 3:] = multiply(now[:, 3:], lies[:, 3:])
    return there


def _slides(view: View) -> tuple[Indices, Floats]:
    """The sliding joint that moves each part, -1 without one, and how it moves it in m at full
    travel (parts,), (parts, 3).
    """
    scene = view.trace.scene
    joint, way = np.full(len(scene.parts), -1, np.intp), np.zeros((len(scene.parts), 3))
    for index, part in enumerate(scene.parts):
        number = scene.joint_index.get(part.joint, -1)
        if number >= 0 and scene.joints[number].kind == "slide":
            joint[index] = number
            way[index] = np.asarray(scene.joints[number].axis) * scene.joints[number].travel
    return joint, way
