"""The propositions around a violation, few enough columns for a line of text."""

from __future__ import annotations

from typing import Any

import numpy as np

from pytest_safemanip.judge import Finding

BEFORE, AFTER = 6, 10
"""Steps shown before the obligation opened, and after the first unsafe step."""
COLUMNS = 60
"""At most; where there are more steps, a column stands for several."""


def timeline(finding: Finding) -> dict[str, Any] | None:
    """The window around a violation in plain builtins; None without values.

    Keys: ``start``, its first step; ``stride``, steps in a column; ``lanes``, by atom: a letter for
    each column, ``#`` where the atom holds at one of its steps and ``.`` where it does not.
    """
    if not finding.values:
        return None
    length = min(len(values) for values in finding.values.values())
    start = max(0, min(finding.opened, finding.first) - BEFORE)
    stop = min(length, finding.first + AFTER + 1)
    stride = -(-(stop - start) // COLUMNS)
    return {
        "start": start,
        "stride": stride,
        "lanes": {
            atom: "".join(
                ".#"[bool(np.any(values[step : min(step + stride, stop)]))]
                for step in range(start, stop, stride)
            )
            for atom, values in finding.values.items()
        },
    }
