"""Searches in a summary: read, put together with those of other runs, written again."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pytest_safemanip.errors import printable
from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.search.units import UNITS


class ToleranceRecord(NamedTuple):
    """The smallest size of a dimension that a policy was not seen to survive, see
    `search/coverage.py`.
    """

    dimension: str
    unit: str
    survived: float
    failed: float | None


class SearchRecord(NamedTuple):
    """What a search for violations of a property by a policy in a task came to.

    ``over`` is whether it came to its end; ``fails`` says when the property is violated, and is
    empty where no violation was found; ``violated_plain`` counts the seeds whose episodes
    violate it without any change; ``recording`` is the file that shows that, if there is one;
    ``told`` is all that the summary says.
    """

    policy: str
    task: str
    property: str
    over: bool
    fails: str
    tolerances: tuple[ToleranceRecord, ...]
    violated_plain: int = 0
    recording: str = ""
    told: Mapping[str, Any] = {}

    def to_json(self, recording: str) -> dict[str, Any]:
        """The entry of a summary.

        Args:
            recording: the file that shows the failure, from the folder of the summary.
        """
        failure = self.told.get("failure")
        shown = {**failure, "recording": recording} if isinstance(failure, dict) else None
        return {**self.told, "failure": shown}


def read_searches(whole: Fields, folder: Path = Path()) -> tuple[SearchRecord, ...]:
    """What a document says of searches; none if it has none.

    Args:
        whole: the document.
        folder: that it is in.

    Raises:
        ConfigError: if it is malformed.
    """
    if "searches" not in whole.values:
        return ()
    return tuple(_read(own, folder) for own in whole.fields("searches"))


def _read(own: Fields, folder: Path) -> SearchRecord:
    fails = recording = ""
    if own.values.get("failure") is not None:
        failure = own.section("failure")
        fails = failure.told("sentence")
        recording = printable(failure.text("recording", empty=True), 4096)
    return SearchRecord(
        own.told("policy"),
        own.told("task"),
        own.told("property"),
        own.boolean("over"),
        fails,
        tuple(map(_tolerance, own.fields("tolerances"))),
        own.count("violated_plain"),
        str(folder / recording) if recording else "",
        own.values,
    )


def _tolerance(own: Fields) -> ToleranceRecord:
    unit = own.told("unit")
    if unit not in UNITS:
        raise own.expected("unit", f"one of {', '.join(UNITS)}")
    failed = None if own.values.get("failed") is None else own.number("failed")
    return ToleranceRecord(own.told("dimension"), unit, own.number("survived"), failed)


def merged_searches(searches: Iterable[SearchRecord]) -> tuple[SearchRecord, ...]:
    """The searches of several runs, the same whatever their order.

    One that came to its end stands for those of the same property that were interrupted. Those that
    came to the same count once; two that did not are both kept, as they may have looked through
    different spaces.
    """
    ordered = sorted(searches, key=lambda own: json.dumps([own.recording, own.told]))
    ended = {own[:3] for own in ordered if own.over}
    kept = {own[:7]: own for own in ordered if own.over or own[:3] not in ended}
    return tuple(sorted(kept.values(), key=lambda own: (own[:3], own.fails, not own.over)))
