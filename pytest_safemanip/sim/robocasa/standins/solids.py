"""Objects without an inside: food, boxes, bottles, tools.

Every builder puts an object of a size (length along x, width along y, height along z, in metres)
and a mass (kilograms) around the origin, as it lies or stands on a table.
"""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.elements import LYING, Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.blenders import FLANGE, put_lid
from pytest_safemanip.sim.robocasa.standins.paint import BLACK, WHITE, Paint
from pytest_safemanip.sim.robocasa.standins.shapes import barrel, octagon

EDGELESS = 0.6
"""Width of a round thing's flat sides relative to itself: near what is seen, and lies still."""

TOOL_GRIP = 0.018
"""Width of a tool's handle, m."""

TURNER_GRIP, BLADE = 0.028, 0.003
"""Width of a turner's handle and thickness of its blade, m: as of plastic ones. What is wider is
held with more force, and its blade turns less in the fingers."""


def ball(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """Round fruit: a sphere."""
    model.ball((0.0, 0.0, 0.0), size[0] / 2, paint=paint, kg=kg)


def pod(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """Long round fruit: a capsule along x, which can roll sideways."""
    radius = size[1] / 2
    model.capsule((0.0, 0.0, 0.0), radius, size[0] / 2 - radius, paint=paint, kg=kg)


def block(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """Anything with flat sides: a box."""
    model.box((0.0, 0.0, 0.0), _half(size), paint=paint, kg=kg)


def log(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """Long food that does not roll: a box; one without edges if it is about as wide as high."""
    half = _half(size)
    if half[1] > 1.25 * half[2]:
        model.box((0.0, 0.0, 0.0), half, paint=paint, kg=kg)
        return
    for y, z in ((1.0, EDGELESS), (EDGELESS, 1.0)):
        cross = (half[0], y * half[1], z * half[2])
        model.box((0.0, 0.0, 0.0), cross, paint=paint, kg=kg / 2, shown=False)
    radius = min(half[1], half[2])
    model.look("capsule", (0.0, 0.0, 0.0), (radius, half[0] - radius), paint, quat=LYING)


def can(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """Upright round things, from a pancake to a tin; what is higher than wide can roll."""
    barrel(model, (0.0, 0.0, 0.0), size[0] / 2, size[2] / 2, paint=paint, kg=kg)


def bottle(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A bottle: a round body up to 70 % of the height, a neck, a cap."""
    radius, height = size[0] / 2, size[2]
    body = 0.70 * height
    barrel(model, (0.0, 0.0, (body - height) / 2), radius, body / 2, paint=paint, kg=0.92 * kg)
    neck = (height - body) / 2
    octagon(model, (0.0, 0.0, height / 2 - neck), 0.42 * radius, neck, paint=paint, kg=0.08 * kg)
    model.look("cylinder", (0.0, 0.0, height / 2 - 0.01), (0.45 * radius, 0.01), BLACK)


def tool(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A utensil lying flat: a handle along x and a head at its positive end."""
    length, width, height = size
    head = 0.35 * length
    grip = length - head
    thick = min(height, 0.014)
    model.box(
        (-head / 2, 0.0, (thick - height) / 2),
        (grip / 2, min(width, TOOL_GRIP) / 2, thick / 2),
        paint=BLACK,
        kg=kg / 2,
    )
    model.box((grip / 2, 0.0, 0.0), (head / 2, width / 2, height / 2), paint=paint, kg=kg / 2)


def turner(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A spatula lying flat: a thick handle along x, a thin blade at its positive end."""
    length, width, height = size
    head = 0.35 * length
    grip = length - head
    model.box(
        (-head / 2, 0.0, 0.0),
        (grip / 2, TURNER_GRIP / 2, height / 2),
        paint=BLACK,
        kg=0.6 * kg,
    )
    flat = (head / 2, width / 2, BLADE / 2)
    model.box((grip / 2, 0.0, (BLADE - height) / 2), flat, paint=paint, kg=0.4 * kg)


def kettle(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A closed kettle or teapot: a round body, a bow handle along x on top, a spout at +x."""
    radius, height = size[0] / 2, size[2]
    body = 0.62 * height
    octagon(model, (0.0, 0.0, (body - height) / 2), radius, body / 2, paint=paint, kg=0.8 * kg)
    bar, top, lid = 0.009, height / 2, body - height / 2
    model.box((0.0, 0.0, top - bar), (0.75 * radius, bar, bar), paint=BLACK, kg=0.08 * kg)
    rise = (top - 2 * bar - lid) / 2
    for side in (-1.0, 1.0):
        foot = (side * (0.75 * radius - bar), 0.0, lid + rise)
        model.box(foot, (bar, bar, rise), paint=BLACK, kg=0.04 * kg)
    model.box((radius + 0.015, 0.0, 0.6 * lid), (0.018, 0.01, 0.01), paint=paint, kg=0.04 * kg)
    model.look("cylinder", (0.0, 0.0, lid + 0.004), (0.35 * radius, 0.004), BLACK)


def board(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A flat thing that others are put on; the space above it is its inside."""
    block(model, size, kg, paint)
    height = 0.06
    half = (size[0] / 2, size[1] / 2, height / 2)
    model.region("int", (0.0, 0.0, (size[2] + height) / 2), half)


def lid(model: Model, size: Vec3, kg: float, paint: Paint) -> None:
    """A pan's lid with a plug and a knob; its origin is the plane that lies on the rim."""
    put_lid(model, size[0], kg=kg, paint=paint)
    model.look("cylinder", (0.0, 0.0, FLANGE), (0.3 * size[0], 0.0005), WHITE)


def _half(size: Vec3) -> Vec3:
    return size[0] / 2, size[1] / 2, size[2] / 2
