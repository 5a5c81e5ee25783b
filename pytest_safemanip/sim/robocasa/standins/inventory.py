"""What RoboCasa asks for, and what of it is there."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pytest_safemanip.sim.robocasa.standins import catalogue, overlay, source
from pytest_safemanip.sim.robocasa.standins.catalogue import Item

Kind = Literal["official", "primitive", "mixed"]


@dataclass(frozen=True)
class Inventory:
    """What RoboCasa asks for, sorted by whether it is there.

    Attributes:
        official: downloaded items that are used.
        files: their models and textures, relative to the assets.
        missing: items to be generated.
        shipped: items that come with RoboCasa's source.
        key: digest of all that decides the content of the assets.
    """

    official: Sequence[Item]
    files: Sequence[str]
    missing: Sequence[Item]
    shipped: Sequence[Item]
    key: str

    @classmethod
    def take(cls, models: Path, roots: Sequence[Path], *, downloads: bool = True) -> Inventory:
        """Look for everything.

        Args:
            models: RoboCasa's package folder ``robocasa/models``.
            roots: folders of assets; the first that has a thing wins.
            downloads: whether what was downloaded is to be used.
        """
        home = next((root for root in roots if (root / source.REGISTRY).is_dir()), roots[-1])
        needs = source.read_needs(models, home)
        official: list[Item] = []
        missing: list[Item] = []
        shipped: list[Item] = []
        there: list[str] = []
        contents: list[str] = []
        for item in catalogue.items(needs):
            found = ((root, item.files_in(root)) for root in roots)
            root, files = next((place for place in found if place[1]), (roots[-1], []))
            if files and overlay.is_shipped(item.path):
                shipped.append(item)
            elif files and downloads:
                official.append(item)
                there += files
                contents += [f"{file} {overlay.model_digest(root / file)}" for file in files]
            else:
                missing.append(item)
        content = {
            "generator": generator_digest(),
            "needs": dataclasses.asdict(needs),
            "shipped": overlay.content_digest(roots),
            "official": contents,
        }
        key = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
        return cls(official, there, missing, shipped, key)

    @property
    def kind(self) -> Kind:
        """What the assets are that are made of this."""
        if not self.missing:
            return "official"
        return "mixed" if self.official else "primitive"

    def is_whole(self, root: Path) -> bool:
        """Whether everything is in this one folder."""
        return (
            not self.missing
            and all((root / top).is_dir() for top in ("arenas", "scenes", source.REGISTRY))
            and all(item.files_in(root) for item in (*self.official, *self.shipped))
        )


@functools.cache
def generator_digest() -> str:
    """Digest of the code and the table that make the stand-ins."""
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parent.rglob("*.*")):
        if file.suffix in (".py", ".yaml"):
            digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()
