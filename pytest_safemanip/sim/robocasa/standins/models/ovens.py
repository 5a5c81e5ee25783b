"""Stand-ins for what heats with burners or racks: stoves, stovetops, ovens, toaster ovens."""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import (
    BAR,
    CLEARANCE,
    KNOB_HALF,
    STANDOFF,
    drop_door,
    knob,
    rack,
    shell,
)
from pytest_safemanip.sim.robocasa.standins.paint import BLACK, DARK_STEEL, STEEL, Paint

WALL = 0.02
BURNERS = ("rear_left", "rear_right", "front_left", "front_right")
FLAME: Paint = (1.0, 0.35, 0.1, 0.0)
LOW_STANDOFF = 0.035
"""Of a toaster oven's handle, m."""
FOOT = 1.1
"""Its foot is so much higher than its handle reaches out: scenes may make it deeper, not higher."""
SLIDES, SLIDES_FAR = 0.65, 0.9
"""How far racks come out, shares of the depth: those of an oven, and those of a toaster oven, which
a hand does not go into."""

KNOB_TURN = 3.4
"""A burner's knob turns from 0 to here; RoboCasa calls it on from 0.35 to 2 pi - 0.35 rad."""


def stove(size: Vec3) -> Model:
    """A range: four burners on top, knobs on the front, an oven below.

    Frame: origin in the middle of the range without knobs and handle; front at negative y, the
    cooktop is the upper face. RoboCasa needs the sites ``burner_on_<place>`` and
    ``burner_<place>_place_site``, the joints ``knob_<place>_joint``, and the region ``main``.

    Args:
        size: width, depth and height in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    model.box((0.0, 0.0, hz - 0.02), (hx, hy, 0.02), paint=BLACK)
    panel = 0.14
    model.box((0.0, 0.0, hz - 0.04 - panel / 2), (hx, hy, panel / 2))
    _burners(model, hx, hy, hz)
    knob_z = hz - 0.04 - panel / 2
    for place, share in zip(BURNERS, (-0.8, 0.54, -0.54, 0.8), strict=True):
        knob(model, place, (share * hx, -hy, knob_z), turn=KNOB_TURN, clockwise=False)
    for name, share in (("temp", -0.16), ("time", 0.16)):
        knob(model, name, (share * hx, -hy, knob_z), turn=KNOB_TURN, clockwise=True)
    plinth = 0.10
    top = knob_z - panel / 2
    model.box((0.0, 0.02, -hz + plinth / 2), (hx, hy - 0.02, plinth / 2), paint=DARK_STEEL)
    _oven_box(model, (0.0, 0.0, (top - hz + plinth) / 2), (hx, hy, (top + hz - plinth) / 2), 2)
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    return model


def stovetop(size: Vec3) -> Model:
    """A cooktop that is let into a counter: four burners and four knobs on one plate.

    Frame: origin in the middle of the plate; front at negative y. Names as for :func:`stove`; the
    knobs turn about the vertical.

    Args:
        size: width, depth and height (of the plate) in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    model.box((0.0, 0.0, 0.0), (hx, hy, hz), paint=BLACK)
    _burners(model, hx, hy, hz, forward=0.05)
    long, short = KNOB_HALF[2], KNOB_HALF[0]
    for place, share in zip(BURNERS, (-0.36, 0.12, -0.12, 0.36), strict=True):
        part = model.child(f"knob_{place}")
        centre = (share * hx, -hy + 0.035, hz + CLEARANCE + 0.012)
        part.hinge(
            f"knob_{place}_joint",
            (0.0, 0.0, 1.0),
            centre,
            (0.0, KNOB_TURN),
            damping=0.05,
            friction=0.05,
        )
        part.box(centre, (short, long, 0.012), name=f"knob_{place}_main", paint=STEEL, kg=0.05)
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    return model


