"""Placing: what is held is brought to one of some spots, in one of some attitudes, lowered until it
stands, and let go.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.motions.approaching import go_before, holding
from pytest_safemanip.expert.motions.attitudes import (
    TURNS,
    Attitudes,
    dipped,
    laid,
    righted,
    standing,
    tipped,
    upwards,
)
from pytest_safemanip.expert.motions.hand_ways import HandWays
from pytest_safemanip.expert.motions.handholds import outline
from pytest_safemanip.expert.motions.lowering import DEEP, SPEED, set_down, withdraw
from pytest_safemanip.expert.motions.poses import SLANTED, Pose, Reach, Ways
from pytest_safemanip.expert.motions.reaching import (
    MOST,
    PATIENCE,
    Reaching,
    any_heading,
    turned_otherwise,
    varied,
)
from pytest_safemanip.expert.motions.resting import check_inside, check_stays, check_steady
from pytest_safemanip.expert.robot.arm import Arm, IllHeld, Motion, NoWay, SkillFailed
from pytest_safemanip.expert.robot.base import LASTING
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.contacts import carriers, supports
from pytest_safemanip.expert.world.room import Room, walls
from pytest_safemanip.expert.world.things import Space, Thing, contents, other_things, solid
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.planar import footprints_overlap

OVER = 0.008
"""Free space below a load before it is lowered until it stands, m."""
INTO = 0.02
"""How far below its goal it is lowered at most between the walls of a vessel, which the palm may
meet, m."""
SOFTLY = 0.05
"""Share of the hand's top speed at which a load is lowered that may break."""
HIGHER = (0.0, 0.015, 0.03, 0.045)
"""How much higher something may be let go, m: where the palm would meet a rim."""
LOWERED_TO, ONTO, DIPPED, END = (0.055,), (0.075,), (0.08, 0.1), 0.01
"""Likewise what the hand then lowers into a vessel, what falls onto what lies in that, and a stick,
m, and how long its end is."""
ENTRIES = (
    *((0.0, up, 0.0) for up in (0.02, 0.006, 0.05, 0.1, 0.15, 0.2, 0.25)),
    *SLANTED,
)
LEAVES = ((0.08, 0.01, 0.0), *((0.0, up, 0.0) for up in (0.1, 0.15, 0.2, 0.25)), *SLANTED)
"""Ways in and out: back along the approach, up, and to the robot, m."""
NARROWLY = 0.2
"""How much farther than they are fingers open in what is narrow, share of the full opening."""
CARRIED = 0.6
"""Share of the usual speeds on the way."""
ON_OTHERS = 0.6
"""What speaks against letting something go above what already lies there."""
JUTS, OUT = 2.0, 0.005
"""What speaks against letting something go that reaches out of a basin, or over what it may not
stand on; and how far something may reach out of what it is to lie in, m.
"""
LEVEL, HIGHER_UP = 0.01, 0.03
"""What is no lower than what something is to stand on, and no higher than that, would be taken for
what carries it, m."""
FALLS, OVERLAP = 0.04, 0.01
"""How far something may fall that is let go, and how far what it falls onto reaches below it, m."""
ALONG = 0.01
"""How far a vessel may rise when the hand leaves it, m."""
INSIDE = 0.025
"""How far from the edge of what it stands on a centre of mass stays, m."""


@dataclass(frozen=True)
class Spot:
    """Where something may be put down.

    Attributes:
        point: of its middle, on the level, at the height of what it comes to stand on (3,).
        cost: what speaks against it.
        kind: of spots that are much alike.
        hollow: entity that it goes into; empty if none.
        area: middle (3,) of what it comes to stand on, and from there to the middles of two sides,
            as columns (3, 2); None if it is large.
        space: that it is to be in, if it is.
        shuts: whether that is shut after: nothing may reach out of it, as it may of a basin.
    """

    point: Array
    cost: float = 0.0
    kind: str = ""
    hollow: str = ""
    area: tuple[Array, Array] | None = None
    space: Space | None = None
    shuts: bool = False


@dataclass(frozen=True)
class Grip:
    """How something is held.

    Attributes:
        point: grip point (3,).
        hand: orientation of the hand (3, 3).
        opening: of the fingers, share of the full opening.
    """

    point: Array
    hand: Array
    opening: float


