"""Everything that stand-ins can be made of: one item for each thing that RoboCasa asks for."""

from __future__ import annotations

import logging
import posixpath
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from pytest_safemanip.sim.robocasa.standins import objects
from pytest_safemanip.sim.robocasa.standins.fixtures import (
    BLENDER,
    KINDS,
    LIDS,
    UNKNOWN,
    fill,
)
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models import blenders, cabinet_parts, fridges, sinks
from pytest_safemanip.sim.robocasa.standins.paint import png, texture_colour
from pytest_safemanip.sim.robocasa.standins.source import (
    PLAIN_TEXTURE,
    Fixture,
    Handle,
    Needs,
    ObjectFolder,
)

MODEL = "model.xml"
UPRIGHT_MODEL = "model_upright.xml"
EVERY_NTH_SINK_IS_DOUBLE = 3

PAIRED = ("oil_bottle", "salt_shaker")
"""Registries of things whose anchor is for a twin of the same height that stands beside them."""

Files = Mapping[str, str | bytes]

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Item:
    """One thing that RoboCasa asks for.

    Attributes:
        group: what to call such things in a message.
        path: of the file, or of the folder with the models, relative to the assets.
        make: the content of its files, by path relative to the assets.
        depth: how many folders below ``path`` its models lie; -1: ``path`` is the file itself.
        unknown: what it is, if nothing here knows it and it gets a generic shape.
    """

    group: str
    path: str
    make: Callable[[], Files]
    depth: int = -1
    unknown: str | None = None

    def files_in(self, root: Path) -> list[str]:
        """Its files below a root, relative to that; of a folder the models. Empty: missing."""
        place = root / self.path
        if self.depth < 0:
            return [self.path] if place.is_file() else []
        if not place.is_dir():
            return []
        pattern = "/".join([*["*"] * self.depth, MODEL])
        return sorted(found.relative_to(root).as_posix() for found in place.glob(pattern))


def items(needs: Needs) -> Iterator[Item]:
    """One item for each need."""
    for path in needs.textures:
        yield Item("textures", path, partial(_texture, path))
    for path in needs.panels:
        yield Item("fixtures", path, partial(_panel, path))
    for handle in needs.handles:
        yield Item("fixtures", handle.path, partial(_handle, handle))
    yield from _object_items(needs)
    yield from _fixture_items(needs)


def _texture(path: str) -> Files:
    return {path: png(texture_colour(path))}


def _panel(path: str) -> Files:
    return {path: cabinet_parts.panel(_up_to_plain(path)).to_xml()}


def _handle(handle: Handle) -> Files:
    texture = _up_to_plain(handle.path)
    if handle.is_knob:
        model = cabinet_parts.knob_handle(texture)
    else:
        model = cabinet_parts.bar_handle(texture, handle.size)
    return {handle.path: model.to_xml()}


def _up_to_plain(path: str) -> str:
    return posixpath.relpath(PLAIN_TEXTURE, posixpath.dirname(path))


def _object_items(needs: Needs) -> Iterator[Item]:
    table = objects.table()
    homes = {folder.path: folder for folder in needs.objects if not folder.nested}
    for folder in needs.objects:
        known = folder.category in table
        row = table.get(folder.category, objects.UNKNOWN)
        # Lids lie in the folders of their pans: it is the pan's instances that name them.
        stem = homes[folder.path].category if folder.nested else folder.category
        yield Item(
            f"{folder.path.split('/')[1]} objects",
            folder.path,
            partial(_instances, folder, row, stem),
            depth=2 if folder.nested else 1,
            unknown=None if known else folder.category,
        )


def _instances(folder: ObjectFolder, row: objects.Row, stem: str) -> Files:
    files: dict[str, str | bytes] = {}
    for index, factor in enumerate(objects.FACTORS):
        place = f"{folder.path}/{stem}_standin{index}" + ("/lid" if folder.nested else "")
        files[f"{place}/{MODEL}"] = objects.object_model(row, factor, folder.scale).to_xml()
        if row.upright:
            upright = objects.object_model(row, factor, folder.scale, upright=True)
            files[f"{place}/{UPRIGHT_MODEL}"] = upright.to_xml()
    return files


def _fixture_items(needs: Needs) -> Iterator[Item]:
    folders = {folder.path: folder for folder in needs.objects if not folder.nested}
    lid_widths = {
        posixpath.dirname(fixture.path): fixture.size[0] or LIDS[fixture.kind][0]
        for fixture in needs.fixtures
        if fixture.kind in LIDS
    }
    all_sinks = [fixture for fixture in needs.fixtures if fixture.kind == "sink"]
    double = set(all_sinks[EVERY_NTH_SINK_IS_DOUBLE - 1 :: EVERY_NTH_SINK_IS_DOUBLE])
    for fixture in needs.fixtures:
        home = folders.get(posixpath.dirname(fixture.path))
        unknown = None
        if fixture.kind in KINDS or fixture.kind in LIDS or fixture.kind == "blender":
            basins = 2 if fixture in double else 1
            width = lid_widths.get(fixture.path)
            build = _fixture_builder(
                fixture, width, basins, posixpath.basename(fixture.path) == fridges.ROOMY
            )
        elif home is not None:
            build = partial(_named_object, fixture, home, lid_widths.get(fixture.path))
        else:
            unknown = fixture.kind
            build = partial(UNKNOWN.build, fill(fixture.size, UNKNOWN.size))
        is_file = fixture.path.endswith(".xml")
        file = fixture.path if is_file else f"{fixture.path}/{MODEL}"
        yield Item("fixtures", file, partial(_single, file, build), unknown=unknown)


def _fixture_builder(
    fixture: Fixture, lid_width: float | None, basins: int, roomy: bool
) -> Callable[[], Model]:
    """What makes a fixture of a known kind; some need more than a size."""
    if fixture.kind in LIDS:
        width, kg = LIDS[fixture.kind]
        return partial(blenders.lid, fixture.size[0] or width, kg=kg)
    if fixture.kind == "blender":
        width = LIDS["blender_lid"][0] if lid_width is None else lid_width
        return partial(blenders.blender, fill(fixture.size, BLENDER), lid_width=width)
    kind = KINDS[fixture.kind]
    size = fill(fixture.size, kind.size)
    if fixture.kind == "sink":
        return partial(sinks.sink, size, basins=basins)
    if roomy:
        return partial(fridges.side_by_side, size, roomy=True)
    return partial(kind.build, size)


def _single(file: str, build: Callable[[], Model]) -> Files:
    return {file: build().to_xml()}


def _named_object(fixture: Fixture, home: ObjectFolder, lid_width: float | None) -> Model:
    """An object that a registry uses as a fixture too, such as a jar on the counter."""
    row = objects.table().get(home.category, objects.UNKNOWN)
    if lid_width is not None:
        width = blenders.LID_OVERHANG * lid_width
        row = replace(row, size=(width, width, fixture.size[2] or row.size[2]))
    model = objects.object_model(row, 1.0, home.scale)
    if fixture.kind in PAIRED:
        model.anchor((1.3 * row.size[0], 0.0, 0.0))
    return model
