"""What of a thing fits between the fingers, and how the hand may close on it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pytest_safemanip.expert.motions.poses import Pose
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.robot.hand import (
    FINGER_SIDE,
    GAP,
    HAND,
    OPENING,
    PALM,
    finger_points,
)
from pytest_safemanip.expert.robot.rotations import Array, about_z
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.geometry import about, matrix

UP = np.array((0.0, 0.0, 1.0))
_GRID = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 5)] * 3), axis=-1).reshape(-1, 3)
SIDES = _GRID[np.abs(_GRID).max(axis=1) == 1.0]
ROUNDNESS = np.sum(SIDES**4, axis=1) ** 0.25
"""Points on the sides of a cube, and how far outside a rounded one they are."""
_WIDE = np.abs(SIDES[:, :2]).max(axis=1) / np.maximum(np.hypot(*SIDES[:, :2].T), 1e-9)
CYLINDER = SIDES * np.stack((_WIDE, _WIDE, np.ones(len(SIDES))), axis=1)
"""Points on an upright cylinder."""
BALL = 0.15
"""By what share of its width the height of what may be a ball differs at most."""
LOW = 1.3
"""What is no more times as high as wide may be round across, too."""
TILTS = (35.0, 20.0, 0.0, 48.0, 60.0, 72.0, -20.0)
"""Degrees from straight down to the hand's approach, about the line of its fingers."""
LEANS, AHEAD = (0.0, 12.0, -12.0, 20.0, -20.0), 0.6
"""Degrees by which the fingers are not level, where their line points so much ahead, as a cosine:
the hand is not tilted about that."""
TURNS = (0.0, 45.0, -45.0, 90.0, 30.0, -30.0, 60.0, -60.0, 15.0, -15.0, 75.0, -75.0)
"""Degrees about the vertical to which a hand may be turned around something round."""
ASKEW = (0.0, 20.0, -20.0)
"""Likewise about a handle or a vessel's wall, for which fingers have room that are not square."""
LEAST_BESIDE = 0.004
"""Free space beside a finger at least, m."""
SHARES = (0.0, 0.2, -0.2, 0.4, -0.4)
"""Where along it something long is pinched, shares of its length from its middle."""
ENDS = (0.65, 1.0)
"""Likewise of what is pinched near either end, shares of the way there."""
DEEP, SHALLOW = 0.022, 0.010
"""From the top of a thing down to the grip point, m."""
PALM_OFF, TIPS_OFF = 0.003, 0.002
"""Free space between palm and thing, and between fingertips and what it stands on, m."""
BESIDE = (0.040, 0.014, 0.007)
"""Free space beside each finger that comes in, m."""
PADS, HOLDS = 0.004, 0.9
"""From the grip point on to the middle of the pads, m, and how far off its middle they may be on
what they pinch, as a share of the way to its surface.
"""
ROUND_WITHIN = 0.004
"""By how much the sides of what may be round differ at most, m."""
HANDLE_SHARE = 0.05
"""Off the middle by more than this share of its width, a box shows where a handle is."""
OFF_HANDLE = math.cos(math.radians(40.0))
"""Cosine of the least angle from the fingers' line to a handle."""
HANDLE_WIDE, HANDLE_THICK = 0.030, 0.018
"""Of a handle, at most, m."""
STUB, STUB_WIDE = 0.05, 1.3
"""What stands out no farther than that, m, is a lug, and so much wider than it is long."""
ON_HANDLE = (0.018, 0.030, 0.045)
"""From a vessel's wall to the grip point on its handle, m: half a finger's width, and room."""
LUG = 0.040
"""Length of a lug that stands out on two sides of a vessel, m."""
RIM, RIM_LONG, RIM_DEEP, WALLS = 0.012, 0.04, 0.04, 0.9
"""Of a vessel's wall: how thick it is at most, how much of it is pinched, along it and down, m, and
what share of the way from the vessel's middle is before it."""
HOLLOW = 0.035
"""What is higher may be hollow, m."""
BOW = 0.020
"""Thickness of a kettle's bow, m."""
KNOB, KNOB_WIDE = 0.5, 0.040
"""Of a knob on a lid: its height as a share of the lid's with it, and its width, m."""


