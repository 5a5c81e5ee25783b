"""Prepares RoboCasa's assets: official ones, stand-ins, or a mix of both.

RoboCasa reads everything below one folder. Where some of it is missing, a folder of links and
generated files in the user's cache takes its place; nothing is ever written into RoboCasa's.
"""

from __future__ import annotations

import dataclasses
import hashlib
import importlib.util
import json
import logging
import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import filelock
import platformdirs

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.robocasa import downloads
from pytest_safemanip.sim.robocasa.standins import overlay, source
from pytest_safemanip.sim.robocasa.standins.catalogue import Item
from pytest_safemanip.sim.robocasa.standins.inventory import Inventory, Kind, generator_digest

Mode = Literal["auto", "official", "primitive"]

COMPLETE = "overlay.json"
"""Lies in every finished overlay and in no other."""

FOLDERS = ("arenas", "fixtures", "objects", "scenes", "textures")
"""What is in RoboCasa's folder of assets, if not everything."""
PATIENCE = 120.0
"""Seconds to wait for another process that builds the same."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Assets:
    """The assets that RoboCasa is to be run on.

    Attributes:
        root: what ``robocasa.models.assets_root`` is to be.
        kind: what they are.
        official: how many textures, models of fixtures and folders of objects are RoboCasa's own
            downloads.
        generated: how many are stand-ins.
        generic: what RoboCasa asks for and the stand-ins do not know; it has a plain shape.
        key: digest of all that decides their content, the same on every machine.
    """

    root: Path
    kind: Kind
    official: int
    generated: int
    generic: tuple[str, ...]
    key: str

    def describe(self) -> str:
        """One line for a report."""
        total = self.official + self.generated
        if self.kind == "official":
            line = f"RoboCasa's own assets ({total} textures and models)"
        elif self.kind == "primitive":
            line = f"primitive stand-ins ({total} textures and models)"
        else:
            line = (
                "RoboCasa's own assets with primitive stand-ins for "
                f"{self.generated} of {total} textures and models"
            )
        if self.generic:
            line += f"; of unknown shape: {', '.join(self.generic)}"
        return f"{line}, key {self.key[:12]}"


def cache_home() -> Path:
    """The folder of this package in the user's cache directory."""
    return Path(platformdirs.user_cache_dir("pytest-safemanip"))


def prepare_assets(package_root: Path, mode: Mode, cache_dir: Path | None = None) -> Assets:
    """Decide which assets RoboCasa is to use, and build what is missing.

    What was built is kept in the cache and found again by a stamp of RoboCasa's folders
    (:func:`overlay.stamp`), so that assets which are downloaded later are noticed.

    Args:
        package_root: RoboCasa's assets: ``robocasa/models/assets``, or the folder that
            ``ROBOCASA_ASSETS_PATH`` names.
        mode: ``official`` demands that everything is downloaded, ``primitive`` uses stand-ins
            even for what is, ``auto`` uses stand-ins for exactly what is missing.
        cache_dir: where to build; by default the user's cache directory.

    Raises:
        ConfigError: if assets are missing in mode ``official``, if a download was not unpacked in
            full, if RoboCasa's files cannot be found or read, or if the cache cannot be written.
    """
    models = _models_folder(package_root)
    shipped = models / "assets"
    roots = [package_root]
    if shipped.is_dir() and not shipped.samefile(package_root):
        roots.append(shipped)
    cache = (cache_dir or cache_home()).absolute() / "assets"
    _check_path(cache)
    try:
        memo = cache / "found" / f"{_stamp(mode, roots, models)}.json"
        assets = _recall(memo, cache)
        if assets is None:
            assets = _prepare(package_root, mode, cache, roots, models)
            _remember(memo, assets)
    except OSError as error:
        # What is written to RoboCasa's package has an error of its own; here something was read.
        raise ConfigError(
            f"RoboCasa's assets in {package_root} cannot be read: {error}; mend or remove that, or "
            "download them again"
        ) from error
    if assets.generic:
        logger.warning("no stand-in knows %s: a plain shape is used", ", ".join(assets.generic))
    return assets


def _prepare(
    package_root: Path, mode: Mode, cache: Path, roots: Sequence[Path], models: Path
) -> Assets:
    found = Inventory.take(models, roots, downloads=mode != "primitive")
    if mode == "official" and found.missing:
        raise ConfigError(_missing_message(found.missing, package_root))
    broken = downloads.incomplete(found.files, roots)
    if broken is not None:
        raise ConfigError(broken)
    root = package_root if found.is_whole(package_root) else _overlay(cache, roots, found, mode)
    return Assets(
        root.absolute(),
        found.kind,
        len(found.official),
        len(found.missing),
        tuple(sorted({item.unknown for item in found.missing if item.unknown})),
        found.key,
    )


