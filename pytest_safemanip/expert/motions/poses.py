"""Poses of the hand, and how hand and arm get to them: what :mod:`reaching` finds."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Self

from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Space


@dataclass(frozen=True)
class Pose:
    """How the hand may be at its goal.

    Attributes:
        point: grip point (3,).
        hand: orientation (3, 3).
        opening: of the fingers on the way there, share of the full opening.
        cost: what speaks against it, about 1 for what is hardly used.
        load: points (L, 3) of what it takes, or brings, there.
        family: what is alike in poses that are likely to fail together: how the hand is there, in
            several respects.
        place: likewise, where it is.
        kind: what is alike in those that are the same but for the arm.
        over: how far the load is above what it comes to stand on, m.
        hollow: entity that it goes into; empty if none.
        holding: opening of the fingers on the load, where it is brought.
        space: that nothing of the load may reach out of, if there is one.
        turned: whether the hand is turned over from how its wrist turns the least.
    """

    point: Array
    hand: Array
    opening: float
    cost: float
    load: Array
    family: tuple[Hashable, ...] = ()
    place: Hashable = 0.0
    kind: Hashable = ()
    over: float = 0.0
    hollow: str = ""
    holding: float = 1.0
    space: Space | None = None
    turned: bool = False

    def turned_over(self) -> Pose:
        """The same with the fingers exchanged, for which the last joint turns by half a turn."""
        return replace(self, hand=self.hand * (-1.0, -1.0, 1.0), turned=not self.turned)


Steps = Sequence[tuple[float, float, float]]
"""How far off its goal the hand is, back along its approach, straight up, and level to the robot,
m."""


SLANTED: Steps = ((0.0, 0.2, 0.08), (0.0, 0.28, 0.14))
"""Out from below an edge."""


@dataclass(frozen=True)
class Ways:
    """How a hand may come to a goal and leave it; the first that has room is taken.

    Attributes:
        entries: where it goes straight from.
        leaves: where it is drawn back from.
        brings: whether it brings something, and does not take it.
    """

    entries: Steps = (
        *((back, 0.0, 0.0) for back in (0.06, 0.12)),
        *((0.0, up, 0.0) for up in (0.12, 0.16, 0.2, 0.25, 0.3)),
        *SLANTED,
    )
    leaves: Steps = (
        *((0.0, up, 0.0) for up in (0.04, 0.06, 0.08, 0.12, 0.16, 0.2, 0.24, 0.28)),
        *SLANTED,
    )
    brings: bool = False


@dataclass(frozen=True)
class Way:
    """How a hand comes to a pose and leaves it.

    Attributes:
        pose: the pose.
        entry: from the grip point to where the hand goes straight from (3,).
        leave: from the grip point to where the hand is drawn back from (3,).
        come: how far off the base stands before (2,), m.
        go: how far off it is drawn after (2,), m.
        cost: what speaks against it.
    """

    pose: Pose
    entry: Array
    leave: Array
    come: Array
    go: Array
    cost: float

    @property
    def below_edge(self) -> bool:
        """Whether the hand comes in or leaves on a slant, below an edge."""
        steps = self.entry, self.leave
        return any(bool(step[2] >= SLANTED[0][1] and step[:2].any()) for step in steps)

    def turned_over(self) -> Self:
        """The same with the hand turned over."""
        return replace(self, pose=self.pose.turned_over())


@dataclass(frozen=True)
class Reach(Way):
    """Likewise of the whole arm.

    Attributes:
        base: where the base stands meanwhile (2,).
        torso: how far it is raised, m.
        room: around the arm's links on the way, m.
        turn: how far the base is turned to the left before, degrees.
        meets: whether the simulator foresees that a link meets something on it.
    """

    base: Array
    torso: float
    room: float
    turn: float = 0.0
    meets: bool = False
