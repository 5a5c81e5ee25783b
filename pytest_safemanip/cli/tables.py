"""Tables as wide as the terminal."""

from __future__ import annotations

import json
import shutil
import textwrap
from collections.abc import Sequence
from typing import Any

GAP = "  "
LEAST = 28
"""Columns that the last cells need to stand beside the others."""


def print_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print rows under headings; see :func:`table_lines`."""
    print("\n".join(table_lines(headings, rows, terminal_width())))


def print_json(content: Any) -> None:
    """Print plain builtins for machines."""
    print(json.dumps(content, indent=1))


def print_wrapped(text: str, indent: str = "") -> None:
    """Print a paragraph, its later lines indented."""
    print("\n".join(_wrapped(text, terminal_width(), later=indent)))


def terminal_width() -> int:
    """Columns of the terminal; 80 where there is none, or as ``COLUMNS`` says."""
    return shutil.get_terminal_size().columns


def table_lines(headings: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[str]:
    """A table whose last column is wrapped; all other cells are complete.

    Where there is no room for the last column beside the others, each row is a paragraph.

    Args:
        headings: of the columns.
        rows: cells; the last one of each may have several lines.
        width: columns of the terminal.
    """
    table = [headings, *rows]
    widths = [max(len(row[n]) for row in table) for n in range(len(headings) - 1)]
    indent = sum(widths) + len(GAP) * len(widths)
    longest = max(len(line) for row in table for line in row[-1].split("\n"))
    if width - indent < min(LEAST, longest):
        return [line for row in rows for line in _paragraph(headings, row, width)]
    lines = []
    for row in table:
        cells = [f"{cell:<{size}}" for cell, size in zip(row[:-1], widths, strict=True)]
        first, *others = _wrapped(row[-1], width - indent)
        lines.append(GAP.join([*cells, first]).rstrip())
        lines += [f"{' ' * indent}{other}".rstrip() for other in others]
    return lines


def _paragraph(headings: Sequence[str], row: Sequence[str], width: int) -> list[str]:
    """A row as text; a number alone would be read as one of the cell before it."""
    name, *middle, last = row
    named = zip(headings[1:-1], middle, strict=True)
    cells = [f"{title} {cell}" if cell[:1].isdecimal() else cell for title, cell in named]
    about = ", ".join(filter(None, cells))
    text = "\n".join(cell for cell in (about, last) if cell)
    return [name, *_wrapped(text, width, "    ", "    ")]


def _wrapped(text: str, width: int, first: str = "", later: str = "") -> list[str]:
    """The lines of a text of several lines; no word is broken."""
    wrapper = textwrap.TextWrapper(
        max(width, 20),
        initial_indent=first,
        subsequent_indent=later,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line for part in text.split("\n") for line in wrapper.wrap(part) or [""]]
