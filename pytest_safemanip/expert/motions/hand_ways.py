"""Ways of the hand alone: what room it has at a pose, how it comes in there and out again.

What stands around is told by boxes (:mod:`~pytest_safemanip.expert.world.room`); the arm behind the
hand is not looked at here.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.motions.poses import Pose, Steps, Way, Ways
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.hand import (
    FINGER_SIDE,
    FINGER_THICK,
    FINGERTIP,
    OPENING,
    PALM,
    finger_points,
    palm_points,
)
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.room import Room

FINGERS_FREE, PALM_FREE = 0.001, 0.003
"""Room around fingers and palm at a goal, m."""
GRAZES = 0.007
"""How much less is left around a hand that has no room otherwise, m: its shape and others are taken
for larger than they are, and a rehearsal tells whether they meet."""
LOWERED = 0.018
"""How far the hand is lowered into a vessel with what it brings, m."""
TIGHT, BELOW_EDGE, ON_WAY = 0.001, 0.005, 0.012
"""Room around the hand and what it holds on the way: at least, out from below an edge, and that is
as good as more, m."""
CLEAR = 0.05
"""Room around a hand that can be turned, m."""
BACKS, SLANTS = np.arange(0.0, 0.72, 0.05), (0.0, 0.15, -0.15, 0.3, -0.3)
"""How far the base stands back, m, and how much of that to the left: no board is between two."""
PALM_POINTS, FINGER_ENDS = palm_points(), finger_points(0.0)
GRAZED = -0.001
"""How far inside of open fingers something may be, m."""
FEW = 6
"""A way on which every so manieth point has no room is none."""
UNDERSIDE = 0.01
"""Points of a load that are no higher than this above its lowest one are on its underside, m."""
STRIDE = 0.02
"""Between places on a straight way that are looked at, m."""
ROUGH = 0.006
"""By how much distances are wrong that are looked up, m."""
ODD = 0.6
"""What speaks against coming from below an edge."""
_NOTHING = np.zeros((0, 3))


class HandWays:
    """Looks for ways of the hand; remembers what it has found out about a pose.

    Attributes:
        room: what is around.

    Args:
        arm: the arm.
        room: what is around.
        ways: how the hand may come and leave.
        squeezed: whether it is squeezed in, and the first way on which it has any room is taken,
            for a roomier one may lead the arm into something.
    """

    def __init__(self, arm: Arm, room: Room, ways: Ways, squeezed: bool = False) -> None:
        self.room, self._ways, self._forward = room, ways, arm.forward
        self._grazes, self._enough = (GRAZES, TIGHT) if squeezed else (0.0, ON_WAY)
        self._frame = arm.frame
        self._grips: dict[Hashable, bool] = {}
        self._known: dict[tuple[Hashable, bool], Way | None] = {}

    def roughly(self, poses: Sequence[Pose]) -> NDArray[np.bool_]:
        """Whether the hand may have room at some poses (K,)."""
        points = self._frame.T @ np.array([pose.point for pose in poses]).T
        hands = self._frame.T @ np.array([pose.hand for pose in poses])
        palms = PALM_POINTS @ hands.transpose(0, 2, 1) + points.T[:, None]
        tips = FINGER_ENDS @ hands.transpose(0, 2, 1) + points.T[:, None]
        free = self.room.away(palms).min(axis=1) > PALM_FREE - self._grazes - ROUGH
        least = FINGERS_FREE - self._grazes - ROUGH
        return np.asarray(free & (self.room.away(tips).min(axis=1) > least))

    def grips(self, pose: Pose) -> bool:
        """Whether the hand has room at a pose, and where it lets go of what it brings."""
        key = _told_by(pose)
        if key not in self._grips:
            self._grips[key] = self._has_room(pose)
        return self._grips[key]

    def way(self, pose: Pose, plain: bool) -> Way | None:
        """How the hand comes and leaves, in any way or out from below an edge; None if it has no
        room for that.
        """
        key = _told_by(pose), plain
        if key not in self._known:
            found = self._find(pose, plain)
            # Without what it brings, which is large.
            self._known[key] = found and replace(found, pose=replace(pose, load=_NOTHING))
        way = self._known[key]
        return way and replace(way, pose=pose)

    def _has_room(self, pose: Pose) -> bool:
        lowered = pose.point - (0.0, 0.0, LOWERED if pose.hollow else 0.0)
        low = pose.point - (0.0, 0.0, min(pose.over, LOWERED) if pose.hollow else 0.0)
        openings = {pose.opening, min(pose.opening, pose.holding)}
        fingers = np.concatenate([finger_points(opening) for opening in openings])
        return (
            self._room_at(replace(pose, point=lowered), PALM_POINTS) >= PALM_FREE - self._grazes
            and self._room_at(pose, fingers) >= FINGERS_FREE - self._grazes
            and self._room_at(replace(pose, point=low), fingers) >= FINGERS_FREE - self._grazes
        )

    def _room_at(self, pose: Pose, points: Array) -> float:
        """Room around points of a hand at a pose, m."""
        return self.room.least((points @ pose.hand.T + pose.point) @ self._frame)

    def _find(self, pose: Pose, plain: bool) -> Way | None:
        ways = self._ways
        entries, leaves = (
            [step for step in steps if plain or step[2]] for steps in (ways.entries, ways.leaves)
        )
        into = self._first_free(pose, entries, ways.brings)
        out = self._first_free(pose, leaves, not ways.brings) if into else None
        if not into or not out:
            return None
        room = min(into[2], out[2], self._room_at(pose, PALM_POINTS))
        cost = 20.0 * max(0.0, ON_WAY - room) + (0.0 if plain else ODD)
        return Way(pose, into[0], out[0], into[1], out[1], cost)

    def _first_free(
        self, pose: Pose, steps: Steps, loaded: bool
    ) -> tuple[Array, Array, float] | None:
        """How far off its goal the hand is before or after, how far it is then drawn back (2,), and
        the room on that way, m; None if there is none.
        """
        best: tuple[Array, Array, float] | None = None
        opening = min(pose.opening, pose.holding) if loaded else pose.opening
        hand = np.concatenate((PALM_POINTS, finger_points(opening))) @ pose.hand.T + pose.point
        points = (np.concatenate((hand, pose.load)) if loaded else hand) @ self._frame
        for back, up, near in steps:
            offset = np.array((0.0, 0.0, up)) - back * pose.hand[:, 2]
            offset[:2] -= near * self._forward
            least = (BELOW_EDGE if near else TIGHT) - self._grazes
            off = offset @ self._frame
            if not self._straight(points, off, least) or not (
                loaded or self._ways.brings or _past(pose, offset)
            ):
                continue
            for slant in SLANTS:
                drawn = self._drawn_back(points + off, slant)
                if drawn is None:
                    continue
                out, room = drawn
                if loaded:
                    room = min(room, self._over(points[len(hand) :] + off, out))
                if room <= TIGHT - self._grazes:
                    continue
                if best is None or room > best[2] + 0.002:
                    best = offset, self._frame[:2, :2] @ out, room
                if room >= self._enough:
                    return best
        return best

    def _straight(self, points: Array, offset: Array, least: float) -> bool:
        """Whether points (P, 3) of a hand have so much room on the straight way to a goal, m."""
        length = float(np.linalg.norm(offset))
        far = np.minimum(np.arange(STRIDE, length + STRIDE, STRIDE), length)
        steps = ((far / length)[:, None] * offset)[:, None]
        for some in (points[::FEW], points):
            if self.room.away(some + steps).min() <= least:
                return False
        # Between the points at which distances are noted is room for a thin board.
        return self.room.least((points + steps).reshape(-1, 3)) > TIGHT - self._grazes - ROUGH

    def _drawn_back(self, points: Array, slant: float) -> tuple[Array, float] | None:
        """How far the base draws back from where a hand has such points (P, 3) for the hand to be
        clear of everything (2,), and the room on that way, m; None if there is none.
        """
        backs = BACKS[:, None] * np.array((-1.0, slant, 0.0))
        for some in (points[::FEW], points):
            away = self.room.away(some + backs[:, None]).min(axis=1)
            shut = np.flatnonzero(away < CLEAR)
            first = int(shut[-1]) + 1 if len(shut) else 0
            room = min(float(away[: max(first, 1)].min()), ON_WAY)
            if first == len(away) or room <= TIGHT - self._grazes:
                return None
        return backs[first, :2], room

    def _over(self, load: Array, back: Array) -> float:
        """Room around what the hand holds (P, 3) as it is drawn back (2,), m: also from boards and
        knobs that fit between its points, or between the places that are looked at.
        """
        under = load[load[:, 2] < load[:, 2].min() + UNDERSIDE]
        one, other = np.triu_indices(len(under), 1)
        points = np.concatenate((load, (under[one] + under[other]) / 2.0))
        shares = np.linspace(0.0, 1.0, 1 + math.ceil(float(np.linalg.norm(back)) / STRIDE))
        steps = shares[:, None, None] * np.append(back, 0.0)
        return self.room.least((points + steps).reshape(-1, 3))


def _told_by(pose: Pose) -> Hashable:
    """What tells one pose of the hand and its load from others."""
    rigid = pose.point, pose.hand, pose.load[:: max(1, len(pose.load) // 3)]
    where = b"".join(points.tobytes() for points in rigid)
    return where, pose.opening, pose.holding, pose.over, pose.hollow


def _past(pose: Pose, offset: Array) -> bool:
    """Whether open fingers pass what they close on, or let go of, on the straight way to it."""
    near = pose.opening * OPENING / 2.0 if pose.opening < 1.0 else OPENING / 2.0
    for share in np.linspace(0.0, 1.0, 5):
        own = (pose.load - pose.point - share * offset) @ pose.hand
        (x, y), ahead = np.abs(own[:, :2]).T, own[:, 2]
        beside = (x > near - GRAZED) & (x < near + FINGER_THICK) & (y < FINGER_SIDE)
        if (beside & (ahead > -PALM) & (ahead < FINGERTIP)).any():
            return False
    return True