@dataclass(frozen=True)
class Handhold:
    """What is pinched, as a box.

    Attributes:
        middle: its centre (3,).
        axes: from there to the middles of three sides, upwards last, as columns (3, 3).
        around: whether it may be turned about the vertical as one likes: it is round.
        places: where along its longer side it may be pinched, m from its middle, the best first.
        name: of what it is a part.
    """

    middle: Array
    axes: Array
    around: bool = False
    places: tuple[float, ...] = (0.0,)
    name: str = "body"

    @property
    def top(self) -> float:
        """Height of its highest point, m."""
        return float(self.middle[2] + np.abs(self.axes[2]).sum())

    def surface(self) -> Array:
        """Points (P, 3) on its sides."""
        return np.asarray(self.middle + SIDES @ self.axes.T)

    def rounded(self) -> Array:
        """Likewise, as if its edges were round: few things are as square as their boxes; what may
        be turned is a cylinder, or a ball if it is as high as wide and fits between the fingers:
        wider things are vessels, whose undersides are flat.
        """
        shape = CYLINDER if self.around else SIDES / ROUNDNESS[:, None]
        width, height = np.linalg.norm(self.axes[:, [0, 2]], axis=0)
        if self.around and 2.0 * width < GAP and abs(height / width - 1.0) < BALL:
            shape = SIDES / np.linalg.norm(SIDES, axis=1)[:, None]
        return np.asarray(self.middle + shape @ self.axes.T)


def handle_way(thing: Thing) -> Array | None:
    """The level direction in which a vessel's handle stands out (3,); None if it has none."""
    out = (thing.centre - thing.middle) * (1.0, 1.0, 0.0)
    length = float(np.linalg.norm(out))
    return None if length < HANDLE_SHARE * thing.sides()[0][1] else out / length


def required_handle_way(thing: Thing) -> Array:
    """Likewise.

    Raises:
        SkillFailed: if it has none.
    """
    way = handle_way(thing)
    if way is None:
        raise SkillFailed(f"{thing.entity} has no handle")
    return way


def body(thing: Thing) -> Handhold:
    """A whole thing, its handle left out."""
    at = thing.corners
    spans = np.stack([(at[4] - at[0]) / 2.0, (at[2] - at[0]) / 2.0, (at[1] - at[0]) / 2.0], axis=1)
    upright = int(np.argmax(np.abs(spans[2]) / np.linalg.norm(spans, axis=0)))
    narrow, long = sorted(
        (k for k in range(3) if k != upright), key=lambda k: float(np.linalg.norm(spans[:, k]))
    )
    axes = spans[:, [narrow, long, upright]]
    if handle_way(thing) is not None:
        axes[:, 1] *= np.linalg.norm(axes[:, 0]) / np.linalg.norm(axes[:, 1])
        middle = np.append(thing.middle[:2], thing.centre[2])
        return Handhold(middle, axes, True)
    short, length = np.linalg.norm(axes[:, 0]), float(np.linalg.norm(axes[:, 1]))
    if length - short < ROUND_WITHIN / 2.0:
        return Handhold(thing.centre, axes, True)
    off = float((thing.com - thing.centre) @ axes[:, 1]) / length
    places = [off + 2.0 * share * length for share in SHARES]
    most = length - FINGER_SIDE
    return Handhold(thing.centre, axes, False, tuple(p for p in places if abs(p) <= most) or (0.0,))


def ends(thing: Thing) -> Handhold:
    """Likewise, to be pinched at either end."""
    whole = body(thing)
    far = float(np.linalg.norm(whole.axes[:, 1])) - 1.5 * FINGER_SIDE
    places = tuple(sign * share * far for share in ENDS for sign in (1.0, -1.0))
    return Handhold(whole.middle, whole.axes, False, places, "end")


