"""Reaching: from which place of the base, with the arm bent how, the hand gets to a pose, and how it
comes in there and out again.

The base stands back, the hand takes its posture, the base drives up to where the hand is before its
goal, and only then the hand goes straight. What has room on that way, by the arm's kinematics and
the boxes around, is offered as a choice, the easiest first; a rehearsal tells which one works.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.motions.travelling import drive, swing_back, travel
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.hand import finger_points, palm_points
from pytest_safemanip.expert.robot.kinematics import bodies, solve, strain
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.robot.torso import lift_torso
from pytest_safemanip.expert.world.room import Room, heading
from pytest_safemanip.expert.world.standing import nearest
from pytest_safemanip.expert.world.things import Thing

FINGERS_FREE, PALM_FREE, LINKS_FREE = 0.001, 0.003, -0.004
"""Room around fingers and palm at a goal, and around the balls that the rest of the arm fits into,
m."""
TIGHT, ON_WAY = 0.001, 0.01
"""Room around the hand and what it holds on the way: at least, and that is as good as more, m."""
ENOUGH = 0.03
"""Room that is as good as more, m."""
CLEAR = 0.05
"""Room around a hand that can be turned, m."""
BACKS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
"""How far the base stands back at most, m."""
BEFORE_WRIST = (0.48, 0.40, 0.56, 0.33)
"""Base to wrist, m."""
BESIDE_WRIST = (0.0, 0.1, -0.1, 0.2, -0.2, 0.3, -0.3, 0.45, -0.45, 0.6, -0.6)
"""How far to the left of the wrist the base stands, m."""
RAISED, HIGH = (0.0, 0.1, 0.2, 0.3), 1.2
"""How far the torso is raised, m, and from which height of the hand on it is."""
WRIST = 0.21
"""From the grip point back to the wrist, m."""
TIRED = 0.9
"""Share of its range to which a joint goes."""
LOOKED, PATIENCE = 40, 400
"""How many poses are looked at in full, and at all."""
PALM_POINTS, FINGER_ENDS = palm_points(), finger_points(0.0)
ROUGH = 0.006
"""By how much distances are wrong that are looked up, m."""
FAILED = 0.05
"""What speaks against poses for each of the same family that the arm does not get to."""
MOST = 16
"""Ways that are offered."""


@dataclass(frozen=True)
class Pose:
    """How the hand may be at its goal.

    Attributes:
        point: grip point (3,).
        hand: orientation (3, 3).
        opening: of the fingers on the way there, share of the full opening.
        cost: what speaks against it, about 1 for what is hardly used.
        load: points (L, 3) of what it takes, or brings, there.
        family: what is alike in poses that are likely to fail together.
        kind: what is alike in those that are the same but for the arm.
    """

    point: Array
    hand: Array
    opening: float
    cost: float
    load: Array
    family: Hashable = ()
    kind: Hashable = ()


@dataclass(frozen=True)
class Reach:
    """A way to a pose.

    Attributes:
        pose: the pose.
        base: where the base stands meanwhile (2,).
        torso: how far it is raised, m.
        entry: from the grip point to where the hand goes straight from (3,).
        leave: from the grip point to where the hand is drawn back from (3,).
        back: how far the base stands back before and after, m.
        cost: what speaks against it.
    """

    pose: Pose
    base: Array
    torso: float
    entry: Array
    leave: Array
    back: float
    cost: float


Steps = Sequence[tuple[float, float]]
"""How far off its goal the hand is, back along its approach and straight up, m."""


@dataclass(frozen=True)
class Ways:
    """How a hand may come to a goal and leave it; the first that has room is taken.

    Attributes:
        entries: where it goes straight from.
        leaves: where it is drawn back from.
        brings: whether it brings something, and does not take it.
    """

    entries: Steps = tuple((back, 0.0) for back in (0.06, 0.12)) + tuple(
        (0.0, up) for up in (0.12, 0.16, 0.2, 0.25, 0.3)
    )
    leaves: Steps = tuple((0.0, up) for up in (0.04, 0.08, 0.12, 0.16, 0.2, 0.24, 0.28))
    brings: bool = False


class Reaching:
    """Looks for ways to poses.

    Args:
        arm: the arm.
        room: what is around.
        ways: how the hand may come and leave.
    """

    def __init__(self, arm: Arm, room: Room, ways: Ways) -> None:
        self._arm, self._room, self._ways = arm, room, ways
        self._frame = heading(arm)
        self._limits: dict[float, float] = {}

    def find(
        self,
        poses: Iterable[Pose],
        most: int = MOST,
        suits: Callable[[Pose], bool] = lambda pose: True,
        patience: int = PATIENCE,
    ) -> list[Reach]:
        """Ways to some poses, the easiest first; last those to poses that do not suit.

        Args:
            poses: the poses.
            most: ways that are enough.
            suits: whether a pose does, for other reasons.
            patience: poses that are looked at.
        """
        good, bad = list[Reach](), list[Reach]()
        kinds = set[Hashable]()
        looked = 0
        for pose in itertools.islice(self._in_turn(poses), patience):
            if way := self._hand_way(pose):
                looked += 1
                ways = self._postures(pose, *way)
                suited = bool(ways) and suits(pose)
                (good if suited else bad).extend(ways)
                self._fails[pose.family] += not ways or 3 * (not suited)
                kinds |= {pose.kind} if suited else set()
            if looked >= LOOKED or len(kinds) >= most:
                break
        return _varied(good, most) + _varied(bad, most - len(kinds))

    def _in_turn(self, poses: Iterable[Pose]) -> Iterator[Pose]:
        """Poses that the hand has room at, the cheapest first, of a family the fewer the more of it
        have failed.
        """
        some = list(poses)
        families: dict[Hashable, list[Pose]] = {}
        for pose, free in sorted(
            zip(some, self._roughly(some), strict=True), key=lambda item: -item[0].cost
        ):
            if free:
                families.setdefault(pose.family, []).append(pose)
        self._fails = dict.fromkeys(families, 0.0)
        while families:
            family = min(families, key=lambda f: families[f][-1].cost + FAILED * self._fails[f])
            pose = families[family].pop()
            if not families[family]:
                del families[family]
            if self._grips(pose):
                yield pose
            else:
                self._fails[family] += 0.2

    def _roughly(self, poses: Sequence[Pose]) -> NDArray[np.bool_]:
        """Whether the hand may have room at some poses (K,)."""
        if not poses:
            return np.zeros(0, bool)
        points = self._frame.T @ np.array([pose.point for pose in poses]).T
        hands = self._frame.T @ np.array([pose.hand for pose in poses])
        palms = PALM_POINTS @ hands.transpose(0, 2, 1) + points.T[:, None]
        tips = FINGER_ENDS @ hands.transpose(0, 2, 1) + points.T[:, None]
        free = self._room.away(palms).min(axis=1) > PALM_FREE - ROUGH
        return np.asarray(free & (self._room.away(tips).min(axis=1) > FINGERS_FREE - ROUGH))

    def _grips(self, pose: Pose) -> bool:
        """Whether the hand has room at a pose."""
        parts = (PALM_POINTS, PALM_FREE), (finger_points(pose.opening), FINGERS_FREE)
        return all(
            self._room.exactly((points @ pose.hand.T + pose.point) @ self._frame).min() >= free
            for points, free in parts
        )

    def _hand_way(self, pose: Pose) -> tuple[Array, Array, float, float] | None:
        """Where the hand comes from, where it leaves to, how far the base stands back, and the room
        on these ways; None if there is none.
        """
        into = self._first_free(pose, self._ways.entries, self._ways.brings)
        out = self._first_free(pose, self._ways.leaves, not self._ways.brings) if into else None
        if not into or not out:
            return None
        return into[0], out[0], max(into[1], out[1]), min(into[2], out[2])

    def _first_free(self, pose: Pose, steps: Steps, loaded: bool) -> tuple[Array, float, float] | None:
        best: tuple[Array, float, float] | None = None
        for back, up in steps:
            offset = np.append(-back * pose.hand[:2, 2], up - back * pose.hand[2, 2])
            away = self._hand_room(pose, offset, loaded)
            shut = np.flatnonzero(away < CLEAR)
            first = int(shut[-1]) + 1 if len(shut) else 0
            if first == len(away):
                continue
            room = min(float(away[: max(first, 1)].min()), ON_WAY)
            if room > TIGHT and (best is None or room > best[2]):
                best = offset, BACKS[first], room
                if room >= ON_WAY:
                    break
        return best

    def _hand_room(self, pose: Pose, offset: Array, loaded: bool) -> Array:
        """Room around a hand so far off a pose, for each distance that it is drawn back, m."""
        hand = np.concatenate((PALM_POINTS, finger_points(pose.opening))) @ pose.hand.T
        points = hand + pose.point
        if loaded:
            points = np.concatenate((points, pose.load))
        backs = np.array([(-back, 0.0, 0.0) for back in BACKS])
        return np.asarray(self._room.away((points + offset) @ self._frame + backs[:, None]).min(axis=1))

    def _postures(
        self, pose: Pose, entry: Array, leave: Array, back: float, way: float
    ) -> list[Reach]:
        """The places of the base from which an arm gets to a pose that its hand has room at."""
        frame = self._frame
        point, hand = pose.point @ frame, frame.T @ pose.hand
        wrist = point - WRIST * hand[:, 2]
        raised = RAISED if wrist[2] > HIGH else RAISED[:1]
        places = np.array(
            [
                (min(wrist[0] - ahead, self._limit(wrist[1] + aside)), wrist[1] + aside, torso)
                for torso in raised
                for ahead in BEFORE_WRIST
                for aside in BESIDE_WRIST
            ]
        )
        found: list[Reach] = []
        for offset in (entry, leave, np.zeros(3)):
            if not len(places):
                return []
            base = np.column_stack((places[:, :2], places[:, 2]))
            at = point + offset @ frame - base
            joints, there = solve(at, np.tile(hand, (len(at), 1, 1)))
            spheres, radii = bodies(joints)
            tired = strain(joints)
            there &= tired < TIRED
            away = self._room.away(spheres + base[:, None], radii).min(axis=1)
            there &= away >= LINKS_FREE
            for share in (0.3, 0.7) if offset.any() else ():
                behind = spheres + base[:, None] - (share * back, 0.0, 0.0)
                there &= self._room.away(behind, radii).min(axis=1) >= LINKS_FREE
            places, away, tired = places[there], away[there], tired[there]
        for place, free, bent in zip(places, away, tired, strict=True):
            cost = pose.cost + 0.5 * max(0.0, float(bent) - 0.5) + 20.0 * (ON_WAY - way)
            cost += 0.3 * (1.0 - min(float(free), ENOUGH) / ENOUGH)
            cost += 0.8 * abs(float(place[1] - wrist[1])) + float(place[2])
            base2 = frame[:2, :2] @ place[:2]
            found.append(Reach(pose, base2, float(place[2]), entry, leave, back, cost))
        return sorted(found, key=lambda reach: reach.cost)[:3]

    def _limit(self, aside: float) -> float:
        place = round(aside, 2)
        if place not in self._limits:
            self._limits[place] = nearest(self._arm, place, place)
        return self._limits[place]


def _varied(found: Iterable[Reach], most: int) -> list[Reach]:
    """The cheapest, those first that are like none before them."""
    ranks: dict[Hashable, int] = {}
    ordered = []
    for reach in sorted(found, key=lambda reach: reach.cost):
        alike = [ranks.get(key, 0) for key in (reach.pose.kind, reach.pose.family)]
        for key in (reach.pose.kind, reach.pose.family):
            ranks[key] = ranks.get(key, 0) + 1
        if alike[0] < 2:
            ordered.append((reach.cost + 0.5 * alike[0] + 0.15 * alike[1], reach))
    ordered.sort(key=lambda item: item[0])
    return [reach for _, reach in ordered[:most]]


def go_before(arm: Arm, reach: Reach, load: Thing | None = None, speed: float = 1.0) -> Motion:
    """Bring base and hand to where the hand goes straight to its goal.

    Args:
        arm: the arm.
        reach: the way.
        load: what it holds.
        speed: share of the usual ones.

    Raises:
        SkillFailed: if base or hand does not get there.
    """
    pose = reach.pose
    entry = pose.point + reach.entry
    if load is None:
        if pose.opening < 1.0:
            yield from arm.open_to(pose.opening)
        else:
            arm.let_open()
    back = swing_back(arm, entry, pose.hand, reach.base, reach.torso, reach.back, load)
    yield from travel(arm, reach.base - back * arm.forward, load)
    yield from lift_torso(arm, reach.torso)
    before = entry - arm.onward(back)
    yield from arm.move(
        before, pose.hand, tolerance=0.03, turn_tolerance=0.1, speed=speed, steps=180
    )
    yield from drive(arm, reach.base, load)
    yield from arm.move(
        entry, pose.hand, tolerance=0.01, turn_tolerance=0.08, speed=0.7 * speed, steps=60
    )


def draw_back(arm: Arm, reach: Reach, load: Thing | None = None, least: float = 0.0) -> Motion:
    """Drive back from a goal that the hand has risen from, and lower the torso.

    Args:
        arm: the arm.
        reach: the way.
        load: what it holds.
        least: how far it drives back at least, m.

    Raises:
        SkillFailed: if the base does not get there.
    """
    back = max(reach.back, least)
    yield from drive(arm, reach.base - back * arm.forward, load)
    yield from lift_torso(arm, -reach.torso)
