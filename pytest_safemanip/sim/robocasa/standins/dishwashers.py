"""The stand-in for dishwashers."""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.appliance import CLEARANCE, drop_door, rack, shell
from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.paint import DARK_STEEL, STEEL

WALL = 0.02
DOOR = 0.03
TOE = 0.05
"""Height below the door, m: what stands on the floor may be let into it a little."""

OPENS = 1.5


def dishwasher(size: Vec3) -> Model:
    """A dishwasher with a drop door and two racks.

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
    shell(model, (0.0, middle_y, 0.0), (hx, depth, hz), WALL, paint=STEEL, lining=DARK_STEEL)
    drop_door(
        model,
        (0.0, -hy, TOE / 2),
        hx - CLEARANCE,
        hz - TOE / 2 - CLEARANCE,
        thickness=DOOR,
        kg=1.5,
        opens=OPENS,
        window=False,
    )
    model.box((0.0, middle_y, -hz + TOE / 2), (hx - WALL, depth, TOE / 2), paint=DARK_STEEL)
    inner_y = middle_y - WALL / 2
    # The open door slopes up by 0.07 rad: the lower rack has to slide out above it.
    lower = -hz + TOE + 0.13 * size[2]
    upper = 0.1 * size[2]
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
    model.region("int", (0.0, inner_y, 0.0), (hx - WALL, depth - WALL / 2, hz - WALL))
    return model
