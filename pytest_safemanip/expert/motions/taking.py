"""Ways to take hold of what a joint moves: a hold, a place of the base, a route of the hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.motions.holds import LETS_GO, Hold
from pytest_safemanip.expert.motions.travelling import joints_now
from pytest_safemanip.expert.robot.arm import FOLDED, Arm, raised
from pytest_safemanip.expert.robot.hand import WRIST
from pytest_safemanip.expert.robot.kinematics import (
    STRIDE,
    bodies,
    follow,
    links,
    reach_of,
    solve,
    strain,
)
from pytest_safemanip.expert.robot.rotations import Array, rotation_vector
from pytest_safemanip.expert.world.candidates import Candidates
from pytest_safemanip.expert.world.contacts import loads
from pytest_safemanip.expert.world.room import Room
from pytest_safemanip.expert.world.standing import nearest, passable, rearmost, solids_then
from pytest_safemanip.expert.world.ways import Leg, foresee
from pytest_safemanip.trace.elements import Joint

REACHES, STRETCHES = (0.64, 0.54, 0.74), (0.60, 0.54, 0.64)
"""Base to hand, and from the arm's shoulder to its wrist at most then, m."""
SHIFTS = (0.0, 0.13, -0.13, 0.3, -0.3, 0.45, -0.45)
"""How much farther to the left than in line with the hand the base stands, m."""
LONGEST, STAYS = 0.86, 0.6
"""Base to hand at most, m, and the cost of staying where it is."""
BEFORE, NEAR = 0.12, 0.03
"""From where a hand comes straight in, and slowly, m."""
STRAIGHT, OVER, *ROUND, FOLDING = range(5)
"""Routes there: straight, from above, with the base drawn back before it drives aside, and straight
once the arm is folded, the hand first drawn back beside a door that it has opened."""
ABOVE, BACKS, DRAWN = 0.16, (0.30, 0.65), 0.2
"""How far above, and how far back base and hand, m."""
BLOCKED = 2.0
"""Cost of driving where something stands."""
FAR_OFF, DRIVES = 10.0, 2.0
"""Costs of each m by which the arm is too short for where it has to go to with the part, wherever
the base stands, and of each m that the base has to drive meanwhile."""
SHARES, UNREACHED = (1.0 / 3.0, 2.0 / 3.0, 1.0), 1.0
"""Of the way on which the hand goes along: where it is looked at, and the cost of a hold with which
the arm comes to the end of a joint there."""
STOPS = 6
"""Equal stretches of that way, whose ends the simulator is asked about in turn."""
TIRED = 0.85
"""Share of its range up to which a joint goes easily."""
MEETS, ROUGHLY = 60.0, 0.01
"""Cost of each m by which the balls around a link are in something, and by how much they are larger
than it, m."""
GRID = 0.02
"""Between places sideways at which it is looked how far ahead the base may stand, m."""
NEAREST, FARTHEST = 0.36, 0.65
"""How far the hand may be from the base at least, and the wrist from the arm's shoulder at most, m.
"""
FAR = 0.15
"""The base goes along with what slides farther, m."""
TWISTED, PLACES, BEHIND = 0.05, 8, 0.3
"""What is held nearer than this to the hinge turns with the hand, m, which is looked at in so many
places on the way, and may stay behind by so much, rad: so far fingers turn about what they hold."""


