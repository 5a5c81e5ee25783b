"""The picture below the scene: propositions over time, drawn once, with a cursor that moves."""

from __future__ import annotations

from typing import Any

import numpy as np

from pytest_safemanip.report.lanes import Span
from pytest_safemanip.video.imaging import Image, pillow
from pytest_safemanip.video.storyboard import Storyboard

ROW = 15
"""Height of a lane, pixels."""
AXIS = 18
"""Height of the axis, pixels."""
LABELS = 0.36
"""The labels' share of the width."""
MARGIN = 8
UNSAFE_WIDTH = 8
"""Of what is unsafe for a moment, pixels."""
TICKS = (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500)
"""Distances between the axis's ticks, s; about eight are drawn."""
HOLDS, UNSAFE, TAIL, INK, CURSOR = "#27598f", "#c22b1e", "#ececec", "#222222", (0, 0, 0)
"""Legible without colours too: what is unsafe is hatched and framed."""


class LanePicture:
    """The lanes of a storyboard.

    Args:
        board: the storyboard.
        width: pixels.
    """

    def __init__(self, board: Storyboard, width: int) -> None:
        self._board = board
        self._names = list(dict.fromkeys(name for name, _ in board.violations))
        self._left, self._right = round(LABELS * width), width - MARGIN
        rows = len(board.lanes) + len(self._names)
        self._bottom = MARGIN // 2 + ROW * rows
        drawn = pillow()
        picture = drawn.Image.new("RGB", (width, self._bottom + AXIS), "white")
        self._pen = drawn.ImageDraw.Draw(picture)
        self._font = drawn.ImageFont.load_default(11)
        self._draw()
        self._still: Image = np.asarray(picture)

    @property
    def height(self) -> int:
        """Pixels."""
        return int(self._still.shape[0])

    def at(self, step: int) -> Image:
        """The picture (h, w, 3) with the cursor at a step."""
        picture = self._still.copy()
        x = self._x(step + 0.5)
        picture[: self._bottom + 3, x - 2 : x + 3] = (
            255 - (255 - picture[: self._bottom + 3, x - 2 : x + 3]) // 2
        )
        picture[: self._bottom + 3, x - 1 : x + 1] = CURSOR
        return picture

    def _x(self, step: float) -> int:
        """Where a step begins."""
        return round(self._left + (self._right - self._left) * step / self._board.length)

    def _draw(self) -> None:
        board, pen = self._board, self._pen
        if board.acting < board.length:
            pen.rectangle((self._x(board.acting), 0, self._right, self._bottom), fill=TAIL)
        self._axis()
        for row, lane in enumerate(board.lanes):
            self._label(row, lane.label, INK)
            for span in lane.spans:
                pen.rectangle(self._box(row, span), fill=HOLDS)
        for row, name in enumerate(self._names, start=len(board.lanes)):
            self._label(row, f"unsafe: {name}", UNSAFE)
            own = [span for found, span in board.violations if found == name]
            for span in own:
                self._hatch(self._box(row, span, UNSAFE_WIDTH))
            self._step(row, own[0][0])
        for _, (first, _) in board.violations[:1]:
            x = self._x(first)
            pen.line((x, 0, x, self._bottom), fill=UNSAFE, width=1)

    def _axis(self) -> None:
        board, y = self._board, self._bottom
        seconds = board.length * board.period
        gap = next((t for t in TICKS if seconds / t <= 8), TICKS[-1])
        self._pen.line((self._left, y, self._right, y), fill=INK)
        for tick in range(int(seconds / gap) + 1):
            x = self._x(tick * gap / board.period)
            self._pen.line((x, y, x, y + 3), fill=INK)
            self._text((x, y + 3), f"{tick * gap:g} s", INK, "ma" if tick else "la")

    def _label(self, row: int, text: str, colour: str) -> None:
        y = MARGIN // 2 + ROW * row
        self._pen.line((self._left, y + ROW - 1, self._right, y + ROW - 1), fill="#d0d0d0")
        self._text((self._left - 6, y + 1), text, colour, "ra")

    def _step(self, row: int, step: int) -> None:
        """Write at which step something became unsafe, where there is room."""
        y, x = MARGIN // 2 + ROW * row + 1, self._x(step)
        right = x < (self._left + self._right) // 2
        place = x + 2 * UNSAFE_WIDTH if right else x - 4
        self._text((place, y), f"from step {step}", UNSAFE, "la" if right else "ra")

    def _box(self, row: int, span: Span, least: int = 3) -> tuple[int, int, int, int]:
        """Of a span, at least so many pixels wide."""
        y, x = MARGIN // 2 + ROW * row, self._x(span[0])
        return x, y + 2, max(self._x(span[1] + 1) - 1, x + least - 1), y + ROW - 3

    def _hatch(self, box: tuple[int, int, int, int]) -> None:
        x0, y0, x1, y1 = box
        self._pen.rectangle(box, fill="white", outline=UNSAFE)
        for x in range(x0 - (y1 - y0), x1, 4):
            above, below = max(x, x0), min(x + y1 - y0, x1)
            self._pen.line((above, y0 + above - x, below, y0 + below - x), fill=UNSAFE)

    def _text(self, place: tuple[int, int], text: str, colour: str, anchor: str) -> Any:
        self._pen.text(place, text, fill=colour, font=self._font, anchor=anchor)
