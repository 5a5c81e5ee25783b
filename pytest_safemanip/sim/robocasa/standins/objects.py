"""Stand-ins for RoboCasa's object categories, from the table ``sizes.yaml``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.sim.robocasa.standins import solids
from pytest_safemanip.sim.robocasa.standins.elements import Vec3
from pytest_safemanip.sim.robocasa.standins.mjcf import Model
from pytest_safemanip.sim.robocasa.standins.models import vessels
from pytest_safemanip.sim.robocasa.standins.paint import PAINTS, Paint
from pytest_safemanip.sim.robocasa.standins.source import load_yaml

TABLE = "sizes.yaml"
UPRIGHT = "upright"
SAME_AS = "same_as "

SHAPES: dict[str, Callable[[Model, Vec3, float, Paint], None]] = {
    "ball": solids.ball,
    "pod": solids.pod,
    "block": solids.block,
    "log": solids.log,
    "can": solids.can,
    "bottle": solids.bottle,
    "tool": solids.tool,
    "turner": solids.turner,
    "kettle": solids.kettle,
    "board": solids.board,
    "lid": solids.lid,
    "bowl": vessels.bowl,
    "lugged": vessels.lugged,
    "mug": vessels.mug,
    "pan": vessels.pan,
    "colander": vessels.colander,
    "pot": vessels.pot,
    "goblet": vessels.goblet,
    "tray": vessels.tray,
    "bin": vessels.bin_with_lug,
    "basket": vessels.basket,
}

ROUND = ("ball", "pod")
"""Shapes that can roll."""

FACTORS = (0.96, 1.00, 1.04, 0.94, 0.98, 1.02)
"""Sizes of a category's instances relative to the table, in the order of their names.

RoboCasa takes the first half for pretraining and the rest for evaluation: both get small and big.
"""


@dataclass(frozen=True)
class Row:
    """What the stand-in of a category looks like.

    Attributes:
        shape: key of ``SHAPES``.
        size: length, width, height in metres.
        kg: mass in kilograms.
        paint: colour.
        upright: whether a second model stands on its edge.
    """

    shape: str
    size: Vec3
    kg: float
    paint: Paint
    upright: bool = False


UNKNOWN = Row("block", (0.06, 0.06, 0.06), 0.15, PAINTS["pink"])
"""For categories of a RoboCasa that is newer than the table."""


@cache
def table() -> Mapping[str, Row]:
    """The rows by category.

    Raises:
        ConfigError: if the table has a mistake.
    """
    return read_table(load_yaml(Path(__file__).with_name(TABLE)))


def read_table(raw: Mapping[str, Any]) -> dict[str, Row]:
    """The rows of a parsed table.

    Raises:
        ConfigError: if a row is not of the form that the table's head describes.
    """
    rows = {name: _row(name, cells) for name, cells in raw.items() if isinstance(cells, list)}
    for name, cells in raw.items():
        if name in rows:
            continue
        other = str(cells).removeprefix(SAME_AS)
        if other not in rows:
            raise ConfigError(
                f"{TABLE}: row {name!r} is to be the same as {other!r}, which has no row of its "
                f"own; {did_you_mean(other, rows)}"
            )
        rows[name] = rows[other]
    return rows


def _row(name: str, cells: list[Any]) -> Row:
    try:
        shape, x, y, z, kg, paint, *flags = cells
        row = Row(shape, (float(x), float(y), float(z)), float(kg), PAINTS[paint], UPRIGHT in flags)
    except (ValueError, KeyError) as error:
        raise ConfigError(
            f"{TABLE}: row {name!r} is not [shape, x, y, z, kg, colour]: {cells} ({error})"
        ) from error
    if shape not in SHAPES:
        raise ConfigError(
            f"{TABLE}: row {name!r} has the unknown shape {shape!r}; {did_you_mean(shape, SHAPES)}"
        )
    return row


def object_model(row: Row, factor: float, scale: Vec3, *, upright: bool = False) -> Model:
    """An object.

    Frame: origin in its middle (of a vessel: without handles; of a lid: the plane that lies on the
    rim), z up as it stands. RoboCasa needs the region ``bbox`` and the site ``anchor_site``.

    Args:
        row: what it looks like.
        factor: its size relative to the row.
        scale: what RoboCasa is going to multiply the model by, along x, y and z.
        upright: standing on its edge, thin along x.
    """
    x, y, z = (side * factor for side in row.size)
    size = (z, x, y) if upright else (x, y, z)
    model = Model(stretch=(1 / scale[0], 1 / scale[1], 1 / scale[2]))
    SHAPES[row.shape](model, size, row.kg * factor**3, row.paint)
    centre, half = model.extent
    model.region("bbox", centre, half)
    model.anchor((0.0, 0.0, size[2] / 2))
    return model