def oven(size: Vec3) -> Model:
    """A built-in oven with two racks, a drop door and two knobs above it.

    Frame: origin in the middle of the closed oven without knobs and handle; front at negative y.
    RoboCasa needs the joints ``door_joint``, ``rack<i>_joint``, ``knob_temp_joint``,
    ``knob_time_joint`` and the regions ``main`` and ``rack<i>``.

    Args:
        size: width, depth and height in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    panel = 0.10
    model.box((0.0, 0.0, hz - panel / 2), (hx, hy, panel / 2), paint=DARK_STEEL)
    for name, share in (("temp", -0.35), ("time", 0.35)):
        knob(model, name, (share * hx, -hy, hz - panel / 2), turn=4.0, clockwise=True)
    _oven_box(model, (0.0, 0.0, -panel / 2), (hx, hy, hz - panel / 2), 2)
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    return model


def toaster_oven(size: Vec3) -> Model:
    """A small oven for the counter: one rack, a drop door, three knobs at its right.

    Frame: origin in the middle of the closed oven with knobs and handle; front at negative y. It
    stands on a foot, so that the handle of the open door stays above the counter.
    RoboCasa needs the joints ``door_joint``, ``rack0_joint``, ``knob_temp_joint``,
    ``knob_function_joint``, ``knob_time_joint`` and the regions ``main`` and ``rack0``.

    Args:
        size: width, depth (with knobs and handle) and height in metres.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    proud = LOW_STANDOFF + BAR / 2
    y, depth = proud / 2, hy - proud / 2
    panel = 0.075
    model.box((hx - panel / 2, y, 0.0), (panel / 2, depth, hz), paint=DARK_STEEL)
    for name, share in (("temp", 0.62), ("function", 0.0), ("time", -0.62)):
        face = (hx - panel / 2, y - depth, share * hz)
        knob(model, name, face, turn=KNOB_TURN, clockwise=True)
    foot = FOOT * proud + CLEARANCE
    model.box((-panel / 2, y, -hz + foot / 2), (hx - panel / 2, depth, foot / 2), paint=BLACK)
    _oven_box(
        model,
        (-panel / 2, y, foot / 2),
        (hx - panel / 2, depth, hz - foot / 2),
        1,
        door_kg=0.4,
        standoff=LOW_STANDOFF,
        slides=SLIDES_FAR,
    )
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    return model


def _burners(model: Model, hx: float, hy: float, hz: float, forward: float = 0.0) -> None:
    """Burner sites on a plate of this half size, moved back by ``forward`` to leave it room."""
    for place in BURNERS:
        x = (0.48 if place.endswith("right") else -0.48) * hx
        y = (0.45 if place.startswith("rear") else -0.42) * (hy - forward) + forward
        radius = min(0.09, 0.4 * hx)
        model.look("cylinder", (x, y, hz), (radius, 0.0008), DARK_STEEL)
        model.site(
            f"burner_on_{place}",
            (x, y, hz + 0.002),
            kind="cylinder",
            size=(radius, 0.002),
            paint=FLAME,
        )
        model.site(f"burner_{place}_place_site", (x, y, hz + 0.002))


def _oven_box(
    model: Model,
    centre: Vec3,
    half: Vec3,
    racks: int,
    *,
    door_kg: float = 1.5,
    standoff: float = STANDOFF,
    slides: float = SLIDES,
) -> None:
    """A heated box with its drop door and racks; ``half`` includes the door."""
    (cx, cy, cz), (hx, hy, hz) = centre, half
    door = 0.025
    depth = hy - (door + CLEARANCE) / 2
    middle = (cx, cy + (door + CLEARANCE) / 2, cz)
    shell(model, middle, (hx, depth, hz), WALL, paint=STEEL, lining=BLACK)
    drop_door(
        model,
        (cx, cy - hy, cz),
        hx - CLEARANCE,
        hz - CLEARANCE,
        thickness=door,
        kg=door_kg,
        standoff=standoff,
    )
    inner = (hx - WALL, depth - WALL / 2, hz - WALL)
    pitch = (2 * inner[2] - 0.04) / racks
    for index in range(racks):
        floor_z = cz - inner[2] + 0.03 + index * pitch
        rack(
            model,
            index,
            (cx, middle[1] - WALL / 2, floor_z),
            inner[0] - CLEARANCE,
            inner[1] - CLEARANCE,
            height=pitch - 0.015,
            travel=slides * 2 * inner[1],
            rail=0.0,
        )
    model.region("int", (cx, middle[1] - WALL / 2, cz), inner)
