"""Sizes with their units, as people write them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from pytest_safemanip.errors import ConfigError, did_you_mean

UNITS: Mapping[str, tuple[str, float]] = {
    "m": ("length", 1.0),
    "cm": ("length", 0.01),
    "mm": ("length", 0.001),
    "rad": ("angle", 180.0 / math.pi),
    "deg": ("angle", 1.0),
    "s": ("time", 1.0),
    "ms": ("time", 0.001),
    "N s": ("impulse", 1.0),
    "mN s": ("impulse", 0.001),
    "%": ("share", 0.01),
}
"""Of each unit its quantity, and how much of the quantity it is: m, degrees, s, N s, 1."""
_SIZE = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(.*?)\s*")
DIGITS = 4
"""Of a size that is told: more than any of these quantities is set with."""


def parse_size(text: str, unit: str) -> float:
    """A size in a unit, from text in any unit of the same quantity: ``4 cm``, ``0.04 m``.

    Raises:
        ConfigError: if it is none; without the place that it stands in.
    """
    value, own = split_size(text)
    if own not in UNITS or UNITS[own][0] != UNITS[unit][0]:
        fitting = [name for name in UNITS if UNITS[name][0] == UNITS[unit][0]]
        hint = did_you_mean(own, fitting) if own else f"known: {', '.join(fitting)}"
        raise ConfigError(f"expected a number and a unit, as in '4 {unit}', found {text!r}; {hint}")
    return rounded(value * UNITS[own][1] / UNITS[unit][1])


def split_size(text: str) -> tuple[float, str]:
    """A number and what follows it.

    Raises:
        ConfigError: if it does not begin with a finite number.
    """
    match = _SIZE.fullmatch(text)
    try:
        value = float(match[1]) if match else math.nan
    except ValueError:
        value = math.nan
    if match is None or not math.isfinite(value):
        raise ConfigError(f"expected a number and a unit, found {text!r}")
    return value, " ".join(match[2].split())


def in_base(value: float, unit: str) -> float:
    """A size in m, degrees, s, N s or as a share of 1."""
    return value * UNITS[unit][1]


def quantity(unit: str) -> str:
    """What a unit is of: ``length``, ``angle``, ``time``, ``impulse`` or ``share``."""
    return UNITS[unit][0]


def rounded(value: float) -> float:
    """A size to so many digits that it is the same when it is written and read."""
    return float(f"{value:.{DIGITS}g}")


def show(value: float, unit: str) -> str:
    """A size as one writes it."""
    return f"{rounded(value):g} {unit}"
