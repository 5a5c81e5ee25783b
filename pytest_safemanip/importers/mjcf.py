"""MuJoCo models of strangers: read, freed of all that is only looked at, and compiled.

MuJoCo would read whatever file a model names. So a model is parsed here, every file that it needs
is found in the source or in an installed package, and MuJoCo is given their contents.
"""

from __future__ import annotations

import importlib.util
import posixpath
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from pytest_safemanip.errors import TraceError, printable
from pytest_safemanip.importers.source import Source
from pytest_safemanip.sim.mujoco.strangers import ASSETS, PACKAGES, packaged, parse

MOST_MESHES = 512 * 2**20
_LIST = re.compile(r"\[[-+.e\d, ]*\]")
"""What robosuite 1.0 wrote where MuJoCo wants numbers: a list of Python's."""
_PATHS = ("meshdir", "texturedir", "assetdir", "strippath")
_SIZES = ("njmax", "nconmax", "nstack", "memory")


class Assets:
    """The files that models of a source may name.

    Args:
        source: where the models are.
        folders: with further assets, named by the user.
    """

    def __init__(self, source: Source, folders: Sequence[Path] = ()) -> None:
        self._source = source
        root = source.root.resolve().name  # the source may be the folder of the package
        self._shipped = {found: name for name in source.names if (found := _own(f"{root}/{name}"))}
        self._folders = [Source(folder) for folder in folders]
        self._packages = {name: Source(path) for name in PACKAGES if (path := _package(name))}

    def read(self, reference: str, folder: str) -> bytes:
        """The content of a file that a model names.

        Args:
            reference: as it stands in the model.
            folder: the model's own, within the source.

        Raises:
            TraceError: if it leads elsewhere, or there is none.
        """
        found = packaged(reference)
        if found is None:
            if posixpath.isabs(reference):
                raise TraceError(
                    f"the model names a file that is of no known package: {printable(reference)}"
                )
            return self._source.read(posixpath.join(folder, reference), MOST_MESHES)
        package, rest = found
        places = [(self._source, self._shipped.get(found, ""))]
        places += [(folder, start + rest) for folder in self._folders for start in ("", ASSETS)]
        if package in self._packages:
            places.append((self._packages[package], ASSETS + rest))
        for source, name in places:
            if name and source.has(name):
                return source.read(name, MOST_MESHES)
        raise TraceError(
            f"the model needs {package}/{ASSETS}{printable(rest)}, which is neither in the source "
            f"nor in an installed {package}: name a folder that has it with --assets"
        )


def _own(name: str) -> tuple[str, str] | None:
    """The asset that a file of a source is, which may have any name; None if it is none."""
    try:
        return packaged(name)
    except TraceError:
        return None


def _package(name: str) -> Path | None:
    spec = importlib.util.find_spec(name)
    places = spec.submodule_search_locations if spec else None
    return Path(places[0]) if places else None


@dataclass(frozen=True)
class Model:
    """A compiled model.

    Attributes:
        compiled: a ``mujoco.MjModel``.
        digest_of: what it was compiled of: the cleaned XML.
    """

    compiled: Any
    digest_of: str


def compile_model(xml: str, assets: Assets, folder: str) -> Model:
    """A model without its pictures: textures, and meshes that nothing can touch.

    Args:
        xml: MJCF.
        assets: what it may name.
        folder: where it is, within the source.

    Raises:
        TraceError: if it is no MJCF, names what it may not, or does not compile.
    """
    root = parse(xml)
    _write_numbers(root)
    _drop_pictures(root)
    contents = _files(root, assets, folder)
    text = ElementTree.tostring(root, encoding="unicode")
    import mujoco

    try:
        model = mujoco.MjModel.from_xml_string(text, contents)
    except ValueError as error:
        raise TraceError(f"the model does not compile: {printable(str(error))}") from error
    return Model(model, text)


def _write_numbers(root: Element) -> None:
    """Write lists as MuJoCo reads them."""
    for element in root.iter():
        for name, value in element.items():
            if _LIST.fullmatch(value):
                element.set(name, value.strip("[]").replace(",", " "))


def _drop_pictures(root: Element) -> None:
    """Remove textures, and meshes of geoms that cannot touch anything and weigh nothing."""
    for parent in root.iter():
        for child in list(parent):
            if child.tag == "texture" or (parent.tag == "material" and child.tag == "layer"):
                parent.remove(child)
    for material in root.iter("material"):
        material.attrib.pop("texture", None)
    weighs = _weighing_groups(root)
    for body in root.iter("body"):
        for geom in body.findall("geom"):
            if geom.get("mesh") and _is_picture(geom, body, weighs):
                body.remove(geom)
    used = {geom.get("mesh") for geom in root.iter("geom")}
    for asset in root.iter("asset"):
        for mesh in asset.findall("mesh"):
            if _name_of(mesh) not in used:
                asset.remove(mesh)


def _weighing_groups(root: Element) -> tuple[int, int]:
    """The groups of geoms that masses are computed of."""
    for compiler in root.iter("compiler"):
        if text := compiler.get("inertiagrouprange"):
            low, high = (int(number) for number in text.split())
            return low, high
    return 0, 5


def _is_picture(geom: Element, body: Element, weighs: tuple[int, int]) -> bool:
    if geom.get("contype") != "0" or geom.get("conaffinity") != "0":
        return False
    weightless = body.find("inertial") is not None or float(geom.get("mass", 1.0)) < 1e-3
    return weightless or not weighs[0] <= int(geom.get("group", 0)) <= weighs[1]


def _name_of(mesh: Element) -> str:
    """A mesh without a name has that of its file."""
    return mesh.get("name") or posixpath.splitext(posixpath.basename(mesh.get("file", "")))[0]


def _files(root: Element, assets: Assets, folder: str) -> dict[str, bytes]:
    """Contents of the files that a model names, by names that it is given instead."""
    for compiler in root.iter("compiler"):
        for name in _PATHS:
            compiler.attrib.pop(name, None)
    for size in root.iter("size"):
        for name in _SIZES:
            size.attrib.pop(name, None)
    contents: dict[str, bytes] = {}
    total = 0
    for element in root.iter():
        named = [name for name in element.attrib if name.startswith("file")]
        if named and (element.tag not in ("mesh", "hfield") or named != ["file"]):
            raise TraceError(f"the model names a file in <{element.tag}>, which is not read")
        if not named:
            continue
        reference = element.attrib["file"]
        content = assets.read(reference, folder)
        total += len(content)
        if total > MOST_MESHES:
            raise TraceError(f"the meshes of the model are more than {MOST_MESHES} bytes")
        element.set("name", _name_of(element))
        name = f"{len(contents)}{posixpath.splitext(reference)[1]}"
        element.set("file", name)
        contents[name] = content
    return contents
