"""Footprints: vertical projections of bodies, their overlaps and margins.

A handful of points at a time, thousands of times: plain floats are several times as fast as arrays.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from pytest_safemanip.trace.geometry import Array

_Point = tuple[float, float]


def footprints_overlap(points: Array, others: Array, slack: float) -> bool:
    """Whether the footprints of two convex bodies overlap by more than ``slack`` metres.

    Args:
        points: corners (K, 3).
        others: of the other one.
        slack: overlap that still counts as apart.
    """
    one, other = _convex_hull(points), _convex_hull(others)
    for hull in (one, other):
        for (ax, ay), (bx, by) in pairwise([*hull, hull[0]]):
            length = math.hypot(bx - ax, by - ay)
            if length == 0.0:
                continue
            x, y = (bx - ax) / length, (by - ay) / length
            # A footprint that is a line is also bounded along it.
            if min(_depth(one, other, x, y), _depth(one, other, y, -x)) <= slack:
                return False
    return True


def _depth(one: list[_Point], other: list[_Point], x: float, y: float) -> float:
    """Overlap of two footprints along an axis, m; negative for a gap."""
    own = [x * px + y * py for px, py in one]
    its = [x * px + y * py for px, py in other]
    return min(max(own), max(its)) - max(min(own), min(its))


def breadth(points: Array) -> float:
    """How broad the footprint of a convex body is where it is narrowest, m; 0 for a line.

    Args:
        points: corners (K, 3).
    """
    hull = _convex_hull(points)
    if len(hull) < 3:
        return 0.0
    sides = [(bx - ax, by - ay) for (ax, ay), (bx, by) in pairwise([*hull, hull[0]])]
    return min(_depth(hull, hull, -y / math.hypot(x, y), x / math.hypot(x, y)) for x, y in sides)


def hull_margin(points: Array, target: Array) -> float:
    """Distance by which a point lies inside the convex hull of others, in the plane.

    Args:
        points: (K, 2).
        target: (2,).

    Returns:
        Metres; negative outside. Fewer than three points, or points on a line, have no inside:
        the result is minus the distance to them.
    """
    hull, (x, y) = _convex_hull(points), (float(target[0]), float(target[1]))
    if len(hull) < 3:
        return -_distance(hull, x, y)
    around = [*hull, hull[0]]
    margin = min(
        ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / math.hypot(bx - ax, by - ay)
        for (ax, ay), (bx, by) in pairwise(around)
    )
    return margin if margin >= 0.0 else -_distance(around, x, y)


def _convex_hull(points: Array) -> list[_Point]:
    """Counter-clockwise hull without collinear points (Andrew's monotone chain)."""
    unique = sorted({(float(p[0]), float(p[1])) for p in np.asarray(points, float).tolist()})
    if len(unique) < 3:
        return unique
    hull: list[_Point] = []
    for ordered in (unique, unique[::-1]):
        chain: list[_Point] = []
        for p in ordered:
            while len(chain) >= 2 and _turn(chain[-2], chain[-1], p) <= 1e-12:
                chain.pop()
            chain.append(p)
        hull += chain[:-1]
    return hull


def _turn(o: _Point, a: _Point, b: _Point) -> float:
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])


def _distance(line: list[_Point], x: float, y: float) -> float:
    """Distance to the nearest point of a polyline."""
    if not line:
        return math.inf
    nearest = math.hypot(x - line[0][0], y - line[0][1])
    for (ax, ay), (bx, by) in pairwise(line):
        ex, ey = bx - ax, by - ay
        along = min(max(((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey), 0.0), 1.0)
        nearest = min(nearest, math.hypot(x - ax - along * ex, y - ay - along * ey))
    return nearest
