"""Writing MuJoCo models in the form that RoboCasa expects, from primitives.

RoboCasa loads a model file as ``worldbody/body/body[@name='object']``. Geoms of group 0 collide
and have mass, geoms of group 1 are seen. It scales a model by multiplying positions and sizes, so
every geom here has an explicit ``pos`` and ``size``, and only yawed boxes are rotated.

Resting contacts are between boxes (or box and sphere, box and capsule): MuJoCo solves those in
closed form and such objects come to rest exactly. Cylinders and ellipsoids are for the eye only.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from pytest_safemanip.sim.robocasa.standins import elements
from pytest_safemanip.sim.robocasa.standins.elements import (
    INTANGIBLE,
    LYING,
    Surface,
    Vec3,
    numbers,
    surface,
)
from pytest_safemanip.sim.robocasa.standins.paint import STEEL, UNSEEN, Paint

DENSITY = 500.0
"""Density of a collision geom without a mass of its own, kg/m^3; counts for moving parts only."""

SPINNING = {"condim": "4"}
"""Contacts of a round thing resist spinning (a finger touches it in one point), but not rolling.

RoboCasa sets the coefficients itself, and its rolling friction of 0.1 m would hold a ball on any
slope. What rolls comes to rest by the damping of RoboCasa's free joints, 0.0005 N m s/rad: an apple
within about 0.6 s.
"""


class Part:
    """One body of a model: its geoms, joints, sites, regions and child bodies.

    Lengths are in metres, masses in kilograms, angles in radians. Coordinates are in the frame of
    the whole model: bodies get no offset of their own, joints are placed by ``anchor``.

    ``stretch`` multiplies everything along x, y, z when it is written: RoboCasa scales objects by
    a factor per category, and a model is written with the inverse, so as to get its true size.
    """

    def __init__(self, name: str, stretch: Vec3 = (1.0, 1.0, 1.0)) -> None:
        self.element = ET.Element("body", name=name)
        self._stretch = stretch
        self._low = [math.inf] * 3
        self._high = [-math.inf] * 3

    def child(self, name: str) -> Part:
        """A body on this one; it needs a joint to move."""
        part = Part(name, self._stretch)
        self.element.append(part.element)
        return part

    def box(
        self,
        centre: Vec3,
        half: Vec3,
        *,
        name: str | None = None,
        paint: Surface = STEEL,
        kg: float | None = None,
        yaw: float = 0.0,
        shown: bool = True,
        grip: bool = False,
    ) -> None:
        """A box that collides, and unless ``shown`` is false its visible twin.

        ``grip`` is for a handle that a vessel hangs on by its side. A finger's rubber pad lies flat
        on it and holds against turning (two of 1.6 cm, 18 N and a friction of 2: 0.5 N m, a bowl
        with food in it), but two boxes that are not quite parallel touch in one point.
        """
        cos, sin = abs(math.cos(yaw)), abs(math.sin(yaw))
        reach = (half[0] * cos + half[1] * sin, half[0] * sin + half[1] * cos, half[2])
        turn = {"euler": numbers((0.0, 0.0, yaw))} if yaw else {}
        named = {"name": name} if name else {}
        spin = SPINNING if grip else {}
        self._collide("box", centre, half, reach, paint, kg, {**named, **turn, **spin})
        if shown:
            self._see("box", centre, half, paint, turn)

    def ball(self, centre: Vec3, radius: float, *, paint: Paint, kg: float) -> None:
        """A sphere that collides and is seen; it rolls."""
        size = (radius, radius, radius)
        self._collide("sphere", centre, size, size, paint, kg, SPINNING)
        self._see("sphere", centre, size, paint, {})

    def capsule(
        self, centre: Vec3, radius: float, half_length: float, *, paint: Paint, kg: float
    ) -> None:
        """A capsule lying along x that collides and is seen; it rolls sideways.

        ``half_length`` is that of its straight part.
        """
        size, turn = (radius, half_length), {"quat": numbers(LYING)}
        reach = (half_length + radius, radius, radius)
        self._collide("capsule", centre, size, reach, paint, kg, {**SPINNING, **turn})
        self._see("capsule", centre, size, paint, turn)

    def roller(
        self, centre: Vec3, radius: float, half_length: float, *, paint: Paint, kg: float
    ) -> None:
        """An upright capsule that collides, what a can rolls on when it lies; it is not seen.

        ``half_length`` is that of its straight part.
        """
        reach = (radius, radius, half_length + radius)
        self._collide("capsule", centre, (radius, half_length), reach, paint, kg, SPINNING)

    def look(
        self,
        kind: str,
        centre: Vec3,
        size: Sequence[float],
        paint: Paint,
        *,
        quat: Sequence[float] | None = None,
        name: str | None = None,
    ) -> None:
        """A geom for the eye only: a ``box``, ``cylinder``, ``ellipsoid``, ``capsule``."""
        extra = {} if quat is None else {"quat": numbers(quat)}
        if name is not None:
            extra["name"] = name
        self._see(kind, centre, size, paint, extra)

    def region(self, name: str, centre: Vec3, half: Vec3) -> None:
        """A named box of space, ``reg_<name>``: RoboCasa's way to say inside, on and how big.

        It has no mass and no contacts; RoboCasa insists on a colour.
        """
        invisible = {"name": f"reg_{name}", "rgba": numbers((0.0, 1.0, 0.0, 0.0))}
        self._geom("box", centre, half, {**INTANGIBLE, **invisible})

    def site(
        self,
        name: str,
        centre: Vec3,
        *,
        kind: str = "sphere",
        size: Sequence[float] = (0.005,),
        paint: Paint = UNSEEN,
    ) -> None:
        """A named place."""
        self.element.append(elements.site(name, centre, kind, size, paint))

    def hinge(
        self,
        name: str,
        axis: Vec3,
        anchor: Vec3,
        limits: tuple[float, float],
        *,
        damping: float,
        friction: float,
    ) -> None:
        """Let this body turn about ``axis`` through ``anchor``.

        Args:
            name: of the joint.
            axis: direction; a positive angle turns counter-clockwise around it.
            anchor: a point on the axis.
            limits: lowest and highest angle.
            damping: N m s/rad.
            friction: torque below which it stays where it is, N m.
        """
        self.element.append(
            elements.joint("hinge", name, axis, anchor, limits, damping, friction, 0.0)
        )

    def slide(
        self,
        name: str,
        axis: Vec3,
        limits: tuple[float, float],
        *,
        damping: float,
        friction: float,
        stiffness: float = 0.0,
    ) -> None:
        """Let this body move along ``axis``.

        Args:
            name: of the joint.
            axis: direction of positive travel.
            limits: lowest and highest travel.
            damping: N s/m.
            friction: force below which it stays where it is, N.
            stiffness: of a spring back to zero, N/m.
        """
        origin = (0.0, 0.0, 0.0)
        self.element.append(
            elements.joint("slide", name, axis, origin, limits, damping, friction, stiffness)
        )

    @property
    def extent(self) -> tuple[Vec3, Vec3]:
        """Centre and half size of the smallest box around this body's own collision geoms."""
        low, high = self._low, self._high
        centre = tuple((a + b) / 2 for a, b in zip(low, high, strict=True))
        half = tuple((b - a) / 2 for a, b in zip(low, high, strict=True))
        return (centre[0], centre[1], centre[2]), (half[0], half[1], half[2])

    def _collide(
        self,
        kind: str,
        centre: Vec3,
        size: Sequence[float],
        reach: Vec3,
        paint: Surface,
        kg: float | None,
        extra: dict[str, str],
    ) -> None:
        for axis in range(3):
            self._low[axis] = min(self._low[axis], centre[axis] - reach[axis])
            self._high[axis] = max(self._high[axis], centre[axis] + reach[axis])
        # RoboCasa overwrites the density of every geom of an object; a mass it leaves alone.
        weight = {"density": numbers((DENSITY,))} if kg is None else {"mass": numbers((kg,))}
        self._geom(kind, centre, size, {"group": "0", **weight, **surface(paint), **extra})

    def _see(
        self, kind: str, centre: Vec3, size: Sequence[float], paint: Surface, extra: dict[str, str]
    ) -> None:
        self._geom(kind, centre, size, {**INTANGIBLE, **surface(paint), **extra})

    def _geom(
        self, kind: str, centre: Vec3, size: Sequence[float], attributes: dict[str, str]
    ) -> None:
        fx, fy, fz = self._stretch
        if len(size) == 3:
            size = (size[0] * fx, size[1] * fy, size[2] * fz)
        elif attributes.get("quat") == numbers(LYING):
            size = (size[0] * fy, size[1] * fx)
        else:
            size = (size[0] * fx, size[1] * fz)
        place = (centre[0] * fx, centre[1] * fy, centre[2] * fz)
        head = {"type": kind, "pos": numbers(place), "size": numbers(size)}
        self.element.append(ET.Element("geom", {**head, **attributes}))
