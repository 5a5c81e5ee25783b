"""Builds an assets folder: links to installed assets, generated files for missing ones."""

from __future__ import annotations

import hashlib
import os
import posixpath
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from pytest_safemanip.sim.robocasa.standins.catalogue import MODEL, Item

DOWNLOADED = ("textures", "generative_textures", "objects")
"""Top folders that RoboCasa's source comes without."""

SHIPPED_FOLDERS = ("fixtures/accessories", "fixtures/counters", "fixtures/fixture_registry")
"""Folders that come with the source as a whole."""

SHIPPED_FILES_IN = ("fixtures/cabinets", "fixtures/cabinets/cabinet_panels", "fixtures/handles")
"""Folders of which only the model files themselves come with the source."""

STAMP_DEPTH, MODELS_DEPTH = 3, 5
"""How many folders below the assets :func:`stamp` looks, and down to which it looks for models."""


def is_shipped(path: str) -> bool:
    """Whether a file, by its path relative to the assets, comes with RoboCasa's source."""
    top = path.split("/", 1)[0]
    if top != "fixtures":
        return top not in DOWNLOADED
    folder, name = posixpath.split(path)
    if folder in SHIPPED_FILES_IN:
        return name.endswith(".xml")
    return any(path == shipped or path.startswith(f"{shipped}/") for shipped in SHIPPED_FOLDERS)


def build(
    target: Path,
    roots: Sequence[Path],
    official: Iterable[Item],
    generated: Iterable[Item],
    *,
    only_shipped: bool,
) -> None:
    """Fill an empty folder.

    Args:
        target: the folder.
        roots: where to find what is there; the first that has a thing wins.
        official: items to take from there.
        generated: items to generate.
        only_shipped: link nothing but what comes with RoboCasa's source.
    """
    written = set()
    for item in generated:
        for path, content in item.make().items():
            file = target / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content.encode() if isinstance(content, str) else content)
            written.add(path)
    # A folder is linked as a whole unless something has to go into it. Those of models are always
    # real ones: a model may refer to textures by "..", which would follow the link, and RoboCasa
    # writes scratch files beside the models of objects.
    own = {folder for path in written for folder in _folders_of(path)}
    for item in official:
        for root in roots:
            for path in item.files_in(root):
                own.update(_folders_of(path))
    for root in roots:
        for file in shipped_files(root):
            path = file.relative_to(root).as_posix()
            if path.startswith("fixtures/"):
                own.update(_folders_of(path))
    _link(target, [root.absolute() for root in roots], "", own, only_shipped)


def _folders_of(path: str) -> list[str]:
    """The folders that a file lies in, the innermost first."""
    folders = []
    while path := posixpath.dirname(path):
        folders.append(path)
    return folders


def _link(
    target: Path, roots: Sequence[Path], folder: str, own: set[str], only_shipped: bool
) -> None:
    """Link what is in a folder of the roots, where nothing is yet."""
    for root in roots:
        if not (root / folder).is_dir():
            continue
        for entry in sorted(os.scandir(root / folder), key=lambda entry: entry.name):
            path = posixpath.join(folder, entry.name)
            place = target / path
            if path in own:
                place.mkdir(exist_ok=True)
                _link(target, [root], path, own, only_shipped)
            elif not os.path.lexists(place) and (is_shipped(path) or not only_shipped):
                place.symlink_to(entry.path)


def content_digest(roots: Sequence[Path]) -> str:
    """Digest of the files that come with RoboCasa's source and decide what a kitchen looks like."""
    digest = hashlib.sha256()
    seen = set()
    for root in roots:
        for file in shipped_files(root):
            path = file.relative_to(root).as_posix()
            if path not in seen:
                seen.add(path)
                digest.update(f"{path}\0".encode() + file.read_bytes() + b"\0")
    return digest.hexdigest()


def shipped_files(root: Path) -> list[Path]:
    """The files below a root that come with RoboCasa's source and that its models are made of."""
    folders = [root / folder for folder in ("arenas", "scenes", *SHIPPED_FOLDERS)]
    files = [file for folder in folders for file in folder.rglob("*") if file.is_file()]
    files += [file for folder in SHIPPED_FILES_IN for file in (root / folder).glob("*.xml")]
    return sorted(files)


def stamp(roots: Sequence[Path], sources: Sequence[Path]) -> str:
    """A cheap sign of whether anything may have changed below the roots.

    It is made of names, modification times and (of files) sizes down to the folders of fixture
    kinds and object categories, and below them of model files only. A download adds models to those
    folders, which changes their times; the gigabytes of meshes and textures are not looked at, nor
    the times of the models' own folders, in which RoboCasa writes scratch files.

    Args:
        roots: folders of assets.
        sources: files to be watched as well.
    """
    lines = []
    for root in roots:
        lines.append(str(root.absolute()))
        lines += _folder_lines(str(root), 1)
    for file in sources:
        status = file.stat()
        lines.append(f"{file} {status.st_mtime_ns} {status.st_size}")
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def model_digest(file: Path) -> str:
    """Digest of a model file and of the names and sizes of all other files in its folder and below,
    such as meshes and textures, XML files left out; of a file that is no model, its size.
    """
    if file.suffix != ".xml":
        return str(file.stat().st_size)
    digest = hashlib.sha256(file.read_bytes())
    for folder, folders, names in os.walk(file.parent):
        folders.sort()
        for name in sorted(name for name in names if not name.endswith(".xml")):
            place = os.path.join(folder, name)
            below = os.path.relpath(place, file.parent)
            digest.update(f"\0{below} {os.stat(place).st_size}".encode())
    return digest.hexdigest()


def _folder_lines(folder: str, depth: int) -> Iterator[str]:
    for entry in sorted(os.scandir(folder), key=lambda entry: entry.name):
        if not entry.is_dir():
            if depth <= STAMP_DEPTH or entry.name == MODEL:
                status = entry.stat()
                yield f"{entry.name} {status.st_mtime_ns} {status.st_size}"
            continue
        if depth <= STAMP_DEPTH:
            yield f"{entry.name}/ {entry.stat().st_mtime_ns}"
        if depth < MODELS_DEPTH:
            yield from _folder_lines(entry.path, depth + 1)
