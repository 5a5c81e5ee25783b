"""Reaching: from which place of the base, with the arm bent how, the hand gets to a pose, and how
it comes in there and out again.

The base stands back, the hand takes its posture, the base drives up to where the hand is before its
goal, and only then the hand goes straight. What has room on that way, by the arm's kinematics and
the boxes around, is offered as a choice, the easiest first; a rehearsal tells which one works.
"""

from __future__ import annotations

import collections
import heapq
import itertools
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.motions.approaching import hand_passes, links_pass
from pytest_safemanip.expert.motions.hand_ways import HandWays
from pytest_safemanip.expert.motions.poses import Pose, Reach, Way
from pytest_safemanip.expert.motions.turning import facing
from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.hand import WRIST
from pytest_safemanip.expert.robot.kinematics import (
    FARTHEST,
    SPHERES,
    bodies,
    reach_of,
    solve,
    strain,
)
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import nearest, rearmost

LINK_CLEARANCES = (-0.004, -0.02)
"""Least clearance of the balls around the arm's links, m. The links are slimmer than the balls, so
that the second value is tried where the first one leaves no way."""
SQUEEZED = -0.025
"""Likewise where the hand has no room otherwise."""
OVERLAP_COST = 50.0
"""Cost of each m by which a ball's clearance is below the first value."""
ENOUGH = 0.03
"""Room that is as good as more, m."""
BEFORE_WRIST = (0.48, 0.40, 0.56, 0.33)
"""Base to wrist, m."""
BESIDE_WRIST = (0.0, 0.1, -0.1, 0.2, -0.2, 0.3, -0.3, 0.45, -0.45, 0.6, -0.6)
"""How far to the left of the wrist the base stands, m."""
RAISED, HIGH = (0.0, 0.1, 0.2, 0.3), 1.2
"""How far the torso is raised, m, and from which height of the hand on it is."""
OTHERWISE = "base turned otherwise"
"""What may be chosen where something is reached."""
LONGEST = 0.85
"""From the base to what the arm reaches, m: what is still nearer is behind it."""
HEADINGS = (0.0, 180.0, 90.0, -90.0)
"""To which the base may be turned to reach something, degrees from where it faces."""
TIRED, STRETCHED, REACHED = 0.9, 0.69, 40.0
"""Share of its range to which a joint goes; from the arm's shoulder to its wrist, m, as good as
less, and what speaks against each m more: straight, it gets 3 cm farther, and the base may stand 2
cm off."""
CHUNKS, VAIN, PATIENCE = (12, 48), 150, 240
"""How many poses are looked at at a time, at first and at most, in vain, and in all."""
FOREARM = next(k for k, (link, *_) in enumerate(SPHERES) if link == 5)
"""First of the arm's balls that may come near what is in the hand."""
LIKE, FAILED, UNFIT = 0.01, 3, 12
"""What speaks against another pose that is alike in one respect, and so many times as much if the
arm does not get to the one it is like, or if that does not suit, which takes long to find out."""
ASKED = 4
"""Ways to a pose that the simulator is asked about, the cheapest."""
MOST, UNSUITED = 16, 4
"""Ways that are offered, and of those to poses that do not suit."""


def any_heading(
    arm: Arm,
    look: Callable[[], Callable[[float], list[Reach]]],
    clearances: Sequence[float] = LINK_CLEARANCES,
    but: Collection[float] = (),
) -> list[Reach]:
    """The ways that are found with the base turned as it is, or else turned otherwise; those on
    which links meet something only where there are no others with so much room around these.

    Args:
        arm: the arm.
        look: looks around with the base turned somehow, and gives what finds them then, given the
            least clearance of the arm's links, m.
        clearances: that that is given, one after the other.
        but: turns of the base that are left out, degrees.
    """
    headings = [turn for turn in HEADINGS if turn not in but]
    finders: dict[float, Callable[[float], list[Reach]]] = {}
    for clearance in clearances:
        meeting: list[Reach] = []
        for turn in headings:
            with facing(arm, turn):
                if turn not in finders:
                    finders[turn] = look()
                found = [replace(reach, turn=turn) for reach in finders[turn](clearance)]
            if not all(reach.meets for reach in found):
                return found
            meeting = meeting or found
        if meeting:
            return meeting
    return []


