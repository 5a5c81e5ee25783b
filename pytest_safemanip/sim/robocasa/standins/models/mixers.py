"""The stand-in for stand mixers."""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import CLEARANCE, GRAVITY
from pytest_safemanip.sim.robocasa.standins.paint import BLACK, RED, STEEL
from pytest_safemanip.sim.robocasa.standins.part import Part
from pytest_safemanip.sim.robocasa.standins.shapes import cup

FOOT = 0.03
WALL = 0.005
HEAD_OPENS = 1.2


def stand_mixer(size: Vec3) -> Model:
    """A stand mixer: a foot with a column, a fixed bowl, a head that tilts up.

    Frame: origin in the middle of the closed mixer; the head points to the front (negative y).
    RoboCasa needs the joints ``head_joint`` (up is positive), ``knob_speed_joint``,
    ``button_head_lock_joint`` and the regions ``main`` and ``bowl``.

    Args:
        size: width, depth and height in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    model.box((0.0, 0.0, -hz + FOOT / 2), (hx, hy, FOOT / 2), paint=RED)
    head_low = hz - 0.32 * size[2]
    column = 0.14 * size[1]
    column_y = hy - column
    rise = hz - FOOT / 2
    model.box((0.0, column_y, FOOT / 2), (0.45 * hx, column, rise), paint=RED)
    radius = min(0.92 * hx, (2 * hy - 2 * column) / 2 - 0.01)
    bowl_y = -hy + radius + 0.005
    height = 0.75 * (head_low + hz - FOOT)
    bowl = model.child("bowl")
    cup(bowl, (0.0, bowl_y, -hz + FOOT), radius, height, WALL, paint=STEEL)
    inner = (radius - WALL) * 0.85
    middle = -hz + FOOT + WALL + height / 2
    bowl.region("bowl", (0.0, bowl_y, middle), (inner, inner, height / 2))
    _head(model, (hx, hy, hz), head_low, hy - 2 * column)
    _controls(model, 0.45 * hx, column_y)
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    return model


def _head(model: Model, half: Vec3, low: float, back: float) -> None:
    """The head hangs on the column's upper front edge, so that it swings clear of it.

    Friction holds it at any angle.
    """
    hx, hy, hz = half
    head = model.child("head")
    kg = 1.0
    reach = (back - CLEARANCE + hy) / 2
    hold = 1.3 * kg * GRAVITY * reach
    head.hinge(
        "head_joint",
        (-1.0, 0.0, 0.0),
        (0.0, back - CLEARANCE, hz),
        (0.0, HEAD_OPENS),
        damping=0.5,
        friction=hold,
    )
    middle = (0.0, reach - hy, (low + hz) / 2)
    head.box(middle, (0.5 * hx, reach, (hz - low) / 2), name="head_main", paint=RED, kg=kg)


def _controls(model: Model, side_x: float, y: float) -> None:
    knob = model.child("knob_speed")
    place = (-side_x - CLEARANCE - 0.012, y, 0.0)
    knob.hinge("knob_speed_joint", (-1.0, 0.0, 0.0), place, (0.0, 4.8), damping=0.05, friction=0.03)
    knob.box(place, (0.012, 0.006, 0.015), name="knob_speed_main", paint=BLACK, kg=0.02)
    lock: Part = model.child("button_head_lock")
    lock.slide(
        "button_head_lock_joint",
        (-1.0, 0.0, 0.0),
        (0.0, 0.002),
        damping=1.0,
        friction=0.05,
        stiffness=400,
    )
    lock.box(
        (side_x + CLEARANCE + 0.004, y, 0.0),
        (0.004, 0.01, 0.01),
        name="button_head_lock_main",
        paint=BLACK,
        kg=0.01,
    )