def handle(thing: Thing) -> Handhold:
    """The handle that stands out to one side of a vessel.

    Raises:
        SkillFailed: if it has none; likewise the other parts.
    """
    way = required_handle_way(thing)
    length = 2.0 * float(np.linalg.norm((thing.centre - thing.middle)[:2]))
    root = thing.middle + (thing.reach(way) - length / 2.0) * way
    middle = np.append((root + length / 2.0 * way)[:2], thing.highest - HANDLE_THICK / 2.0)
    across = np.cross(UP, way) * max(HANDLE_WIDE, STUB_WIDE * length * (length < STUB))
    axes = np.stack((across, way * length, UP * HANDLE_THICK), axis=1) / 2.0
    most = length - FINGER_SIDE / 2.0
    places = tuple(min(off, max(most, length / 2.0)) - length / 2.0 for off in ON_HANDLE)
    return Handhold(middle, axes, False, tuple(dict.fromkeys(places)), "handle")


def lug(thing: Thing) -> Handhold:
    """The lugs that stand out on both long sides of a vessel."""
    (narrow, _), (long, length) = thing.sides()
    middle = np.append(thing.middle[:2], thing.highest - HANDLE_THICK / 2.0)
    axes = np.stack((narrow * HANDLE_WIDE, long * length, UP * HANDLE_THICK), axis=1) / 2.0
    far = (length - LUG) / 2.0
    return Handhold(middle, axes, False, (far, -far), "lug")


def lugged(thing: Thing) -> Array:
    """Points (P, 3) on a vessel that is round but for its lugs."""
    axes, lugs = body(thing).axes.copy(), lug(thing)
    axes[:, 1] *= np.linalg.norm(axes[:, 0]) / np.linalg.norm(axes[:, 1])
    whole = replace(body(thing), axes=axes, around=True)
    return np.concatenate((whole.rounded(), lugs.surface()))


def bow(thing: Thing) -> Handhold:
    """The bow over a kettle, along its longer side."""
    (narrow, _), (long, length) = thing.sides()
    middle = np.append(thing.middle[:2], thing.highest - BOW / 2.0)
    axes = np.stack((narrow * BOW / 2.0, long * length / 4.0, UP * BOW / 2.0), axis=1)
    return Handhold(middle, axes, False, (0.0,), "bow")


def knob(thing: Thing) -> Handhold:
    """What stands up in the middle of a lid."""
    axes = body(thing).axes * 1.0
    half = np.array((KNOB_WIDE, KNOB_WIDE, KNOB * thing.height)) / 2.0
    axes *= half / np.linalg.norm(axes, axis=0)
    return Handhold(np.append(thing.middle[:2], thing.highest - half[2]), axes, True, name="knob")


def lidded(thing: Thing) -> Array:
    """Points (P, 3) on a lid: it is high only where its knob is."""
    whole, share = body(thing), 1.0 - KNOB
    lower = whole.middle - KNOB * thing.height / 2.0 * UP
    flat = replace(whole, middle=lower, axes=whole.axes * (1.0, 1.0, share))
    return np.concatenate((flat.rounded(), knob(thing).surface()))


def outline(thing: Thing) -> Array:
    """Points (P, 3) on a thing, with its handle."""
    points = body(thing).rounded()
    if handle_way(thing) is None:
        return points
    return np.concatenate((points, handle(thing).surface()))


def rims(thing: Thing) -> list[Handhold]:
    """The walls of a vessel, upright, in the middle of its four sides."""
    return [_rim(thing, out, width) for axis, width in thing.sides() for out in (axis, -axis)]


def _rim(thing: Thing, out: Array, width: float) -> Handhold:
    """The wall on one side of a vessel, out (3,) from its middle, which is so wide there, m."""
    at = np.append(thing.middle[:2], thing.highest - RIM_DEEP / 2.0)
    axes = np.stack((out * RIM, np.cross(UP, out) * RIM_LONG, UP * RIM_DEEP), axis=1) / 2.0
    return Handhold(at + (width - RIM) / 2.0 * out, axes, False, (0.0,), "rim")


def wall(thing: Thing, turn: float) -> Handhold:
    """The wall of a round vessel with a handle, upright, so many degrees from that.

    Raises:
        SkillFailed: if it has no handle.
    """
    way = required_handle_way(thing)
    return _rim(thing, about_z(turn) @ way, thing.sides()[0][1])


