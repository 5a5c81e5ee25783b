"""A whole model file, in the form that RoboCasa expects."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from pytest_safemanip.sim.robocasa.standins import elements
from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.part import Part


class Model(Part):
    """A whole model file; itself the fixed body of a fixture, or the body of an object."""

    def __init__(self, stretch: Vec3 = (1.0, 1.0, 1.0)) -> None:
        super().__init__("object", stretch)
        self._anchor: Vec3 | None = None
        self._texture: str | None = None

    def anchor(self, place: Vec3) -> None:
        """Where a lid sits: its origin comes to lie here."""
        fx, fy, fz = self._stretch
        self._anchor = (place[0] * fx, place[1] * fy, place[2] * fz)

    def retexturable(self, file: str) -> None:
        """Declare the texture ``tex`` and the material ``mat`` that RoboCasa renames.

        Args:
            file: path of the texture, relative to the model file.
        """
        self._texture = file

    def to_xml(self) -> str:
        """The text of the model file."""
        root = ET.Element("mujoco", model="stand-in")
        ET.SubElement(root, "compiler", angle="radian")
        asset = ET.SubElement(root, "asset")
        if self._texture is not None:
            ET.SubElement(asset, "texture", name="tex", type="2d", file=self._texture)
            ET.SubElement(asset, "material", name="mat", texture="tex")
        outer = ET.SubElement(ET.SubElement(root, "worldbody"), "body")
        outer.append(self.element)
        if self._anchor is not None:
            outer.append(elements.site("anchor_site", self._anchor))
        return ET.tostring(root, encoding="unicode") + "\n"
