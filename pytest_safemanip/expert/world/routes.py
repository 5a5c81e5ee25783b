"""A way for the base around furniture: sideways too, as the robot faces, or turned where that is
much shorter, for the base is longer than wide.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array, about_z
from pytest_safemanip.expert.world.standing import BODY, HAND_ROOM, solids
from pytest_safemanip.expert.world.things import Thing, solid

Place = tuple[int, int, int]
"""Quarter turns to the left from how the robot faces now, and cells ahead and aside from there."""
Band = tuple[float, float, Array]
"""From and to which height a part of the robot is, m, and where (2, 2)."""
Free = NDArray[np.bool_]

CELL = 0.05
"""Between neighbouring places of the base, m."""
ROUTE_ROOM = 0.04
"""Kept free around the robot, m: how far it drives past a corner, and the arm's sway."""
CARRYING_BODY = (*BODY, (1.00, 1.60, -0.36, 0.11, 0.17))
"""The robot with its elbow, which stays behind the shoulder."""
HAND_HEIGHT = 0.25
"""How far above the grip point the wrist reaches, m."""
TURNS_ABOUT = 0.20
"""How far behind its origin the base has its middle, about which it turns, m."""
CORNER, QUARTER = 0.4, 1.2
"""Length of way that a corner, at which the base stops, and a quarter turn count as, m."""
BETWEEN = (15.0, 30.0, 45.0, 60.0, 75.0)
"""Headings at which there has to be room on a quarter turn, degrees: an arm's breadth apart."""
DETOUR = 2.0
"""Turns of the base are considered where the shortest route without any exceeds the distance to the
goal by more, m."""
DRAWN_BACK = 12
"""How many cells the robot draws back at its start, and comes from at its goal, at most."""


def route(arm: Arm, thing: Thing | None, goal: Array) -> list[tuple[Array, float]]:
    """Where the base stops on its way to a goal, each (2,), and how far it is turned to the left
    there, degrees. At the goal, which is the last, the robot faces as it does now.

    Args:
        arm: where the robot stands now, holding its arm as it will on the way.
        thing: what it carries; None for nothing.
        goal: base position on the floor (2,), free.

    Raises:
        SkillFailed: if the way there is blocked, at its beginning or its end too.
    """
    low, high = floor(arm)
    # The middle of the base stays where it is when that turns.
    middle = np.array((TURNS_ABOUT, 0.0))
    here, there = arm.level(arm.base) - middle, arm.level(goal) - middle
    low, high = np.minimum(low, here), np.maximum(high, (here, there)).max(axis=0)
    # The grid goes through the start; the goal's cell is the nearest one, off the floor too.
    off = np.minimum(np.ceil((low - here) / CELL), np.rint((there - here) / CELL))
    low = here + CELL * off
    grid = _Grid(arm, thing, low, np.ceil((high - low) / CELL).astype(int) + 1)
    ends = [(0, int(c[0]), int(c[1])) for c in np.rint((np.stack((here, there)) - low) / CELL)]
    free = grid.free(0.0)[None]
    first, last = (_drawn_back(free[0], end) for end in ends)
    far = CELL * (abs(last[1] - first[1]) + abs(last[2] - first[2]))
    cost, found = _search(free, np.zeros_like(free[0]), first, last)
    if cost > far + DETOUR:
        free = np.array([grid.free(90.0 * quarter) for quarter in range(4)])
        cost, found = min((cost, found), _search(free, grid.turns(), first, last))
    if not found:
        raise SkillFailed("there is no way for the base around the furniture")
    places = [place for place, _ in itertools.groupby([*ends[:1], *found, *ends[1:]])]
    return _stops(arm, low, places, goal)


