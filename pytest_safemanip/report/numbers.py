"""Numbers and lines as text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import wrap

from pytest_safemanip.errors import printable
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.statistics.intervals import Interval

MIN_WIDTH = 80
"""Columns that any terminal has."""


def counted(number: int, noun: str) -> str:
    """A number of things, in words: "1 case", "2 cases"."""
    ending = "es" if noun.endswith("ch") else "s"
    return f"{number} {noun}{'' if number == 1 else ending}"


def one_line(text: str) -> str:
    """Text of a file in one line, with escapes for what a terminal would take for a command."""
    return printable(" ".join(text.split()), 500)


def percent(value: float | None) -> str:
    """A share, or a dash where it is undefined."""
    return "-" if value is None else f"{value * 100:.1f} %"


def spread(bounds: Interval | None) -> str:
    """An interval of shares, or a dash where it is undefined."""
    return "-" if bounds is None else f"{bounds[0] * 100:.0f} to {bounds[1] * 100:.0f} %"


def share(rate: Rate) -> str:
    """The point estimate; without a hit also what it is below."""
    if rate.below is None:
        return percent(rate.value)
    digits = 1 if rate.below < 0.1 else 0
    return f"{percent(rate.value)} (< {rate.below * 100:.{digits}f} %)"


def fraction(rate: Rate) -> str:
    """What a rate was counted from."""
    return f"{rate.hits:g} of {rate.total}"


def aligned(rows: Iterable[Sequence[str]], left: int = 1) -> list[str]:
    """A table: the first columns to the left, the others to the right, two blanks in between.

    Cells of several lines stand on the lowest line of their row.
    """
    table = [line for row in rows for line in _lines(row)]
    widths = [max(len(row[n]) for row in table) for n in range(len(table[0]))]
    return [
        "  ".join(
            f"{cell:<{width}}" if n < left else f"{cell:>{width}}"
            for n, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in table
    ]


def blocks(
    labels: Sequence[str], columns: Sequence[Sequence[str]], width: int = MIN_WIDTH
) -> list[str]:
    """A table, cut into several with the same labels where it is wider than the terminal.

    Args:
        labels: the first column; cells may have several lines.
        columns: the others.
        width: columns of the terminal, not less than :data:`MIN_WIDTH`.
    """
    room = width - _widest(labels)
    found: list[list[Sequence[str]]] = [[]]
    left = room
    for cells in columns:
        left -= 2 + _widest(cells)
        if left < 0 and found[-1]:
            found.append([])
            left = room - 2 - _widest(cells)
        found[-1].append(cells)
    return [line for block in found for line in aligned(zip(labels, *block, strict=True))]


def fitted(line: str, width: int = MIN_WIDTH, indent: int = 0) -> list[str]:
    """A line of words, broken where the terminal ends; no word is.

    Args:
        line: the line; what it begins with keeps its blanks.
        width: columns of the terminal, not less than :data:`MIN_WIDTH`.
        indent: blanks before the later lines, beside those that the line begins with.
    """
    before = " " * (len(line) - len(line.lstrip()))
    return wrap(
        line.strip(),
        max(width, MIN_WIDTH),
        initial_indent=before,
        subsequent_indent=before + " " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    ) or [""]


def _widest(cells: Sequence[str]) -> int:
    return max(len(line) for cell in cells for line in cell.split("\n"))


def _lines(row: Sequence[str]) -> list[list[str]]:
    cells = [cell.split("\n") for cell in row]
    height = max(len(cell) for cell in cells)
    padded = [[""] * (height - len(cell)) + cell for cell in cells]
    return [list(line) for line in zip(*padded, strict=True)]
