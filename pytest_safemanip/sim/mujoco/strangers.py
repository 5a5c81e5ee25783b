"""Models that others wrote: parsed without reading anything that they name."""

from __future__ import annotations

import math
import posixpath
import re
from collections import Counter
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from pytest_safemanip.errors import TraceError, printable

MOST_XML = 16 * 2**20
MOST_ELEMENTS = 200_000
MOST_ATTRIBUTES = 100
"""Of an element; finding one takes a compiler as long as there are others."""
MOST_MOVING = 5_000
"""Bodies, and joints: in RoboCasa's largest kitchens there are some hundreds."""
PACKAGES = ("robosuite", "robocasa")
"""Packages whose assets models refer to, by paths of the machine that they were made on."""
ASSETS = "models/assets/"
_PACKAGED = re.compile(rf"(?:.*/)?({'|'.join(PACKAGES)})/{ASSETS}(.+)", re.DOTALL)
_REFUSED = ("include", "extension", "plugin", "composite", "flexcomp", "replicate", "model", "skin")
"""Elements that read other files, run other code, or make many elements of one."""
_SIZES = ("nuserdata", "nkey", "nuser_")
"""How sizes begin for which memory is taken whether or not it is used."""
_LONG = ("iterations", "initpoints")
"""How options end that say how often something is tried."""
_WIDE = ("dim", "actdim", "nsample")
"""Numbers of a sensor's or an actuator's own, for which memory is taken likewise."""
MOST_SIZE = 1000
MOST_CELLS = 2**22
"""Of a height field, and of what a camera measures."""


def parse(xml: str) -> Element:
    """The elements of a model.

    Raises:
        TraceError: if it is malformed, declares entities, or has an element that is refused.
    """
    if len(xml) > MOST_XML:
        raise TraceError(f"the model is longer than {MOST_XML} characters")
    parser = ElementTree.XMLParser(target=_Builder())  # noqa: S314 - no document type
    try:
        parser.feed(xml)
        root: Element = parser.close()
    except ElementTree.ParseError as error:
        raise TraceError(f"the model is no XML ({error})") from error
    if root.tag != "mujoco":
        raise TraceError(f"the model is no MJCF, but <{printable(root.tag)}>")
    counts: Counter[str] = Counter()
    for count, element in enumerate(root.iter()):
        if count >= MOST_ELEMENTS:
            raise TraceError(f"the model has more than {MOST_ELEMENTS} elements")
        if element.tag in _REFUSED:
            raise TraceError(f"the model has an element <{element.tag}>, which is not read")
        counts[element.tag] += 1
        _check_size(element)
    for what in ("body", "joint"):
        if counts[what] + (counts["freejoint"] if what == "joint" else 0) > MOST_MOVING:
            raise TraceError(f"the model has more than {MOST_MOVING} elements <{what}>")
    return root


def _check_size(element: Element) -> None:
    """Refuse what a compiler would make gigabytes of."""
    large = []
    if element.tag in ("size", "option"):
        own = [n for n in element.attrib if n.startswith(_SIZES) or n.endswith(_LONG)]
        large = [name for name in own if _number(element.attrib[name]) > MOST_SIZE]
    elif element.tag == "camera":
        cells = [_number(text) for text in element.get("resolution", "").split()]
        large = ["resolution"] if math.prod(cells) > MOST_CELLS else []
    elif element.tag == "hfield":
        cells = [_number(element.get(name, "0")) for name in ("nrow", "ncol")]
        large = ["nrow"] if math.prod(cells) > MOST_CELLS else []
    elif element.tag == "mesh" and "builtin" in element.attrib:
        large = ["builtin"]
    large += [name for name in _WIDE if _number(element.get(name, "0")) > MOST_SIZE]
    if large:
        value = printable(element.attrib[large[0]])
        raise TraceError(f"the model has a <{element.tag}> with {large[0]}={value!r}: too large")


def _number(text: str) -> float:
    try:
        return abs(float(text))
    except ValueError:
        return 0.0  # MuJoCo refuses it


class _Builder(ElementTree.TreeBuilder):
    def start(self, tag: Any, attrs: Any) -> Element:
        if len(attrs) > MOST_ATTRIBUTES:
            raise TraceError(f"the model has a <{printable(tag)}> with {len(attrs)} attributes")
        return super().start(tag, attrs)

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        """Only a document type can declare entities, and MJCF has none."""
        raise TraceError("the model has a document type, which may name other files")


def packaged(reference: str) -> tuple[str, str] | None:
    """The package whose asset a model names, and the path in its assets; None if it is of none.

    Args:
        reference: a path of whatever machine.

    Raises:
        TraceError: if it leads out of the package's assets.
    """
    match = _PACKAGED.fullmatch(reference.replace("\\", "/"))
    if not match:
        return None
    package, rest = match[1], posixpath.normpath(match[2])
    if rest.startswith(("..", "/")) or "\0" in rest:
        raise TraceError(f"the model names a file outside of {package}: {printable(reference)}")
    return package, rest
