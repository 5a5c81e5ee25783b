"""Where things can be put: on one another and into one another, on counters, shelves and burners.

Spots are only offered here, those that suit the task best first; whether thing, hand and arm have
room at one is looked at when they are placed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from pytest_safemanip.expert.motions.placing import Spot
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.room import Room
from pytest_safemanip.expert.world.things import Furniture, Thing, spaces_around
from pytest_safemanip.trace.geometry import matrix

GRID = (0.0, 0.08, -0.08, 0.16, -0.16, 0.24, -0.24)
"""Places along a target's sides, shares of their length from its middle."""
FLOOR, WALL = 0.006, 0.008
"""Thickness of a vessel's floor and of its wall, at most, m."""
FROM_EDGE = 0.03
"""From what is put down to the edge of what it stands on, m."""
DEPTHS = (0.02, 0.04, 0.07, 0.10, 0.14)
"""From the front of a shelf to what is put there, m."""
ASIDE = (0.0, 0.06, -0.06, 0.12, -0.12, 0.18, -0.18, 0.25, -0.25, 0.32, -0.32, 0.4, -0.4)
"""Places along a shelf or a counter, m from its middle or from where the hand is."""
OFF_BURNER = (0.0, 0.02, -0.02, 0.04, -0.04)
"""How far beside the middle of a burner, ahead and aside, something may stand, m."""
BESIDE = (0.0, 0.04, -0.04, 0.08, -0.08)
"""How far beside a point, ahead and to the left, m."""
SHIFTED = (0.0, -0.03, 0.03, -0.06, 0.06, -0.09, 0.09, -0.12, 0.12, -0.15, 0.15)
"""How far beside where water falls a vessel may stand, ahead and aside, m."""
UNDER_WATER = 0.45
"""How far beside it at most, as a share of the vessel's diagonal: RoboCasa wants it within half."""
POURED = (0.0, -0.01, -0.02, -0.03, 0.01), (0.0, 0.01, -0.01, 0.02, -0.02)
"""How far ahead and to the left of where a machine pours a cup may stand, m."""
LIES_ASKEW = 1.2
"""How many times as large as its own footprint the box around something that lies askew is."""
REACHABLE = 1.12
"""Height that the arm reaches best, m."""
CLOSE, APART = 0.13, 0.14
"""From the middle of one thing to that of another one that it belongs to, m, and at most: RoboCasa
wants 15 cm."""
NEXT_TO = (0.12, 0.15, 0.18, 0.21, 0.24, 0.27)
"""Likewise on a counter."""


def on_thing(arm: Arm, target: Thing, end: str = "") -> list[Spot]:
    """On another thing, its middle first.

    Args:
        arm: the arm.
        target: what it is put on.
        end: ``near`` or ``far`` for that half of it, ``end`` for one of its ends; empty for any.
    """
    (narrow, width), (long, length) = target.sides_about_middle()
    fixture, space = next(iter(spaces_around(arm, target)), ("", None))
    shuts = bool(arm.scene.doors_of(fixture))
    spans = np.stack((narrow * width, long * length), axis=1) / 2.0
    found = []
    for i, j in product(GRID, repeat=2):
        way = i * length * long + j * width * narrow
        spot = target.middle + way * (1.0, 1.0, 0.0)
        spot[2] = target.highest
        cost = 2.0 * math.hypot(i * length, j * width)
        if end in ("near", "far"):
            sign = 1.0 if end == "far" else -1.0
            cost = 3.0 * abs(sign * arm.ahead(way) - 0.25 * min(width, length))
        elif end:
            cost = 3.0 * abs(abs(i) - 0.24) * length + 2.0 * abs(j) * width
        kind = f"on {i:.2f} {j:.2f}"
        area = target.middle, spans
        found.append(Spot(spot, cost, kind, area=area, space=space, shuts=shuts))
    return found


def into_thing(arm: Arm, thing: Thing, target: Thing) -> list[Spot]:
    """Likewise into a vessel: off its middle only where what is put there fits beside it."""
    (_, width), (long, length) = target.sides_about_middle()
    room = max(0.0, (width - thing.sides()[1][1]) / 2.0 - WALL)
    found = []
    for spot in on_thing(arm, target):
        off = (spot.point - target.middle)[:2]
        along = float(np.clip(off @ long[:2], -(length - width) / 2.0, (length - width) / 2.0))
        if np.linalg.norm(off - along * long[:2]) <= room:
            point = np.append(spot.point[:2], target.bottom + FLOOR)
            found.append(Spot(point, spot.cost, spot.kind.replace("on", "in"), target.entity))
    return found


def beside(spots: Sequence[Spot], other: Thing, within: float = CLOSE) -> list[Spot]:
    """The spots that are near to another thing."""
    found = []
    for spot in spots:
        away = float(np.linalg.norm((spot.point - other.middle)[:2]))
        if away < APART:
            cost = 0.3 * spot.cost + 10.0 * max(0.0, away - within)
            found.append(replace(spot, cost=cost))
    return found


def inside(
    arm: Arm,
    thing: Thing,
    fixture: Furniture,
    spaces: Sequence[int] = (),
    onto: Sequence[Thing] = (),
) -> list[Spot]:
    """In a fixture: on the shelf that the arm reaches best, near its front.

    Args:
        arm: the arm.
        thing: what is put there.
        fixture: the fixture.
        spaces: numbers of its interiors, the lowest is 0; empty for any.
        onto: what is put down on it then.

    Raises:
        SkillFailed: if it has no interior.
    """
    if not fixture.interiors():
        raise SkillFailed(f"{fixture.entity} has no inside; on it things are placed with 'on'")
    as_is = np.max([np.ptp(t.corners @ arm.frame, axis=0) / 2.0 for t in (thing, *onto)], axis=0)
    narrow, wide = (np.max([t.sides()[k][1] for t in (thing, *onto)]) / 2.0 for k in (0, 1))
    # It may be turned straight there.
    sizes = [as_is[:2]]
    if as_is[0] * as_is[1] > LIES_ASKEW * narrow * wide:
        sizes += [np.array((narrow, wide)), np.array((wide, narrow))]
    return next((found for size in sizes if (found := _on_shelves(arm, fixture, size, spaces))), [])


