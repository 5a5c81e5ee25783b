"""Reads the assets that RoboCasa needs from its files, without importing it.

Importing RoboCasa lists its model folders, so the folders have to be there before. Its registries
are YAML; its object categories and its lists of panels and handles are Python source, of which
the literals are read from the syntax tree: nothing is executed.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.robocasa.standins import literals
from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.fixtures import PartialSize
from pytest_safemanip.sim.robocasa.standins.models.cabinet_parts import HandleSize

REGISTRY = "fixtures/fixture_registry"
CATEGORIES = "objects/kitchen_objects.py"
REGISTRY_FOLDERS = {"aigen": "aigen_objs"}
"""Folder of an object registry, where it is not its name."""

PLAIN_TEXTURE = "textures/flat/gray.png"
"""What panels and handles have before RoboCasa retextures them."""

CONSTANTS = (
    "OBJ_CATEGORIES",
    "VISUAL_MESH_PANEL_PATH_REG",
    "VISUAL_MESH_ELONGATED_HANDLE_REG",
    "VISUAL_MESH_KNOB_HANDLE_REG",
)
"""Dictionaries in RoboCasa's source that say what is needed."""

COMPUTED = ("exclude",)
"""What RoboCasa computes in its table of categories; it concerns single official models only."""

_TEXTURE = re.compile(r"(?:generative_)?textures/[\w./-]+\.png")
_FILE = re.compile(r'file="([^"]+\.png)"')


@dataclass(frozen=True)
class Fixture:
    """A fixture model that a registry names.

    Attributes:
        path: folder (or file) of the model, relative to the assets.
        kind: name of the registry file: what it is.
        size: width, depth, height in metres that RoboCasa scales it to, where it does.
    """

    path: str
    kind: str
    size: PartialSize


@dataclass(frozen=True)
class ObjectFolder:
    """A folder with the models of a category.

    Attributes:
        path: relative to the assets.
        category: the category; of several that share the folder, the first.
        scale: what RoboCasa multiplies the models by, along x, y, z.
        nested: whether the models lie one folder deeper, in those of another category.
    """

    path: str
    category: str
    scale: Vec3
    nested: bool


@dataclass(frozen=True)
class Handle:
    """A cabinet handle.

    Attributes:
        path: of the model file, relative to the assets.
        is_knob: a knob rather than a bar.
        size: what the registry prescribes.
    """

    path: str
    is_knob: bool
    size: HandleSize


@dataclass(frozen=True)
class Needs:
    """The assets that RoboCasa needs; every list in a fixed order."""

    textures: Sequence[str]
    fixtures: Sequence[Fixture]
    panels: Sequence[str]
    handles: Sequence[Handle]
    objects: Sequence[ObjectFolder]


def read_needs(models: Path, assets: Path) -> Needs:
    """Read the assets that RoboCasa needs.

    Args:
        models: RoboCasa's package folder ``robocasa/models``.
        assets: the assets that ship with it.

    Raises:
        ConfigError: if a file is missing or is not in a form that is known here.
    """
    registries = {path.stem: load_yaml(path) for path in sorted((assets / REGISTRY).glob("*.yaml"))}
    if not registries:
        raise ConfigError(
            f"no fixture registry in {assets / REGISTRY}: this is not RoboCasa's assets folder"
        )
    sources = {path: path.read_text(encoding="utf-8") for path in source_files(models)}
    constants = literals.dictionaries(sources, CONSTANTS, COMPUTED)
    absent = sorted(set(CONSTANTS) - set(constants))
    if absent:
        raise ConfigError(
            f"{models} does not define {', '.join(absent)}: this RoboCasa is of a version that "
            "the stand-in assets do not know; use --safemanip-assets=official with its downloads"
        )
    sizes = _handle_sizes(registries.get("cabinet", {}))
    handles = [
        Handle(path, is_knob, sizes.get(name, HandleSize()))
        for table, is_knob in (
            ("VISUAL_MESH_ELONGATED_HANDLE_REG", False),
            ("VISUAL_MESH_KNOB_HANDLE_REG", True),
        )
        for name, path in sorted(constants[table].items())
    ]
    return Needs(
        textures=sorted(_textures(assets, sources.values()) | {PLAIN_TEXTURE}),
        fixtures=list(_fixtures(registries)),
        panels=sorted(constants["VISUAL_MESH_PANEL_PATH_REG"].values()),
        handles=handles,
        objects=list(_object_folders(constants["OBJ_CATEGORIES"])),
    )


