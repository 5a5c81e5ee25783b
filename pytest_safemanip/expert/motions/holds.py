"""Ways to take along what a joint moves: pinched between the fingers, pushed with closed ones, or
with one finger of an open hand, which hooks it.

They are found on the solid pieces that the joint moves, whatever those are: a bar, a panel's edge,
the fin of a knob, a lever, a rail.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.base import NOTCH
from pytest_safemanip.expert.robot.hand import (
    FINGER_SIDE,
    FINGER_THICK,
    FINGERTIP,
    OPENING,
    finger_points,
    palm_points,
)
from pytest_safemanip.expert.robot.rotations import Array, rotation_vector
from pytest_safemanip.expert.world.room import Room
from pytest_safemanip.expert.world.standing import solids_then
from pytest_safemanip.expert.world.things import Piece, pieces
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import about, corners, matrix, rotate
from pytest_safemanip.trace.kinematics import carried

WIDEST = 0.064
"""Of what is pinched, m: the fingers open to 8 cm, and come in with room on both sides."""
BESIDE, OFF_FACE, SIDEWAYS, HEAD_ON = 0.009, 0.006, 0.5, -0.5
"""Kept free between what is pinched and the fingers that come in, and before a face that they come
in along, m; and with how much of its approach along a face, and away from it, a hand does that, as
cosines."""
LETS_GO = 0.10
"""How far the hand draws back from what it held, m."""
SHALLOWEST, DEEPEST, BEYOND, BEFORE_BACK = -0.005, 0.018, 0.010, (0.0135, 0.0185)
"""How far behind a piece's edge it is pinched at least and at most, how far beyond its middle if it
is thin, and how far before its back for fingertips, straight or tipped, to stay before what is
behind it, m."""
TILTS, SLANTS = (0.0, 20.0, -20.0, 40.0, -40.0), (0.0, 30.0, -30.0)
"""How far a hand that pinches may be turned about the line between its pads, and about a bar, for
one finger to be behind it, degrees."""
SLIGHTLY = (15.0, -15.0)
"""Likewise about the fin of a knob where something juts out beside that: the palm clears it, and
neither finger meets what the fin stands on, degrees."""
PITCHES, YAWS, ROLLS = (15.0, 35.0, 55.0, 75.0, 88.0), (0.0, 30.0, -30.0, 60.0, -60.0), (0.0, 90.0)
"""Of a hand that pushes, degrees."""
NEARLY = math.radians(6.0)
"""By how much two fingertips are off the face that they push, at most, for the hand to be turned
until they are on it, rad: the base stands askew, and one alone may not press as hard as some doors
ask.
"""
HALF_ROUND = 0.5
"""Cost of a hand that is rotated by 180 degrees about its approach: its fingers are alike, but the
arm behind it goes elsewhere."""
AGAINST, ALONG, OVER_EDGE, INSIDE, OVER = 0.6, 0.15, 0.75, 0.7, 0.4
"""A face is pushed that points against the motion by at least this, by a hand that points along it
or towards it, or away from it over its edge, or by the inner side of a finger, as cosines."""
SPACING, FROM_END, OFF_EDGE, ON_EDGE = 0.10, 0.015, 0.03, 0.004
"""Between two places on a piece, and from its end, where it is pinched, pushed, and hooked, m."""
TIP = 0.010
"""From a place near an edge back to the grip point of fingers whose tips just come over it, m."""
ROUND = 0.2
"""A knob is all round its hinge, its middle nearer to it than this share of its farthest point."""
LEVERAGE, SMALL, ON_AXIS = 0.5, 0.07, 0.02
"""Nearer to a hinge than by this share of the farthest point a part is not pushed; what reaches no
farther from its hinge than this, m, is held this near to it, m, and turned with the hand."""
BACKWARDS, UPWARDS = -0.1, 0.3
"""A hand points neither back towards the base nor up by more, as cosines."""
EDGE, SLIPPED, FOR_PULLING, FOR_PUSHING, HOOKED, TO_TWIST = 1.2, 0.8, 0.6, 1.0, 0.2, 1.5
"""Costs: of pinching what is not made for it, or what slipped; of pushing what is to be opened, of
pinching what is to be closed, of one finger alone, of pushing what is small enough to twist."""
CROWDED, MEETS, ROUGHLY = 80.0, 2.0, 0.001
"""Costs for each m by which the hand would be in something some time, and of that at all, if it is
more than what boxes around pieces are too large, m."""
BARS = (0.0, 0.006, 0.012)
"""How far behind the grip point what is as thin as a bar is looked for beside the fingers, m."""
PALM_OFF = 0.008
"""Room that a palm is to have that turns with what it holds: it is ahead of that, and sags, m."""
APART, OFF_MIDDLE, NARROW = 0.04, 1.5, 0.5
"""Of places that are alike only one is looked at, m; costs of each m off the middle of what slides,
and of a face that is narrower than a finger."""
KIND, AGAIN = 0.4, 0.1
"""Hands that point the same way within this, as cosines, are of a kind, and the cost of each
further one of a kind."""
SPOTS, MOST, LIKELY = 36, 1500, 400
"""Places that are pushed, holds that are looked at, and those that are offered."""


@dataclass(frozen=True)
class Hold:
    """How the hand takes a part along.

    Attributes:
        point: grip point (3,).
        hand: orientation (3, 3).
        opening: of the fingers on the way there, share of the full opening.
        cost: what speaks against it, 1 for a good reason.
        contact: the point of the part that the hand goes with (3,).
        normal: of the face that fingers push (3,); zeros where they pinch.
        finger: which one pushes: 1 or -1 along the fingers' travel, 0 if both do, closed.
        until: share of the way on which nothing is in the way of arm and hand.
    """

    point: Array
    hand: Array
    opening: float
    cost: float
    contact: Array
    normal: Array
    finger: int = 0
    until: float = 1.0

    @property
    def pinched(self) -> bool:
        """Whether the fingers close on the part."""
        return not self.normal.any()

    @property
    def into(self) -> Array:
        """The direction in which the hand comes in (3,): along a face that a side pushes."""
        approach = self.hand[:, 2]
        away = float(approach @ self.normal)
        along = approach - away * self.normal
        length = float(np.linalg.norm(along))
        return along / length if length > SIDEWAYS and away > HEAD_ON else approach

    def back(self, joint: Joint, by: float) -> Array:
        """The direction in which the hand draws back (3,): off a face that it points at, and the
        way that it came, which was free, if it pushed that far.

        Args:
            joint: moves the part.
            by: how much more open it is than when the hand came.
        """
        if float(self.hand[:, 2] @ self.normal) > 0.0:
            return -self.into
        far = joint.kind == "slide" and abs(by * joint.travel) > LETS_GO
        return self.normal if far and not (self.pinched or self.finger) else -self.hand[:, 2]

    @property
    def clear(self) -> Array:
        """From the grip point to one off the face that fingers push (3,)."""
        return (OFF_FACE if float(self.into @ self.normal) > -0.1 else 0.0) * self.normal

    def moved(self, joint: Joint, by: float, share: float) -> Hold:
        """The same when the part is more open.

        Args:
            joint: moves the part.
            by: how much more.
            share: of a hinge's turn that the hand turns with it.
        """
        pose = np.append(self.contact, (1.0, 0.0, 0.0, 0.0))
        contact, hand, normal = carried(joint, pose, np.array(by))[:3], self.hand, self.normal
        if joint.kind == "hinge":
            axis, turn = np.asarray(joint.axis), by * joint.travel
            hand = np.asarray(matrix(about(axis, share * turn))) @ hand
            normal = rotate(about(axis, turn), normal)
        point = contact + _off(normal, hand, self.finger)
        return replace(self, point=point, hand=hand, contact=contact, normal=normal)


def holds(
    arm: Arm,
    joint: Joint,
    bars: Sequence[Piece],
    first: float,
    goal: float,
    slips: bool = False,
    wider: bool = False,
) -> list[Hold]:
    """Ways to move a part, the likeliest first.

    Args:
        arm: the arm.
        joint: moves the part.
        bars: around what is made to be taken hold of.
        first: openness now.
        goal: openness wanted.
        slips: whether it slipped out of the fingers.
        wider: whether it is moved in ways that are rarely needed, and only so.
    """
    part, way = pieces(arm, joint, first), math.copysign(1.0, goal - first)
    farthest, by = _farthest(joint, part), goal - first
    small = farthest < SMALL
    # Nothing turns that is pushed at the corners of the box around a round knob.
    knob = small and motion(joint, _middle(part), 1.0)[1] < ROUND * farthest
    found = [] if wider and knob else [*_pushed(arm, joint, part, way, wider)]
    if knob or not wider:
        slants = SLIGHTLY if wider else SLANTS
        found = [*_pinched(arm, joint, part, bars, by, slips, slants), *found]
    found = [hold for hold in found if _stays(hold.moved(joint, goal - first, 0.0))]
    found = [found[number] for number in _likeliest(found, MOST)]
    off = PALM_OFF if small else 0.0
    rough = _crowded(arm, joint, found, np.linspace(first, goal, 3), 7, off)
    found = [found[number] for number in _likeliest(rough, LIKELY)]
    found = _crowded(arm, joint, found, np.linspace(first, goal, 7), 13, off)
    return sorted(found, key=lambda hold: hold.cost)


def _likeliest(found: Sequence[Hold], most: int) -> list[int]:
    """The numbers of the cheapest holds, of all kinds of hands: which ones the arm can reach is not
    known yet.
    """
    seen: dict[tuple[int, ...], int] = {}
    costs = np.zeros(len(found))
    for number in np.argsort([hold.cost for hold in found], kind="stable").tolist():
        hold = found[number]
        ways = np.append(hold.hand[:, 2], hold.normal) / KIND
        kind = (hold.finger, *np.round(ways).astype(int).tolist())
        costs[number] = hold.cost + AGAIN * seen.setdefault(kind, 0)
        seen[kind] += 1
    order: list[int] = np.argsort(costs, kind="stable")[:most].tolist()
    return order


def _stays(hold: Hold) -> bool:
    """Whether the finger of an open hand that pushed a face still does where it came to."""
    return not hold.finger or hold.finger * float(hold.hand[:, 0] @ hold.normal) > ALONG


def _crowded(
    arm: Arm, joint: Joint, found: Sequence[Hold], times: Array, rows: int, off: float
) -> list[Hold]:
    """Holds, with the cost of what the hand would be in.

    Args:
        arm: the arm.
        joint: moves the part.
        found: the holds now.
        times: openness at which they are looked at, the first one that is now.
        rows: of points along the palm.
        off: room that the palm is to have, m.
    """
    deepest = np.zeros(len(found))
    for openness in times.tolist():
        later = [hold.moved(joint, openness - times[0], float(hold.pinched)) for hold in found]
        deepest = np.maximum(
            deepest, _deep(arm, joint, float(times[0]), openness, later, rows, off)
        )
    costs = CROWDED * deepest + MEETS * (deepest > ROUGHLY)
    return [
        replace(hold, cost=hold.cost + float(more)) for hold, more in zip(found, costs, strict=True)
    ]


def motion(joint: Joint, point: Array, way: float) -> tuple[Array, float]:
    """Unit direction in which a point (3,) of a part moves (3,), and how far from the hinge it is,
    m: infinitely for what slides.
    """
    axis = np.asarray(joint.axis, np.float64)
    sense = way * math.copysign(1.0, joint.travel)
    if joint.kind == "slide":
        return sense * axis, math.inf
    moved = np.cross(axis, point - np.asarray(joint.anchor))
    radius = float(np.linalg.norm(moved))
    return sense * moved / max(radius, 1e-9), radius


def _pinched(
    arm: Arm,
    joint: Joint,
    part: Sequence[Piece],
    bars: Sequence[Piece],
    by: float,
    slips: bool,
    slants: Sequence[float],
) -> Iterator[Hold]:
    """Across a thin side of a piece, from any of the others; a bar across its corners too."""
    farthest, forward = _farthest(joint, part), arm.onward(1.0)
    way = math.copysign(1.0, by)
    turned = np.asarray(matrix(about(np.asarray(joint.axis), by * joint.travel)))
    for piece in part:
        handle = any(bar.around(piece.centre) for bar in bars)
        for across, edge, sign in product(range(3), range(3), (1.0, -1.0)):
            if across == edge or piece.half[across] > WIDEST / 2.0:
                continue
            along = 3 - across - edge
            thin = piece.half[edge] < WIDEST / 2.0
            places = _places(float(piece.half[along]))
            for off, slant in product(places, slants if thin else {0.0}.intersection(slants)):
                turn = np.asarray(matrix(about(piece.axes[:, along], math.radians(slant))))
                out, travel = sign * turn @ piece.axes[:, edge], turn @ piece.axes[:, across]
                width, thick = piece.reach(travel), piece.reach(out)
                if -out @ forward < BACKWARDS or -out[2] > UPWARDS or width > WIDEST / 2.0:
                    continue
                front = piece.centre + off * piece.axes[:, along] + thick * out
                moved, radius = motion(joint, front - min(thick, DEEPEST) * out, way)
                twists = farthest < SMALL and radius < ON_AXIS
                if not twists and radius < LEVERAGE * farthest:
                    continue
                cost = abs(off) / 0.3 + SLIPPED * slips + EDGE * (not handle and not twists)
                if not twists:
                    # What comes out along the fingers is held by friction alone.
                    cost += FOR_PUSHING * (way < 0) + 0.3 * abs(float(moved @ out))
                    cost += 0.5 * (1.0 - min(radius, farthest) / farthest)
                end = turned if twists else np.eye(3)
                yield from _hands(arm, front, out, travel, width, thick, cost, end)


def _hands(
    arm: Arm,
    front: Array,
    out: Array,
    travel: Array,
    width: float,
    thick: float,
    cost: float,
    end: Array,
) -> Iterator[Hold]:
    """The hands that pinch a piece at one place.

    Args:
        arm: the arm.
        front: middle of the edge that they come over (3,).
        out: away from it (3,).
        travel: the fingers' (3,).
        width: half of what is between them, m.
        thick: half of how deep it is, m.
        cost: of the place.
        end: how far the hand is turned with the piece (3, 3).
    """
    opening = min(1.0, NOTCH * math.ceil(2.0 * (width + BESIDE) / OPENING / NOTCH))
    for tilt in TILTS:
        approach = np.asarray(matrix(about(travel, math.radians(tilt)))) @ -out
        if approach[:2] @ arm.forward < BACKWARDS:
            continue
        across = np.cross(approach, travel)
        either = [np.stack((k * travel, k * across, approach), axis=1) for k in (1.0, -1.0)]
        twists = [max(_twisted(arm, hand), _twisted(arm, end @ hand)) for hand in either]
        twisted, hand = min(zip(twists, either, strict=True), key=lambda t: t[0])
        for n, deep in enumerate(_depths(thick)):
            full, point = cost + 0.1 * n + abs(tilt) / 200.0 + twisted, front - deep * out
            yield Hold(point, hand, opening, full, point, np.zeros(3))


def _pushed(
    arm: Arm, joint: Joint, part: Sequence[Piece], way: float, wider: bool
) -> Iterator[Hold]:
    """Fingers against a face that points against the motion: closed ones, or, near its edge, one of
    an open hand; or, if ``wider``, those of a hand rotated by 180 degrees about its approach, and
    the tips of one that goes along the face.
    """
    usual = [arm.pointing(*posed) for posed in product(PITCHES, ROLLS, YAWS)]
    hands = [(hand, _twisted(arm, hand)) for hand in usual]
    rotated = [(hand * (-1.0, -1.0, 1.0), twisted + HALF_ROUND) for hand, twisted in hands]
    turned = rotated if wider else hands
    for cost, spot, normal, _ in _spots(joint, part, way, False, wider):
        for hand, twisted in turned:
            if hand[:, 2] @ normal < ALONG:
                yield _closed(hand, spot, normal, cost + twisted)
    for cost, spot, normal, inward in _spots(joint, part, way, True, wider):
        for hand, twisted in (*hands, *rotated) if wider else ():
            if hand[:, 2] @ inward >= OVER and abs(hand[:, 2] @ normal) < ALONG:
                yield _closed(hand, spot, normal, cost + HOOKED + twisted, TIP)
        for hand, twisted in turned:
            if hand[:, 2] @ inward < OVER:
                continue
            full = cost + HOOKED + twisted
            if ALONG < hand[:, 2] @ normal < OVER_EDGE:
                yield _closed(hand, spot, normal, full)
            if abs(hand[:, 0] @ normal) > INSIDE:
                finger = round(np.sign(hand[:, 0] @ normal))
                point = spot + _off(normal, hand, finger)
                yield Hold(point, hand, 1.0, full, spot, normal, finger)


def _spots(
    joint: Joint, part: Sequence[Piece], way: float, edges: bool, wider: bool
) -> list[tuple[float, Array, Array, Array]]:
    """Places on faces that point against the motion, the cheapest first: the cost of each, the
    place (3,), the normal of the face (3,), and the way inwards from the edge that is near (3,).

    Args:
        joint: moves the part.
        part: its pieces.
        way: 1 to open it, -1 to close it.
        edges: whether they are at the edges, or off them.
        wider: whether edges are pushed near their ends too, and what turns little as other parts.
    """
    found: dict[tuple[int, ...], tuple[float, Array, Array, Array]] = {}
    farthest, middle = _farthest(joint, part), _middle(part)
    axis = np.asarray(joint.axis)
    for piece in part:
        for out, sign, first in product(range(3), (1.0, -1.0), range(3)):
            second = 3 - out - first
            if first == out or (not edges and first > second):
                continue
            normal = sign * piece.axes[:, out]
            us, vs = (_places(float(piece.half[k]), OFF_EDGE) for k in (first, second))
            if edges:
                end = max(0.0, float(piece.half[first]) - ON_EDGE)
                us = (-end, end)
                side = max(0.0, float(piece.half[second]) - 2.0 * ON_EDGE)
                vs = (*vs, -side, side) if wider else vs
            for u, v in product(us, vs):
                inward = -math.copysign(1.0, u) * piece.axes[:, first]
                spot = piece.centre + piece.half[out] * normal
                spot = spot + u * piece.axes[:, first] + v * piece.axes[:, second]
                moved, radius = motion(joint, spot, way)
                if normal @ moved > -AGAINST or radius < LEVERAGE * farthest:
                    continue
                cost = FOR_PULLING * (way > 0) + 1.0 - min(radius, farthest) / farthest
                turns = min(1.0, abs(joint.travel)) if wider else 1.0
                cost += TO_TWIST * (farthest < SMALL) * turns
                if math.isinf(radius):
                    cost += OFF_MIDDLE * float(np.linalg.norm(np.cross(axis, spot - middle)))
                cost += NARROW * float(min(piece.half[first], piece.half[second]) < FINGER_SIDE)
                cell = (*np.round(spot / APART), *np.round(normal), *(inward * edges).round())
                if cell not in found or found[cell][0] > cost:
                    found[cell] = cost, spot, normal, inward
    return sorted(found.values(), key=lambda item: item[0])[:SPOTS]


def _closed(hand: Array, spot: Array, normal: Array, cost: float, back: float = 0.0) -> Hold:
    """Closed fingers on a place on a face (3,), so far back from it along their approach, m."""
    flat = _flat(hand, normal)
    at = spot - back * flat[:, 2]
    return Hold(at + _off(normal, flat), flat, 0.0, cost, at, normal)


def _flat(hand: Array, normal: Array) -> Array:
    """A hand whose two fingertips nearly lie on a face, turned until both do: each bears half."""
    off = math.asin(float(np.clip(hand[:, 0] @ normal, -1.0, 1.0)))
    if off == 0.0 or abs(off) > NEARLY:
        return hand
    axis = np.cross(normal, hand[:, 0])
    turn = about(axis / np.linalg.norm(axis), off)
    return np.asarray(matrix(turn)) @ hand


def _off(normal: Array, hand: Array, finger: int = 0) -> Array:
    """From a face that fingers touch to the grip point (3,)."""
    thick = FINGER_THICK / 2.0 if finger else FINGER_THICK
    size = np.array((thick, FINGER_SIDE, FINGERTIP))
    aside = finger * (OPENING / 2.0 + thick) * hand[:, 0]
    return np.asarray(float(size @ np.abs(normal @ hand)) * normal - aside)


def _depths(thick: float) -> list[float]:
    """How far behind the edge of a piece it may be pinched, m: the firmest first.

    Args:
        thick: half of how deep the piece is, m.
    """
    wanted = (thick + BEYOND, thick, *(2.0 * thick - before for before in BEFORE_BACK))
    return list(dict.fromkeys(float(np.clip(deep, SHALLOWEST, DEEPEST)) for deep in wanted))


def _twisted(arm: Arm, hand: Array) -> float:
    """How far a hand is turned from straight ahead of the base, as a cost."""
    approach, pitch = hand[:, 2], arm.pitch_of(hand)
    yaw = arm.bearing(approach[:2]) if pitch > 10.0 else 0.0
    roll = math.degrees(rotation_vector(arm.pointing(pitch, 0.0, yaw).T @ hand)[2])
    return (yaw / 60.0) ** 2 + (roll / 150.0) ** 2


def _deep(
    arm: Arm,
    joint: Joint,
    first: float,
    openness: float,
    later: Sequence[Hold],
    rows: int,
    off: float,
) -> Array:
    """How deep hands are in something when a part is as open as that (H,), m.

    Args:
        arm: the arm.
        joint: moves the part.
        first: openness now.
        openness: of the part then.
        later: the holds then (H).
        rows: of points along the palm.
        off: room that the palm is to have, m.
    """
    if not later:
        return np.zeros(0)
    palm, frame = palm_points(rows), arm.frame
    points = np.array(
        [
            np.concatenate((palm, finger_points(hold.opening, BARS))) @ hold.hand.T + hold.point
            for hold in later
        ]
    )
    flat = (points @ frame).reshape(-1, 3)
    boxes = solids_then(arm, joint, first, openness)
    room = Room(boxes, frame, flat.min(axis=0), flat.max(axis=0))
    away = room.exactly(flat).reshape(len(later), -1)
    away[:, : len(palm)] -= off
    return np.asarray(np.maximum(0.0, -away.min(axis=1)))


def _farthest(joint: Joint, part: Sequence[Piece]) -> float:
    """How far from its hinge a part reaches, m; 1 for what slides."""
    if joint.kind == "slide":
        return 1.0
    points = (point for piece in part for point in corners(piece.pose, piece.half))
    return max(motion(joint, point, 1.0)[1] for point in points)


def _middle(part: Sequence[Piece]) -> Array:
    """Middle of the box along the axes of the world that is around all pieces (3,)."""
    points = np.concatenate([corners(piece.pose, piece.half) for piece in part])
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2.0)


def _places(half: float, off: float = FROM_END) -> Sequence[float]:
    """Where along a piece it is taken hold of, from its middle, m; so far from its ends, m."""
    if half < 2.0 * off:
        return (0.0,)
    end = half - off
    found: list[float] = np.linspace(-end, end, 1 + 2 * max(1, round(end / SPACING))).tolist()
    return found
