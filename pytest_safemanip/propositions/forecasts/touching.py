"""What the robot, or what it holds, is about to touch: distances and closing speeds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.forecasts.motion import Told
from pytest_safemanip.propositions.grasp import pressed_by
from pytest_safemanip.propositions.kernels.solids import body_boxes, poses_at
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.distance import Boxes, separation
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import centred, multiply, relative, to_world

Floats = NDArray[np.float64]

AHEAD = 0.5
"""Seconds that are looked ahead."""
TIMES = np.linspace(0.0, AHEAD, 11)
"""When on the way it is looked."""
SLOW = 0.02
"""What closes in more slowly, m/s, only creeps."""
HARD = 0.15
"""Speed at which what stands fast and may be touched is struck rather than touched, m/s; of a limb,
whose shape is not known well, nothing slower counts."""
WRIST, WIDTH = 0.16, 0.06
"""How far an arm's last links reach behind its hand, and to the sides, m."""
FOOT, RISES = 0.8, 0.3
"""Height of the middle of the column that an arm stands on, above its base, and how far it reaches
up and down from there, m; it is as wide as the wrist."""
DEEP = 0.02
"""How far boxes have to reach into one another on the way, m: they are larger than what is in them,
and what slides along something only grazes it."""
LIMB, HAND = "limb", "hand"


class Mover(NamedTuple):
    """A box that the robot moves.

    Attributes:
        kind: of the hand, or of a limb; an object that is held, by name.
        pose: of its centre (7,).
        half: half extents (3,), m.
        velocity: of its centre (3,), m/s.
        brakes: share of that speed that it loses in a second; 0 if it does not slow down.
    """

    kind: str
    pose: Floats
    half: Floats
    velocity: Floats
    brakes: float

    def way(self, times: Floats) -> Floats:
        """How far it will have moved after some seconds (3, K), m: if it slows down, until it
        stands.
        """
        rolling = np.minimum(times, 1.0 / self.brakes) if self.brakes else times
        return np.multiply.outer(self.velocity, rolling - 0.5 * self.brakes * rolling**2)

    @classmethod
    def along(cls, kind: str, path: Floats, half: Floats, dt: float, pace: float) -> Mover:
        """What has come along poses (T, 7), a step every ``dt`` seconds, and goes on at a pace."""
        places = path[-4:, :3]
        if len(places) < 3:
            return cls(kind, path[-1], half, np.zeros(3), 0.0)
        velocity = (places[-1] - places[-2]) / dt
        before = (places[-1] - places[0]) / (dt * (len(places) - 1))
        # Between the middles of the two spans lies half of their difference.
        loss = (before - velocity) / (0.5 * dt * (len(places) - 2))
        square = float(velocity @ velocity)
        brakes = max(float(loss @ velocity) / square, 0.0) if square > SLOW**2 else 0.0
        return cls(kind, path[-1], half, pace * velocity, brakes)


class Approach(NamedTuple):
    """Something that is going to be touched if everything moves on as it does.

    Attributes:
        kind: of what moves, see :class:`Mover`.
        entity: what is touched.
        joint: what moves that piece of it, as ``entity/joint``; empty if nothing does.
        seconds: until then.
        speed: at which they close in, m/s.
    """

    kind: str
    entity: str
    joint: str
    seconds: float
    speed: float


def collision_in(view: View, told: Told) -> float:
    """Seconds until a limb strikes anything, or what is held touches what it may not."""
    fine = view.binding.supports
    return min(
        (
            one.seconds
            for one in view.own(approaches, told.pace)
            if (
                one.speed > HARD
                if one.kind == LIMB
                else one.kind != HAND and one.entity not in fine.get(one.kind, frozenset())
            )
        ),
        default=math.inf,
    )


def bad_contact_in(view: View, told: Told) -> float:
    """Seconds until the hand touches what it may not, or strikes what it may touch and what does
    not give way.
    """
    movable = view.trace.scene.object_index
    return min(
        (
            one.seconds
            for one in view.own(approaches, told.pace)
            if one.kind == HAND
            and (
                not _allowed(view, one)
                or (one.speed > HARD and not one.joint and one.entity not in movable)
            )
        ),
        default=math.inf,
    )