def turned_otherwise(arm: Arm, find: Callable[[Sequence[float]], list[Reach]]) -> list[Reach]:
    """Ways that are found, or, if that is chosen, those with the base turned otherwise than on
    them: where it should stand may be where it does not get.

    Args:
        arm: the arm.
        find: finds them, given the turns of the base that are left out, degrees.
    """
    ways = find(())
    otherwise = bool(ways) and arm.choices.choose(OTHERWISE, (False, True), (0, 2))
    return find((ways[0].turn,)) if otherwise else ways


class Reaching:
    """Looks for ways to poses.

    Args:
        arm: the arm.
        hands: looks for the ways of the hand.
        clearance: least one of the arm's links, m.
        vessels: that the hand goes into, which it must not touch.
        either: whether the hand may be turned over.
    """

    def __init__(
        self,
        arm: Arm,
        hands: HandWays,
        clearance: float = LINK_CLEARANCES[0],
        vessels: Sequence[str] = (),
        either: bool = False,
    ) -> None:
        self._arm, self._hands, self._clearance = arm, hands, clearance
        self._vessels, self._either = vessels, either
        self._frame = arm.frame
        self._fronts, self._rears = dict[float, float](), dict[float, float]()

    def find(
        self,
        poses: Iterable[Pose],
        most: int = MOST,
        suits: Callable[[Pose], Pose | None] = lambda pose: pose,
        patience: int = PATIENCE,
    ) -> list[Reach]:
        """Ways to some poses, the easiest first; last those to poses that do not suit.

        Args:
            poses: the poses.
            most: ways that are enough.
            suits: gives a pose, or the same with the hand turned over, whichever suits for other
                reasons; None if neither does.
            patience: poses that are looked at.
        """
        some = list(poses)
        if not some:
            return []
        self._past = min(self._arm.ahead(pose.point) for pose in some) - LONGEST
        good, bad = list[Reach](), list[Reach]()
        kinds = set[Hashable]()
        looked, size = 0, CHUNKS[0]
        seen = collections.Counter[Hashable]()
        turn = self._in_turn(some, seen)
        while looked < patience and len(kinds) < most:
            next_ones = list(itertools.islice(turn, size))
            found = self._reaches(next_ones)
            reached = {id(way.pose) for _, way, _ in found}
            for pose in next_ones:
                seen.update(FAILED * _respects(pose) if id(pose) not in reached else ())
            for plain, way, straight in found:
                pose = way.pose
                if not hand_passes(self._arm, min(straight, key=_cost), self._vessels):
                    seen.update(FAILED * _respects(pose))
                    continue
                suited = self._suited(way, straight, suits) if len(kinds) < most else []
                passing = self._passing(suited)
                good += passing
                if not passing:
                    bad += [replace(reach, meets=True) for reach in suited] or straight
                seen.update(() if passing else UNFIT * _respects(pose))
                # From below an edge the arm may get caught: that is not enough.
                kinds |= {pose.kind} if passing and plain else set()
            looked += size
            size = min(2 * size, CHUNKS[1])
            if not found and looked > VAIN:
                break
        return varied(good, 2 * most) + varied(bad, min(UNSUITED, most - len(kinds)))

    def _suited(
        self, way: Way, reaches: Sequence[Reach], suits: Callable[[Pose], Pose | None]
    ) -> Sequence[Reach]:
        """The places of the base for a way of the hand if its pose suits, or those for the same
        with the hand turned over if that does; empty if neither does.
        """
        pose = suits(reaches[0].pose)
        if pose is None or pose.turned == reaches[0].pose.turned:
            return reaches if pose else []
        return self._postures([replace(way, pose=pose)])

    def _passing(self, reaches: Sequence[Reach]) -> Sequence[Reach]:
        """Those ways to a pose, of the cheapest, on which the arm's links touch nothing."""
        likely = sorted(reaches, key=_cost)[:ASKED]
        return [reach for reach in likely if links_pass(self._arm, reach)]

    def _reaches(self, poses: Sequence[Pose]) -> list[tuple[bool, Way, list[Reach]]]:
        """How the hand gets to each of some poses that the arm reaches, as it is or turned over;
        from which places of the base; and whether it is not out from below an edge: those are
        looked at last.
        """
        found, left = list[tuple[bool, Way, list[Reach]]](), list(poses)
        for plain in (True, False):
            ways = [way for pose in left if (way := self._hands.way(pose, plain))]
            of = {id(way.pose): way for way in ways}
            reaches = self._postures(ways)
            if self._either:
                reached = {id(reach.pose) for reach in reaches}
                turned = [(way, way.turned_over()) for way in ways if id(way.pose) not in reached]
                of |= {id(over.pose): way for way, over in turned}
                reaches += self._postures([over for _, over in turned])
            for key, alike in itertools.groupby(reaches, key=lambda reach: id(reach.pose)):
                found.append((plain, of[key], list(alike)))
            known = {id(way.pose) for _, way, _ in found}
            left = [pose for pose in left if id(pose) not in known]
        return found

    def _in_turn(self, some: Sequence[Pose], seen: collections.Counter[Hashable]) -> Iterator[Pose]:
        """Poses that the hand has room at, the cheapest first, those later that are like others.

        Args:
            some: the poses.
            seen: how often one was looked at, by the respects in which poses are alike.
        """
        alike: dict[Hashable, list[Pose]] = {}
        for pose, free in zip(some, self._hands.roughly(some), strict=True):
            if free:
                alike.setdefault((pose.family, pose.place), []).append(pose)
        turns = {
            key: iter(sorted(poses, key=lambda pose: pose.cost)) for key, poses in alike.items()
        }

        def worse(pose: Pose) -> float:
            return pose.cost + LIKE * sum(seen[respect] for respect in _respects(pose))

        firsts = [next(turn) for turn in turns.values()]
        waiting = [(pose.cost, number, pose) for number, pose in enumerate(firsts)]
        heapq.heapify(waiting)
        while waiting:
            cost, number, pose = heapq.heappop(waiting)
            if worse(pose) > cost:
                heapq.heappush(waiting, (worse(pose), number, pose))
                continue
            if (after := next(turns[pose.family, pose.place], None)) is not None:
                heapq.heappush(waiting, (worse(after), number, after))
            if self._hands.grips(pose):
                seen.update(_respects(pose))
                yield pose

    def _postures(self, ways: Sequence[Way]) -> list[Reach]:
        """The places of the base from which the arm gets to poses that its hand has room at."""
        if not ways:
            return []
        rows = [row for number, way in enumerate(ways) for row in self._places(number, way.pose)]
        which = np.array([int(row[0]) for row in rows])
        base = np.array([row[1:] for row in rows])
        frame = self._frame
        points = np.array([way.pose.point @ frame for way in ways])
        hands = np.array([frame.T @ way.pose.hand for way in ways])
        stops = np.array([(way.entry @ frame, way.leave @ frame, np.zeros(3)) for way in ways])
        offs = np.array([(way.come, way.go, np.zeros(2)) for way in ways]) @ frame[:2, :2]
        least = np.full(len(rows), np.inf)
        tired, stretched = np.zeros(len(rows)), np.zeros(len(rows))
        left = np.arange(len(rows))
        for stop in range(3):
            at = points[which[left]] + stops[which[left], stop] - base[left]
            reaches = reach_of(at - WRIST * hands[which[left], :, 2])
            # What the arm is too short for need not be solved.
            near = reaches < FARTHEST
            left, at, reaches = left[near], at[near], reaches[near]
            if not len(left):
                return []
            joints, there = solve(at, hands[which[left]])
            spheres, radii = bodies(joints)
            spheres += base[left, None]
            for share in (0.0, 0.3, 0.7) if stop < 2 else (0.0,):
                off = np.zeros((len(left), 1, 3))
                off[:, 0, :2] = share * offs[which[left], stop]
                away = self._hands.room.away(spheres + off, radii).min(axis=1)
                least[left] = np.minimum(least[left], away)
            if stop == 2:
                there &= self._off_load([ways[k].pose for k in which[left]], spheres, radii)
            tired[left] = np.maximum(tired[left], strain(joints))
            there &= (least[left] >= self._clearance) & (tired[left] < TIRED)
            drawn = base[left, :2] + offs[which[left], stop]
            there &= drawn[:, 0] >= [self._rear_limit(aside) for aside in drawn[:, 1].tolist()]
            stretched[left] = np.maximum(stretched[left], reaches - STRETCHED)
            left = left[there]
        found = []
        for row in left.tolist():
            way = ways[which[row]]
            ahead, aside, torso = base[row].tolist()
            cost = way.pose.cost + way.cost + 0.5 * max(0.0, float(tired[row]) - 0.5)
            cost += 1.0 - min(max(float(least[row]), 0.0), ENOUGH) / ENOUGH
            cost += OVERLAP_COST * max(0.0, LINK_CLEARANCES[0] - float(least[row]))
            cost += 0.8 * abs(aside - self._wrist(way.pose)[1]) + torso + REACHED * stretched[row]
            place = frame[:2, :2] @ (ahead, aside)
            hand = way.pose, way.entry, way.leave, way.come, way.go
            found.append(Reach(*hand, cost, place, torso, float(least[row])))
        return found

    def _off_load(self, poses: Sequence[Pose], balls: Array, radii: Array) -> NDArray[np.bool_]:
        """Whether the arm behind the hand is off what the hand takes or brings (K,)."""
        free, first = np.ones(len(poses), bool), 0
        least = (radii[FOREARM:] + self._clearance) ** 2
        for _, rows in itertools.groupby(poses, key=id):
            alike = list(rows)
            load, last = alike[0].load @ self._frame, first + len(alike)
            near = balls[first:last, FOREARM:]
            # Distances squared, by products, for a table of all differences would be large.
            apart = (load**2).sum(axis=1) - 2.0 * near @ load.T
            away = (near**2).sum(axis=2) + apart.min(axis=2)
            free[first:last], first = (away > least).all(axis=1), last
        return free

    def _places(self, number: int, pose: Pose) -> list[tuple[float, ...]]:
        """A number with places ahead and aside of the base, and how far the torso is raised, m."""
        ahead, aside, height = self._wrist(pose)
        return [
            (number, min(ahead - before, self._limit(aside + beside)), aside + beside, torso)
            for torso in (RAISED if height > HIGH else RAISED[:1])
            for before in BEFORE_WRIST
            for beside in BESIDE_WRIST
        ]

    def _wrist(self, pose: Pose) -> Array:
        return np.asarray((pose.point - WRIST * pose.hand[:, 2]) @ self._frame)

    def _limit(self, aside: float) -> float:
        """How far ahead the base may be at most, m."""
        place = round(aside, 2)
        if place not in self._fronts:
            self._fronts[place] = nearest(self._arm, place, place, self._past)
        return self._fronts[place]

    def _rear_limit(self, aside: float) -> float:
        """How far ahead the base has to be at least, m."""
        place = round(aside, 2)
        if place not in self._rears:
            self._rears[place] = rearmost(self._arm, place, place, self._past)
        return self._rears[place]


def _cost(reach: Reach) -> float:
    return reach.cost


def _respects(pose: Pose) -> list[Hashable]:
    """In what a pose is like others."""
    return [("place", pose.place), *enumerate(pose.family)]


def varied(found: Iterable[Reach], most: int) -> list[Reach]:
    """The cheapest, those first that are like none before them."""
    ranks: dict[Hashable, int] = {}
    ordered = []
    for reach in sorted(found, key=_cost):
        alike = [ranks.get(key, 0) for key in (reach.pose.kind, reach.pose.family)]
        for key in (reach.pose.kind, reach.pose.family):
            ranks[key] = ranks.get(key, 0) + 1
        if alike[0] < 2:
            ordered.append((reach.cost + 0.5 * alike[0] + 0.15 * alike[1], reach))
    ordered.sort(key=lambda item: item[0])
    return [reach for _, reach in ordered[:most]]
