"""Stand-ins for cabinet doors' panels and handles.

RoboCasa scales these to the cabinet. A panel is stretched in all directions until its region
``main`` has the size of the door. A handle is stretched until its region ``main`` has half size
``(given or its own, given or its own, length / 2)``, and its origin is put at

    y = front of the panel - (half depth of the region - 2.5 mm)

So the region here has exactly the half depth and half width that the registry gives a handle
(then nothing but the length is stretched), and the bar stands 5 cm off the panel, whatever the
region's depth. Both need the texture ``tex`` and the material ``mat``, which RoboCasa renames.
"""

from __future__ import annotations

from dataclasses import dataclass

from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models.appliance import BAR, STANDOFF, handle

MATERIAL = "mat"
EMBEDDED = 0.0025
"""How deep RoboCasa sinks a handle into its panel, m."""

PANEL_HALF = (0.25, 0.01, 0.35)
SOLID_SHARE = 0.6
"""Share of a panel's depth that is solid."""

LENGTH = 0.24
"""Of an unscaled handle, m: RoboCasa's default, so that it is usually shortened at most."""

HALF_WIDTH = 0.015
HALF_DEPTH = 0.02
KNOB_RADIUS = 0.015
KNOB_HALF_DEPTH = 0.017


@dataclass(frozen=True)
class HandleSize:
    """What the registry prescribes for a kind of handle; ``None``: the model's own.

    Attributes:
        half_width: half size across, metres.
        half_depth: half size away from the panel, metres.
    """

    half_width: float | None = None
    half_depth: float | None = None


def panel(texture: str) -> Model:
    """The flat panel of a door or drawer.

    Frame: origin in its middle; the room is at negative y.

    Only the front part of its depth is solid: RoboCasa puts a door's hinge at its front, inside
    its outer edge, and the back corner of a full slab would scrape along the cabinet's side wall.

    Args:
        texture: path of its default texture, relative to the model file.
    """
    model = Model()
    model.retexturable(texture)
    width, depth, height = PANEL_HALF
    solid = (width, SOLID_SHARE * depth, height)
    model.box((0.0, -(1.0 - SOLID_SHARE) * depth, 0.0), solid, name="door", paint=MATERIAL)
    model.region("main", (0.0, 0.0, 0.0), PANEL_HALF)
    return model


def bar_handle(texture: str, size: HandleSize) -> Model:
    """A bar on two posts, upright (RoboCasa lays it down for drawers).

    Frame: the panel's front is at ``y = half depth - 2.5 mm``, the room at negative y.

    Args:
        texture: path of its default texture, relative to the model file.
        size: what the registry prescribes.
    """
    half_width = HALF_WIDTH if size.half_width is None else size.half_width
    half_depth = HALF_DEPTH if size.half_depth is None else size.half_depth
    model = Model()
    model.retexturable(texture)
    face = (0.0, half_depth - EMBEDDED, 0.0)
    handle(model, "handle", face, LENGTH, upright=True, standoff=STANDOFF, paint=MATERIAL)
    model.region("main", (0.0, 0.0, 0.0), (half_width, half_depth, LENGTH / 2))
    return model


def knob_handle(texture: str) -> Model:
    """A knob: a square head on a stem, 3.2 cm deep.

    Frame: as for :func:`bar_handle`.

    Args:
        texture: path of its default texture, relative to the model file.
    """
    model = Model()
    model.retexturable(texture)
    face = KNOB_HALF_DEPTH - EMBEDDED
    head = BAR / 2
    front = -KNOB_HALF_DEPTH
    model.box(
        (0.0, front + head, 0.0), (KNOB_RADIUS, head, KNOB_RADIUS), name="handle", paint=MATERIAL
    )
    stem = (face - front - 2 * head) / 2
    model.box((0.0, face - stem, 0.0), (0.006, stem, 0.006), name="handle_stem", paint=MATERIAL)
    model.region("main", (0.0, 0.0, 0.0), (KNOB_RADIUS, KNOB_HALF_DEPTH, KNOB_RADIUS))
    return model