def hollowed(thing: Thing) -> Array:
    """Points (P, 3) on a vessel, none of them over its opening."""
    whole, points = body(thing), outline(thing)
    own = np.linalg.solve(whole.axes, (points - whole.middle).T)
    return np.asarray(points[(own[2] < WALLS) | (np.hypot(*own[:2]) > WALLS)])


PAN_WALLS = {f"wall at {turn}": partial(wall, turn=turn) for turn in (45, -45, 90, -90, 135, -135)}
"""Walls of a pan, by degrees from its handle: those first that are nearest to that, and so to its
centre of mass."""
PARTS: Mapping[str, Callable[[Thing], Handhold]] = {
    "body": body,
    "end": ends,
    "handle": handle,
    "lug": lug,
    "bow": bow,
    "knob": knob,
    **PAN_WALLS,
}
Part = str | Callable[[Thing], Handhold]
"""What is pinched: empty for what fits between the fingers, a thing itself or its handle."""


def handholds(thing: Thing, part: Part = "") -> list[Handhold]:
    """What of a thing may be pinched.

    Args:
        thing: the thing.
        part: which.

    Raises:
        SkillFailed: if it has no such part.
    """
    if part:
        find = PARTS[part] if isinstance(part, str) else part
        return [find(thing)]
    whole = body(thing)
    fits = 2.0 * np.linalg.norm(whole.axes, axis=0) < GAP
    if fits[:2].any():
        return [whole]
    if handle_way(thing) is None:
        if thing.height < HOLLOW:
            raise SkillFailed(f"{thing.entity} is too wide for the gripper")
        return rims(thing)
    return [handle(thing)]


def grasp_poses(arm: Arm, thing: Thing, hold: Handhold, floor: float) -> Iterator[Pose]:
    """How the hand may close on a part of a thing.

    Args:
        arm: the arm.
        thing: the thing.
        hold: the part.
        floor: height of what the fingertips stay above, m.
    """
    load = {"rim": hollowed, "lug": lugged, "knob": lidded}.get(hold.name, outline)(thing)
    whole = body(thing)
    own = whole.rounded() if hold.name in ("body", "end") else load
    along = hold.axes[:, 1] / np.linalg.norm(hold.axes[:, 1])
    sides = np.linalg.norm(hold.axes, axis=0)
    # What is no higher than wide may be round there, and slips out of pads off its middle.
    round_there = hold.name in ("body", "end") and sides[2] < LOW * sides[0]
    for number, (line, width, odd) in enumerate(_lines(thing, hold)):
        for tilt, lean, hand in hands(arm, line):
            for place in hold.places:
                for depth, (opening, shift, rare) in itertools.product(
                    (DEEP, SHALLOW), _openings(width)
                ):
                    at = hold.middle + place * along
                    point = _grip(own, hold, at, hand, opening, depth, floor)
                    off = _off(hold, hand, point)
                    if off >= HOLDS:
                        continue
                    level = abs(float((point - at) @ np.cross(line, UP)))
                    cost = odd + rare + 0.02 * abs(lean)
                    cost += _odd(tilt, float(hand[:2, 2] @ arm.forward))
                    cost += 5.0 * abs(place) + 8.0 * max(0.0, level - 0.003)
                    cost += 0.3 * (width / GAP) ** 2 + (2.0 if round_there else 0.3) * off**2
                    family = hold.name, number, tilt, lean, np.sign(shift)
                    spot = round(place, 3)
                    at, kind = point + shift * line, (family, spot)
                    yield Pose(at, hand, opening, cost, load, family, spot, kind)


def _odd(tilt: float, ahead: float) -> float:
    """What speaks against a tilt that has the hand point so far ahead."""
    return 0.1 * TILTS.index(tilt) if ahead > 0.1 else 0.2 + 0.005 * abs(tilt)


def _openings(width: float) -> Iterator[tuple[float, float, float]]:
    """Openings of the fingers around something so wide, m, how far the hand may be off its middle
    along their line, m, and what speaks against it.
    """
    for rare, beside in enumerate(BESIDE):
        yield min(1.0, (width + 2.0 * beside) / OPENING), 0.0, 0.1 * rare
    most = (OPENING - width) / 2.0 - LEAST_BESIDE
    if most > LEAST_BESIDE:
        yield 1.0, most, 0.35
        yield 1.0, -most, 0.35