def _allowed(view: View, one: Approach) -> bool:
    """Whether the task gives the hand a reason to touch some part of that entity: beside a button
    is what it is on, and boxes are too coarse to tell.
    """
    return any(entity == one.entity for entity, _ in view.binding.touch)


def approaches(view: View, pace: float) -> list[Approach]:
    """What is going to be touched within :data:`AHEAD` by what the robot moves, straight on at the
    speed that each has, or slower as the robot is told; what touches already, or only slides along,
    is left out. Boxes meet before what is in them: where they reach into one another by less than
    :data:`DEEP`, and come on faster than :data:`HARD`, the touch is to come at once.

    Args:
        view: what is looked at.
        pace: see :class:`~pytest_safemanip.propositions.forecasts.motion.Told`.
    """
    movers = [m for m in _movers(view, min(pace, 1.0)) if float(np.linalg.norm(m.velocity)) > SLOW]
    if not movers:
        return []
    fields, found = (view.shared(_still), _moving(view)), list[Approach]()
    for mover in movers:
        own = Boxes.of(mover.pose[None], mover.half[None])
        way, around = mover.way(TIMES)[:, -1], _extent(own)[:, 0]
        low = mover.pose[:3] + np.minimum(way, 0.0) - around
        high = mover.pose[:3] + np.maximum(way, 0.0) + around
        met = [field.within(low, high) for field in fields]
        near = [field.only(some) for field, some in zip(fields, met, strict=True) if len(some)]
        if near:
            arrays = zip(*(field.boxes for field in near), strict=True)
            boxes = Boxes(*(np.concatenate(parts, axis=-1) for parts in arrays))
            owners = [owner for field in near for owner in field.owners]
            found += _first_touches(mover, own, boxes, owners)
    return found


def _first_touches(
    mover: Mover, own: Boxes, boxes: Boxes, owners: Sequence[tuple[str, str]]
) -> Iterator[Approach]:
    """Which of some boxes a mover touches on its way, and when."""
    count, samples = len(owners), len(TIMES)
    shift = np.repeat(mover.way(TIMES), count, axis=1)
    moved = Boxes(
        own.centre + shift,
        np.broadcast_to(own.axes, (3, 3, count * samples)),
        np.broadcast_to(own.half, (3, count * samples)),
    )
    there = Boxes(*(np.tile(array, samples) for array in boxes))
    gaps = separation(moved, there).reshape(samples, count)
    begun = (gaps[0] > -DEEP) & (gaps[0] - gaps[1] > HARD * TIMES[1])
    meets = ((gaps[0] > 0.0) | begun) & (gaps.min(axis=0) <= -DEEP)
    for k in np.flatnonzero(meets).tolist():
        owner, gap, n = owners[k], gaps[:, k], int(np.argmax(gaps[:, k] <= 0.0))
        part = gap[n - 1] / (gap[n - 1] - gap[n]) if n else 0.0
        when = float(TIMES[n - 1] + part * (TIMES[n] - TIMES[n - 1])) if n else 0.0
        closing = float(gap[0]) / max(when, 1e-3) if n else float(gap[0] - gap[1]) / TIMES[1]
        if owner[0] != mover.kind and closing > SLOW:
            yield Approach(mover.kind, owner[0], owner[1], when, closing)


def _extent(boxes: Boxes) -> Floats:
    """Half extents of the upright boxes around boxes (3, K), m."""
    return np.asarray(np.einsum("cak,ak->ck", np.abs(boxes.axes), boxes.half))


