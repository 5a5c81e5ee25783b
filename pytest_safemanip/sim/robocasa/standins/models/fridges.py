"""Stand-ins for refrigerators: french door, side by side, bottom freezer.

Frame: origin in the middle of the closed fridge without handles; front at negative y.

RoboCasa tells compartments apart by name. Joints with ``fridge`` or ``freezer`` and ``door`` are
doors, joints with ``drawer`` are drawers inside; regions ``<compartment>_shelf<i>`` and
``<compartment>_drawer<i>`` are where things can be, counted from below. A shelf counts only if
at least 20 cm are free above it, and without an explicit index only between 0.5 m and 1.5 m above
the floor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import CLEARANCE, handle, shell
from pytest_safemanip.sim.robocasa.standins.paint import BLACK, GLASS, WHITE
from pytest_safemanip.sim.robocasa.standins.part import Part

WALL = 0.03
DOOR = 0.055
TOE = 0.05
"""Height below the doors, m: some layouts let a fridge into the floor by a few centimetres."""

DRAWER_HEIGHT = 0.16
SHELF_PITCH = 0.28
HANDY = 1.005
"""Height above the floor of the lower of the two upper shelves of a roomy fridge, m: RoboCasa puts
what is to be taken out between 1.0 m and 1.5 m. The two share what is above, 35 cm each and more:
bottles stand there, and a hand that points down, 29 cm high, comes in over what lies there."""
ROOMY = "Refrigerator085"
"""The one of RoboCasa's models whose stand-in is roomy."""
HINGE_FRICTION = 1.0
"""N m; 2 to 3 N at the handle, so that a door which is brushed does not swing away. The suction of
a real seal, some 20 N over the first millimetres, is left out."""
DRAWER_TRAVEL = 0.38
DRAWER_INSET = DOOR - WALL + 0.005
"""Air beside a drawer, m: it has to pass a door that stands open at a right angle."""


@dataclass(frozen=True)
class Space:
    """The inside of a compartment, in metres, in the fridge's frame.

    Attributes:
        name: ``fridge`` or ``freezer``.
        left: x of its left wall.
        right: x of its right wall.
        front: y where its shelves may begin.
        back: y of its back wall.
        low: z of its floor.
        high: z of its ceiling.
    """

    name: str
    left: float
    right: float
    front: float
    back: float
    low: float
    high: float

    def middle(self, z: float) -> Vec3:
        """The middle of the space at a height."""
        return (self.left + self.right) / 2, (self.front + self.back) / 2, z

    def half(self, inset: float, height: float) -> Vec3:
        """Half size of something that fits in with this much air on every side."""
        width, depth = self.right - self.left, self.back - self.front
        return width / 2 - inset, depth / 2 - inset, height / 2


def french_door(size: Vec3) -> Model:
    """Two doors above, a freezer drawer below: ``fridge_left_door``, ``fridge_right_door``.

    Args:
        size: width, depth and height in metres.
    """
    hx, _, hz = (side / 2 for side in size)
    model, fridge = _above_freezer(size)
    split = fridge.low - WALL / 2
    _swing_door(model, "fridge_left_door", size, (-hx, -0.5 * CLEARANCE), (split, hz), "left")
    _swing_door(model, "fridge_right_door", size, (0.5 * CLEARANCE, hx), (split, hz), "right")
    return model


def bottom_freezer(size: Vec3) -> Model:
    """One door above, ``fridge_door``, and a freezer drawer below.

    Args:
        size: width, depth and height in metres.
    """
    hx, _, hz = (side / 2 for side in size)
    model, fridge = _above_freezer(size)
    _swing_door(model, "fridge_door", size, (-hx, hx), (fridge.low - WALL / 2, hz), "right")
    return model


def side_by_side(size: Vec3, roomy: bool = False) -> Model:
    """A freezer at the left and a fridge at the right: ``freezer_door``, ``fridge_door``.

    Args:
        size: width, depth and height in metres.
        roomy: whether the upper shelves of the fridge are farther apart.
    """
    hx, hy, hz = (side / 2 for side in size)
    model = _body(size)
    split = -0.1 * size[0]
    depth = (hy - DOOR - CLEARANCE + hy) / 2
    partition = (split, hy - depth, 0.0)
    model.box(partition, (WALL / 2, depth, hz - WALL), paint=WHITE)
    front, back = -hy + DOOR + 0.02, hy - WALL
    for name, left, right in (
        ("freezer", -hx + WALL, split - WALL / 2),
        ("fridge", split + WALL / 2, hx - WALL),
    ):
        space = Space(name, left, right, front, back, TOE - hz, hz - WALL)
        _drawer(model, space)
        first = space.low + DRAWER_HEIGHT + 0.03
        heights = _evenly(space, first)
        if roomy and name == "fridge":
            handy = HANDY - hz
            heights = [first, (first + handy) / 2, handy, (handy + space.high) / 2]
        _shelves(model, space, heights)
    _swing_door(model, "freezer_door", size, (-hx, split - 0.5 * CLEARANCE), (TOE - hz, hz), "left")
    _swing_door(model, "fridge_door", size, (split + 0.5 * CLEARANCE, hx), (TOE - hz, hz), "right")
    return model


def _body(size: Vec3) -> Model:
    hx, hy, hz = (side / 2 for side in size)
    model = Model()
    front = -hy + DOOR + CLEARANCE
    middle_y, depth = (hy + front) / 2, (hy - front) / 2
    shell(model, (0.0, middle_y, 0.0), (hx, depth, hz), WALL, lining=WHITE)
    plinth = (TOE - WALL) / 2
    model.box((0.0, middle_y, -hz + WALL + plinth), (hx - WALL, depth - WALL, plinth), paint=BLACK)
    model.region("main", (0.0, 0.0, 0.0), (hx, hy, hz))
    return model


