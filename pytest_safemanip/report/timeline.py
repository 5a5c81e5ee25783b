"""The timeline of a violation as text and as a picture."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any

HELD, NOT_HELD = "█", "·"
MARK = "▲"
MAX_LANES = 12
_COLUMN, _LANE, _LETTER = 10, 22, 8
"""Pixels: width of a column, height of a lane, width of a letter."""
_BLUE, _GREY, _RED = "#0072b2", "#d9d9d9", "#d55e00"
"""Colours that are told apart with any colour vision."""


def timeline_lines(timeline: Mapping[str, Any], first: int) -> list[str]:
    """A lane of characters for each proposition, and a mark below the first unsafe step.

    Args:
        timeline: see :func:`~pytest_safemanip.run.timeline.timeline`.
        first: the first unsafe step.
    """
    lanes = dict(list(timeline["lanes"].items())[:MAX_LANES])
    if not lanes:
        return []
    start, stride = timeline["start"], timeline["stride"]
    width = max(map(len, lanes))
    column = min((first - start) // stride, len(next(iter(lanes.values()))) - 1)
    scale = f", {stride} steps in a column" if stride > 1 else ""
    return [
        *(
            f"{name:<{width}}  {lane.replace('#', HELD).replace('.', NOT_HELD)}"
            for name, lane in lanes.items()
        ),
        f"{'':<{width}}  {' ' * max(column, 0)}{MARK}",
        f"{'':<{width}}  from step {start}{scale}; {MARK} first unsafe step {first}",
    ]


def timeline_svg(timeline: Mapping[str, Any], first: int, title: str) -> str:
    """The same as a picture, of some kilobytes, for reports that show pictures.

    Args:
        timeline: see :func:`~pytest_safemanip.run.timeline.timeline`.
        first: the first unsafe step.
        title: what is above it; any text.
    """
    lanes = dict(list(timeline["lanes"].items())[:MAX_LANES])
    start, stride = timeline["start"], timeline["stride"]
    left = 12 + _LETTER * max(map(len, lanes), default=0)
    columns = max(map(len, lanes.values()), default=1)
    width, height = max(left + _COLUMN * columns + 12, 360), 34 + _LANE * len(lanes) + 24
    mark = left + _COLUMN * min(max((first - start) // stride, 0), columns - 1)
    bottom = 34 + _LANE * len(lanes)
    parts = [_text(8, 20, title)]
    for row, (name, lane) in enumerate(lanes.items()):
        top = 34 + _LANE * row
        parts.append(_text(8, top + 13, name))
        parts += [
            f'<rect x="{left + _COLUMN * n}" y="{top + 2}" width="{_COLUMN - 1}" '
            f'height="{_LANE - 6}" fill="{_BLUE if letter == "#" else _GREY}"/>'
            for n, letter in enumerate(lane)
        ]
    parts.append(
        f'<rect x="{mark - 1}" y="28" width="{_COLUMN + 1}" height="{bottom - 28}" fill="none" '
        f'stroke="{_RED}" stroke-width="2"/>'
    )
    scale = f", {stride} steps in a column" if stride > 1 else ""
    parts.append(_text(8, bottom + 16, f"from step {start}{scale}; unsafe from step {first}"))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}"><rect width="100%" height="100%" fill="#ffffff"/>'
        f"{''.join(parts)}</svg>\n"
    )


def _text(x: int, y: int, text: str) -> str:
    return (
        f'<text x="{x}" y="{y}" font-family="monospace" font-size="12" fill="#000000">'
        f"{html.escape(text)}</text>"
    )
