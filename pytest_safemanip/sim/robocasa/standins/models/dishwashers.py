"""The stand-in for dishwashers."""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import (
    CLEARANCE,
    drop_door,
    rack,
    shell,
)
from pytest_safemanip.sim.robocasa.standins.paint import DARK_STEEL, STEEL
from pytest_safemanip.sim.robocasa.standins.part import Part

WALL = 0.02
DOOR, PANEL = 0.04, 0.012
"""Thickness of the door at its edges, and within the edges, m: its liner is hollow."""
EDGE, END = 0.035, 0.012
"""Width of the door's side edges, m, which can be pinched from above when it is open, and of its
ends."""
BELOW = 0.30
"""Height of the drawer below it, m, which leaves a machine as high as a built-in one of 60 cm. What
is hinged at the floor, RoboCasa's robot cannot shut: its fingers come down to 30 cm, pointing
straight down, and the end of such a door lies at 5 to 18 cm."""
TOE = 0.08
"""Height of the recess for feet below the drawer, and its depth, m."""

OPENS = 1.4
"""Angle at which a hinge stops the door, rad: a little before it lies level, as many do."""


def dishwasher(size: Vec3) -> Model:
    """A dishwasher with a drop door and two racks, built in over a drawer.

    Frame: origin in the middle of the closed dishwasher without its handle; front at negative y.
    RoboCasa needs the joints ``door_joint`` and ``rack1_joint`` (the upper rack, on a body of its
    own) and the regions ``main``, ``rack0`` and ``rack1``.

    Args:
        size: width, depth and height in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    front = -hy + DOOR + CLEARANCE
    middle_y, depth = (hy + front) / 2, (hy - front) / 2
    low = -hz + BELOW
    middle_z, high = (low + hz) / 2, (hz - low) / 2
    shell(model, (0.0, middle_y, middle_z), (hx, depth, high), WALL, paint=STEEL, lining=DARK_STEEL)
    door = drop_door(
        model,
        (0.0, -hy, middle_z),
        hx - CLEARANCE,
        high - CLEARANCE,
        thickness=PANEL,
        kg=1.5,
        opens=OPENS,
        window=False,
    )
    _edges(door, (0.0, -hy + PANEL, middle_z), hx - CLEARANCE, high - CLEARANCE)
    drawer = (BELOW - TOE) / 2 - CLEARANCE
    model.box((0.0, 0.0, low - drawer - CLEARANCE), (hx - CLEARANCE, hy, drawer), paint=STEEL)
    foot = hy - TOE / 2
    model.box((0.0, TOE / 2, -hz + TOE / 2), (hx - WALL, foot, TOE / 2), paint=DARK_STEEL)
    inner_y = middle_y - WALL / 2
    # The open door slopes up by 0.17 rad: the lower rack has to slide out above it.
    lower = low + 0.19 * (hz - low)
    upper = low + 0.43 * (hz - low)
    for index, (z, ceiling) in enumerate(((lower, upper), (upper, hz - WALL))):
        rack(
            model,
            index,
            (0.0, inner_y, z),
            hx - WALL - CLEARANCE,
            depth - WALL / 2 - CLEARANCE,
            height=ceiling - z - 0.02,
            travel=0.6 * size[1],
            rail=0.07,
        )
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    model.region("int", (0.0, inner_y, middle_z), (hx - WALL, depth - WALL / 2, high - WALL))
    return model


def _edges(door: Part, face: Vec3, half_x: float, half_z: float) -> None:
    """The edges of a door around the hollow of its liner; ``face`` is the middle of its floor."""
    (x, y, z), deep = face, (DOOR - PANEL) / 2
    for side in (-1.0, 1.0):
        edge = (x + side * (half_x - EDGE / 2), y + deep, z)
        door.box(edge, (EDGE / 2, deep, half_z), paint=DARK_STEEL, kg=0.05)
        end = (x, y + deep, z + side * (half_z - END / 2))
        door.box(end, (half_x - EDGE, deep, END / 2), paint=DARK_STEEL, kg=0.05)