def _above_freezer(size: Vec3) -> tuple[Model, Space]:
    """A body with a freezer drawer below and shelves above; the fridge's space."""
    hx, hy, hz = (side / 2 for side in size)
    model = _body(size)
    split = -hz + 0.30 * size[2]
    front, back = -hy + DOOR + CLEARANCE, hy - WALL
    model.box(
        (0.0, (front + back) / 2, split), (hx - WALL, (back - front) / 2, WALL / 2), paint=WHITE
    )
    fridge = Space("fridge", -hx + WALL, hx - WALL, front + 0.02, back, split + WALL / 2, hz - WALL)
    _drawer(model, fridge)
    _shelves(model, fridge, _evenly(fridge, fridge.low + DRAWER_HEIGHT + 0.03))
    freezer = Space("freezer", -hx + WALL, hx - WALL, front, back, TOE - hz, split - WALL / 2)
    _freezer_drawer(model, size, freezer, top=split - CLEARANCE)
    return model, fridge


def _swing_door(
    model: Model,
    name: str,
    size: Vec3,
    across: tuple[float, float],
    upright: tuple[float, float],
    hinged: str,
) -> None:
    """A door that swings about its outer front edge, and so stays within the fridge's width."""
    (x0, x1), (z0, z1), front = across, upright, -size[1] / 2
    at_left = hinged == "left"
    door = model.child(name)
    middle_z = (z0 + z1) / 2
    door.hinge(
        f"{name}_joint",
        (0.0, 0.0, -1.0 if at_left else 1.0),
        (x0 if at_left else x1, front, middle_z),
        (0.0, math.pi / 2),
        damping=1.0,
        friction=HINGE_FRICTION,
    )
    half = ((x1 - x0) / 2 - CLEARANCE, DOOR / 2, (z1 - z0) / 2 - CLEARANCE)
    door.box(((x0 + x1) / 2, front + DOOR / 2, middle_z), half, name=f"{name}_main", kg=4.0)
    bar_x = x1 - 0.05 if at_left else x0 + 0.05
    length = min(0.55, 0.6 * (z1 - z0))
    handle(door, f"{name}_handle_main", (bar_x, front, middle_z), length, upright=True)


def _evenly(space: Space, first: float) -> list[float]:
    """Heights of shelves, evenly spaced from the first one to the ceiling."""
    count = int((space.high - first) / SHELF_PITCH)
    clear = (space.high - first) / count
    return [first + index * clear for index in range(count)]


def _shelves(model: Model, space: Space, heights: Sequence[float]) -> None:
    """Shelves at these heights, the lowest first."""
    for index, (z, above) in enumerate(pairwise((*heights, space.high))):
        model.box(space.middle(z - 0.004), space.half(0.0, 0.008), paint=GLASS)
        height = above - z - 0.02
        model.region(
            f"{space.name}_shelf{index}",
            space.middle(z + height / 2),
            space.half(0.01, height),
        )


def _drawer(model: Model, space: Space) -> None:
    """The compartment's crisper: body ``<compartment>_drawer0`` and its joint and region."""
    name = f"{space.name}_drawer0"
    part = model.child(name)
    part.slide(f"{name}_joint", (0.0, -1.0, 0.0), (0.0, DRAWER_TRAVEL), damping=3.0, friction=2.0)
    low = space.low + CLEARANCE
    _open_box(part, space.middle(low), space.half(DRAWER_INSET, DRAWER_HEIGHT))
    height = DRAWER_HEIGHT - 0.01
    half = space.half(DRAWER_INSET + 0.008, height)
    part.region(name, space.middle(low + 0.006 + height / 2), half)


def _freezer_drawer(model: Model, size: Vec3, space: Space, *, top: float) -> None:
    """The freezer: front and box are one drawer, body ``freezer0``."""
    hx, hy, hz = (side / 2 for side in size)
    part = model.child("freezer0")
    part.slide("freezer0_door_joint", (0.0, -1.0, 0.0), (0.0, 0.45), damping=5.0, friction=3.0)
    bottom = TOE - hz
    middle_z = (top + bottom) / 2
    half = (hx - CLEARANCE, DOOR / 2, (top - bottom) / 2)
    part.box((0.0, -hy + DOOR / 2, middle_z), half, name="freezer0_door_main", kg=4.0)
    bar = (0.0, -hy, top - 0.06)
    handle(part, "freezer0_door_handle_main", bar, 0.6 * size[0], upright=False)
    low = space.low + CLEARANCE
    inside = Space("freezer", space.left, space.right, space.front, space.back, low, top)
    _open_box(part, inside.middle(low), inside.half(0.006, 0.28))
    height = space.high - low - 0.02
    part.region("freezer0", inside.middle(low + 0.006 + height / 2), inside.half(0.018, height))


def _open_box(part: Part, bottom: Vec3, half: Vec3) -> None:
    """Floor and four sides of a drawer; ``half[2]`` is half the height of the sides."""
    (x, y, z), (hx, hy, hz), t = bottom, half, 0.003
    part.box((x, y, z + t), (hx, hy, t), paint=GLASS, kg=0.5)
    for side in (-1.0, 1.0):
        part.box((x + side * (hx - t), y, z + hz), (t, hy, hz), paint=GLASS)
        part.box((x, y + side * (hy - t), z + hz), (hx - 2 * t, t, hz), paint=GLASS)
