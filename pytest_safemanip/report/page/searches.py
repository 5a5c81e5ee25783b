"""What searches found, as a summary tells it, for the page."""

from __future__ import annotations

from typing import Any

from pytest_safemanip.errors import printable
from pytest_safemanip.metrics.fields import MAX_TOLD, Fields
from pytest_safemanip.metrics.searches.records import read_searches
from pytest_safemanip.report.page.release import finite
from pytest_safemanip.search.units import show

Json = dict[str, Any]
MAX_SEARCHES, MAX_TRIALS, MAX_REGIONS = 1_000, 2_000, 100
"""Searches that are shown, and of each the trials and, of each dimension, the regions."""
BOUND = 1.0
"""Margins beyond are drawn as this: 1 is all that a threshold has."""


def searches(whole: Fields) -> list[Json]:
    """A row for each search, those that found something first.

    Keys: ``policy``, ``task``, ``property``, ``over``, ``rollouts``, ``trials``, ``refused``,
    ``seeds``, ``violated_plain``, ``failure`` (None, or ``sentence``, ``found_at``, ``changes``,
    ``first_changes``, ``margin``, ``severity``, ``kept``), ``margins`` (bounded, None where there
    is none), ``tolerances`` (texts ``dimension``, ``survived``, ``failed``), ``looked_at``
    (``dimension``, ``unit``, ``regions``: name and count).

    Raises:
        ConfigError: naming the file, what is wrong in it and where.
    """
    if "searches" not in whole.values:
        return []
    told = zip(whole.fields("searches"), read_searches(whole), strict=True)
    found = [
        {
            "policy": record.policy,
            "task": record.task,
            "property": record.property,
            "over": record.over,
            **{name: own.count(name) for name in ("rollouts", "shrinking", "trials", "refused")},
            **{name: own.count(name) for name in ("seeds", "violated_plain")},
            "failure": None if own.values.get("failure") is None else _failure(own),
            "margins": _margins(own),
            "tolerances": [
                {
                    "dimension": row.dimension,
                    "survived": show(row.survived, row.unit),
                    "failed": "" if row.failed is None else show(row.failed, row.unit),
                }
                for row in record.tolerances
            ],
            "looked_at": [_looked(row) for row in own.fields("looked_at")],
        }
        for own, record in told
    ]
    return sorted(found, key=lambda own: own["failure"] is None)[:MAX_SEARCHES]


def _failure(own: Fields) -> Json:
    failure = own.section("failure")
    return {
        "sentence": failure.told("sentence"),
        "kept": printable(failure.text("kept", empty=True), MAX_TOLD),
        **{name: failure.count(name) for name in ("found_at", "first_changes")},
        **{name: finite(failure, name) for name in ("margin", "severity")},
        "changes": len(failure.fields("changes")),
    }


def _margins(own: Fields) -> list[float | None]:
    values = own.values.get("margins")
    numbers = values if isinstance(values, list) else []
    if not all(type(value) in (int, float, type(None)) for value in numbers):
        raise own.expected("margins", "numbers")
    bounded = [None if x is None else round(max(-BOUND, min(x, BOUND)), 3) for x in numbers]
    return bounded[:MAX_TRIALS]


def _looked(row: Fields) -> Json:
    regions = row.section("regions")
    return {
        "dimension": row.told("dimension"),
        "unit": row.told("unit", empty=True),
        "regions": [
            [printable(name, MAX_TOLD), regions.count(name)]
            for name in list(regions.values)[:MAX_REGIONS]
        ],
    }
