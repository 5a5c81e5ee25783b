"""Stand-ins for what hangs on walls and stands about: hoods, windows, racks, plants, stools.

Frame everywhere: origin in the middle of the whole thing, front at negative y, z up. All get the
region ``main`` or ``bbox`` around them; sizes are width, depth and height in metres.
"""

from __future__ import annotations

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.paint import (
    BLACK,
    BRASS,
    GLASS,
    GREEN,
    STEEL,
    WHITE,
    WOOD,
    Paint,
)
from pytest_safemanip.sim.robocasa.standins.shapes import cup, octagon, tub


def hood(size: Vec3) -> Model:
    """A range hood: a canopy with a chimney."""
    hx, hy, hz = _half(size)
    model = Model()
    canopy = 0.28 * size[2]
    model.box((0.0, 0.0, -hz + canopy / 2), (hx, hy, canopy / 2))
    rise = hz - canopy / 2
    model.box((0.0, 0.5 * hy, canopy / 2), (0.35 * hx, 0.5 * hy, rise))
    return _bounded(model, "main", size)


def window(size: Vec3) -> Model:
    """A framed pane; RoboCasa puts a picture behind it."""
    hx, hy, hz = _half(size)
    model = Model()
    frame = 0.03
    for side in (-1.0, 1.0):
        model.box((side * (hx - frame), 0.0, 0.0), (frame, hy, hz), paint=WHITE)
        model.box((0.0, 0.0, side * (hz - frame)), (hx - 2 * frame, hy, frame), paint=WHITE)
    model.box((0.0, 0.0, 0.0), (hx - 2 * frame, 0.2 * hy, hz - 2 * frame), paint=GLASS)
    return _bounded(model, "main", size)


def dish_rack(size: Vec3) -> Model:
    """An open rack with three bays, the regions ``int_0`` to ``int_2``."""
    hx, hy, hz = _half(size)
    wall = 0.006
    model = Model()
    tub(model, (0.0, 0.0, -hz), hx, hy, 0.6 * size[2], wall, paint=STEEL)
    bay = (hx - wall) / 3
    rise = 0.35 * size[2]
    for index, x in enumerate((-2 * bay, 0.0, 2 * bay)):
        if index:
            model.box((x - bay, 0.0, -hz + rise), (0.003, hy - wall, rise), paint=STEEL)
        model.region(f"int_{index}", (x, 0.0, 0.0), (bay - 0.006, hy - wall - 0.004, hz - wall))
    return _bounded(model, "bbox", size)


def knife_block(size: Vec3) -> Model:
    """A wooden block with handles on top."""
    hx, hy, hz = _half(size)
    model = Model()
    model.box((0.0, 0.0, -0.2 * hz), (hx, hy, 0.8 * hz), paint=WOOD)
    for x in (-0.5, 0.0, 0.5):
        model.box((x * hx, 0.0, 0.8 * hz), (0.12 * hx, 0.2 * hy, 0.2 * hz), paint=BLACK)
    return _bounded(model, "bbox", size)


def paper_towel_holder(size: Vec3) -> Model:
    """A roll on a stand."""
    hx, _, hz = _half(size)
    model = Model()
    octagon(model, (0.0, 0.0, -hz + 0.006), hx, 0.006, paint=WOOD)
    octagon(model, (0.0, 0.0, -0.02 * hz), 0.75 * hx, 0.85 * hz, paint=WHITE)
    model.box((0.0, 0.0, 0.9 * hz), (0.012, 0.012, 0.1 * hz), paint=WOOD)
    return _bounded(model, "bbox", size)


def plant(size: Vec3) -> Model:
    """A pot plant."""
    return _potted(size, 0.35, WOOD, 0.6)


def flower_vase(size: Vec3) -> Model:
    """Flowers in a vase."""
    return _potted(size, 0.55, WHITE, 0.5)


def utensil_set(size: Vec3) -> Model:
    """A crock with spoons."""
    hx, _, hz = _half(size)
    model = Model()
    crock = 0.5 * hz
    octagon(model, (0.0, 0.0, -hz + crock), 0.8 * hx, crock, paint=WHITE)
    for x in (-0.4, 0.0, 0.4):
        model.box((x * hx, 0.0, crock), (0.1 * hx, 0.1 * hx, hz - crock), paint=WOOD)
    return _bounded(model, "bbox", size)


def utensil_rack(size: Vec3) -> Model:
    """A rail on the wall with ladles hanging from it."""
    hx, hy, hz = _half(size)
    model = Model()
    model.box((0.0, 0.5 * hy, 0.85 * hz), (hx, 0.5 * hy, 0.15 * hz), paint=BRASS)
    for x in (-0.6, -0.2, 0.2, 0.6):
        model.box((x * hx, 0.0, -0.15 * hz), (0.04 * hx, 0.3 * hy, 0.85 * hz), paint=STEEL)
    return _bounded(model, "bbox", size)


def fruit_bowl(size: Vec3) -> Model:
    """An empty bowl."""
    hx, _, hz = _half(size)
    model = Model()
    cup(model, (0.0, 0.0, -hz), hx, size[2], 0.008, paint=WOOD, kg=0.6)
    return _bounded(model, "bbox", size)


def tiered_basket(size: Vec3) -> Model:
    """Two trays above each other on a pole."""
    hx, hy, hz = _half(size)
    model = Model()
    tub(model, (0.0, 0.0, -hz), hx, hy, 0.25 * size[2], 0.008, paint=WOOD)
    model.box((0.0, 0.0, 0.0), (0.012, 0.012, hz), paint=WOOD)
    tub(model, (0.0, 0.0, 0.1 * hz), 0.75 * hx, 0.75 * hy, 0.2 * size[2], 0.008, paint=WOOD)
    return _bounded(model, "bbox", size)


def stool(size: Vec3) -> Model:
    """A chair with a back, its open side to the front."""
    hx, hy, hz = _half(size)
    model = Model()
    seat = -hz + 0.6 * size[2]
    model.box((0.0, 0.0, seat), (hx, hy, 0.02), paint=WOOD)
    leg = 0.018
    rise = (seat - 0.02 + hz) / 2
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.0):
            foot = (x * (hx - leg), y * (hy - leg), -hz + rise)
            model.box(foot, (leg, leg, rise), paint=WOOD)
    back = (hz - seat - 0.02) / 2
    model.box((0.0, hy - leg, hz - back), (hx, leg, back), paint=WOOD)
    return _bounded(model, "bbox", size)


def plain(size: Vec3) -> Model:
    """A box, for a kind of fixture that is not known here."""
    model = Model()
    model.box((0.0, 0.0, 0.0), _half(size))
    return _bounded(model, "main", size)


def _half(size: Vec3) -> Vec3:
    return size[0] / 2, size[1] / 2, size[2] / 2


def _potted(size: Vec3, share: float, paint: Paint, width: float) -> Model:
    """A pot below foliage that collides as a box of ``width`` times the whole width."""
    hx, _, hz = _half(size)
    model = Model()
    pot = share * hz
    octagon(model, (0.0, 0.0, -hz + pot), 0.6 * hx, pot, paint=paint)
    model.box((0.0, 0.0, pot), (width * hx, width * hx, hz - pot), paint=GREEN, shown=False)
    model.look("ellipsoid", (0.0, 0.0, pot), (hx, hx, hz - pot), GREEN)
    return _bounded(model, "bbox", size)


def _bounded(model: Model, region: str, size: Vec3) -> Model:
    model.region(region, (0.0, 0.0, 0.0), _half(size))
    model.anchor((0.0, 0.0, size[2] / 2))
    return model
