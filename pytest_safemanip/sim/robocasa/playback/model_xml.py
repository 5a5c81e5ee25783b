"""A model's XML: the files that it names, led to the assets of this machine and to no others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from pytest_safemanip.errors import TraceError, printable
from pytest_safemanip.sim.mujoco.strangers import ASSETS, packaged
from pytest_safemanip.sim.robocasa import downloads

FOLDERS = ("meshdir", "texturedir", "assetdir")
_TETRAHEDRON = "0 0 0 0 0 .01 0 .01 0 .01 0 0"


def published(text: str, roots: Mapping[str, Path]) -> str:
    """A model for a dataset: without the paths of this machine.

    Args:
        text: the XML.
        roots: the assets folder of each package.
    """
    root = ElementTree.fromstring(text)  # noqa: S314 - RoboCasa has just written it
    for element, name, value in _files(root):
        for package, folder in roots.items():
            path = PurePosixPath(value)
            if path.is_relative_to(folder):
                element.set(name, f"/{package}/{ASSETS}{path.relative_to(folder)}")
    return ElementTree.tostring(root, encoding="unicode")


def rerooted(root: Element, roots: Mapping[str, Path]) -> str:
    """A model whose files are those of this machine, without what only pictures need: official
    robots and kitchens have tens of megabytes of it, and reading them is most of compiling.

    Args:
        root: of the model, without elements that read files in other ways; is changed.
        roots: the assets folder of each package.

    Raises:
        TraceError: if a path leads anywhere else, or an asset is not installed.
    """
    for compiler in root.iter("compiler"):
        for folder in FOLDERS:  # all paths are whole
            compiler.attrib.pop(folder, None)
    for element, name, value in _files(root):
        element.set(name, str(_found(value, roots)))
    _drop_looks(root)
    return ElementTree.tostring(root, encoding="unicode")


def _drop_looks(root: Element) -> None:
    """Replace textures' pictures, and meshes that touch and weigh nothing, by small ones."""
    for texture in root.iterfind("asset/texture"):
        if any(name.startswith("file") for name in texture.attrib):
            kept = {k: v for k, v in texture.attrib.items() if k in ("name", "type")}
            texture.attrib.clear()
            texture.attrib.update(kept, builtin="flat", width="1", height="1")
    masses = [compiler.get("inertiagrouprange") for compiler in root.iter("compiler")]
    if masses != ["0 0"] or any(
        e.tag == "pair" or (e.tag == "default" and len(e)) for e in root.iter()
    ):
        return  # what is seen might weigh something, or touch something
    needed = {geom.get("mesh") for geom in root.iter("geom") if not _only_seen(geom)}
    for mesh in root.iterfind("asset/mesh"):
        if (name := mesh.get("name")) and name not in needed:
            mesh.attrib.clear()
            mesh.attrib.update(name=name, vertex=_TETRAHEDRON)


def _only_seen(geom: Element) -> bool:
    mask = geom.get("contype"), geom.get("conaffinity")
    return geom.get("type") == "mesh" and mask == ("0", "0") and geom.get("group", "0") != "0"


def below(folder: Path, rest: str, whole: str) -> Path:
    """A file of a folder.

    Args:
        folder: on this machine.
        rest: its path in it, as a stranger has it.
        whole: the stranger's whole path, for errors.

    Raises:
        TraceError: if it leads out of it, or is not there.
    """
    if ".." in PurePosixPath(rest).parts or rest.startswith("/") or "\0" in rest:
        raise TraceError(f"{printable(whole)}: leads out of the assets")
    path = folder / rest
    if not path.is_file():
        raise TraceError(
            f"{printable(whole)} is not among the assets of this machine; RoboCasa's own are "
            f"downloaded with: {downloads.COMMAND}"
        )
    return path


def _found(value: str, roots: Mapping[str, Path]) -> Path:
    found = packaged(value)
    if found is None:
        raise TraceError(
            f"the model names a file that is of no known package: {printable(value)}; nothing else "
            "is read"
        )
    package, rest = found
    return below(roots[package], rest, value)


def _files(root: Element) -> Iterator[tuple[Element, str, str]]:
    """The attributes that name files: ``file``, and ``fileup`` and the like of a cube's sides."""
    for element in root.iter():
        for name, value in list(element.attrib.items()):
            if name.startswith("file") and value:
                yield element, name, value