def hands(arm: Arm, line: Array) -> Iterator[tuple[float, float, Array]]:
    """Tilt and lean, degrees, and orientation (3, 3) of hands whose fingers close along a line."""
    straight = np.append(arm.forward, 0.0)
    down = -UP + (UP @ line) * line
    down /= np.linalg.norm(down)
    for tilt in TILTS:
        for approach in _tilted(line, down, tilt, straight):
            level = _hand(arm, line, approach)
            for lean in LEANS if tilt == 0.0 and abs(line @ straight) > AHEAD else (0.0,):
                turn = np.asarray(matrix(about(level[:, 1], math.radians(lean))))
                yield tilt, lean, turn @ level


def _lines(thing: Thing, hold: Handhold) -> Iterator[tuple[Array, float, float]]:
    """Directions (3,) in which the fingers may close, the width there, m, and what speaks against
    it.
    """
    way = handle_way(thing) if hold.name == "body" else None
    for number in range(2):
        half = float(np.linalg.norm(hold.axes[:, number]))
        line = hold.axes[:, number] / half
        if number and hold.name not in ("body", "end"):
            return
        if number and hold.around:
            return
        slanted = ASKEW if hold.name in ("handle", "rim") else (0.0,)
        for turn in TURNS if hold.around else slanted:
            turned = about_z(turn) @ line
            width = 2.0 * (half + FINGER_SIDE * math.sin(math.radians(abs(turn))))
            if hold.around:
                width = 2.0 * half / (1.0 if not turn % 45.0 or way is not None else 0.93)
            meets_handle = way is not None and abs(float(turned @ way)) > OFF_HANDLE
            if width <= GAP and not meets_handle:
                odd = 0.15 if hold.around else 0.4
                yield turned, width, odd * bool(turn) + 0.2 * number


def _tilted(line: Array, down: Array, tilt: float, straight: Array) -> Iterator[Array]:
    """The approach, tilted about the fingers' line: away from the robot, or to both sides where
    that line points away from it.
    """
    if tilt == 0.0:
        yield down
        return
    for sign in (1.0, -1.0):
        approach = matrix(about(line, sign * math.radians(tilt))) @ down
        ahead = float(approach @ straight)
        if (ahead > 0.1) == (tilt > 0.0) or abs(ahead) <= 0.1:
            yield approach


def _hand(arm: Arm, line: Array, approach: Array) -> Array:
    """The hand (3, 3) with its fingers on a line and an approach, its wrist turned the least."""
    usual = arm.straight_down[:, 0]
    side = line if line @ usual > -0.5 else -line
    return np.stack((side, np.cross(approach, side), approach), axis=1)


def _grip(
    own: Array, hold: Handhold, at: Array, hand: Array, opening: float, depth: float, floor: float
) -> Array:
    """Where a hand grips, as deep as palm and fingertips let it (3,)."""
    high = hold.top - hold.middle[2]
    point = at + np.array((0.0, 0.0, max(0.0, high - depth) if depth < 2.0 * high else 0.0))
    lowest = float((finger_points(opening) @ hand.T)[:, 2].min())
    point[2] = max(point[2], floor + TIPS_OFF - lowest)
    local = (own - point) @ hand
    under = (np.abs(local[:, 0]) < HAND[0]) & (np.abs(local[:, 1]) < HAND[1] + 0.002)
    back = float(np.max(PALM_OFF - PALM - local[under, 2], initial=0.0))
    return np.asarray(point - back * hand[:, 2])


def _off(hold: Handhold, hand: Array, point: Array) -> float:
    """How far off the middle of what they pinch the pads are, as a share of the way to its surface:
    the farther, the easier it turns or slips.
    """
    pads = np.abs(np.linalg.solve(hold.axes, point + PADS * hand[:, 2] - hold.middle))
    if hold.name in ("handle", "rim"):
        return HOLDS * float(max(pads[1:]))
    return float(np.hypot(*pads[1:]))
