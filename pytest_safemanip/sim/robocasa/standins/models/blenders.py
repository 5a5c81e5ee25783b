"""Stand-ins for blenders and their lids."""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import button
from pytest_safemanip.sim.robocasa.standins.paint import BLACK, DARK_STEEL, GLASS, GREEN, Paint
from pytest_safemanip.sim.robocasa.standins.part import Part
from pytest_safemanip.sim.robocasa.standins.shapes import cup, octagon

WALL = 0.005
PLUG = 0.012
FLANGE = 0.008
KNOB = 0.03
SNUG = 0.004
"""Air around a lid's plug in the vessel that it closes, m."""

LID_OVERHANG = 0.96
"""Outer width of a vessel as a share of its lid's."""


def blender(size: Vec3, *, lid_width: float) -> Model:
    """A blender: a base with a power button, and an open jug standing on it.

    Frame: origin in the middle of base and jug; front at negative y. RoboCasa needs the geom
    ``power_button_main``, the anchor of the lid (at the jug's rim) and the regions ``main`` and
    ``int``.

    Args:
        size: width, depth and height in metres.
        lid_width: of the lid that has to fit, in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    base = 0.36 * size[2]
    model.box((0.0, 0.0, -hz + base / 2), (hx, hy, base / 2), paint=DARK_STEEL)
    button(model, "power_button_main", (0.0, -hy, -hz + base / 2), GREEN, half=0.014)
    radius = LID_OVERHANG * lid_width / 2
    bottom = -hz + base
    cup(model, (0.0, 0.0, bottom), radius, hz - bottom, WALL, paint=GLASS)
    inner = (radius - WALL) * 0.8
    height = hz - bottom - WALL
    model.region("int", (0.0, 0.0, bottom + WALL + height / 2), (inner, inner, height / 2))
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    model.anchor((0.0, 0.0, hz))
    return model


def lid(width: float, *, kg: float, paint: Paint = BLACK) -> Model:
    """A lid with a plug below and a knob on top.

    Frame: origin in the middle of the underside of its flange, the plane that comes to lie on the
    rim. It is a fixture or an object: RoboCasa needs the region ``main`` or ``bbox``.

    Args:
        width: of the flange, in metres.
        kg: its mass.
        paint: its colour.
    """
    model = Model()
    put_lid(model, width, kg=kg, paint=paint)
    half = (width / 2, width / 2, (PLUG + FLANGE + KNOB) / 2)
    centre = (0.0, 0.0, half[2] - PLUG)
    model.region("main", centre, half)
    model.region("bbox", centre, half)
    return model


def put_lid(part: Part, width: float, *, kg: float, paint: Paint, depth: float = PLUG) -> None:
    """The solids of a lid, see :func:`lid`; ``depth`` is that of its plug."""
    plug = LID_OVERHANG * width / 2 - WALL - SNUG
    octagon(part, (0.0, 0.0, -depth / 2), plug, depth / 2, paint=paint, kg=kg * 0.3)
    octagon(part, (0.0, 0.0, FLANGE / 2), width / 2, FLANGE / 2, paint=paint, kg=kg * 0.5)
    grip = min(0.018, 0.3 * width)
    part.box((0.0, 0.0, FLANGE + KNOB / 2), (grip, grip, KNOB / 2), paint=DARK_STEEL, kg=kg * 0.2)