def source_files(models: Path) -> list[Path]:
    """The Python files in which RoboCasa's models name assets."""
    # The assets lie in the same folder: up to 10 GB that must not be walked.
    return [
        path
        for folder in ("fixtures", "objects", "scenes")
        for path in sorted((models / folder).rglob("*.py"))
    ]


def load_yaml(path: Path) -> Any:
    """Parse a YAML file, with libyaml where it is there.

    Raises:
        ConfigError: if it is none.
    """
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        with path.open(encoding="utf-8") as file:
            return yaml.load(file, Loader=loader)  # noqa: S506 - both are safe loaders
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        why = " ".join(str(error).split())
        raise ConfigError(f"{path} is no YAML: {why}; download RoboCasa's assets again") from error


def _fixtures(registries: Mapping[str, Mapping[str, Any]]) -> Iterator[Fixture]:
    seen = set()
    for kind, registry in registries.items():
        default = registry.get("default") or {}
        for entry in registry.values():
            merged = {**default, **(entry or {})}
            path = merged.get("xml")
            if path is None or path in seen:
                continue
            seen.add(path)
            size = merged.get("size") or (None, None, None)
            yield Fixture(path, kind, (size[0], size[1], size[2]))


def _handle_sizes(cabinet: Mapping[str, Any]) -> dict[str, HandleSize]:
    sizes = {}
    for entry in cabinet.values():
        half = ((entry or {}).get("handle_config") or {}).get("half_size")
        if half is not None and "handle_type" in entry:
            sizes[entry["handle_type"]] = HandleSize(half[0], half[1])
    return sizes


def _textures(assets: Path, sources: Iterable[str]) -> set[str]:
    """Textures named in registries and source, and images that shipped models refer to."""
    found: set[str] = set()
    for text in sources:
        found.update(_TEXTURE.findall(text))
    for path in sorted((assets / REGISTRY).glob("*.yaml")):
        found.update(_TEXTURE.findall(path.read_text(encoding="utf-8")))
    for path in shipped_models(assets):
        folder = path.parent.relative_to(assets).as_posix()
        for name in _FILE.findall(path.read_text(encoding="utf-8")):
            found.add(posixpath.normpath(f"{folder}/{name}"))
    # One of RoboCasa's models points out of the folder, at a texture that it always replaces.
    return {path for path in found if not path.startswith("..")}


def shipped_models(assets: Path) -> list[Path]:
    """The model files that come with RoboCasa's source, not with its downloads."""
    patterns = (
        "arenas/*.xml",
        "fixtures/cabinets/*.xml",
        "fixtures/cabinets/cabinet_panels/*.xml",
        "fixtures/handles/*.xml",
        "fixtures/counters/*/*.xml",
        "fixtures/accessories/*/*/*.xml",
    )
    return [path for pattern in patterns for path in sorted(assets.glob(pattern))]


def _object_folders(categories: Mapping[str, Any]) -> Iterator[ObjectFolder]:
    seen = set()
    for category, entry in categories.items():
        for registry, options in entry.items():
            if not isinstance(options, dict):
                continue
            scale = options.get("scale", 1.0)
            x, y, z = scale if isinstance(scale, list | tuple) else (scale, scale, scale)
            home = REGISTRY_FOLDERS.get(registry, registry)
            nested = bool(entry.get("is_auxiliary_obj") or options.get("is_auxiliary_obj"))
            for folder in options.get("model_folders") or [f"{home}/{category}"]:
                key = (folder, nested)
                if key not in seen:
                    seen.add(key)
                    yield ObjectFolder(f"objects/{folder}", category, (x, y, z), nested)