class Takes:
    """Ways to take hold of a part: each a hold, a place of the base, and a route.

    Args:
        arm: the arm.
        found: the holds, the likeliest first.
        joint: moves the part.
        first: openness now.
        goal: openness wanted.
    """

    def __init__(
        self,
        arm: Arm,
        found: Sequence[Hold],
        joint: Joint,
        first: float,
        goal: float,
    ) -> None:
        self._arm, self._holds, self._joint = arm, found, joint
        self._first, self._by = first, goal - first
        self._parts = sorted({part.name for part in arm.scene.parts if part.joint == joint.key})
        self._loads = loads(arm, joint)
        along = [
            [hold.moved(joint, share * self._by, float(hold.pinched)) for hold in found]
            for share in SHARES
        ]
        ends = along[-1]
        slides = by_base(arm, joint) * self._by * joint.travel * np.asarray(joint.axis)
        points = np.array([h.point for h in found]).reshape(-1, 3) @ arm.frame
        hands = arm.frame.T @ np.array([h.hand for h in found]).reshape(-1, 3, 3)
        self._intos, self._backs = (
            np.array(ways).reshape(-1, 3) @ arm.frame
            for ways in ([h.into for h in found], [h.back(joint, self._by) for h in ends])
        )
        bearing = np.arctan2(hands[:, 1, 2], hands[:, 0, 2])
        bearing *= np.linalg.norm(hands[:, :2, 2], axis=1) > 0.3
        shift = np.tile(SHIFTS, len(REACHES))
        far = np.repeat(self._reaches(points, hands), len(SHIFTS), axis=1)
        effort = 0.3 * np.repeat(range(len(REACHES)), len(SHIFTS)) + 1.5 * np.abs(shift)
        aside = points[:, 1:2] - far * np.sin(bearing)[:, None] + shift
        nearer = far - np.sqrt(np.maximum(far**2 - shift**2, NEAREST**2))
        ahead = points[:, :1] - far * np.cos(bearing)[:, None] + nearer
        here = arm.ahead(arm.base), arm.aside(arm.base)
        ahead, aside = (
            np.append(places, np.full((len(found), 1), stays), axis=1)
            for places, stays in zip((ahead, aside), here, strict=True)
        )
        front, rear, passing, backing = self._limits(aside)
        stand = np.maximum(np.minimum(ahead, front), rear)
        cost = np.array([h.cost for h in found])[:, None] + np.append(effort, STAYS)
        cost += 2.0 * np.abs(ahead - stand)
        cost[(points[:, :1] - stand > LONGEST) | (stand > front)] = np.inf
        self._slides = slides @ arm.frame * (1.0, 1.0, 0.0)
        self._at = np.stack((stand, aside), axis=2)
        # So far the base comes when the part is out of its way.
        self._farthest = np.maximum(stand, self._limits(aside, joint.key)[0])
        self._last = self._at + self._slides[:2]
        self._last[:, :, 0] = np.minimum(self._last[:, :, 0], self._farthest)
        self._along = [
            (
                np.array([h.point for h in then]).reshape(-1, 3) @ arm.frame,
                arm.frame.T @ np.array([h.hand for h in then]).reshape(-1, 3, 3),
            )
            for then in along
        ]
        cost += self._to_follow(*self._along[-1])
        routes = np.arange(FOLDING + 1)
        near = np.minimum(stand, here[0])[..., None]
        drawn, most = near - np.array(BACKS), backing[..., None]
        # What it is beside is not behind it when it has drawn back.
        self._back = np.where(most > near, drawn, np.maximum(drawn, most))
        straight = np.maximum(stand, here[0])[..., None]
        ahead = np.concatenate((straight, straight, self._back, straight), axis=2)
        unlikely = BLOCKED * (passing[..., None] < ahead)
        unlikely[:, :, ROUND] += BLOCKED * self._shut(aside, self._back)
        unlikely[:, :, FOLDING] += 0.0 if foresee(arm, self._fold()).free else np.inf
        pushed = np.array([not h.pinched for h in found])
        own = np.concatenate(
            (points / 0.08, hands[:, :, 2] / 0.5, hands[:, :, 0] / 0.7, pushed[:, None] * 1.5),
            axis=1,
        )
        shape = *cost.shape, len(routes)
        features = np.concatenate(
            (
                np.broadcast_to(own[:, None, None], (*shape, own.shape[1])),
                np.broadcast_to(self._at[:, :, None] / 0.12, (*shape, 2)),
                np.broadcast_to(1.5 * routes[:, None], (*shape, 1)),
            ),
            axis=3,
        )
        self._points, self._hands, self._shape = points, hands, shape
        total = cost[:, :, None] + 0.25 * routes + unlikely
        cells = np.round(self._at / GRID).astype(int).reshape(-1, 2)
        place = np.unique(cells, axis=0, return_inverse=True)[1].reshape(*cost.shape, 1)
        drives = place * len(routes) + np.maximum(routes, OVER)
        table = features.reshape(total.size, own.shape[1] + 3)
        self._all = Candidates(total.ravel(), table, own.shape[1], drives.ravel(), self._hard)

    def free(self, number: int, joint: Joint) -> tuple[Hold, Sequence[Leg]]:
        """The number-th of those whose way is free, and that way; how far it may be moved then is
        in the hold.

        Raises:
            SkillFailed: if there are no so many.
        """
        permits = [("finger", f"{joint.entity}/{name}") for name in self._parts]
        goal = f"the {self._parts[0] if self._parts else 'part'} of {joint.entity}"
        then = None if joint.kind == "hinge" and not swings(joint) else self._going_along
        chosen = self._all.free(number, self._arm, self._way, permits, goal, then)
        hold, stops = self._holds[self._index(chosen)[0]], self._all.ends.get(chosen)
        # The hand does not stop at once; where it would not come to the first stop, it is tried.
        until = (stops - 0.5) / STOPS if stops else 1.0
        return replace(hold, until=until), self._way(chosen)[0]

    def _reaches(self, points: Array, hands: Array) -> Array:
        """How far from holds the base is to stand (N, R), m: nearer if they are high or low."""
        approach = hands[:, :, 2]
        up = reach_of((points - WRIST * approach - (0.0, 0.0, self._arm.torso)) * (0.0, 0.0, 1.0))
        level = np.sqrt(np.maximum(0.0, np.square(STRETCHES) - up[:, None] ** 2))
        level += WRIST * np.linalg.norm(approach[:, :2], axis=1)[:, None]
        return np.asarray(np.clip(level, NEAREST, REACHES))

    def _to_follow(self, points: Array, hands: Array) -> Array:
        """Costs (N, S) of where the hand goes to with the part, from where the base is then.

        Args:
            points: grip points there (N, 3), seen from the base's heading.
            hands: orientations there (N, 3, 3), likewise.
        """
        wrists = points - WRIST * hands[:, :, 2]
        front = self._limits(wrists[:, 1:2])[0][:, 0]
        ahead, left, up = wrists.T - np.array(((0.0,), (0.0,), (self._arm.torso,)))
        least = np.stack((np.maximum(0.0, ahead - front), 0.0 * left, up), axis=1)
        stand, aside = np.moveaxis(self._last, 2, 0)
        up = np.broadcast_to(up[:, None], stand.shape)
        off = np.stack((ahead[:, None] - stand, left[:, None] - aside, up), axis=2)
        short, drives = (np.maximum(0.0, reach_of(way) - FARTHEST) for way in (least, off))
        return np.asarray(FAR_OFF * short[:, None] + DRIVES * drives)

    def _index(self, number: int) -> tuple[int, int, int]:
        hold, stand, route = np.unravel_index(number, self._shape)
        return int(hold), int(stand), int(route)

    def _way(self, number: int) -> tuple[Sequence[Leg], float]:
        which, place, route = self._index(number)
        arm, hold, (ahead, aside) = self._arm, self._holds[which], self._at[which, place].tolist()
        hand, near = hold.hand, hold.point + hold.clear
        before = near - BEFORE * hold.into
        stand, near_by = Leg(arm.floor_point(ahead, aside)), 0.006 if hold.pinched else 0.012
        legs = [
            Leg(before, hand, 0.02),
            Leg(near - NEAR * hold.into, hand, near_by, 0.6, 80, exact=True),
            *([Leg(near, hand, near_by, 0.3, 50, exact=True)] if hold.clear.any() else []),
            Leg(hold.point, hand, 0.008, 0.3, 50, touches=True),
        ]
        if route == STRAIGHT:
            return [stand, *legs], hold.opening
        if route == OVER:
            return [stand, Leg(raised(before, ABOVE), hand, 0.03), *legs], hold.opening
        if route == FOLDING:
            return [*self._fold(), stand, *legs], hold.opening
        back = float(self._back[which, place, route - ROUND[0]])
        drawn = [Leg(arm.floor_point(back, side)) for side in (arm.aside(arm.base), aside)]
        posed = Leg(before - arm.onward(ahead - back), hand, 0.03)
        return [*drawn, posed, stand, *legs], hold.opening

    def _going_along(self, number: int) -> int | None:
        """To how many stops the hand may go along with the part; None if nothing is in the way, nor
        where it draws back then: nothing but the part itself, and what goes with it.
        """
        which, place, _ = self._index(number)
        arm, hold, joint = self._arm, self._holds[which], self._joint
        (coming, opening), along = self._way(number), list[Leg]()
        for share in np.linspace(0.0, 1.0, STOPS + 1)[1:].tolist():
            then = hold.moved(joint, share * self._by, float(hold.pinched))
            seen = (then.point @ arm.frame)[None], (arm.frame.T @ then.hand)[None]
            (base,) = self._bases(np.array([which]), np.array([place]), share, *seen)
            stand = arm.floor_point(*base[:2])
            along += [Leg(stand, touches=True), Leg(then.point, then.hand, 0.02)]
        along.append(Leg(then.point + LETS_GO * then.back(joint, self._by), then.hand, 0.02))
        own = {f"{joint.entity}/{name}" for name in self._parts} | self._loads
        permits = [("", name) for name in sorted(own)]
        legs = [*(replace(leg, touches=False) for leg in coming), *along]
        answer = foresee(arm, legs, permits, opening, 0.0, begins=len(coming))
        return (answer.waypoint - len(coming)) // 2 if answer.touch else None

    def _bases(
        self,
        which: NDArray[np.intp],
        place: NDArray[np.intp],
        share: float,
        points: Array,
        hands: Array,
    ) -> Array:
        """Where the base stands for some holds and places (K,) after a share of the way (K, 3), m.

        Args:
            which: the holds.
            place: where the base stood before.
            share: of the way.
            points: grip points then (K, 3), seen from the base's heading.
            hands: orientations then (K, 3, 3), likewise.
        """
        torso = np.full((len(which), 1), self._arm.torso)
        bases = np.concatenate((self._at[which, place], torso), axis=1) + share * self._slides
        bases[:, :2] += self._eased(points - WRIST * hands[:, :, 2] - bases)
        bases[:, 0] = np.minimum(bases[:, 0], self._farthest[which, place])
        return np.asarray(bases)

    def _fold(self) -> Sequence[Leg]:
        """The way on which the arm folds."""
        arm, (far, height, pitch) = self._arm, FOLDED
        drawn = Leg(arm.position - arm.onward(DRAWN), tolerance=0.03)
        return [drawn, Leg(arm.before(far, height), arm.pointing(pitch), 0.05)]

    def _hard(self, numbers: NDArray[np.intp]) -> Array:
        """How hard the postures of some are for the arm, and how deep its links would be in
        something.
        """
        which, place, _ = np.unravel_index(numbers, self._shape)
        torso = np.full((len(which), 1), self._arm.torso)
        stands = np.concatenate((self._at[which, place], torso), axis=1)
        found = np.zeros(len(numbers))
        turns = self._joint.kind == "hinge" and not swings(self._joint)
        joints = np.repeat(joints_now(self._arm), len(numbers), axis=0)
        for before in (BEFORE, 0.0):
            points = self._points[which] - before * self._intos[which] - stands
            # The hand comes to a knob from above or from afar, and not as the arm is bent now.
            joints, there = solve(points, self._hands[which], None if turns else joints)
            # It may come there in other ways than straight.
            far = ~there
            joints[far], there[far] = solve(points[far], self._hands[which][far])
            found += UNREACHED * far
            tired = np.maximum(0.0, strain(joints) - TIRED) / (1.0 - TIRED)
            found[~there] = np.inf
            found[there] += tired[there] + MEETS * self._deep(joints[there], stands[there])
        if turns:
            # On the spot, as far as it goes.
            return found
        for share, (grips, hands) in zip(SHARES, self._along, strict=True):
            points, turned = grips[which], hands[which]
            bases = self._bases(which, place, share, points, turned)
            joints, there = solve(points - bases, turned, joints, STRIDE)
            found += MEETS * self._deep(joints, bases, share)
        found += UNREACHED * ~there
        points = points + LETS_GO * self._backs[which]
        joints, _ = solve(points - bases, turned, joints, STRIDE)
        found += MEETS * self._deep(joints, bases, share)
        return found

    @staticmethod
    def _eased(wrists: Array) -> Array:
        """How far the base drives for the arm not to be stretched (K, 2), m.

        Args:
            wrists: seen from it (K, 3), m.
        """
        far = np.maximum(np.linalg.norm(wrists[:, :2], axis=1), 1e-9)
        level = np.sqrt(np.maximum(0.0, FARTHEST**2 - reach_of(wrists * (0.0, 0.0, 1.0)) ** 2))
        return np.asarray(wrists[:, :2] * np.maximum(0.0, 1.0 - level / far)[:, None])

    def _deep(self, joints: Array, stands: Array, share: float = 0.0) -> Array:
        """How deep the links are in something after a share of the way, m."""
        if not len(joints):
            return np.zeros(0)
        arm, (middles, radii) = self._arm, bodies(joints)
        seen = (middles + stands[:, None]).reshape(-1, 3)
        openness = self._first + share * self._by
        boxes = solids_then(arm, self._joint, self._first, openness)
        room = Room(boxes, arm.frame, seen.min(axis=0), seen.max(axis=0))
        away = room.exactly(seen).reshape(len(joints), -1) - radii
        return np.asarray(np.maximum(0.0, -away.min(axis=1) - ROUGHLY))

    def _shut(self, aside: Array, ahead: Array) -> NDArray[np.bool_]:
        """Whether the base cannot drive sideways to places (N, S), m, so far ahead (N, S, K), m."""
        here = self._arm.aside(self._arm.base)
        cells = np.round(np.stack(np.broadcast_arrays(aside[..., None], ahead), axis=-1) / GRID)
        drives, which = np.unique(cells.reshape(-1, 2), axis=0, return_inverse=True)
        shut = [
            not passable(self._arm, min(here, there), max(here, there), at)
            for there, at in (GRID * drives).tolist()
        ]
        return np.array(shut, bool)[which].reshape(ahead.shape)

    def _limits(self, aside: Array, but: str = "") -> tuple[Array, Array, Array, Array]:
        """How far ahead, and how far back, the base may stand at some places sideways, and on the
        way there from where it is, m; what a joint moves left out.
        """
        arm = self._arm
        here = round(arm.aside(arm.base) / GRID)
        cells = np.round(aside / GRID).astype(int)
        first, last = min(here, int(cells.min())), max(here, int(cells.max()))
        places, start = [n * GRID for n in range(first, last + 1)], here - first
        front = np.array([nearest(arm, at, at, but=but) for at in places])
        rear = np.array([rearmost(arm, at, at) for at in places])
        passing, backing = (
            np.append(least(side[start::-1])[::-1], least(side[start:])[1:])
            for side, least in ((front, np.minimum.accumulate), (rear, np.maximum.accumulate))
        )
        index = cells - first
        return front[index], rear[index], passing[index], backing[index]