Bools = NDArray[np.bool_]
Spots = Callable[[], Sequence[Spot]]
Bringing = Generator[Array, None, Reach]
"""A motion that ends where the hand goes straight to its goal; gives how it got there."""


def place(
    arm: Arm, role: str, spots: Spots, attitudes: Attitudes = standing, speed: float = SPEED
) -> Motion:
    """Put a held object down on one of some spots, and draw back.

    Args:
        arm: the arm.
        role: the object.
        spots: finds the spots.
        attitudes: finds how it may be turned there.
        speed: share of the hand's top speed at which it is lowered.

    Raises:
        SkillFailed: if there is no way to any, or if it does not stay there.
    """
    thing = Thing(arm, role)
    up = upwards(arm, thing)
    reach = yield from bring(arm, thing, spots, attitudes)
    deep = float(reach.entry[2]) + INTO if reach.pose.hollow else DEEP
    # What is heavy has turned in the fingers on the way, if it is not to be tipped.
    stands = attitudes is standing and reach.pose.family[0] in range(len(TURNS))
    hand = righted(arm, thing) @ arm.rotation if stands else None
    # What comes in from the side is lowered where it is to stand.
    above = reach.pose.point + reach.entry * (not reach.entry[:2].any())
    yield from set_down(arm, thing, deep, speed, above, hand)
    vessel = Thing(arm, reach.pose.hollow) if reach.pose.hollow else None
    floors = [float(reach.pose.load[:, 2].min()) - reach.pose.over]
    if vessel is not None:
        others = (it for it in contents(arm, vessel) if it.entity != thing.entity)
        below = (it for it in others if footprints_overlap(thing.corners, it.corners, OVERLAP))
        floors += [it.highest for it in below]
    fall, stood = thing.bottom - max(floors), vessel.bottom if vessel else 0.0
    # What hangs on a vessel's rim is not in it yet; what lies across something else would slip off.
    if fall > FALLS and not (vessel and carriers(arm, thing) - {vessel.entity}):
        raise IllHeld(f"{thing.entity} would fall {100 * fall:.0f} cm")
    if reach.pose.space and _out(reach.pose.space, thing.corners):
        raise SkillFailed(f"{thing.entity} would jut out")
    if reach.pose.opening < 1.0:
        yield from arm.let_go(NARROWLY / 2.0)
    else:
        yield from arm.grip(False)
    yield from withdraw(arm, reach)
    if vessel is not None:
        check_inside(arm, thing, vessel)
        if vessel.bottom - stood > ALONG:
            raise SkillFailed(f"{vessel.entity} came along")
    elif attitudes not in (laid, dipped):
        check_stays(thing, reach, up)
        check_steady(arm, thing)


def bring(arm: Arm, thing: Thing, spots: Spots, attitudes: Attitudes = standing) -> Bringing:
    """Bring a held thing to where it goes straight to one of some spots.

    Raises:
        SkillFailed: if there is no way to any, or if it slips in the fingers.
    """
    state = arm.step.object_pose.tobytes(), arm.step.base_pose.tobytes()

    def look() -> Callable[[float], list[Reach]]:
        return partial(Placing(arm, thing, spots(), attitudes).ways, held(arm))

    def find(but: Sequence[float]) -> list[Reach]:
        return arm.latest(
            f"ways to bring {thing.entity} {but}",
            state,
            lambda: any_heading(arm, look, but=but),
            LASTING,
        )

    ways = turned_otherwise(arm, find)
    if not ways:
        raise NoWay(f"there is no way to where {thing.entity} is to go")
    reach = arm.choices.choose("way to bring it", ways)
    yield from holding(arm, go_before(arm, reach, thing, CARRIED), thing)
    return reach


def held(arm: Arm) -> Grip:
    """How the hand is now."""
    return Grip(arm.position, arm.rotation, float(arm.step.gripper[0]))


_Rest = tuple[Array, float, list[tuple[float, Array, float]]]
"""Points on what is put down, from its middle (L, 3), what speaks against what lies below it, and
how much higher it may be let go, m, where its middle is then (3,), and what speaks against that."""


