"""Parts that appliances share: walls, handles, knobs, buttons, doors and racks.

Frame everywhere: x to the right of someone who stands in front, y away from them (the front is at
negative y), z up.
"""

from __future__ import annotations

import math

from pytest_safemanip.sim.robocasa.standins.elements import ACROSS, Surface, Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.paint import (
    BLACK,
    DARK_GLASS,
    DARK_STEEL,
    STEEL,
    WHITE,
    Paint,
)
from pytest_safemanip.sim.robocasa.standins.part import Part

GRAVITY = 9.81

CLEARANCE = 0.003
"""Gap between a moving part and what it must not touch, m.

MuJoCo does not exempt a part from contacts with a parent that is fixed to the world: a part that
overlaps it is pushed open.
"""

BAR = 0.016
"""Thickness of a handle's bar, m."""

STANDOFF = 0.05
"""From a door's front to the middle of its handle's bar, m: room for a finger behind the bar."""

KNOB_HALF: Vec3 = (0.008, 0.014, 0.021)
"""Half size of a knob's grip, m: a fin, standing upright at angle zero, that can be pinched."""


def shell(
    part: Part,
    centre: Vec3,
    half: Vec3,
    wall: float,
    *,
    paint: Paint = STEEL,
    lining: Paint | None = None,
) -> None:
    """A box of five walls, open to the front.

    Args:
        part: the body that gets the walls.
        centre: middle of the box.
        half: outer half size.
        wall: thickness of the walls.
        paint: colour of the walls.
        lining: colour of the back wall; ``None``: like the others.
    """
    (cx, cy, cz), (hx, hy, hz), t = centre, half, wall / 2
    for side in (-1.0, 1.0):
        part.box((cx, cy, cz + side * (hz - t)), (hx, hy, t), paint=paint)
        part.box((cx + side * (hx - t), cy, cz), (t, hy, hz - 2 * t), paint=paint)
    back = (cx, cy + hy - t, cz)
    part.box(back, (hx - 2 * t, t, hz - 2 * t), paint=paint if lining is None else lining)


def handle(
    part: Part,
    name: str,
    face: Vec3,
    length: float,
    *,
    upright: bool,
    standoff: float = STANDOFF,
    paint: Surface = DARK_STEEL,
) -> None:
    """A bar on two posts in front of a door.

    Args:
        part: the door.
        name: of the bar; the posts are ``<name>_post0`` and ``<name>_post1``.
        face: the point of the door's front behind the middle of the bar.
        length: of the bar.
        upright: along z; else along x.
        standoff: from the face to the middle of the bar.
        paint: of bar and posts.
    """
    x, y, z = face
    bar, along = BAR / 2, length / 2
    part.box(
        (x, y - standoff, z),
        (bar, bar, along) if upright else (along, bar, bar),
        name=name,
        paint=paint,
    )
    reach = (standoff - bar) / 2
    for index, side in enumerate((-1.0, 1.0)):
        shift = side * (along - 2 * bar)
        part.box(
            (x, y - reach, z + shift) if upright else (x + shift, y - reach, z),
            (bar * 0.8, reach, bar * 0.8),
            name=f"{name}_post{index}",
            paint=paint,
        )


def knob(
    model: Model,
    name: str,
    face: Vec3,
    *,
    turn: float,
    clockwise: bool,
    kg: float = 0.05,
) -> None:
    """A knob on a front panel: body and joint ``knob_<name>``, ``knob_<name>_joint``.

    Args:
        model: the appliance.
        name: what the knob is for.
        face: the point of the panel behind the middle of the knob.
        turn: largest angle; the knob starts upright at zero.
        clockwise: which way it turns, seen from the front.
        kg: its mass.
    """
    x, y, z = face
    half_y = KNOB_HALF[1]
    centre = (x, y - half_y - CLEARANCE, z)
    part = model.child(f"knob_{name}")
    # Seen from the front, a counter-clockwise turn is a positive one around the axis to the front.
    axis = (0.0, 1.0, 0.0) if clockwise else (0.0, -1.0, 0.0)
    part.hinge(f"knob_{name}_joint", axis, centre, (0.0, turn), damping=0.05, friction=0.05)
    part.box(centre, KNOB_HALF, name=f"knob_{name}_main", paint=BLACK, kg=kg)
    part.look("cylinder", (x, y - CLEARANCE, z), (0.024, 0.002), DARK_STEEL, quat=ACROSS)


