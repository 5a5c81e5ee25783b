"""Whether an object is statically supported: what carries it reaches around its centre of mass.

The margin of a hull, or of a surface, cannot change by more than its points and the centre of mass
move. So how an object is carried is analysed once, and again when it has moved too far for that
analysis to decide.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.kernels.solids import (
    Solids,
    body_corners,
    max_travel,
    solids,
)
from pytest_safemanip.propositions.kernels.support import Carried, Floats, Indices, margin_at
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.geometry import tilt, to_world
from pytest_safemanip.trace.planar import hull_margin
from pytest_safemanip.trace.scene import Scene

SAME_LEVEL = 0.01
"""Largest height of a surface above or below a contact point that touches it, m."""
ROUNDING = 1e-5
"""More than what float32 positions are off by, m: nothing is inferred from a smaller distance."""
UPRIGHT = 0.5
"""A vessel that leans less than this holds what lies in it, rad."""
_REMEMBERED = 4
"""Number of cached poses per object: it may rock between some."""
_SPARE = 0.02
"""How far around it is looked for what might come below an object that moves a little, m."""


def statically_supported(view: View, found: Carried, groups: Indices) -> Bools:
    """Whether what carries objects does so far enough around the centre of mass (groups,)."""
    cache, result = view.cache(SupportCache), np.zeros(len(groups), bool)
    bodies = found.body[groups]
    for body in np.unique(bodies).tolist():
        todo, known = np.flatnonzero(bodies == body), cache.of[body]
        for analysis in known:
            todo = analysis.apply_cached(view, found, groups[todo], todo, result)
        while len(todo):
            new = _analyse(view, found, int(groups[todo[0]]))
            result[todo[0]] = new.supported
            todo = new.apply_cached(view, found, groups[todo[1:]], todo[1:], result)
            known.appendleft(new)
    return result


class SupportCache:
    """Cache of the latest support analyses of each object.

    An analysis says itself how far from where it was made it holds. So it does not matter for a
    value which ones are here: what they do not decide is analysed anew.

    Args:
        scene: has the objects.

    Attributes:
        of: analyses of each object, the latest first.
    """

    def __init__(self, scene: Scene) -> None:
        self.of: list[deque[_Support]] = [deque(maxlen=_REMEMBERED) for _ in scene.bodies]


@dataclass(frozen=True)
class _Movable:
    """A movable support, with its pose at the analysis.

    Attributes:
        stack: the object that it is, -1 for a surface.
        box: corners of that object (8, 3).
        joint: what moves the surface.
        openness: of that joint.
        max_travel: how far the surface moves at most while it opens by 1, m.
    """

    stack: int = -1
    box: Floats | None = None
    joint: int = -1
    openness: float = 0.0
    max_travel: float = 0.0

    def displacement(self, view: View, steps: Indices) -> Floats:
        """Upper bound of its displacement since, at some steps, m (steps,)."""
        if self.stack < 0:
            openness = view.trace.steps.joint[steps, self.joint, 0]
            return np.asarray(self.max_travel * np.abs(openness - self.openness))
        apart = body_corners(view, steps, self.stack) - self.box
        return np.asarray(np.linalg.norm(apart, axis=-1).max(axis=-1))


@dataclass(frozen=True)
class _Support:
    """How an object was carried, and how far from there that still decides.

    Attributes:
        supported: whether far enough around its centre of mass.
        com: its centre of mass (2,).
        slack: how far all that matters may be from where it was, together, m.
        points: contact points (K, 2); None if they do not matter.
        level: height of the contact points, m.
        rise: how far they may be above or below it, m.
        below: what of it can move.
    """

    supported: bool
    com: Floats
    slack: float
    points: NDArray[np.float32] | None = None
    level: float = 0.0
    rise: float = np.inf
    below: tuple[_Movable, ...] = ()

    def apply_cached(
        self, view: View, found: Carried, at: Indices, todo: Indices, result: Bools
    ) -> Indices:
        """Write the result for those of some groups that this decides; the others, left to do.

        Args:
            view: what is looked at.
            found: who is carried.
            at: the groups, all of this object.
            todo: their places in the result.
            result: what is written to.
        """
        moved = np.hypot(*(found.com[at, :2] - self.com).T)
        lift, same = np.abs(found.level[at] - self.level), np.ones(len(at), bool)
        for thing in self.below:
            displacement = thing.displacement(view, found.step[at])
            moved, lift = moved + displacement, lift + displacement
        if self.points is not None:
            same = found.count[at] == len(self.points)
            places = found.first[at[same]][:, None] + np.arange(len(self.points))
            apart = np.hypot(*(found.points[places, :2] - self.points).T)
            moved[same] += apart.max(axis=0)
        same &= (moved < self.slack) & (lift < self.rise)
        result[todo[same]] = self.supported
        left: Indices = todo[~same]
        return left


def _analyse(view: View, found: Carried, group: int) -> _Support:
    """Analyse the support of one object at one step."""
    needed = view.parameters["settled.margin"]
    margin = margin_at(view, found, group)
    if margin < needed:
        return _ground_around(view, found, group, needed - margin)
    points = found.points_of(group)[:, :2]
    return _Support(True, found.com[group, :2], margin - needed - ROUNDING, points)


def _ground_around(view: View, found: Carried, group: int, lacking: float) -> _Support:
    """Whether permitted supports reach around below the centre of mass, by the margin.

    A ball touches its support in one point, a can on its side in a line: their contact hull has
    no inside, yet they do not fall as long as the surface goes on around them.

    Args:
        view: what is looked at.
        found: who is carried.
        group: which of them, and when.
        lacking: by how much the contact hull is too small, m.
    """
    com, step, level = found.com[group, :2], int(found.step[group]), float(found.level[group])
    margin = view.parameters["settled.margin"]
    found_below, apart, tops, inside = _surfaces(view, found, group)
    boxes = found_below.boxes
    for k, depth in zip(tops, inside, strict=True):
        if depth >= margin:  # one surface alone reaches far enough
            rise = SAME_LEVEL - float(apart[k]) - ROUNDING
            below = _movable(view, found_below, [k], step)
            return _Support(True, com, depth - margin - ROUNDING, None, level, rise, below)
    vessels = _vessels(view, found_below, step, com, level)
    for k, aside, up_or_down in vessels:
        if aside > 0.0 and up_or_down >= 0.0:
            below = _movable(view, found_below, [k], step)
            limits = aside - ROUNDING, None, level, up_or_down - ROUNDING
            return _Support(True, com, *limits, below)
    depths = _depths_around(boxes[tops], com, margin)
    if min(depths) >= 0.0:
        below = _movable(view, found_below, tops, step)
        rise = SAME_LEVEL - float(apart[tops].max()) - ROUNDING
        return _Support(True, com, min(depths) - ROUNDING, None, level, rise, below)
    slack = min(lacking, -min(depths), _SPARE, *(margin - depth for depth in inside)) - ROUNDING
    others = apart[apart >= SAME_LEVEL] - SAME_LEVEL
    rise = float(others.min(initial=np.inf)) - ROUNDING
    for _, aside, up_or_down in vessels:  # nor must it come into one of them
        if aside <= 0.0:
            slack = min(slack, -aside - ROUNDING)
        else:
            rise = min(rise, -up_or_down - ROUNDING)
    below = _movable(view, found_below, range(len(boxes)), step)
    return _Support(False, com, slack, found.points_of(group)[:, :2], level, rise, below)


def support_margin(view: View, found: Carried, group: int) -> float:
    """The margin of one object being statically supported at one step: how far inside of what
    carries it the centre of mass is, beyond what it has to be, in units of that.
    """
    needed = view.parameters["settled.margin"]
    inside = margin_at(view, found, group) - needed
    if inside < 0.0:
        com, step = found.com[group, :2], int(found.step[group])
        below, _, tops, depths = _surfaces(view, found, group)
        vessels = _vessels(view, below, step, com, float(found.level[group]))
        around = min(_depths_around(below.boxes[tops], com, needed))
        held_in = (min(aside, up_or_down) for _, aside, up_or_down in vessels)
        inside = max(inside, around, *(depth - needed for depth in depths), *held_in)
    return inside / needed


def _surfaces(
    view: View, found: Carried, group: int
) -> tuple[Solids, Floats, list[int], list[float]]:
    """Permitted supports around what is below an object's centre of mass, how far their tops are
    above or below its contact points, m, those of them at the same height, and how far inside each
    of these the centre of mass is, m.
    """
    com, step, level = found.com[group, :2], int(found.step[group]), float(found.level[group])
    name = view.trace.scene.bodies[found.body[group]].entity
    allowed, margin = view.binding.supports.get(name, ()), view.parameters["settled.margin"]
    below = solids(view, name, step, (com, margin + _SPARE), allowed)
    apart = np.abs(below.boxes[:, :, 2].max(axis=1) - level)
    tops = np.flatnonzero(apart < SAME_LEVEL).tolist()
    return below, apart, tops, [hull_margin(below.boxes[k, :, :2], com) for k in tops]


def _depths_around(tops: Floats, com: Floats, margin: float) -> list[float]:
    """How far inside one of some boxes (K, 8, 3) points are that lie around a centre of mass by a
    margin, m.
    """
    turns = np.arange(8) * (np.pi / 4.0)
    around = com + margin * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    return [max((hull_margin(box[:, :2], p) for box in tops), default=-_SPARE) for p in around]


def _vessels(
    view: View, solid: Solids, step: int, com: Floats, level: float
) -> list[tuple[int, float, float]]:
    """Of each vessel, its place among what is below an object, and by how much the object is held
    inside it, to the side and up or down, m. Its wall goes on around what is in it: below the rim,
    and nearer to the vessel's own centre of mass than its narrow side reaches, for what lies on a
    handle is neither. Where one of the two is negative it is not held, and by as much it, or the
    vessel, has to move first.
    """
    found = []
    for place, (number, box) in enumerate(zip(solid.numbers, solid.boxes, strict=True)):
        index = -1 - number
        if number >= 0 or "container" not in view.binding.attributes_of(solid.owners[place]):
            continue
        vessel, pose = view.trace.scene.bodies[index], view.trace.steps.object_pose[step, index]
        away = np.linalg.norm(com - to_world(pose, vessel.com)[:2])
        room = float(min(vessel.half[:2]) - view.parameters["settled.margin"] - away)
        # Before a vessel leans UPRIGHT, or no longer does, some corner moves by as much as this.
        sway = 2.0 * vessel.half[2] * np.sin((UPRIGHT - float(tilt(pose[3:]))) / 2.0)
        above = level - float(box[:, 2].min())
        below_rim = float(box[:, 2].max()) - SAME_LEVEL - level
        found.append((place, min(room, float(sway)), min(above, below_rim)))
    return found


def _movable(view: View, solid: Solids, places: Iterable[int], step: int) -> tuple[_Movable, ...]:
    """Which of some surfaces and objects can move, and where they are now."""
    found = []
    for place in places:
        number = solid.numbers[place]
        if number < 0:
            found.append(_Movable(stack=-1 - number, box=solid.boxes[place]))
            continue
        joint, travel = max_travel(view, number)
        if joint >= 0:
            openness = float(view.trace.steps.joint[step, joint, 0])
            found.append(_Movable(joint=joint, openness=openness, max_travel=travel))
    return tuple(found)
