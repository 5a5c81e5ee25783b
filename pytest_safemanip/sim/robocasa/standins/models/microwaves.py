"""The stand-in for microwave ovens."""

from __future__ import annotations

import math

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import CLEARANCE, button, handle, shell
from pytest_safemanip.sim.robocasa.standins.paint import (
    BLACK,
    DARK_GLASS,
    DARK_STEEL,
    GLASS,
    GREEN,
    RED,
)
from pytest_safemanip.sim.robocasa.standins.shapes import octagon

WALL = 0.02
DOOR = 0.02
TRAY = 0.012


def microwave(size: Vec3) -> Model:
    """A microwave oven with a turntable, a side-hinged door and two buttons.

    Frame: origin in the middle of the closed oven without its handle; front at negative y.
    RoboCasa needs the joint ``microjoint`` (hinged at the left, opens to -pi/2), the geoms
    ``door_handle_main``, ``start_button``, ``stop_button``, and the regions ``main`` and ``tray``.

    Args:
        size: width, depth and height in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    panel = min(max(0.16 * size[0], 0.09), 0.12)
    right = hx - panel
    model = Model()
    front = -hy + DOOR + CLEARANCE
    body_half = ((right + hx) / 2, (hy - front) / 2, hz)
    body_centre = ((right - hx) / 2, (hy + front) / 2, 0.0)
    shell(model, body_centre, body_half, WALL, paint=DARK_STEEL)
    model.box((right + panel / 2, 0.0, 0.0), (panel / 2, hy, hz), paint=BLACK)
    button(model, "start_button", (right + panel * 0.7, -hy, -0.25 * size[2]), GREEN)
    button(model, "stop_button", (right + panel * 0.3, -hy, -0.25 * size[2]), RED)
    model.look("box", (right + panel / 2, -hy, hz * 0.6), (panel * 0.35, 0.001, 0.02), GLASS)
    _door(model, size, right)
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    _cavity(model, body_centre, (body_half[0] - WALL, body_half[1] - WALL, hz - WALL))
    return model


def _door(model: Model, size: Vec3, right: float) -> None:
    hx, hy, hz = (side / 2 for side in size)
    door = model.child("door")
    hinge = (-hx, -hy, 0.0)
    door.hinge("microjoint", (0.0, 0.0, 1.0), hinge, (-math.pi / 2, 0.0), damping=0.5, friction=0.5)
    # A gap all around: neighbours in a kitchen touch the oven, and often overlap it a little.
    half = ((right + hx) / 2 - CLEARANCE, DOOR / 2, hz - CLEARANCE)
    centre = ((right - hx) / 2, -hy + DOOR / 2, 0.0)
    door.box(centre, half, name="door_main", paint=DARK_STEEL, kg=1.5)
    pane = (half[0] * 0.75, DOOR / 2 + 0.001, hz * 0.7)
    door.look("box", (centre[0] - 0.02, centre[1], 0.0), pane, DARK_GLASS)
    handle(door, "door_handle_main", (right - 0.035, -hy, 0.0), 0.7 * size[2], upright=True)


def _cavity(model: Model, centre: Vec3, half: Vec3) -> None:
    """Turntable and regions in a cavity of this inner half size (its front at the door)."""
    middle = (centre[0], centre[1] - WALL / 2, 0.0)
    reach = min(half[0], half[1])
    floor = -half[2]
    octagon(
        model,
        (middle[0], middle[1], floor + TRAY / 2),
        reach - 0.012,
        TRAY / 2,
        name="tray",
        paint=GLASS,
    )
    top = floor + TRAY
    space = (half[2] - 0.01 - top) / 2
    model.region("tray", (middle[0], middle[1], top + space), (reach, reach, space))
    model.region("int", middle, (half[0], half[1], half[2]))
