"""What all figures look like: legible in black and white, and whatever colours one sees."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

from pytest_safemanip.errors import ConfigError, install_command, printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pytest_safemanip.report.lanes import Span

HOLDS, UNSAFE, LIMIT, TAIL = "#0072b2", "#d55e00", "#000000", "#e6e6e6"
"""Of Okabe and Ito's colours; each comes with a hatch, a dash or a place of its own."""
HATCH = "////"
NARROWEST = 0.012
"""Width of what is unsafe for a moment, of that of the axis."""
WIDTH = 8.0
"""Of a figure, inches."""
RESOLUTION = 120
"""Of a figure in a notebook, pixels per inch."""


def new_figure(height: float) -> Figure:
    """A figure that shows itself in notebooks and is not kept by pyplot.

    Args:
        height: inches.

    Raises:
        ConfigError: if matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ConfigError(
            f"figures are drawn with matplotlib: {install_command('plots')} ({error})"
        ) from error

    class Shown(Figure):
        def _repr_png_(self) -> bytes:
            target = io.BytesIO()
            self.savefig(target, format="png", dpi=RESOLUTION)
            return target.getvalue()

    return Shown(figsize=(WIDTH, height), layout="constrained")


def plain(text: str) -> str:
    """Text of a stranger, which is neither a control sequence nor a formula of TeX."""
    return printable(text, 80).replace("$", r"\$")


def draw_lanes(
    axes: Axes, labels: Sequence[str], spans: Sequence[Sequence[Span]], period: float
) -> None:
    """Draw when some things hold, one below the other, over time in seconds.

    Args:
        axes: where.
        labels: of the lanes.
        spans: the steps at which each holds.
        period: control period, s.
    """
    for row, own in enumerate(spans):
        bars = [(first * period, (last + 1 - first) * period) for first, last in own]
        axes.broken_barh(bars, (row - 0.35, 0.7), facecolors=HOLDS, edgecolors=HOLDS, linewidth=0.8)
    label_rows(axes, labels)


def draw_unsafe(axes: Axes, row: int, spans: Sequence[Span], period: float) -> None:
    """Draw unsafe steps in a lane: hatched, so that they differ without colours, and never too
    narrow to be seen.
    """
    least = NARROWEST * axes.get_xlim()[1]
    bars = [(a * period, max((b + 1 - a) * period, least)) for a, b in spans]
    axes.broken_barh(
        bars, (row - 0.35, 0.7), facecolors="white", edgecolors=UNSAFE, hatch=HATCH, linewidth=1.4
    )


def draw_tail(axes: Axes, acting: int, length: int, period: float) -> None:
    """Shade the settle tail."""
    if acting < length:
        axes.axvspan(acting * period, length * period, color=TAIL, zorder=0, linewidth=0)


def label_rows(axes: Axes, labels: Sequence[str]) -> None:
    """Name the lanes, the first on top."""
    axes.set_yticks(range(len(labels)), [plain(label) for label in labels])
    axes.set_ylim(len(labels) - 0.4, -0.6)
    axes.grid(axis="x", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.tick_params(axis="y", length=0)
