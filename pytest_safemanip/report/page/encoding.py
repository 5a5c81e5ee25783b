"""Arrays and text as the page's scripts read them."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import printable
from pytest_safemanip.metrics.fields import MAX_TOLD
from pytest_safemanip.report.lanes import spans_of

LEVELS = 65_535
"""Steps between the smallest and the largest value of a signal: more than a screen has pixels."""


def runs(values: NDArray[np.bool_]) -> list[int]:
    """Where values (T,) are true, run-length-coded: first and last step of each run, in a row."""
    return [step for span in spans_of(values) for step in span]


def changes(values: NDArray[Any]) -> list[int]:
    """Whole numbers (T,), run-length-coded: the step from which a value holds and the value, in a
    row.
    """
    starts = np.flatnonzero(np.diff(values.astype(np.int64), prepend=int(values[0]) - 1))
    return [int(number) for start in starts for number in (start, values[start])]


def packed(values: NDArray[np.floating[Any]]) -> dict[str, Any]:
    """Numbers (T,) as 16 bits each between their smallest and largest, in base64; NaN is 65535.

    Keys: ``low``, ``high``, ``data``.
    """
    known = np.isfinite(values)
    low = float(values[known].min()) if known.any() else 0.0
    high = float(values[known].max()) if known.any() else 0.0
    scale = (LEVELS - 1) / (high - low) if high > low else 0.0
    levels = np.full(len(values), LEVELS, "<u2")
    levels[known] = np.rint((values[known] - low) * scale)
    return {
        "low": float(f"{low:.6g}"),
        "high": float(f"{high:.6g}"),
        "data": base64.b64encode(levels.tobytes()).decode(),
    }


def told(content: Any) -> Any:
    """JSON with the texts of strangers made harmless for people: escapes instead of what moves a
    cursor or turns the direction of reading.
    """
    match content:
        case str():
            # Most is harmless, and looking at its letters one by one takes long.
            harmless = content.replace("\n", "").isprintable() and len(content) <= MAX_TOLD
            return content if harmless else printable(content, MAX_TOLD, lines=True)
        case dict():
            return {told(key): told(value) for key, value in content.items()}
        case list():
            return [told(item) for item in content]
    return content