def button(part: Part, name: str, face: Vec3, paint: Paint, half: float = 0.012) -> None:
    """A fixed square button, 4 mm proud of a front panel; pressing it is touching it."""
    x, y, z = face
    part.box((x, y - 0.002, z), (half, 0.002, half), name=name, paint=paint)


def drop_door(
    model: Model,
    face: Vec3,
    half_x: float,
    half_z: float,
    *,
    thickness: float,
    kg: float,
    opens: float = math.pi / 2,
    window: bool = True,
    standoff: float = STANDOFF,
) -> Part:
    """A door that is hinged at its lower edge: body ``door``, joint ``door_joint``.

    It turns about its lower front edge, so that no part of it dips into the appliance or the
    floor, and friction in the hinge holds it at any angle, as the springs of a real one do.

    Args:
        model: the appliance.
        face: middle of the door's front.
        half_x: half its width.
        half_z: half its height.
        thickness: of the door.
        kg: its mass.
        opens: angle at which it is fully open.
        window: whether it has a pane.
        standoff: of its handle, see :func:`handle`.

    Returns:
        The door.
    """
    x, y, z = face
    door = model.child("door")
    hold = 1.3 * kg * GRAVITY * half_z
    lower_edge = (x, y, z - half_z)
    door.hinge("door_joint", (1.0, 0.0, 0.0), lower_edge, (0.0, opens), damping=1.0, friction=hold)
    depth = y + thickness / 2
    # MuJoCo finds no contact between a plate and a box that it goes right through near both
    # middles (40 % of RoboCasa's robots in front of an open dishwasher); with two plates it does.
    for side, name in ((-1.0, "door_main"), (1.0, "door_main_right")):
        panel = (half_x / 2, thickness / 2, half_z)
        door.box((x + side * half_x / 2, depth, z), panel, name=name, kg=kg / 2)
    if window:
        pane = (half_x * 0.72, thickness / 2 + 0.001, half_z * 0.6)
        door.look("box", (x, depth, z - 0.08 * half_z), pane, DARK_GLASS)
    top = z + half_z - 2.2 * BAR
    handle(door, "door_handle_main", (x, y, top), 1.5 * half_x, upright=False, standoff=standoff)
    return door


def rack(
    model: Model,
    index: int,
    floor: Vec3,
    half_x: float,
    half_y: float,
    *,
    height: float,
    travel: float,
    rail: float,
) -> None:
    """A rack that slides out to the front: body ``rack<i>``, joint and region of that name.

    Args:
        model: the appliance.
        index: 0 for the lowest.
        floor: middle of the rack's upper surface.
        half_x: half its width.
        half_y: half its depth.
        height: of the space above it that counts as on the rack.
        travel: how far it slides.
        rail: height of its edge.
    """
    x, y, z = floor
    part = model.child(f"rack{index}")
    part.slide(f"rack{index}_joint", (0.0, -1.0, 0.0), (0.0, travel), damping=3.0, friction=2.0)
    part.box((x, y, z - 0.004), (half_x, half_y, 0.004), paint=DARK_STEEL, kg=0.6)
    if rail > 0:
        _rails(part, floor, half_x, half_y, rail)
    for step in range(-3, 4):
        wire = (x + step * half_x / 4, y, z + 0.0005)
        part.look("box", wire, (0.003, half_y, 0.001), WHITE)
    inset = 0.008
    part.region(
        f"rack{index}", (x, y, z + height / 2), (half_x - inset, half_y - inset, height / 2)
    )


def _rails(part: Part, floor: Vec3, half_x: float, half_y: float, rail: float) -> None:
    (x, y, z), t = floor, 0.003
    for side in (-1.0, 1.0):
        part.box(
            (x + side * (half_x - t), y, z + rail / 2), (t, half_y, rail / 2), paint=DARK_STEEL
        )
        part.box(
            (x, y + side * (half_y - t), z + rail / 2),
            (half_x - 2 * t, t, rail / 2),
            paint=DARK_STEEL,
        )
