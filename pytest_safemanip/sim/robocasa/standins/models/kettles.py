"""The stand-in for electric kettles."""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import CLEARANCE
from pytest_safemanip.sim.robocasa.standins.paint import BLACK, DARK_STEEL, RED, STEEL
from pytest_safemanip.sim.robocasa.standins.part import Part
from pytest_safemanip.sim.robocasa.standins.shapes import octagon

GRIP = 0.012
SWITCH_TRAVEL = 0.006
PADDLE = 0.013
"""Half the side of the switch's paddle, m."""


def electric_kettle(size: Vec3) -> Model:
    """An electric kettle on its base, with a handle, a hinged lid and a switch.

    Frame: origin in the middle of kettle, base, handle and switch; the handle is to the right
    (positive x), the switch sticks out beyond it so that a finger reaches it from above. The
    kettle does not move as a whole. RoboCasa needs the joints ``lid_joint``, ``switch_joint`` (down
    is on; it holds the switch down itself), ``button_lid_joint``, and the region ``main``.

    Args:
        size: width, depth and height in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    right = hx - 2 * PADDLE
    radius = min(hy, 0.75 * (hx - PADDLE))
    x = radius - hx
    base_top = -hz + 0.02
    octagon(model, (x, 0.0, -hz + 0.01), radius, 0.01, paint=BLACK)
    body = model.child("kettle_main")
    top = hz - 0.02
    octagon(body, (x, 0.0, (base_top + top) / 2), 0.92 * radius, (top - base_top) / 2, paint=STEEL)
    grip_x = right - GRIP
    side_x = x + 0.92 * radius
    low, high = -0.4 * hz, 0.75 * hz
    body.box(
        (grip_x, 0.0, (low + high) / 2),
        (GRIP, GRIP, (high - low) / 2),
        name="handle_main",
        paint=BLACK,
    )
    for index, z in enumerate((low + GRIP, high - GRIP)):
        reach = (grip_x - GRIP - side_x) / 2
        body.box(
            (side_x + reach, 0.0, z), (reach, GRIP, GRIP), name=f"handle_post{index}", paint=BLACK
        )
    _lid(body, x, 0.88 * radius, top)
    _switch(body, hx - PADDLE, -0.6 * hz, side_x)
    _lid_button(body, grip_x, high)
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    return model


def _lid(body: Part, x: float, radius: float, z: float) -> None:
    lid = body.child("lid")
    hinge = (x + radius, 0.0, z + CLEARANCE)
    lid.hinge("lid_joint", (0.0, 1.0, 0.0), hinge, (0.0, 1.7), damping=0.1, friction=0.05)
    octagon(
        lid,
        (x, 0.0, z + CLEARANCE + 0.005),
        radius,
        0.005,
        name="lid_main",
        paint=DARK_STEEL,
        kg=0.05,
    )


def _switch(body: Part, x: float, z: float, root: float) -> None:
    switch = body.child("switch")
    switch.slide("switch_joint", (0.0, 0.0, -1.0), (0.0, SWITCH_TRAVEL), damping=1.0, friction=0.5)
    switch.box((x, 0.0, z), (PADDLE, PADDLE, 0.004), name="switch_main", paint=RED, kg=0.02)
    arm = (x - root) / 2
    switch.look("box", (root + arm, 0.0, z), (arm, 0.005, 0.002), BLACK)


def _lid_button(body: Part, x: float, z: float) -> None:
    button = body.child("button_lid")
    button.slide(
        "button_lid_joint",
        (0.0, 0.0, -1.0),
        (0.0, 0.002),
        damping=1.0,
        friction=0.05,
        stiffness=2000,  # the cap's own weight sinks it 2.5 %; RoboCasa opens the lid at 10 %
    )
    button.box(
        (x, 0.0, z + CLEARANCE + 0.004),
        (0.008, 0.008, 0.004),
        name="button_lid_main",
        paint=DARK_STEEL,
        kg=0.01,
    )