def _models_folder(package_root: Path) -> Path:
    """RoboCasa's package folder ``robocasa/models``."""
    if not package_root.is_dir():
        raise ConfigError(
            f"RoboCasa's assets folder {package_root} is not a folder; check ROBOCASA_ASSETS_PATH "
            "or reinstall RoboCasa"
        )
    if any(package_root.iterdir()) and not any((package_root / name).is_dir() for name in FOLDERS):
        raise ConfigError(
            f"{package_root} is no folder of RoboCasa's assets: none of {', '.join(FOLDERS)} is in "
            "it; check ROBOCASA_ASSETS_PATH"
        )
    if (package_root / COMPLETE).is_file():
        raise ConfigError(
            f"{package_root} holds generated assets, not RoboCasa's own; unset ROBOCASA_ASSETS_PATH"
        )
    if (package_root.parent / source.CATEGORIES).is_file():
        return package_root.parent
    spec = importlib.util.find_spec("robocasa")
    if spec is None or not spec.submodule_search_locations:
        raise ConfigError("robocasa is not installed: its object categories cannot be read")
    return Path(next(iter(spec.submodule_search_locations))) / "models"


def _check_path(cache: Path) -> None:
    """RoboCasa cuts paths at certain words; none of them may be in the way to the overlay."""
    for word in ("textures/", "models/assets/"):
        if word in f"{cache.as_posix()}/":
            raise ConfigError(
                f"generated assets cannot be kept in {cache}: RoboCasa cannot read textures from a "
                f"path that contains {word!r}; choose another cache folder (XDG_CACHE_HOME)"
            )


def _stamp(mode: Mode, roots: Sequence[Path], models: Path) -> str:
    scenes = [file for root in roots for file in sorted((root / "scenes").glob("*/*/*.yaml"))]
    sources = source.source_files(models)
    text = f"{mode} {generator_digest()} {overlay.stamp(roots, [*scenes, *sources])}"
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _overlay(cache: Path, roots: Sequence[Path], found: Inventory, mode: Mode) -> Path:
    """The folder in the cache, built if it is not there."""
    # The links are absolute: two installations of the same RoboCasa must not share an overlay.
    places = "\n".join(str(root.absolute()) for root in roots)
    name = f"{found.key[:16]}-{hashlib.sha256(places.encode()).hexdigest()[:8]}"
    target = cache / name
    try:
        cache.mkdir(parents=True, exist_ok=True)
        with filelock.FileLock(cache / f"{name}.lock", timeout=PATIENCE):
            if not (target / COMPLETE).is_file():
                _build(target, roots, found, mode)
    except filelock.Timeout as error:
        raise ConfigError(
            f"another process has been building assets in {cache} for {PATIENCE:.0f} s; if none "
            f"is, delete {name}.lock there"
        ) from error
    except OSError as error:
        raise ConfigError(_unwritable_message(cache, error)) from error
    return target


def _build(target: Path, roots: Sequence[Path], found: Inventory, mode: Mode) -> None:
    """Build beside the target and move into place, so that a half-built one is never found."""
    scratch = target.with_name(f".{target.name}.building")
    shutil.rmtree(scratch, ignore_errors=True)
    shutil.rmtree(target, ignore_errors=True)
    scratch.mkdir()
    overlay.build(scratch, roots, found.official, found.missing, only_shipped=mode == "primitive")
    (scratch / COMPLETE).write_text(json.dumps({"key": found.key}) + "\n", encoding="utf-8")
    scratch.rename(target)


def _remember(memo: Path, assets: Assets) -> None:
    content = {**dataclasses.asdict(assets), "root": str(assets.root)}
    try:
        memo.parent.mkdir(parents=True, exist_ok=True)
        scratch = memo.with_suffix(f".{os.getpid()}")
        scratch.write_text(json.dumps(content) + "\n", encoding="utf-8")
        scratch.rename(memo)
    except OSError as error:
        if assets.kind == "official":
            logger.info("cannot remember the assets in %s: %s", memo, error)
            return
        raise ConfigError(_unwritable_message(memo.parent, error)) from error


def _recall(memo: Path, cache: Path) -> Assets | None:
    """The assets found by an earlier run, if they are still there."""
    try:
        content: dict[str, Any] = json.loads(memo.read_text(encoding="utf-8"))
        plain = {"root": Path(content["root"]), "generic": tuple(content["generic"])}
        assets = Assets(**{**content, **plain})
    except (OSError, ValueError, KeyError, TypeError):
        return None
    if assets.root.parent != cache:
        return assets if assets.root.is_dir() else None
    if not (assets.root / COMPLETE).is_file():
        return None
    if not os.access(assets.root, os.W_OK):
        raise ConfigError(_unwritable_message(assets.root, "RoboCasa writes scratch files there"))
    return assets


def _missing_message(missing: Sequence[Item], root: Path) -> str:
    groups: dict[str, list[str]] = {}
    for item in missing:
        groups.setdefault(item.group, []).append(item.path)
    parts = [
        f"{len(paths)} {group} ({', '.join(paths[:3])}{', ...' if len(paths) > 3 else ''})"
        for group, paths in groups.items()
    ]
    return (
        f"RoboCasa's downloaded assets are incomplete in {root}: missing are {'; '.join(parts)}. "
        f"Download them with: {downloads.COMMAND} ({downloads.SIZE}), or run with "
        "--safemanip-assets=auto"
    )


def _unwritable_message(folder: Path, reason: object) -> str:
    return (
        f"cannot write generated assets to {folder} ({reason}); make it writable, or choose "
        "another folder with the environment variable XDG_CACHE_HOME"
    )
