"""The XML elements that models are made of, with numbers written alike on every machine."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence

from pytest_safemanip.sim.robocasa.standins.paint import UNSEEN, Paint

Vec3 = tuple[float, float, float]
Surface = Paint | str
"""A colour, or the name of a material."""

LYING = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
"""Quaternion (w, x, y, z) that lays the axis of a capsule or cylinder along x."""

ACROSS = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
"""Quaternion (w, x, y, z) that lays the axis of a cylinder along y."""

INTANGIBLE = {"group": "1", "contype": "0", "conaffinity": "0", "mass": "0"}
"""Attributes of a geom that neither collides nor weighs."""


def numbers(values: Iterable[float]) -> str:
    """Numbers as MuJoCo reads them: short, and the same text on every machine."""
    return " ".join(f"{round(value, 6) + 0.0:.6g}" for value in values)


def surface(paint: Surface) -> dict[str, str]:
    """The attribute that gives a geom its look."""
    return {"material": paint} if isinstance(paint, str) else {"rgba": numbers(paint)}


def site(
    name: str,
    centre: Vec3,
    kind: str = "sphere",
    size: Sequence[float] = (0.005,),
    paint: Paint = UNSEEN,
) -> ET.Element:
    """A named place."""
    return ET.Element(
        "site",
        name=name,
        type=kind,
        pos=numbers(centre),
        size=numbers(size),
        rgba=numbers(paint),
    )


def joint(
    kind: str,
    name: str,
    axis: Vec3,
    anchor: Vec3,
    limits: tuple[float, float],
    damping: float,
    friction: float,
    stiffness: float,
) -> ET.Element:
    """A limited joint; units and meaning as in :meth:`part.Part.hinge` and ``slide``."""
    # MuJoCo's usual friction in joints creeps (an open oven door sinks by 1 cm per second), and its
    # usual limits give way. These make the one hold and the other stop.
    element = ET.Element(
        "joint",
        name=name,
        type=kind,
        axis=numbers(axis),
        pos=numbers(anchor),
        limited="true",
        range=numbers(limits),
        damping=numbers((damping,)),
        frictionloss=numbers((friction,)),
        solreffriction="0.004 1",
        solimpfriction="0.999 0.999 0.001",
        solreflimit="0.004 1",
        solimplimit="0.99 0.99 0.001",
        armature="0.01",
    )
    if stiffness:
        element.set("stiffness", numbers((stiffness,)))
    return element