class Placing:
    """Looks for ways to put a thing down.

    Args:
        arm: the arm.
        thing: the thing.
        spots: where it may go.
        attitudes: finds how it may be turned there.
        squeezed: whether the hand is squeezed in.
        either: whether it may be held with the hand turned over just as well.
    """

    def __init__(
        self,
        arm: Arm,
        thing: Thing,
        spots: Iterable[Spot],
        attitudes: Attitudes = standing,
        squeezed: bool = False,
        either: bool = False,
    ) -> None:
        self._arm, self._thing, self._turns = arm, thing, attitudes(arm, thing)
        self._either = either
        self._dipped, self._along = attitudes is dipped, contents(arm, thing)
        self._tips = attitudes is standing and not self._along
        self._frame = arm.frame
        # Of fixtures that it has no leave to rest on; none where nobody knows.
        strange = set(arm.scene.entity) - supports(arm).get(thing.entity, set())
        self._strange = _Boxes(solid(arm, strange if arm.permissions else (), moving=False))
        others = other_things(arm, thing, *self._along)
        self._names = np.array([other.entity for other in others], str)
        self._others = _Boxes([other.corners for other in others])
        self._shape = np.concatenate([outline(one) for one in (thing, *self._along)]) - thing.middle
        self._rests: dict[int, list[_Rest | None]] = {}
        self._groups: list[tuple[list[Spot], HandWays]] = []
        self._reaching: dict[tuple[int, float], Reaching] = {}
        self._poses: tuple[bytes, list[list[Pose]]] = b"", []
        ways = Ways(ENTRIES, LEAVES, brings=True)
        ordered = sorted(spots, key=lambda spot: spot.hollow)
        for hollow, some in itertools.groupby(ordered, key=lambda spot: spot.hollow):
            group = list(some)
            without = [thing.entity, *(other.entity for other in self._along)]
            extra = list[Array]()
            if hollow:
                without, extra = [*without, hollow], walls(Thing(arm, hollow))
            room = Room.around(arm, [spot.point for spot in group], without, extra)
            self._groups.append((group, HandWays(arm, room, ways, squeezed)))

    def ways(
        self, grip: Grip, clearance: float, most: int = MOST, patience: int = PATIENCE
    ) -> list[Reach]:
        """Ways to put it down, the easiest first.

        Args:
            grip: how it is held.
            clearance: least one of the arm's links, m.
            most: ways that are enough.
            patience: poses that are looked at for that.
        """
        found: list[Reach] = []
        for number, poses in enumerate(self.poses(grip)):
            key, hands = (number, clearance), self._groups[number][1]
            if key not in self._reaching:
                self._reaching[key] = Reaching(self._arm, hands, clearance, either=self._either)
            found += self._reaching[key].find(poses, most, patience=patience)
        return varied(found, most)

    def poses(self, grip: Grip) -> list[list[Pose]]:
        """How the hand may be with the thing on a spot of each group."""
        key = np.concatenate((grip.point, grip.hand.ravel(), [grip.opening])).tobytes()
        if key != self._poses[0]:
            # There are thousands: those of one grip are remembered.
            self._poses = (
                key,
                [
                    [pose for spot in group for pose in self._on(spot, hands.room, grip)]
                    for group, hands in self._groups
                ],
            )
        return self._poses[1]

    def _on(self, spot: Spot, room: Room, held: Grip) -> Iterator[Pose]:
        """How the hand may be with the thing on a spot."""
        tips = tipped(self._arm, held.hand) if spot.hollow and self._tips else []
        openings = (1.0, min(1.0, held.opening + NARROWLY)) if spot.hollow else (1.0,)
        grip = held.point - self._thing.middle
        if id(spot) not in self._rests:
            self._rests[id(spot)] = [self._at_rest(spot, room, turn) for turn, _ in self._turns]
        rests = self._rests[id(spot)] + [self._at_rest(spot, room, turn) for turn, _ in tips]
        turns = zip([*self._turns, *tips], rests, strict=True)
        for number, ((turn, odd), rest) in enumerate(turns):
            if rest is None:
                continue
            load, others, heights = rest
            for opening, (higher, middle, cost) in itertools.product(
                dict.fromkeys(openings), heights
            ):
                family = number, higher, opening
                yield Pose(
                    middle + turn @ grip,
                    turn @ held.hand,
                    opening,
                    spot.cost + odd + others + cost + 0.2 * (opening < 1.0),
                    middle + load,
                    family,
                    spot.kind,
                    (spot.kind, *family),
                    OVER + higher,
                    spot.hollow,
                    held.opening,
                    spot.space if spot.shuts else None,
                )

    def _at_rest(self, spot: Spot, room: Room, turn: Array) -> _Rest | None:
        """How the thing may be let go on a spot, turned somehow, however it is held; None if it
        would not rest there.
        """
        thing = self._thing
        load = self._shape @ turn.T
        com = turn @ (thing.com - thing.middle)
        if not self._dipped and not _over(spot, spot.point + com):
            return None
        lowest = float(load[:, 2].min())
        box = (thing.corners - thing.middle) @ turn.T
        at = spot.point - (0.0, 0.0, lowest - OVER)
        others = self._on_others(spot, room, box + at, com + at)
        if self._on_top(spot, box + at):
            return None
        strange = not spot.hollow and self._strange.below(box + at, spot, (-LEVEL, HIGHER_UP))
        # What is dipped goes in with its end, and need not come down to the floor.
        end = load[load[:, 2] < lowest + END].mean(axis=0) if self._dipped else np.zeros(3)
        heights = []
        for higher in HIGHER + (DIPPED if self._dipped else self._into(spot.hollow)):
            middle = spot.point - np.append(end[:2], lowest - OVER - higher)
            juts = spot.space is not None and _out(spot.space, box + middle)
            if not (juts and spot.shuts):
                heights.append((higher, middle, 5.0 * higher + JUTS * (juts or strange)))
        return load, others, heights

    def _into(self, hollow: str) -> tuple[float, ...]:
        """How much higher still what goes into a vessel may be let go, m."""
        if not hollow:
            return ()
        return LOWERED_TO + (ONTO if contents(self._arm, Thing(self._arm, hollow)) else ())

    def _on_others(self, spot: Spot, room: Room, box: Array, com: Array) -> float:
        """What speaks against letting go of something above what already lies there: the more if it
        would not tip off.

        Args:
            spot: where it comes to stand.
            room: what is around.
            box: its corners there (8, 3).
            com: its centre of mass there (3,).
        """
        column = np.linspace((*com[:2], box[:, 2].min()), com, 4)
        above = self._others.below(box, spot, (LEVEL, math.inf), self._names != spot.hollow)
        inside = room.away(column @ self._frame).min() < 0.0
        return 0.5 * ON_OTHERS * (float(above) + float(inside))

    def _on_top(self, spot: Spot, box: Array) -> bool:
        """Whether the box (8, 3) of what is put on a shelf would be on top of what stands there."""
        if spot.space is None or spot.area is not None:
            return False
        there = self._others.low[:, 2] < spot.point[2] + HIGHER_UP
        return self._others.below(box, spot, (LEVEL, math.inf), there)