def _movers(view: View, pace: float) -> Iterator[Mover]:
    scene, steps, dt = view.trace.scene, view.trace.steps, view.trace.dt
    for number, hand in enumerate(scene.grippers):
        half, centre = np.array(hand.half), np.array(hand.centre)
        path = centred(np.asarray(steps.eef_poses[:, number], float), centre)
        yield Mover.along(HAND, path, half, dt, pace)
        back = int(np.argmax(np.abs(centre)))
        if abs(centre[back]) < half.min() / 4.0:
            continue  # nobody can tell from the box where its arm is
        behind, wrist, fingers = np.zeros(3), np.full(3, WIDTH), half / 2.0
        behind[back] = -math.copysign(fingers[back], centre[back])
        yield Mover.along(HAND, centred(path, behind), fingers, dt, pace)
        wrist[back] = WRIST / 2.0
        behind[back] = math.copysign(half[back] + wrist[back], centre[back])
        path = centred(path, behind)
        yield Mover.along(LIMB, path, wrist, dt, pace)
    column = centred(np.asarray(steps.base_pose, float), np.array((0.0, 0.0, FOOT)))
    yield Mover.along(LIMB, column, np.array((WIDTH, WIDTH, RISES)), dt, pace)
    for name in view.binding.objects:
        for number in range(len(scene.grippers)):
            if not view("obj_grasped", name)[-1] or not pressed_by(view, name, number)[-1]:
                continue
            index = scene.object_index[name]
            body = scene.bodies[index]
            # It is carried along: what it does by itself in an opening hand is no way of the hand.
            place = centred(np.asarray(steps.object_pose[-1, index], float), body.centre)
            path = _carried_along(np.asarray(steps.eef_poses[:, number], float), place)
            yield Mover.along(name, path, np.array(body.half), dt, pace)


def _carried_along(hand: Floats, place: Floats) -> Floats:
    """Where what is at a pose (7,) now was when the hand that holds it was at some (T, 7)."""
    own = relative(hand[-1], place)
    turned = multiply(hand[:, 3:], np.broadcast_to(own[3:], (len(hand), 4)))
    return np.concatenate((to_world(hand, own[:3]), turned), axis=1)


class _Field(NamedTuple):
    """Boxes of what may be in the way.

    Attributes:
        boxes: they.
        low: of the upright boxes around them (3, K), m.
        high: likewise.
        owners: entity and joint of each.
    """

    boxes: Boxes
    low: Floats
    high: Floats
    owners: Sequence[tuple[str, str]]

    @classmethod
    def of(cls, pose: Floats, half: Floats, owners: Sequence[tuple[str, str]]) -> _Field:
        """Of poses of their centres (K, 7) and half extents (K, 3)."""
        boxes = Boxes.of(pose, half)
        around = _extent(boxes)
        return cls(boxes, boxes.centre - around, boxes.centre + around, owners)

    def within(self, low: Floats, high: Floats) -> NDArray[np.intp]:
        """Numbers of those that reach into an upright box."""
        meets = (self.low <= high[:, None]) & (self.high >= low[:, None])
        return np.flatnonzero(meets.all(axis=0))

    def only(self, some: NDArray[np.intp]) -> _Field:
        """Some of them, by number."""
        boxes = Boxes(*(array[..., some] for array in self.boxes))
        owners = [self.owners[k] for k in some.tolist()]
        return _Field(boxes, self.low[:, some], self.high[:, some], owners)


def _still(view: View) -> _Field:
    """The pieces of furniture that never move."""
    solid = view.trace.scene.solid
    own = [k for k in range(len(solid)) if not solid.joints[k] and solid.entities[k] != ROBOT]
    return _Field.of(solid.pose[own], solid.half[own], [(solid.entities[k], "") for k in own])


def _moving(view: View) -> _Field:
    """The pieces that joints move, and the objects, where they are at the last step."""
    solid, steps = view.trace.scene.solid, view.trace.steps
    pieces, joints, owners = view.shared(_jointed)
    half, centre = view.shared(body_boxes)
    poses = poses_at(view, pieces, steps.joint[-1, joints, 0])
    things = centred(np.asarray(steps.object_pose[-1], float), centre)
    return _Field.of(
        np.concatenate((poses, things)), np.concatenate((solid.half[pieces], half)), owners
    )


def _jointed(
    view: View,
) -> tuple[NDArray[np.intp], NDArray[np.intp], list[tuple[str, str]]]:
    """Numbers of the pieces that joints move, of these joints, and owners of these pieces and of
    all objects.
    """
    scene, solid = view.trace.scene, view.trace.scene.solid
    pieces = [k for k in range(len(solid)) if solid.joints[k]]
    joints = [scene.joint_index[solid.joints[k]] for k in pieces]
    owners = [(solid.entities[k], solid.joints[k]) for k in pieces]
    owners += [(body.entity, "") for body in scene.bodies]
    return np.array(pieces, np.intp), np.array(joints, np.intp), owners
