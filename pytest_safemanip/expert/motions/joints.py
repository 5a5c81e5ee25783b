"""Moving whatever a joint moves: a door, a drawer, a rack, a lid, a knob, a lever, a spout.

The part is taken hold of where it can be, and the hand goes along with it; the base takes over
where the arm would be stretched. Where the hand lost it, or came to its end, it is taken anew.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.motions.holds import Hold, holds, motion, solids_then
from pytest_safemanip.expert.motions.travelling import joints_now, step_aside
from pytest_safemanip.expert.robot.arm import Arm, Motion, NoWay, SkillFailed, raised
from pytest_safemanip.expert.robot.base import BASE_DEAD_BAND, LASTING
from pytest_safemanip.expert.robot.hand import WRIST
from pytest_safemanip.expert.robot.kinematics import STRIDE, bodies, reach_of, solve, strain
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.candidates import OPTIONS, Candidates
from pytest_safemanip.expert.world.room import Room, heading
from pytest_safemanip.expert.world.standing import nearest, rearmost
from pytest_safemanip.expert.world.things import Furniture
from pytest_safemanip.expert.world.ways import Leg, go
from pytest_safemanip.trace.elements import ROBOT, Joint

STAGES, WIDE_STAGES, WIDE = (1, 2, 3), (2, 1, 3), 1.2
"""In how many stages a part may be moved, each with a hold of its own; one that is pushed round by
more than this, rad, usually in two: what pushes its outer side at first is in its way later."""
HOLDS = 4
"""How often a part is taken hold of at most."""
STUCK = 0.02
"""A hold that takes it less far along, share of its travel, is the last one."""
REACHES, STRETCHES = (0.64, 0.54, 0.74), (0.60, 0.54, 0.64)
"""Base to hand, and from the arm's shoulder to its wrist at most then, m."""
SHIFTS = (0.0, 0.13, -0.13, 0.3, -0.3, 0.45, -0.45)
"""How much farther to the left than in line with the hand the base stands, m."""
LONGEST, STAYS = 0.86, 0.6
"""Base to hand at most, m, and the cost of staying where it is."""
BEFORE, NEAR = 0.12, 0.03
"""From where a hand comes straight in, and slowly, m."""
STRAIGHT, OVER, *ROUND = range(4)
"""Routes there: straight, from above, and with the base drawn back before it drives aside."""
ABOVE, BACKS = 0.16, (0.30, 0.65)
"""How far above, and how far back, m."""
BLOCKED = 2.0
"""Cost of driving straight where something stands."""
FAR_OFF, DRIVES = 10.0, 2.0
"""Costs of each m by which the arm is too short for where it has to go to with the part, wherever
the base stands, and of each m that the base has to drive meanwhile."""
SHARES, UNREACHED = (1.0 / 3.0, 2.0 / 3.0, 1.0), 1.0
"""Of the way on which the hand goes along: where it is looked at, and the cost of a hold with which
the arm comes to the end of a joint there."""
TIRED = 0.85
"""Share of its range up to which a joint goes easily."""
MEETS, ROUGHLY = 60.0, 0.01
"""Cost of each m by which the balls around a link are in something, and by how much they are larger
than it, m."""
GRID = 0.02
"""Between places sideways at which it is looked how far ahead the base may stand, m."""
LETS_GO = 0.10
"""How far the hand draws back from what it held, m."""