def _on_shelves(arm: Arm, fixture: Furniture, size: Array, spaces: Sequence[int]) -> list[Spot]:
    """Spots on the shelves of a fixture, for what has some half extents ahead and aside (2,), m."""
    found = []
    shelves, frame = fixture.open_interiors(), arm.frame
    shuts = bool(fixture.doors())
    for number, (pose, half) in enumerate(shelves):
        if spaces and number not in spaces and number - len(shelves) not in spaces:
            continue
        deep, across, high = np.abs(frame.T @ matrix(pose[3:])) @ half
        floor, middle = float(pose[2] - high), pose[:3] @ frame
        for depth in (*DEPTHS, float(deep - size[0])):
            ahead = middle[0] - deep + depth + size[0]
            if ahead > middle[0] + deep - 0.5 * size[0]:
                continue
            for aside in ASIDE:
                if abs(aside) > across - size[1]:
                    continue
                point = arm.point(ahead, middle[1] + aside, floor)
                cost = depth + 0.7 * abs(aside) + 0.5 * abs(floor - REACHABLE)
                kind = f"in {number} {depth:.2f} {aside:.2f}"
                found.append(Spot(point, cost, kind, space=(pose, half), shuts=shuts))
    return found


def on_counter(
    arm: Arm, thing: Thing, fixture: Furniture, other: Thing | None = None
) -> list[Spot]:
    """On a counter: near where the robot is, or near another thing."""
    _, high = fixture.extent()
    top = float(high[2]) if other is None else other.bottom
    centres = _around(arm, fixture, other)
    room = Room.around(arm, [np.append(point, top) for point, _ in centres])
    size = np.ptp(thing.corners, axis=0)[:2] / 2.0 + FROM_EDGE
    feet = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]) * size
    found = []
    for point, cost in centres:
        below = np.column_stack((point + feet, np.full(len(feet), top - 0.008)))
        if (room.exactly(below @ arm.frame) < 0.0).all():
            kind = f"at {point[0]:.2f} {point[1]:.2f}"
            found.append(Spot(np.append(point, top), cost, kind))
    return found


def _around(arm: Arm, fixture: Furniture, other: Thing | None) -> list[tuple[Array, float]]:
    if other is not None:
        turns = np.arange(0.0, 2.0 * math.pi, math.pi / 8)
        ways = np.stack((np.cos(turns), np.sin(turns)), axis=1)
        return [(other.middle[:2] + far * way, far) for far in NEXT_TO for way in ways]
    front, here = min(map(arm.ahead, fixture.extent())), arm.aside(arm.base)
    return [
        (arm.floor_point(front + depth, here + aside), abs(aside) + depth)
        for depth in (0.12, 0.18, 0.25, 0.32)
        for side in ASIDE
        for aside in (side, side * 2.0)
    ]


def around(
    arm: Arm, point: Array, ahead: Sequence[float] = BESIDE, left: Sequence[float] = BESIDE
) -> list[Spot]:
    """At a point (3,), or so far beside it, m."""
    return [
        Spot(
            point + arm.onward(i) + j * np.append(arm.left, 0.0),
            2.0 * math.hypot(i, j),
            f"around {i:.2f} {j:.2f}",
        )
        for i, j in product(ahead, left)
    ]


def on_burner(arm: Arm, thing: Thing, stove: Furniture) -> list[Spot]:
    """On a burner of a stove: the one that the instruction names, if it does.

    Raises:
        SkillFailed: if it has none.
    """
    numbers = stove.burners()
    names = {k: arm.scene.boxes[k].name.replace("_", " ") for k in numbers}
    named = [k for k in numbers if names[k] in arm.instruction]
    out = thing.centre - thing.middle
    found = []
    for k in named or numbers:
        burner = np.asarray(arm.step.box_pose[k][:3], np.float64)
        for i, j in product(OFF_BURNER, repeat=2):
            off = np.append(arm.floor_point(i, j), 0.0)
            spot = burner + off - 0.3 * out * (1.0, 1.0, 0.0)
            aside = abs(arm.aside(spot) - arm.aside(thing.middle))
            cost = 3.0 * math.hypot(i, j) + 0.5 * arm.ahead(spot - arm.position) + 0.2 * aside
            found.append(Spot(spot, cost, f"{names[k]} {i:.2f} {j:.2f}"))
    return found


def on_tray(arm: Arm, machine: Furniture) -> list[Spot]:
    """Where a machine pours."""
    found = around(arm, machine.tray(), *POURED)
    return [replace(spot, cost=2.5 * spot.cost) for spot in found]


def under_tap(arm: Arm, thing: Thing, sink: Furniture) -> list[Spot]:
    """Where the water of a tap falls into something that its basin has room for."""
    water, _ = sink.water()
    basin, half = sink.interior(water[:3])
    narrow, wide = (width for _, width in thing.sides())
    room = np.maximum(half - narrow / 2.0, FROM_EDGE)
    most = UNDER_WATER * math.hypot(wide, narrow)
    found = []
    for spot in around(arm, np.append(water[:2], basin[2] - half[2]), SHIFTED, SHIFTED):
        off = np.abs((spot.point - basin[:3]) @ matrix(basin[3:]))
        if spot.cost < 2.0 * most and (off < room)[:2].all():
            found.append(spot)
    return found