class _Boxes:
    """Boxes that something may reach over.

    Args:
        boxes: their corners, each (8, 3).
    """

    def __init__(self, boxes: Sequence[Array]) -> None:
        self._corners = np.array(boxes, float).reshape(-1, 8, 3)
        self.low, self._high = self._corners.min(axis=1), self._corners.max(axis=1)

    def below(
        self, box: Array, spot: Spot, top: tuple[float, float], among: Bools | bool = True
    ) -> bool:
        """Whether the box (8, 3) of what comes to stand on a spot reaches over one of some.

        Args:
            box: the box there.
            spot: the spot.
            top: how much higher than it those end, at least and at most, m.
            among: which of them are looked at.
        """
        ends = self._high[:, 2] - spot.point[2]
        near = among & (top[0] < ends) & (ends < top[1])
        near &= (self.low[:, :2] < box.max(axis=0)[:2]).all(axis=1)
        near &= (self._high[:, :2] > box.min(axis=0)[:2]).all(axis=1)
        return any(footprints_overlap(box, other, 0.0) for other in self._corners[near])


def _over(spot: Spot, com: Array) -> bool:
    """Whether a centre of mass (3,) is well over what carries it."""
    if spot.area is None:
        return True
    middle, spans = spot.area
    half = np.linalg.norm(spans, axis=0)
    off = np.abs((com - middle) @ (spans / half))
    return bool((off < half - np.minimum(INSIDE, half / 2.0)).all())


def _out(space: Space, box: Array) -> bool:
    """Whether a box (8, 3) reaches out of where it is to be, not at its floor."""
    pose, half = space
    own = (box - pose[:3]) @ matrix(pose[3:])
    out = (own[:, 2] > half[2] + OUT) | (np.abs(own[:, :2]) > half[:2] + OUT).any(axis=1)
    return bool(out.any())
