"""Placing: what is held is brought to one of some spots, lowered until it stands, and let go."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.expert.motions.handholds import outline
from pytest_safemanip.expert.motions.reaching import (
    MOST,
    PATIENCE,
    Pose,
    Reach,
    Reaching,
    Ways,
    draw_back,
    go_before,
    holding,
)
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.rotations import Array, about_z, rotation_vector, upright
from pytest_safemanip.expert.world.contacts import carried_by_something, palm_meets
from pytest_safemanip.expert.world.room import Room, walls
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.geometry import matrix

OVER = 0.008
"""Free space below a load before it is lowered until it stands, m."""
HIGHER = (0.0, 0.02, 0.04, 0.06)
"""How much higher something may be let go, m: where the palm would meet a rim."""
TURNS = (0.0, 20.0, -20.0, 45.0, -45.0, 90.0, -90.0, 180.0)
"""How far a load may be turned about the vertical from how it is held, degrees."""
ASKEW, LYING = math.radians(2.0), math.radians(35.0)
"""How askew something hangs that is set upright again, at least and at most, rad."""
ENTRIES = ((0.0, 0.02), (0.0, 0.05), (0.0, 0.1), (0.0, 0.18))
LEAVES = ((0.08, 0.01), (0.0, 0.1), (0.0, 0.18))
SPEED, SOFTLY = 0.12, 0.05
"""Share of the hand's top speed at which a load is lowered: usually, and what may break."""
CARRIED = 0.6
"""Share of the usual speeds on the way."""
OFF = 0.25
"""How far the base draws back at least from what is let go, m."""
STANDS, TIPPED = 0.06, math.radians(25.0)
"""How far from its spot something may come to rest, m, and turned by how much from upright, rad."""


@dataclass(frozen=True)
class Spot:
    """Where something may be put down.

    Attributes:
        point: of its middle, on the level, at the height of what it comes to stand on (3,).
        cost: what speaks against it.
        kind: of spots that are much alike.
        hollow: entity that it goes into; empty if none.
    """

    point: Array
    cost: float = 0.0
    kind: str = ""
    hollow: str = ""


Spots = Callable[[], Sequence[Spot]]


def place(arm: Arm, role: str, spots: Spots) -> Motion:
    """Put a held object down on one of some spots, and draw back.

    Args:
        arm: the arm.
        role: the object.
        spots: finds the spots.

    Raises:
        SkillFailed: if there is no way to any, or if it does not stay there.
    """
    thing = Thing(arm, role)
    state = arm.step.object_pose.tobytes(), arm.step.base_pose.tobytes()
    ways = arm.latest(
        f"ways to place {role}", state, lambda: Placing(arm, thing, spots()).ways(held(arm))
    )
    if not ways:
        raise SkillFailed(f"there is no way to where {role} is to go")
    reach = arm.choices.choose("way to place", ways)
    yield from holding(arm, go_before(arm, reach, thing, CARRIED), thing)
    yield from set_down(arm, thing)
    yield from arm.grip(False)
    yield from withdraw(arm, reach)
    check(arm, thing, reach)


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


def held(arm: Arm) -> Grip:
    """How the hand is now."""
    return Grip(arm.position, arm.rotation, float(arm.step.gripper[0]))


class Placing:
    """Looks for ways to put a thing down.

    Args:
        arm: the arm.
        thing: the thing.
        spots: where it may go.
    """

    def __init__(self, arm: Arm, thing: Thing, spots: Iterable[Spot]) -> None:
        self._thing = thing
        self._groups: list[tuple[list[Spot], Reaching]] = []
        ways = Ways(ENTRIES, LEAVES, brings=True)
        ordered = sorted(spots, key=lambda spot: spot.hollow)
        for hollow, some in itertools.groupby(ordered, key=lambda spot: spot.hollow):
            group = list(some)
            without, extra = [thing.entity], list[Array]()
            if hollow:
                without, extra = [*without, hollow], walls(Thing(arm, hollow))
            room = Room.around(arm, [spot.point for spot in group], without, extra)
            self._groups.append((group, Reaching(arm, room, ways)))

    def ways(self, grip: Grip, most: int = MOST, patience: int = PATIENCE) -> list[Reach]:
        """Ways to put it down, the easiest first.

        Args:
            grip: how it is held.
            most: ways that are enough.
            patience: poses that are looked at for that.
        """
        found: list[Reach] = []
        for group, reaching in self._groups:
            poses = [pose for spot in group for pose in poses_at(self._thing, spot, grip)]
            found += reaching.find(poses, most, patience=patience)
        return sorted(found, key=lambda reach: reach.cost)[:most]


def poses_at(thing: Thing, spot: Spot, held: Grip) -> Iterator[Pose]:
    """How the hand may be with a held thing on a spot."""
    right, shape = righted(thing), outline(thing) - thing.middle
    for number, turn in enumerate(TURNS):
        turned = about_z(turn) @ right
        hand = turned @ held.hand
        load = shape @ turned.T
        grip = turned @ (held.point - thing.middle)
        for higher in HIGHER:
            middle = spot.point + (0.0, 0.0, OVER + higher - float(load[:, 2].min()))
            cost = spot.cost + 0.1 * number + 5.0 * higher
            kind = spot.kind, number, higher
            family = number, higher
            yield Pose(middle + grip, hand, held.opening, cost, middle + load, family, kind)


def righted(thing: Thing) -> Array:
    """The turn (3, 3) that sets something upright that hangs askew."""
    axes = matrix(thing.pose[3:])
    number = int(np.argmax(np.abs(axes[2])))
    axis = axes[:, number] * math.copysign(1.0, axes[2, number])
    askew = math.acos(min(1.0, float(axis[2])))
    return upright(axis) if ASKEW < askew < LYING else np.eye(3)


def set_down(arm: Arm, thing: Thing, depth: float = 0.25, speed: float = SPEED) -> Motion:
    """Lower a held thing until it stands on something, or the palm does."""
    yield from arm.move(
        arm.position, tolerance=0.01, turn_tolerance=0.3, steps=15, required=False, exact=True
    )
    yield from arm.move(
        raised(arm.position, -depth),
        arm.rotation,
        speed=speed,
        steps=round(1.2 * depth / (0.05 * speed)),
        until=lambda: carried_by_something(arm, thing) or palm_meets(arm, thing),
        required=False,
    )


def withdraw(arm: Arm, reach: Reach) -> Motion:
    """Draw an empty hand off what it let go, and back."""
    yield from arm.move(
        arm.position + reach.leave, tolerance=0.02, speed=0.5, steps=50, required=False
    )
    yield from draw_back(arm, reach, least=OFF)


def check(arm: Arm, thing: Thing, reach: Reach) -> None:
    """See whether something stays where it was put.

    Raises:
        SkillFailed: if it does not.
    """
    off = float(np.linalg.norm((outline(thing) - reach.pose.load).mean(axis=0)[:2]))
    if off > STANDS:
        raise SkillFailed(f"{thing.entity} came to rest {100 * off:.0f} cm off its place")


def tilt_between(one: Array, other: Array) -> float:
    """Angle between two orientations (3, 3), rad."""
    return float(np.linalg.norm(rotation_vector(one @ other.T)))
