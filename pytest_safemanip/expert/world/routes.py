"""A way for the base around furniture, the robot facing as it does: the base moves sideways too."""

from __future__ import annotations

import heapq
import itertools
import math

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import BODY, HAND_ROOM, solids
from pytest_safemanip.expert.world.things import Thing, solid

Cell = tuple[int, int]

CELL = 0.05
"""Between neighbouring places of the base, m."""
ROUTE_ROOM = 0.04
"""Kept free around the robot, m: how far it drives past a corner, and the arm's sway."""
CARRYING_BODY = (*BODY, (1.00, 1.60, -0.36, 0.11, 0.17))
"""The robot with its elbow, which stays behind the shoulder."""
HAND_HEIGHT = 0.25
"""How far above the grip point the wrist reaches, m."""
CORNER = 0.4
"""A turn costs as much as so long a way, m: at each the base stops."""
DRAWN_BACK = 12
"""How many cells the robot draws back at its start, and comes from at its goal, at most."""
WAYS: tuple[Cell, ...] = ((-1, 0), (0, 1), (0, -1), (1, 0))
NO_WAY: Cell = (0, 0)


def route(arm: Arm, thing: Thing | None, goal: Array) -> list[Array]:
    """Where the base turns on its way to a goal, the goal last, each (2,).

    Args:
        arm: where the robot stands now, holding its arm as it will on the way.
        thing: what it carries; None for nothing.
        goal: base position on the floor (2,), free.

    Raises:
        SkillFailed: if the way there is blocked, at its beginning or its end too.
    """
    low, high = floor(arm)
    here, there = arm.level(arm.base), arm.level(goal)
    low, high = np.minimum(low, (here, there)).min(axis=0), np.maximum(high, (here, there)).max(0)
    # The grid goes through the start; the goal's cell is the nearest one.
    low = here - np.floor((here - low) / CELL) * CELL
    size = tuple(int(n) for n in np.ceil((high - low) / CELL) + 1)
    free = np.ones(size, bool)
    for bottom, top, box in _shape(arm, thing):
        for points in solids(arm):
            if points[:, 2].min() < top and points[:, 2].max() > bottom:
                flat = arm.level(points)
                first = np.ceil((flat.min(axis=0) - box[1] - ROUTE_ROOM - low) / CELL)
                last = np.floor((flat.max(axis=0) - box[0] + ROUTE_ROOM - low) / CELL)
                i, j = np.maximum(first, 0).astype(int), np.maximum(last + 1, 0).astype(int)
                free[i[0] : j[0], i[1] : j[1]] = False
    ends = [(int(c[0]), int(c[1])) for c in np.rint((np.stack((here, there)) - low) / CELL)]
    first, last = (_drawn_back(free, end) for end in ends)
    found = [*ends[:1], *_search(free, first, last), *ends[1:]]
    cells = np.array([cell for cell, _ in itertools.groupby(found)])
    steps = np.diff(cells, axis=0)
    bends = (steps[1:] != steps[:-1]).any(axis=1)
    places = low + CELL * cells[1:-1][bends]
    if len(places):
        # The last stretch but one ends beside the goal, and not beside its cell.
        axis = int(steps[-1, 0] != 0)
        places[-1, axis] = there[axis]
    return [arm.floor_point(*place) for place in (*places.tolist(), there)]


def floor(arm: Arm) -> tuple[Array, Array]:
    """Least and greatest place of the base, ahead and aside (2,), at which it is on the floor."""
    floors = [name for name, entity in arm.scene.entity.items() if entity.category == "Floor"]
    flat = arm.level(np.concatenate(solid(arm, floors)))
    _, _, back, front, half = CARRYING_BODY[0]
    return flat.min(axis=0) - (back, -half), flat.max(axis=0) - (front, half)


def _shape(arm: Arm, thing: Thing | None) -> list[tuple[float, float, Array]]:
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


def _drawn_back(free: NDArray[np.bool_], cell: Cell) -> Cell:
    """The first place behind one that is nearer to something than a robot on its way should be."""
    column = free[max(0, cell[0] - DRAWN_BACK) : cell[0] + 1, cell[1]]
    behind = np.flatnonzero(column[::-1])
    return (cell[0] - int(behind[0]), cell[1]) if len(behind) else cell


def _search(free: NDArray[np.bool_], start: Cell, goal: Cell) -> list[Cell]:
    """The cells of the shortest way, few corners counting as part of its length."""
    queue = [(0.0, start, NO_WAY)]
    least = {(start, NO_WAY): 0.0}
    came: dict[tuple[Cell, Cell], tuple[Cell, Cell]] = {}
    while queue:
        cost, cell, way = heapq.heappop(queue)
        if cell == goal:
            return _back(came, (cell, way))
        for step in WAYS:
            after = cell[0] + step[0], cell[1] + step[1]
            inside = 0 <= after[0] < free.shape[0] and 0 <= after[1] < free.shape[1]
            if not inside or not free[after]:
                continue
            more = cost + CELL + (0.0 if way in (step, NO_WAY) else CORNER)
            if more < least.get((after, step), math.inf):
                least[after, step] = more
                came[after, step] = cell, way
                heapq.heappush(queue, (more, after, step))
    raise SkillFailed("there is no way for the base around the furniture")


def _back(came: dict[tuple[Cell, Cell], tuple[Cell, Cell]], last: tuple[Cell, Cell]) -> list[Cell]:
    found = [last]
    while found[-1] in came:
        found.append(came[found[-1]])
    return [cell for cell, _ in reversed(found)]
