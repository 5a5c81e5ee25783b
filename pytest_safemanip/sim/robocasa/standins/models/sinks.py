"""The stand-in for sinks."""

from __future__ import annotations

import math

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import CLEARANCE
from pytest_safemanip.sim.robocasa.standins.paint import DARK_STEEL, STEEL

FLOOR = 0.01
RIM = 0.03
DECK = 0.09
"""Depth of the rim at the back that carries the faucet, m."""

WATER = (0.55, 0.75, 1.0, 0.0)
LEVER_X = 0.10
"""How far right of the spout the lever stands, m: a gripper fits between them."""


def sink(size: Vec3, *, basins: int = 1) -> Model:
    """A sink with a faucet: a lever that turns the water on and off, a spout that swings.

    Frame: origin in the middle of the box that the counter is cut out for; its upper face is
    flush with the counter, the faucet stands above it at the back (positive y).
    RoboCasa needs the joints ``handle_joint`` (0 to 0.5 rad, on from 0.4), ``handle_temp_joint``,
    ``spout_joint``, the site ``water``, and the regions ``main`` and ``basin`` (or ``basin_left``
    and ``basin_right``).

    Args:
        size: width, depth and height in metres.
        basins: one or two.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    model.box((0.0, 0.0, -hz + FLOOR / 2), (hx, hy, FLOOR / 2), paint=DARK_STEEL)
    wall_z, wall = FLOOR / 2, hz - FLOOR / 2
    for side in (-1.0, 1.0):
        model.box((side * (hx - RIM / 2), 0.0, wall_z), (RIM / 2, hy, wall))
    inner = hx - RIM
    model.box((0.0, -hy + RIM / 2, wall_z), (inner, RIM / 2, wall))
    model.box((0.0, hy - DECK / 2, wall_z), (inner, DECK / 2, wall))
    middle_y, half_y = (RIM - DECK) / 2, hy - (RIM + DECK) / 2
    if basins == 1:
        model.region("basin", (0.0, middle_y, wall_z), (inner, half_y, wall))
    else:
        model.box((0.0, middle_y, wall_z - 0.01), (RIM / 2, half_y, wall - 0.01))
        half = (inner - RIM / 2) / 2
        for name, sign in (("left", -1.0), ("right", 1.0)):
            centre = (sign * (half + RIM / 2), middle_y, wall_z)
            model.region(f"basin_{name}", centre, (half, half_y, wall))
    model.look("cylinder", (0.0, middle_y, -hz + FLOOR), (0.03, 0.001), STEEL)
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    _faucet(model, hy - DECK / 2, hz, -hz + FLOOR)
    return model


def _faucet(model: Model, y: float, deck_z: float, floor_z: float) -> None:
    """Lever and spout on the deck; the water falls 17 cm in front of them."""
    lever = model.child("handle")
    foot = deck_z + 0.02
    model.box((LEVER_X, y, deck_z + 0.006), (0.022, 0.022, 0.006))
    pivot = (LEVER_X, y, foot)
    quarter = math.pi / 4
    lever.hinge(
        "handle_temp_joint", (1.0, 0.0, 0.0), pivot, (-quarter, quarter), damping=0.5, friction=0.1
    )
    lever.hinge("handle_joint", (0.0, 1.0, 0.0), pivot, (0.0, 0.5), damping=0.5, friction=0.1)
    lever.box((LEVER_X, y, foot + 0.06), (0.01, 0.01, 0.05), name="handle_main", kg=0.05)

    spout = model.child("spout")
    model.box((0.0, y, deck_z + 0.006), (0.022, 0.022, 0.006))
    low, high, reach = deck_z + 0.012 + CLEARANCE, deck_z + 0.26, 0.17
    spout.hinge(
        "spout_joint",
        (0.0, 0.0, 1.0),
        (0.0, y, low),
        (-quarter, quarter),
        damping=5.0,
        friction=0.2,
    )
    spout.box((0.0, y, (low + high) / 2), (0.012, 0.012, (high - low) / 2), name="spout_main")
    spout.box((0.0, y - reach / 2, high), (0.012, reach / 2 + 0.012, 0.012), name="spout_arm")
    outlet = high - 0.04
    spout.box((0.0, y - reach, (high + outlet) / 2), (0.010, 0.010, (high - outlet) / 2))
    fall = (outlet - floor_z) / 2
    spout.site(
        "water", (0.0, y - reach, outlet - fall), kind="cylinder", size=(0.006, fall), paint=WATER
    )
