"""Objects that hold things: bowls, cups, pans, trays.

Size (metres) is that of the vessel itself, handles come on top; its underside is at minus half the
height and its middle is the origin, also where a handle makes it lopsided: RoboCasa takes the
origin for the place of a pan on a burner. Every vessel gets the region ``int`` and the invisible
geom ``liquid`` that RoboCasa colours.
"""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.paint import BLACK, DARK_STEEL, UNSEEN, Paint
from pytest_safemanip.sim.robocasa.standins.shapes import cup, octagon, tub

THIN, THICK = 0.003, 0.006
"""Least and greatest thickness of walls, m."""

PAN_HANDLE = 0.16
"""Length of a pan's handle, m: 15 to 20 cm are usual."""
PAN_WIDTH = 0.032
"""Width of a pan's handle, m: bakelite ones are 25 to 35 mm wide near the pan."""
LUG, LUG_WIDTH, LUG_THICK = 0.028, 0.036, 0.016
"""How far a soup bowl's lug stands out, its width and its thickness, m: as of onion soup bowls. A
finger's pad, 1.6 cm wide, lies on it, and a bowl of 70 % fits with its lug into one of 95 %."""
FOOT = 0.010
"""How high a soup bowl's foot is, m: usual are 8 to 15 mm. What lies in a bowl that is 6.5 cm high
then has 4.9 cm of wall around it, over which the fingers, 4 cm from palm to tip, reach it."""
LOOP = 0.040
"""How far a mug's handle stands out, m: a finger of the gripper, 2 cm thick, fits through."""

GRIP, GRIP_WIDE, GRIP_THICK = 0.040, 0.032, 0.018
"""How far a colander's grip stands out, its width and thickness, m: solid plastic ones, as wide as
two fingers."""

EAR_HALF = 0.038
EAR_BAR = 0.006
"""Half length and half thickness of the bar of a pot's ear, m."""


def bowl(model: Model, size: Vec3, kg: float, paint: Paint, foot: float = 0.0) -> None:
    """A round open vessel without a handle: bowl, plate, cup, glass; on a foot so high, m."""
    wall = _wall(size)
    bottom, radius = (0.0, 0.0, -size[2] / 2), size[0] / 2
    cup(model, bottom, radius, size[2], wall, paint=paint, kg=kg, foot=foot)
    floor = wall + foot
    _round_inside(model, floor - size[2] / 2, size[2] - floor, radius - wall)