def _stops(arm: Arm, low: Array, places: Sequence[Place], goal: Array) -> list[tuple[Array, float]]:
    """Where a route through neighbouring places, the first of them the robot's, has corners and
    turns, and its goal (2,).
    """
    steps = [_step(*pair) for pair in itertools.pairwise(places)]
    stops, number = [(arm.base, 0.0)], 0
    for step, run in itertools.groupby(steps):
        count = len(list(run))
        number += count
        if step[0]:
            stops[-1] = stops[-1][0], 90.0 * step[0] * count
            continue
        quarter, *cell = places[number]
        ahead, aside = low + CELL * np.array(cell) + TURNS_ABOUT * about_z(90.0 * quarter)[:2, 0]
        stops.append((arm.floor_point(float(ahead), float(aside)), 0.0))
    begin = 0 if stops[0][1] else 1
    if stops[-1][1]:
        return [*stops[begin:], (goal, 0.0)]
    if len(stops) > 2 and not stops[-2][1]:
        # The last stretch but one ends beside the goal, and not beside its cell.
        along = arm.forward if steps[-1][1] else arm.left
        off = goal - stops[-2][0]
        stops[-2] = stops[-2][0] + off - (off @ along) * along, 0.0
    return [*stops[begin:-1], (goal, 0.0)]


def _step(before: Place, after: Place) -> Place:
    """From a place to a neighbour: one quarter turn, or one cell."""
    turn = (after[0] - before[0] + 1) % 4 - 1
    return turn, after[1] - before[1], after[2] - before[2]


def floor(arm: Arm) -> tuple[Array, Array]:
    """Least and greatest place of the base, ahead and aside (2,), at which it is on the floor."""
    floors = [name for name, entity in arm.scene.entity.items() if entity.category == "Floor"]
    flat = arm.level(np.concatenate(solid(arm, floors)))
    _, _, back, front, half = CARRYING_BODY[0]
    return flat.min(axis=0) - (back, -half), flat.max(axis=0) - (front, half)


class _Grid:
    """Where there is room for the middle of the base on the floor.

    Args:
        arm: the arm, held as it will be.
        thing: what it carries.
        low: of the first cell, ahead and aside (2,), m.
        size: how many there are (2,).
    """

    def __init__(self, arm: Arm, thing: Thing | None, low: Array, size: NDArray[np.intp]) -> None:
        self._bands = [
            (b, t, box + np.array((TURNS_ABOUT, 0.0))) for b, t, box in _shape(arm, thing)
        ]
        self._low, self._size = low, size
        self._furniture = solids(arm) @ arm.frame

    def free(self, degrees: float) -> Free:
        """Cells (I, J) where there is room for the robot, turned so far to the left."""
        free = np.ones(self._size, bool)
        turn, square = about_z(degrees)[:2, :2], degrees % 90.0 == 0.0
        for bottom, top, box in self._bands:
            middle, half = turn @ box.mean(axis=0), np.ptp(box, axis=0) / 2.0
            reach = np.abs(turn) @ half
            for low, high in self._between(bottom, top):
                cut = self._cells(low - middle - reach, high - middle + reach)
                if square:
                    free[cut] = False
                    continue
                # Slanted boxes meet if they do seen along the sides of either.
                at = (low + high) / 2.0 - middle - self._low
                x, y = (at[k] - CELL * np.arange(cut[k].start, cut[k].stop) for k in (0, 1))
                room = half + np.abs(turn.T) @ ((high - low) / 2.0) + ROUTE_ROOM
                ahead, aside = (np.abs(np.add.outer(a * x, b * y)) for a, b in turn.T)
                part = free[cut]
                part &= ((ahead > room[0]) | (aside > room[1]))[: part.shape[0], : part.shape[1]]
        return free

    def turns(self) -> Free:
        """Cells (Q, I, J) where there is room to turn on to the left by a quarter, turned so many
        times before.
        """
        return np.array(
            [
                np.logical_and.reduce([self.free(90.0 * quarter + on) for on in BETWEEN])
                for quarter in range(4)
            ]
        )

    def _between(self, bottom: float, top: float) -> list[tuple[Array, Array]]:
        """From where to where furniture is that reaches into a band of heights, each (2,), m."""
        heights = self._furniture[:, :, 2]
        some = self._furniture[(heights.min(axis=1) < top) & (heights.max(axis=1) > bottom), :, :2]
        return list(zip(some.min(axis=1), some.max(axis=1), strict=True))

    def _cells(self, low: Array, high: Array) -> tuple[slice, slice]:
        """The cells between two places, or hardly beyond them."""
        first = np.ceil((low - ROUTE_ROOM - self._low) / CELL)
        last = np.floor((high + ROUTE_ROOM - self._low) / CELL)
        i, j = np.maximum(first, 0).astype(int), np.maximum(last + 1, 0).astype(int)
        return slice(i[0], j[0]), slice(i[1], j[1])


