"""The stand-in for coffee machines."""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import button
from pytest_safemanip.sim.robocasa.standins.paint import BLACK, DARK_STEEL, GREEN, STEEL

TRAY = 0.03
LIP = 0.04
"""How far the head reaches beyond its outlet, m: as in machines for single cups, whose tray sticks
out farther than the head, so that a cup is put on it from the front."""
BUTTON = 0.025
"""Middle of the button above the lower edge of the head, m: a hand that presses it stays below the
open doors of a cabinet above."""
COFFEE = (0.30, 0.15, 0.05, 0.0)


def coffee_machine(size: Vec3) -> Model:
    """A coffee machine: a tray for the cup, a head above it with the start button.

    Frame: origin in the middle of the machine; front at negative y, open on three sides between
    tray and head. RoboCasa needs the geom ``start_button``, the sites ``receptacle_place_site``
    (where the cup stands) and ``coffee_liquid``, and the region ``main``.

    Args:
        size: width, depth and height in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    split = 0.1 * size[1]
    column = (hy - split) / 2
    model.box((0.0, split + column, 0.0), (hx, column, hz), paint=DARK_STEEL)
    open_y, half_y = (split - hy) / 2, (split + hy) / 2
    model.box((0.0, open_y, -hz + TRAY / 2), (hx, half_y, TRAY / 2), paint=BLACK)
    head = 0.26 * size[2]
    front = open_y - min(LIP, half_y)
    over = (split - front) / 2
    model.box((0.0, split - over, hz - head / 2), (hx, over, head / 2), paint=STEEL)
    outlet = hz - head
    model.look("cylinder", (0.0, open_y, outlet), (0.012, 0.012), DARK_STEEL)
    button(model, "start_button", (0.0, front, outlet + BUTTON), GREEN, half=0.015)
    top = -hz + TRAY
    model.site("receptacle_place_site", (0.0, open_y, top + 0.002))
    fall = (outlet - top) / 2
    model.site(
        "coffee_liquid",
        (0.0, open_y, top + fall),
        kind="cylinder",
        size=(0.004, fall),
        paint=COFFEE,
    )
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    return model