def lugged(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A soup bowl on a foot, with a lug to the front (-y), flush with its rim."""
    bowl(model, size, 0.92 * kg, paint, FOOT)
    _front_lug(model, size, kg, paint)


def mug(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A round vessel with a loop at +x: mug, jug, measuring cup."""
    bowl(model, size, 0.9 * kg, paint)
    radius, bar = size[0] / 2, 0.005
    reach = 0.32 * size[2]
    outer = radius + LOOP - bar
    model.box((outer, 0.0, 0.0), (bar, 0.007, reach), paint=paint, kg=0.05 * kg)
    half = (LOOP - 2 * bar) / 2
    for side in (-1.0, 1.0):
        place = (radius + half, 0.0, side * (reach - bar))
        model.box(place, (half, 0.007, bar), paint=paint, kg=0.025 * kg)


def pan(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A round vessel with a long handle to the front (-y): pan, saucepan, strainer."""
    bowl(model, size, 0.85 * kg, paint)
    radius, half = size[0] / 2, PAN_HANDLE / 2
    place = (0.0, -radius - half, 0.3 * size[2])
    grip = (PAN_WIDTH / 2, half, 0.008)
    model.box(place, grip, paint=BLACK, kg=0.15 * kg, grip=True)


def pot(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A round vessel with an ear at either side (x), a loop as wide as a mug's: pot."""
    bowl(model, size, 0.88 * kg, paint)
    radius, z, bar = size[0] / 2, 0.32 * size[2], EAR_BAR
    post = (LOOP - 2 * bar) / 2
    for side in (-1.0, 1.0):
        outer = (side * (radius + LOOP - bar), 0.0, z)
        model.box(outer, (bar, EAR_HALF, bar), paint=DARK_STEEL, kg=0.03 * kg)
        for end in (-1.0, 1.0):
            place = (side * (radius + post), end * (EAR_HALF - bar), z)
            model.box(place, (post, bar, bar), paint=DARK_STEEL, kg=0.015 * kg)


def colander(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A round vessel with a solid grip at either side (x), flush with its rim."""
    bowl(model, size, 0.88 * kg, paint)
    half = (GRIP / 2, GRIP_WIDE / 2, GRIP_THICK / 2)
    for side in (-1.0, 1.0):
        place = (side * (size[0] / 2 + half[0]), 0.0, size[2] / 2 - half[2])
        model.box(place, half, paint=DARK_STEEL, kg=0.06 * kg)


def goblet(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A wine glass: a foot, a stem, a cup from 45 % of the height."""
    radius, height = size[0] / 2, size[2]
    low, foot = -height / 2, 0.008
    octagon(model, (0.0, 0.0, low + foot / 2), 0.9 * radius, foot / 2, paint=paint, kg=0.5 * kg)
    stem = (0.45 * height - foot) / 2
    model.box((0.0, 0.0, low + foot + stem), (0.005, 0.005, stem), paint=paint, kg=0.1 * kg)
    bottom, wall = low + 0.45 * height, _wall(size)
    cup(model, (0.0, 0.0, bottom), radius, 0.55 * height, wall, paint=paint, kg=0.4 * kg)
    _round_inside(model, bottom + wall, 0.55 * height - wall, radius - wall)


def tray(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A rectangular open vessel: tray, box."""
    wall = _wall(size)
    hx, hy = size[0] / 2, size[1] / 2
    tub(model, (0.0, 0.0, -size[2] / 2), hx, hy, size[2], wall, paint=paint, kg=kg)
    rise = (size[2] - wall) / 2
    model.region("int", (0.0, 0.0, wall / 2), (hx - wall, hy - wall, rise))
    liquid = (hx - wall, hy - wall, 0.6 * rise)
    model.look("box", (0.0, 0.0, wall / 2 - 0.4 * rise), liquid, UNSEEN, name="liquid")


def bin_with_lug(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A rectangular vessel with a lug in the middle of a short side (-x), flush with its rim: a
    food box, which is drawn out of a fridge by it.
    """
    tray(model, size, 0.92 * kg, paint)
    half = (LUG / 2, LUG_WIDTH / 2, LUG_THICK / 2)
    place = (-size[0] / 2 - half[0], 0.0, size[2] / 2 - half[2])
    model.box(place, half, paint=paint, kg=0.08 * kg, grip=True)


def basket(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A rectangular vessel with a lug in the middle of its long front (-y), flush with its rim: a
    bread basket, carried by it.
    """
    tray(model, size, 0.92 * kg, paint)
    _front_lug(model, size, kg, paint)


def _front_lug(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A lug of 8 % of a vessel's mass in the middle of its front (-y), flush with its rim."""
    half = (LUG_WIDTH / 2, LUG / 2, LUG_THICK / 2)
    place = (0.0, -size[1] / 2 - half[1], size[2] / 2 - half[2])
    model.box(place, half, paint=paint, kg=0.08 * kg, grip=True)


def _wall(size: Vec3) -> float:
    return min(max(0.035 * min(size[0], size[1]), THIN), THICK)


def _round_inside(model: Model, floor: float, height: float, radius: float) -> None:
    """Region and liquid of a round vessel of this inner radius."""
    side = 0.9 * radius
    model.region("int", (0.0, 0.0, floor + height / 2), (side, side, height / 2))
    depth = 0.3 * height
    model.look("cylinder", (0.0, 0.0, floor + depth), (radius, depth), UNSEEN, name="liquid")
