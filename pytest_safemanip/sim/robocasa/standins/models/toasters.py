"""The stand-in for toasters."""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.elements import ACROSS, Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import CLEARANCE
from pytest_safemanip.sim.robocasa.standins.paint import BLACK, DARK_STEEL

SLOT_HALF_WIDTH = 0.015
SLOT_DEPTH = 0.075
"""From the toaster's top to the floor of a slot, m: a slice of 11 cm sticks out by a third."""

SLICE_SPACE = 0.15
"""Height of a slot's region, m: RoboCasa puts bread only where it fits in whole."""

LEVER_TRAVEL = 0.045
PROUD = 0.03 + CLEARANCE
"""How far the lever sticks out, m."""

END = 0.006
"""Half the thickness of the walls at the ends of the slots, m."""


def toaster(size: Vec3) -> Model:
    """A toaster with two slots, a lever that springs up, a knob and a button.

    Frame: origin in the middle of the toaster with lever and knob; front at negative y, the slots
    run along y. RoboCasa needs the geoms ``slotL_floor`` and ``slotR_floor``, the joints
    ``lever_joint`` (down from 0; it holds the lever down itself while toasting),
    ``knob_doneness_joint``, ``button_cancel_joint`` and the regions ``main``, ``slotL``, ``slotR``.

    Args:
        size: width, depth and height in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    y, depth = PROUD / 2, hy - PROUD / 2
    floor = hz - SLOT_DEPTH
    model.box((0.0, y, (floor - hz) / 2), (hx, depth, (floor + hz) / 2))
    rise = SLOT_DEPTH / 2
    for side in (-1.0, 1.0):
        model.box((0.0, y + side * (depth - END), floor + rise), (hx, END, rise))
    middle = 0.45 * hx
    inner, outer = middle - SLOT_HALF_WIDTH, middle + SLOT_HALF_WIDTH
    long = depth - 2 * END
    model.box((0.0, y, floor + rise), (inner, long, rise), paint=DARK_STEEL)
    for name, side in (("L", -1.0), ("R", 1.0)):
        edge = (hx - outer) / 2
        model.box((side * (hx - edge), y, floor + rise), (edge, long, rise))
        x = side * middle
        model.box(
            (x, y, floor + 0.002),
            (SLOT_HALF_WIDTH, long, 0.002),
            name=f"slot{name}_floor",
            paint=BLACK,
        )
        model.region(
            f"slot{name}",
            (x, y, floor + 0.004 + SLICE_SPACE / 2),
            (SLOT_HALF_WIDTH - 0.002, long - 0.002, SLICE_SPACE / 2),
        )
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    _controls(model, hx, y - depth, hz)
    return model


def _controls(model: Model, hx: float, front: float, hz: float) -> None:
    lever = model.child("lever")
    # Light, sprung and with little friction, so that it stays up and comes up again.
    lever.slide(
        "lever_joint",
        (0.0, 0.0, -1.0),
        (0.0, LEVER_TRAVEL),
        damping=1.0,
        friction=0.3,
        stiffness=60,
    )
    y = front - CLEARANCE
    lever.box((0.5 * hx, y - 0.015, 0.5 * hz), (0.018, 0.015, 0.006), name="lever_handle", kg=0.02)

    knob = model.child("knob_doneness")
    place = (-0.5 * hx, y - 0.010, -0.4 * hz)
    knob.hinge(
        "knob_doneness_joint", (0.0, 1.0, 0.0), place, (0.0, 4.6), damping=0.05, friction=0.03
    )
    knob.box(place, (0.006, 0.010, 0.015), name="knob_doneness_main", paint=BLACK, kg=0.02)
    knob.look("cylinder", (place[0], y, place[2]), (0.018, 0.002), DARK_STEEL, quat=ACROSS)

    button = model.child("button_cancel")
    button.slide(
        "button_cancel_joint",
        (0.0, 1.0, 0.0),
        (0.0, 0.002),
        damping=1.0,
        friction=0.05,
        stiffness=400,
    )
    button.box(
        (-0.5 * hx, y - 0.004, 0.3 * hz), (0.01, 0.004, 0.01), name="button_cancel_main", kg=0.01
    )