def _shape(arm: Arm, thing: Thing | None) -> list[Band]:
    """Boxes around robot and load: from and to which height, and the least and greatest
    coordinates, ahead and aside of the base's origin (2, 2), m.
    """
    here = arm.level(arm.base)
    hand = arm.level(arm.position) - here
    height = float(arm.position[2])
    box = np.array((np.minimum(hand - HAND_ROOM, 0.0), np.maximum(hand + HAND_ROOM, 0.0)))
    found = [
        (low, high, np.array(((back, -w), (front, w))))
        for low, high, back, front, w in CARRYING_BODY
    ]
    found.append((height - 0.02, height + HAND_HEIGHT, box))
    if thing is not None:
        load = arm.level(thing.corners) - here
        found.append((thing.bottom, thing.highest, np.array((load.min(axis=0), load.max(axis=0)))))
    return found


def _drawn_back(free: Free, place: Place) -> Place:
    """The first place behind one that is nearer to something than a robot on its way should be."""
    quarter, i, j = place
    column = free[max(0, i - DRAWN_BACK) : i + 1, j]
    behind = np.flatnonzero(column[::-1])
    return (quarter, i - int(behind[0]), j) if len(behind) else place


def _search(free: Free, turns: Free, start: Place, goal: Place) -> tuple[float, list[Place]]:
    """The shortest way, corners and turns counting as part of its length, m, and its places, some
    twice; infinite if there is none.

    Args:
        free: where there is room for the robot, turned so many times (Q, I, J).
        turns: where it may turn on from there to the left (Q, I, J).
        start: the first place, where it is, free or not.
        goal: the last one.
    """
    free = free.copy()
    free[start] = True
    # A place is two nodes: one for driving ahead and back, one for driving aside.
    nodes = np.arange(2 * free.size).reshape(2, *free.shape)
    ahead, aside = nodes
    edges = [
        (ahead[:, :-1], ahead[:, 1:], free[:, :-1] & free[:, 1:], CELL),
        (aside[:, :, :-1], aside[:, :, 1:], free[:, :, :-1] & free[:, :, 1:], CELL),
        (ahead, aside, free, CORNER),
    ]
    if len(free) > 1:
        turned = np.roll(free, -1, axis=0)
        edges.append((ahead, np.roll(ahead, -1, axis=0), free & turned & turns, QUARTER))
    kept = [(a[where], b[where], np.full(int(where.sum()), cost)) for a, b, where, cost in edges]
    rows, columns, costs = map(np.concatenate, zip(*kept, strict=True))
    graph = coo_array((costs, (rows, columns)), shape=(nodes.size, nodes.size)).tocsr()
    first = nodes[:, *start]
    found = dijkstra(graph, directed=False, indices=first, return_predecessors=True, min_only=True)
    far, before = np.asarray(found[0]), np.asarray(found[1])
    node = min(nodes[:, *goal].tolist(), key=lambda node: float(far[node]))
    cost = float(far[node])
    if not math.isfinite(cost):
        return cost, []
    places = list[Place]()
    while node >= 0:
        quarter, i, j = (int(k) for k in np.unravel_index(node % free.size, free.shape))
        places.append((quarter, i, j))
        node = int(before[node])
    return cost, places[::-1]
