"""Solids and hollows made of boxes that behave like round ones.

A round thing is an upright octagon. As a solid it is two crossed boxes whose convex hull is the
octagon: it stands on eight points, and two parallel fingers find a flat from any of eight sides.
"""

from __future__ import annotations

import math

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.paint import Paint
from pytest_safemanip.sim.robocasa.standins.part import Part

FLAT = math.tan(math.pi / 8)
"""Half the length of an octagon's side, for an octagon of half width one."""

ROUND_OFF = 0.92
"""Half width of an octagon whose corners lie within a circle of radius one (0.9239)."""

STEPS = ((1.0, FLAT), (FLAT, 1.0), (0.7, 0.7), (0.85, 0.56), (0.56, 0.85))
"""Half sizes of the boxes that an octagon's floor of half width one is made of, a cross first.

The gaps that they leave at the slanting walls let nothing through that is wider than 9 % of the
half width: 7 mm in a bowl. None is turned: two alike, one upon the other and turned by 45 degrees,
stop MuJoCo 3.9 ("9 contacts, expected at most 8"), and before RoboCasa places its objects, all are
in one place.
"""

LIFT = 0.001
"""How much shorter than its octagon a barrel's capsule is at either end, m: it stands on boxes."""


def octagon(
    part: Part,
    centre: Vec3,
    radius: float,
    half_height: float,
    *,
    paint: Paint,
    name: str | None = None,
    kg: float | None = None,
    shown: bool = True,
) -> None:
    """An upright solid octagon that looks like a cylinder.

    Args:
        part: the body that gets it.
        centre: its middle.
        radius: half its width between opposite sides.
        half_height: half its height.
        paint: its colour.
        name: of the first of its two boxes.
        kg: its mass.
        shown: whether the cylinder is there to be seen.
    """
    share = None if kg is None else kg / 2
    for index, half in enumerate(((radius, radius * FLAT), (radius * FLAT, radius))):
        part.box(
            centre,
            (half[0], half[1], half_height),
            name=name if index == 0 else None,
            paint=paint,
            kg=share,
            shown=False,
        )
    if shown:
        part.look("cylinder", centre, (radius, half_height), paint)


def barrel(
    part: Part, centre: Vec3, radius: float, half_height: float, *, paint: Paint, kg: float
) -> None:
    """An upright cylinder that stands firmly, and rolls when it lies: a tin, a bottle.

    It stands on an octagon and rolls on a capsule within it, which is the wider of the two and a
    little shorter. What is flatter than it is wide is an octagon alone.

    Args:
        part: the body that gets it.
        centre: its middle.
        radius: half its width.
        half_height: half its height.
        paint: its colour.
        kg: its mass.
    """
    straight = half_height - radius - LIFT
    if straight <= 0.0:
        octagon(part, centre, radius, half_height, paint=paint, kg=kg)
        return
    inset = ROUND_OFF * radius
    octagon(part, centre, inset, half_height, paint=paint, kg=kg / 2, shown=False)
    part.roller(centre, radius, straight, paint=paint, kg=kg / 2)
    part.look("cylinder", centre, (radius, half_height), paint)


def cup(
    part: Part,
    bottom: Vec3,
    radius: float,
    height: float,
    wall: float,
    *,
    paint: Paint,
    kg: float | None = None,
    foot: float = 0.0,
) -> None:
    """An open octagonal vessel: a floor and eight walls.

    Args:
        part: the body that gets it.
        bottom: middle of its underside.
        radius: outer half width between opposite sides.
        height: outer height.
        wall: thickness of walls and floor.
        paint: its colour.
        kg: its mass.
        foot: how much thicker the floor is, for the foot that it stands on.
    """
    x, y, z = bottom
    t, rise = wall / 2, (wall + foot) / 2
    floor = None if kg is None else kg / 2 / len(STEPS)
    side = None if kg is None else kg / 16
    # The cross alone carries the vessel, the rest hangs a little higher.
    for index, (long, wide) in enumerate(STEPS):
        half = (min(long * radius, radius - t), min(wide * radius, radius - t), rise)
        lift = 0.0003 if index > 1 else 0.0
        part.box((x, y, z + rise + lift), half, paint=paint, kg=floor, shown=False)
    part.look("cylinder", (x, y, z + rise), (radius - t, rise), paint)
    for index in range(8):
        angle = index * math.pi / 4
        place = (
            x + (radius - t) * math.cos(angle),
            y + (radius - t) * math.sin(angle),
            z + height / 2 + t / 2,
        )
        part.box(place, (t, radius * FLAT, (height - t) / 2), paint=paint, kg=side, yaw=angle)


def tub(
    part: Part,
    bottom: Vec3,
    half_x: float,
    half_y: float,
    height: float,
    wall: float,
    *,
    paint: Paint,
    kg: float | None = None,
) -> None:
    """An open box: a floor and four walls.

    Args:
        part: the body that gets it.
        bottom: middle of its underside.
        half_x: outer half width.
        half_y: outer half depth.
        height: outer height.
        wall: thickness of walls and floor.
        paint: its colour.
        kg: its mass.
    """
    x, y, z = bottom
    t = wall / 2
    floor, side = (None, None) if kg is None else (kg / 2, kg / 8)
    part.box((x, y, z + t), (half_x, half_y, t), paint=paint, kg=floor)
    rise = (height - wall) / 2
    for sign in (-1.0, 1.0):
        part.box(
            (x + sign * (half_x - t), y, z + wall + rise), (t, half_y, rise), paint=paint, kg=side
        )
        part.box(
            (x, y + sign * (half_y - t), z + wall + rise),
            (half_x - wall, t, rise),
            paint=paint,
            kg=side,
        )