def move_joint(
    arm: Arm,
    fixture: Furniture,
    joint: Joint,
    goal: float,
    off: float = 0.02,
    until: Callable[[], bool] | None = None,
) -> Motion:
    """Move what a joint moves until it is as open as wanted.

    Args:
        arm: the arm.
        fixture: whose part it is.
        joint: the joint.
        goal: openness.
        off: how far from the goal it may stay on this side.
        until: replaces these two.

    Raises:
        SkillFailed: if it does not get there.
    """
    way = math.copysign(1.0, goal - fixture.openness(joint))

    def there(share: float = 1.0) -> bool:
        return until() if until else (fixture.openness(joint) - goal) * way >= -share * off

    def passed(end: float) -> bool:
        return (fixture.openness(joint) - end) * way >= 0.0 or there(0.7)

    slips, first = False, fixture.openness(joint)
    # Another hold is likelier to help than other stages, and is asked for first.
    arm.choices.choose(f"hold 1 of {joint.name}", range(OPTIONS))
    swings = _swings(joint)
    wide = swings and (first - goal) * abs(joint.travel) > WIDE
    stages = arm.choices.choose(f"stages of {joint.name}", WIDE_STAGES if wide else STAGES)
    for number in range(1, HOLDS + stages):
        if there():
            return
        before = fixture.openness(joint)
        next_ = first + (goal - first) * min(1.0, number / stages)
        try:
            hold = yield from take_hold(arm, fixture, joint, next_, f"hold {number}", slips)
        except NoWay as error:
            if number == 1:
                raise
            raise SkillFailed(f"{joint.key} stopped at {before:.0%}, {error}") from error
        yield from follow(
            arm,
            fixture,
            joint,
            hold,
            # What is pushed does not come to rest in between.
            next_ if hold.pinched else goal,
            partial(passed, next_),
        )
        hold = hold.moved(joint, fixture.openness(joint) - before, 0.0)
        yield from let_go(arm, hold)
        yield from _settled(arm, joint)
        slips = hold.pinched and not passed(next_)
        if abs(fixture.openness(joint) - before) < STUCK:
            break
    if not there():
        raise SkillFailed(f"{joint.key} stopped at {fixture.openness(joint):.0%}")


def take_hold(
    arm: Arm,
    fixture: Furniture,
    joint: Joint,
    goal: float,
    what: str,
    slips: bool = False,
    pinched: bool = False,
) -> Generator[Array, None, Hold]:
    """Bring the hand to a part, and close it where it is to be pinched.

    Args:
        arm: the arm.
        fixture: whose part it is.
        joint: moves it.
        goal: openness wanted.
        what: name of the choice.
        slips: whether it slipped out of the fingers.
        pinched: whether it has to be held between them.

    Returns:
        The hold, as it is then.

    Raises:
        SkillFailed: if no way there is free.
    """
    yield from step_aside(arm)
    first = fixture.openness(joint)
    state = arm.step.joint.tobytes(), arm.step.eef_pose.tobytes(), arm.step.base_pose.tobytes()

    def ways() -> _Takes:
        found = holds(arm, joint, fixture.boxes("handle", joint.name), first, goal, slips)
        found = [hold for hold in found if hold.pinched or not pinched]
        return _Takes(arm, found, joint, first, goal)

    takes = arm.latest(f"{what} {goal} {slips} of {joint.key}", state, ways, LASTING)
    number = arm.choices.choose(f"{what} of {joint.name}", range(OPTIONS))
    hold, legs = takes.free(number, joint)
    yield from arm.open_to(hold.opening)
    *coming, last = legs
    yield from go(arm, coming)

    def now() -> Hold:
        return hold.moved(joint, fixture.openness(joint) - first, 0.0)

    yield from arm.move(
        lambda: now().point, hold.hand, tolerance=0.004, speed=last.speed, steps=50, required=False
    )
    if not hold.pinched:
        return now()
    yield from arm.grip(True)
    return replace(hold, contact=arm.position, point=arm.position)