def swings(joint: Joint) -> bool:
    """Whether a part swings about a hinge, as doors do and knobs do not."""
    return joint.kind == "hinge" and float(np.linalg.norm(joint.half)) > TWISTED


def turns_along(arm: Arm, hold: Hold, joint: Joint, by: float) -> bool:
    """Whether a hand, with the arm as it is bent now, turns about as far as what it holds, and no
    joint keeps it from that.

    Args:
        arm: the arm.
        hold: how it holds it.
        joint: moves the part.
        by: how much more open it is to be.
    """
    then = [hold.moved(joint, share * by, 1.0) for share in np.linspace(0.0, 1.0, PLACES + 1)]
    start = np.append(arm.base, arm.torso)
    points = (np.array([h.point for h in then]) - start) @ arm.frame
    hands = arm.frame.T @ np.array([h.hand for h in then])
    joints, _ = follow(joints_now(arm), points[None], hands[None])
    turned = links(joints[0])[1][:, 7]
    lags = [rotation_vector(hand @ now.T) for hand, now in zip(hands, turned, strict=True)]
    return float(np.linalg.norm(lags, axis=1).max()) < BEHIND


def by_base(arm: Arm, joint: Joint) -> bool:
    """Whether the base goes along with a part: with one that slides far towards it."""
    straight = joint.kind == "slide" and abs(arm.ahead(np.asarray(joint.axis))) > 0.9
    return straight and abs(joint.travel) > FAR
