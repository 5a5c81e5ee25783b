"""What gates and the comparison with a baseline decided, as a summary tells it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pytest_safemanip.errors import printable
from pytest_safemanip.metrics.fields import MAX_TOLD, Fields

Json = dict[str, Any]
MAX_ROWS = 5_000
"""Gates, comparisons and flips that are shown, of each."""
_GATE = ("name", "policy", "gate", "verdict", "basis", "why")
_COMPARISON = ("policy", "name", "kind", "verdict", "why")
_FIGURES = ("before", "now", "difference", "p_worse", "p_better", "detectable")
_FLIP = ("policy", "task", "property", "category")


def read_release(place: str, found: object) -> Json | None:
    """The decisions, or None if the run had neither a gate nor a baseline.

    Keys: ``gates``, ``baseline`` (``place``, ``policies``, ``comparisons``, ``flips``,
    ``unpaired``, ``absent``, ``earlier``) or None, ``refused``.

    Args:
        place: of the document, for messages.
        found: its ``release``.

    Raises:
        ConfigError: naming the file, what is wrong in it and where.
    """
    if found is None:
        return None
    release = Fields(f"{place}: release", found)
    baseline = release.values.get("baseline")
    return {
        "gates": [_gate(gate) for gate in release.fields("gates")[:MAX_ROWS]],
        "refused": release.told("refused", empty=True),
        "baseline": None if baseline is None else _baseline(release.section("baseline")),
    }


def _gate(gate: Fields) -> Json:
    return {
        **_texts(gate, _GATE),
        "required": gate.boolean("required"),
        "value": finite(gate, "value"),
        "hits": finite(gate, "hits"),
        "total": finite(gate, "total"),
        "interval": _interval(gate, "interval"),
    }


def _baseline(baseline: Fields) -> Json:
    return {
        "place": baseline.told("place"),
        "policies": baseline.facts("policies"),
        "unpaired": baseline.count("unpaired"),
        **{key: _counted(baseline, key) for key in ("absent", "earlier")},
        "comparisons": [_comparison(own) for own in baseline.fields("comparisons")[:MAX_ROWS]],
        "flips": [
            {**_texts(own, _FLIP), "seed": own.count("seed"), "regressed": own.boolean("regressed")}
            for own in baseline.fields("flips")[:MAX_ROWS]
        ],
    }


def _comparison(own: Fields) -> Json:
    pairs = own.section("pairs")
    return {
        **_texts(own, _COMPARISON),
        "required": own.boolean("required"),
        "pairs": {name: pairs.count(name) for name in ("both", "fixed", "regressed", "neither")},
        "interval": _interval(own, "newcombe90"),
        **{name: finite(own, name) for name in _FIGURES},
        "triggered": _interval(own, "triggered"),
    }


def _counted(own: Fields, key: str) -> int:
    """A number of things, 0 of an earlier version's summary that does not have it."""
    return own.count(key) if key in own.values else 0


def _texts(own: Fields, names: tuple[str, ...]) -> Mapping[str, str]:
    return {name: printable(own.text(name, empty=True), MAX_TOLD) for name in names}


def finite(own: Fields, key: str) -> float | None:
    """A finite number of either sign, or None.

    Raises:
        ConfigError: if it is anything else.
    """
    value = own.values.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e12:
        raise own.expected(key, "a number or null")
    return float(value)


def _interval(own: Fields, key: str) -> list[float] | None:
    value = own.values.get(key)
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != 2:
        raise own.expected(key, "two numbers or null")
    bounds = [finite(Fields(own.place, {key: bound}), key) for bound in value]
    if None in bounds:
        raise own.expected(key, "two numbers or null")
    return [bound for bound in bounds if bound is not None]