class _Takes:
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
        along = [
            [hold.moved(joint, share * self._by, float(hold.pinched)) for hold in found]
            for share in SHARES
        ]
        ends = along[-1]
        slides = _by_base(arm, joint) * self._by * joint.travel * np.asarray(joint.axis)
        points = np.array([h.point for h in found]).reshape(-1, 3) @ arm.frame
        hands = arm.frame.T @ np.array([h.hand for h in found]).reshape(-1, 3, 3)
        self._intos, self._backs = (
            np.array(ways).reshape(-1, 3) @ arm.frame
            for ways in ([h.into for h in found], [h.back for h in ends])
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
        routes = np.arange(ROUND[-1] + 1)
        near = np.minimum(stand, here[0])[..., None]
        drawn, most = near - np.array(BACKS), backing[..., None]
        # What it is beside is not behind it when it has drawn back.
        self._back = np.where(most > near, drawn, np.maximum(drawn, most))
        straight = np.repeat(np.maximum(stand, here[0])[..., None], ROUND[0], axis=2)
        blocked = passing[..., None] < np.append(straight, self._back, axis=2)
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
        total = cost[:, :, None] + 0.25 * routes + BLOCKED * blocked
        cells = np.round(self._at / GRID).astype(int).reshape(-1, 2)
        place = np.unique(cells, axis=0, return_inverse=True)[1].reshape(*cost.shape, 1)
        drives = place * len(routes) + np.maximum(routes, OVER)
        table = features.reshape(total.size, own.shape[1] + 3)
        self._all = Candidates(total.ravel(), table, own.shape[1], drives.ravel(), self._hard)

    def free(self, number: int, joint: Joint) -> tuple[Hold, Sequence[Leg]]:
        """The number-th of those whose way is free, and that way.

        Raises:
            SkillFailed: if there are no so many.
        """
        names = sorted({part.name for part in self._arm.scene.parts if part.joint == joint.key})
        permits = [("finger", f"{joint.entity}/{name}") for name in names]
        goal = f"the {names[0] if names else 'part'} of {joint.entity}"
        chosen = self._all.free(number, self._arm, self._way, permits, goal)
        return self._holds[self._index(chosen)[0]], self._way(chosen)[0]

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
        back = float(self._back[which, place, route - ROUND[0]])
        drawn = [Leg(arm.floor_point(back, side)) for side in (arm.aside(arm.base), aside)]
        posed = Leg(before - arm.onward(ahead - back), hand, 0.03)
        return [*drawn, posed, stand, *legs], hold.opening

    def _hard(self, numbers: NDArray[np.intp]) -> Array:
        """How hard the postures of some are for the arm, and how deep its links would be in
        something.
        """
        which, place, _ = np.unravel_index(numbers, self._shape)
        torso = np.full((len(which), 1), self._arm.torso)
        stands = np.concatenate((self._at[which, place], torso), axis=1)
        found, joints = (
            np.zeros(len(numbers)),
            np.repeat(joints_now(self._arm), len(numbers), axis=0),
        )
        for before in (BEFORE, 0.0):
            points = self._points[which] - before * self._intos[which] - stands
            joints, there = solve(points, self._hands[which], joints)
            # It may come there in other ways than straight.
            far = ~there
            joints[far], there[far] = solve(points[far], self._hands[which][far])
            found += UNREACHED * far
            tired = np.maximum(0.0, strain(joints) - TIRED) / (1.0 - TIRED)
            found[~there] = np.inf
            found[there] += tired[there] + MEETS * self._deep(joints[there], stands[there])
        if not _swings(self._joint) and self._joint.kind == "hinge":
            # The hand turns on the spot, as far as it goes.
            return found
        for share, (grips, hands) in zip(SHARES, self._along, strict=True):
            points, turned = grips[which], hands[which]
            bases = stands + share * self._slides
            bases[:, :2] += self._eased(points - WRIST * turned[:, :, 2] - bases)
            bases[:, 0] = np.minimum(bases[:, 0], self._farthest[which, place])
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
        room = Room(boxes, heading(arm), seen.min(axis=0), seen.max(axis=0))
        away = room.exactly(seen).reshape(len(joints), -1) - radii
        return np.asarray(np.maximum(0.0, -away.min(axis=1) - ROUGHLY))

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


SLOWEST, FASTEST, PULLED, BRAKE = 0.02, 0.15, 0.08, 1.0
"""Speeds of what is moved, m/s, of a door that is pulled by its handle, which creeps out of the
fingers the more the harder they pull, and in how many seconds it comes to rest, s."""
LEAST_LEAD, MOST_LEAD, LEAD_GAIN, YIELD_GAIN = 0.004, 0.05, 0.01, 0.03
"""How far ahead of the part the hand aims to press on it, m, and how much farther, or less far, in
each control step for each m/s that the part is too slow, or too fast."""
STIFFNESS, LAGS = 500.0, 0.19
"""Of the hand, N/m, and by how much it lags behind where it aims, s."""
FRICTION = 0.6
"""Share of the fingers' force by which a hand pulls, for what they pinch not to slip."""
PATIENCE = 30
"""Control steps in which a part that is pushed with all force has to have moved."""
CREEPS, CREPT = 60, 0.006
"""Control steps in which any part has to have moved so far, m."""
NEAREST, FARTHEST = 0.36, 0.65
"""How far the hand may be from the base at least, and the wrist from the arm's shoulder at most, m.
"""
WITHIN = 0.03
"""How far inside of that the base brings it, m."""
STEPS = 500
"""Control steps of one hold at most."""
OFF = 0.04
"""A hand that is farther from where it holds has lost it, m."""
BY_HAND = 0.05
"""The last stretch, which the base would not end gently, m."""
FAR = 0.15
"""The base goes along with what slides farther, m."""
BETWEEN = 4
"""Control steps between two in which the hand goes on while the base drives."""
BASE_SPEED = 0.37
"""Of the base at a full command, m/s."""
SETTLES, RESTS = 40, 0.02
"""Control steps in which a part comes to rest, and how much of its travel it then moves in 1 s."""
LOOKAHEAD = 0.06
"""How far ahead of it is looked for what stands there, m."""
TURNS = (0.75, 1.0, 0.0)
"""Shares of a door's turn that a hand turns with it; the bar turns between the pads."""
TWISTED, TWIST, TWISTING = 0.05, 0.08, 0.03
"""What is held nearer than this to the hinge turns with the hand, m, as fast as a point so far from
it at this speed, m/s, and that is so far ahead at most, m."""


def follow(
    arm: Arm,
    fixture: Furniture,
    joint: Joint,
    hold: Hold,
    goal: float,
    there: Callable[[], bool],
) -> Motion:
    """Go along with a part that is held, until it is there, stuck or lost."""
    first = fixture.openness(joint)
    way = math.copysign(1.0, goal - first)
    radius = _radius(joint, hold.contact)
    travel = abs(joint.travel)
    long = travel if joint.kind == "slide" else max(radius, TWISTED) * travel
    twists = joint.kind == "hinge" and radius < TWISTED and hold.pinched
    share = 1.0 if twists else 0.0
    if hold.pinched and not twists:
        share = arm.choices.choose(f"{joint.name} turned along", TURNS)
    brake = BRAKE / 2.0 if twists else BRAKE
    by_base = _by_base(arm, joint)
    pulls = hold.pinched and not twists
    fastest = TWIST if twists else PULLED if pulls and joint.kind == "hinge" else FASTEST
    press, last, still, mark = LEAST_LEAD, first, 0, first
    eases: Array | None = None
    period = arm.scene.control_period
    for number in range(STEPS):
        now = fixture.openness(joint)
        if there():
            return
        rate, last = (now - last) * way * long / period, now
        if number and not number % CREEPS:
            if (now - mark) * way * long < CREPT:
                return
            mark = now
        most = fastest if by_base or eases is None else fastest / 2.0
        left = max(0.0, (goal - now) * way * long)
        wanted = float(np.clip(math.sqrt(2.0 * left * fastest / brake), SLOWEST, most))
        most = TWISTING if twists else MOST_LEAD
        most = min(most, FRICTION * _gripping(arm) / STIFFNESS) if pulls else most
        gain = LEAD_GAIN if rate < wanted else YIELD_GAIN
        press = float(np.clip(press + gain * (wanted - rate), LEAST_LEAD, most))
        lead = press + LAGS * float(np.clip(rate, 0.0, wanted))
        still = still + 1 if press >= most and rate < 0.1 * SLOWEST else 0
        at = hold.moved(joint, now - first, share).point
        off = at - arm.position
        # What is pushed may run ahead of the hand.
        behind = 0.0 if pulls else max(0.0, float(off @ motion(joint, at, way)[0]))
        if still > PATIENCE or (not twists and float(np.linalg.norm(off)) - behind > OFF):
            return
        ahead = hold.moved(joint, now - first + way * (lead - behind) / long, share)
        if not twists:
            eases = _eases(arm, ahead, WITHIN if eases is not None else 0.0)
        # The hand moves on in between.
        if by_base and (goal - now) * way * long > BY_HAND:
            driven = _drive(arm, ahead.point - arm.position, wanted)
        elif eases is not None and number % BETWEEN:
            driven = _drive(arm, eases, 2.0 * wanted)
        else:
            driven = None
        yield arm.towards(ahead.point, ahead.hand) if driven is None else driven


def _swings(joint: Joint) -> bool:
    """Whether a part swings about a hinge, as doors do and knobs do not."""
    return joint.kind == "hinge" and float(np.linalg.norm(joint.half)) > TWISTED


def _by_base(arm: Arm, joint: Joint) -> bool:
    """Whether the base goes along with a part: with one that slides far towards it."""
    straight = joint.kind == "slide" and abs(arm.ahead(np.asarray(joint.axis))) > 0.9
    return straight and abs(joint.travel) > FAR


def _eases(arm: Arm, hold: Hold, within: float) -> Array | None:
    """Where the base has to drive for the arm to be neither stretched nor crowded (3,); None if it
    may stay.

    Args:
        arm: the arm.
        hold: where the hand goes.
        within: how far inside of its limits it is to be, m.
    """
    off = hold.point - np.append(arm.base, 0.0)
    to_wrist = off - WRIST * hold.hand[:, 2]
    if reach_of(to_wrist - (0.0, 0.0, arm.torso)) > FARTHEST - within:
        return np.asarray(to_wrist)
    return np.negative(off) if math.hypot(off[0], off[1]) < NEAREST + within else None


def _drive(arm: Arm, way: Array, speed: float) -> Array | None:
    """The action that drives the base along a way as far as it is free, at a speed, m/s, or back
    from what comes to it; None if it cannot drive.
    """
    ahead, aside = arm.ahead(way), arm.aside(way)
    length = math.hypot(ahead, aside)
    if length < 1e-6:
        return None
    ahead, aside = ahead / length, aside / length
    here = arm.ahead(arm.base), arm.aside(arm.base)
    beside = here[1] + LOOKAHEAD * aside
    ends = min(here[1], beside), max(here[1], beside)
    if nearest(arm, *ends) < here[0]:
        aside, ends = 0.0, (here[1], here[1])
    front = nearest(arm, *ends)
    if front < here[0]:
        ahead = -1.0
    elif front < here[0] + LOOKAHEAD * ahead:
        ahead = 0.0
    if ahead < 0.0 and rearmost(arm, *ends) > here[0] + LOOKAHEAD * ahead:
        ahead = 0.0
    command = float(np.clip(speed / BASE_SPEED, BASE_DEAD_BAND, 0.6))
    action, drives = arm.hold(), False
    for number, share in enumerate((ahead, aside)):
        if abs(share) > 0.3:
            action[7 + number] = math.copysign(max(BASE_DEAD_BAND, command * abs(share)), share)
            drives = True
    return action if drives else None


def _radius(joint: Joint, point: Array) -> float:
    axis, off = np.asarray(joint.axis), point - np.asarray(joint.anchor)
    return float(np.linalg.norm(np.cross(axis, off)))


def _gripping(arm: Arm) -> float:
    """With how much force the fingers press on anything, N."""
    contacts, parts, hand = arm.step.contacts, arm.scene.parts, arm.scene.grippers[0]
    fingers = {finger for group in hand.fingers for finger in group}
    total = 0.0
    for row in np.flatnonzero(contacts.force > 0.0).tolist():
        pair = parts[contacts.a[row]], parts[contacts.b[row]]
        if any(part.entity == ROBOT and part.name in fingers for part in pair):
            total += float(contacts.force[row])
    return total


def _settled(arm: Arm, joint: Joint) -> Motion:
    """Hold still until a part that swings has come to rest."""
    number = arm.scene.joint_index[joint.key]
    for _ in range(SETTLES):
        if abs(float(arm.step.joint[number, 1])) < RESTS:
            return
        yield arm.hold()


def let_go(arm: Arm, hold: Hold) -> Motion:
    """Open the fingers around a part as far as they were, and draw the hand back from it."""
    if hold.pinched:
        yield from arm.open_to(hold.opening)
    # What is pinched turned the hand, or turned between its fingers.
    back = -arm.rotation[:, 2] if hold.pinched else hold.back
    for away in (hold.clear, LETS_GO * back):
        if away.any():
            yield from arm.move(arm.position + away, tolerance=0.02, steps=40, required=False)
