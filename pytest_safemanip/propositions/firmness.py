"""Whether what carries an object reaches far enough around its centre of mass.

The margin of a hull, or of a surface, cannot change by more than its points and the centre of mass
move. So what rests is looked at once, and again when it has moved too far for that to decide.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools
from pytest_safemanip.propositions.solids import Solids, body_corners, pace, solids
from pytest_safemanip.propositions.support import Carried, Floats, Indices, margin_at
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.geometry import tilt, to_world
from pytest_safemanip.trace.planar import hull_margin

SAME_LEVEL = 0.01
"""How far a surface may be above or below a contact point to be what is touched there, m."""
ROUNDING = 1e-5
"""More than what float32 positions are off by, m: nothing is inferred from a smaller distance."""
UPRIGHT = 0.5
"""A vessel that leans less than this holds what lies in it, rad."""
_REMEMBERED = 4
"""How many places of an object are remembered: it may rock between some."""
_SPARE = 0.02
"""How far around it is looked for what might come below an object that moves a little, m."""


def firm(view: View, found: Carried, groups: Indices) -> Bools:
    """Whether what carries objects does so far enough around the centre of mass (groups,)."""
    seen, result = view.shared(_seen), np.zeros(len(groups), bool)
    bodies = found.body[groups]
    for body in np.unique(bodies).tolist():
        todo = np.flatnonzero(bodies == body)
        known = seen.setdefault(body, [])
        for rest in known:
            todo = rest.strike(view, found, groups[todo], todo, result)
        while len(todo):
            new = _look(view, found, int(groups[todo[0]]))
            result[todo[0]] = new.firm
            todo = new.strike(view, found, groups[todo[1:]], todo[1:], result)
            known[:] = [new, *known[: _REMEMBERED - 1]]
    return result


@dataclass(frozen=True)
class _Below:
    """Something solid that can move, where it was.

    Attributes:
        stack: the object that it is, -1 for a surface.
        box: corners of that object (8, 3).
        joint: what moves the surface.
        openness: of that joint.
        pace: how far the surface moves while it opens by 1, m.
    """

    stack: int = -1
    box: Floats | None = None
    joint: int = -1
    openness: float = 0.0
    pace: float = 0.0

    def way(self, view: View, steps: Indices) -> Floats:
        """How far it is from there at some steps, m (steps,)."""
        if self.stack < 0:
            openness = view.trace.steps.joint[steps, self.joint, 0]
            return np.asarray(self.pace * np.abs(openness - self.openness))
        apart = body_corners(view, steps, self.stack) - self.box
        return np.asarray(np.linalg.norm(apart, axis=-1).max(axis=-1))


@dataclass(frozen=True)
class _Rest:
    """How an object was carried, and how far from there that is still so.

    Attributes:
        firm: whether far enough around its centre of mass.
        com: its centre of mass (2,).
        slack: how far all that matters may be from where it was, together, m.
        points: contact points (K, 2); None if they do not matter.
        level: height of the contact points, m.
        rise: how far they may be above or below it, m.
        below: what of it can move.
    """

    firm: bool
    com: Floats
    slack: float
    points: NDArray[np.float32] | None = None
    level: float = 0.0
    rise: float = np.inf
    below: tuple[_Below, ...] = ()

    def strike(
        self, view: View, found: Carried, at: Indices, todo: Indices, result: Bools
    ) -> Indices:
        """Mark those of some groups that are as firm as this; what is left to do."""
        moved = np.hypot(*(found.com[at, :2] - self.com).T)
        lift, same = np.abs(found.level[at] - self.level), np.ones(len(at), bool)
        for thing in self.below:
            way = thing.way(view, found.step[at])
            moved, lift = moved + way, lift + way
        if self.points is not None:
            same = found.count[at] == len(self.points)
            places = found.first[at[same]][:, None] + np.arange(len(self.points))
            apart = np.hypot(*(found.points[places, :2] - self.points).T)
            moved[same] += apart.max(axis=0)
        same &= (moved < self.slack) & (lift < self.rise)
        result[todo[same]] = self.firm
        left: Indices = todo[~same]
        return left


def _seen(view: View) -> dict[int, list[_Rest]]:
    """How objects were carried, the latest first; filled while it is looked at."""
    return {}


def _look(view: View, found: Carried, group: int) -> _Rest:
    """How one object is carried at one step."""
    needed = view.parameters["settled.margin"]
    margin = margin_at(view, found, group)
    if margin < needed:
        return _ground_around(view, found, group, needed - margin)
    points = found.points_of(group)[:, :2]
    return _Rest(True, found.com[group, :2], margin - needed - ROUNDING, points)


def _ground_around(view: View, found: Carried, group: int, lacking: float) -> _Rest:
    """Whether permitted supports reach around below the centre of mass, by the margin.

    A ball touches its support in one point, a can on its side in a line: their contact hull has
    no inside, yet they do not fall as long as the surface goes on around them.

    Args:
        view: what is looked at.
        found: who is carried.
        group: which of them, and when.
        lacking: by how much the contact hull is too small, m.
    """
    com, step, level = found.com[group], int(found.step[group]), float(found.level[group])
    name = view.trace.scene.bodies[found.body[group]].entity
    allowed, margin = view.binding.supports.get(name, ()), view.parameters["settled.margin"]
    found_below = solids(view, name, step, (com, margin + _SPARE), allowed)
    boxes = found_below.boxes
    apart = np.abs(boxes[:, :, 2].max(axis=1) - level)
    tops = np.flatnonzero(apart < SAME_LEVEL).tolist()
    inside = [hull_margin(boxes[k, :, :2], com[:2]) for k in tops]
    for k, depth in zip(tops, inside, strict=True):
        if depth >= margin:  # one surface alone reaches far enough
            rise = SAME_LEVEL - float(apart[k]) - ROUNDING
            below = _movable(view, found_below, [k], step)
            return _Rest(True, com[:2], depth - margin - ROUNDING, None, level, rise, below)
    for k, number in enumerate(found_below.numbers):
        if number < 0 and (rest := _in_vessel(view, found_below, k, step, com, level)):
            return rest
    turns = np.arange(8) * (np.pi / 4.0)
    around = com[:2] + margin * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    depths = [max((hull_margin(boxes[k, :, :2], p) for k in tops), default=-_SPARE) for p in around]
    if min(depths) >= 0.0:
        below = _movable(view, found_below, tops, step)
        rise = SAME_LEVEL - float(apart[tops].max()) - ROUNDING
        return _Rest(True, com[:2], min(depths) - ROUNDING, None, level, rise, below)
    slack = min(lacking, -min(depths), _SPARE, *(margin - depth for depth in inside)) - ROUNDING
    others = apart[apart >= SAME_LEVEL] - SAME_LEVEL
    rise = float(others.min(initial=np.inf)) - ROUNDING
    below = _movable(view, found_below, range(len(boxes)), step)
    return _Rest(False, com[:2], slack, found.points_of(group)[:, :2], level, rise, below)


def _in_vessel(
    view: View, solid: Solids, place: int, step: int, com: Floats, level: float
) -> _Rest | None:
    """That something is carried inside an upright vessel, if it is: its wall goes on around it.

    Below the rim, and nearer to the vessel's own centre of mass than its narrow side reaches: what
    lies on a handle is neither.
    """
    index, box = -1 - solid.numbers[place], solid.boxes[place]
    vessel = view.trace.scene.bodies[index]
    if "container" not in view.binding.attributes.get(vessel.entity, ()):
        return None
    pose = view.trace.steps.object_pose[step, index]
    away = np.linalg.norm(com[:2] - to_world(pose, vessel.com)[:2])
    room = float(min(vessel.half[:2]) - view.parameters["settled.margin"] - away)
    above = level - float(box[:, 2].min())
    below_rim = float(box[:, 2].max()) - SAME_LEVEL - level
    upright = UPRIGHT - float(tilt(pose[3:]))
    if min(room, upright) <= 0.0 or min(above, below_rim) < 0.0:
        return None
    # A vessel whose corners move by less than this leans less than UPRIGHT still.
    sway = 2.0 * vessel.half[2] * np.sin(upright / 2.0)
    return _Rest(
        True,
        com[:2],
        min(room, sway) - ROUNDING,
        None,
        level,
        min(above, below_rim) - ROUNDING,
        _movable(view, solid, [place], step),
    )


def _movable(view: View, solid: Solids, places: Iterable[int], step: int) -> tuple[_Below, ...]:
    """Which of some surfaces and objects can move, and where they are now."""
    found = []
    for place in places:
        number = solid.numbers[place]
        joint, way = pace(view, number) if number >= 0 else (-1, 0.0)
        if number < 0:
            found.append(_Below(stack=-1 - number, box=solid.boxes[place]))
        elif joint >= 0:
            openness = float(view.trace.steps.joint[step, joint, 0])
            found.append(_Below(joint=joint, openness=openness, pace=way))
    return tuple(found)
