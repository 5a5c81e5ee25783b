"""Merging the summaries of one evaluation, of several runs or machines."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.records import RolloutKey, RolloutRecord
from pytest_safemanip.metrics.searches.records import merged_searches
from pytest_safemanip.metrics.summaries import Summary, check_alike


def merge(summaries: Sequence[Summary]) -> Summary:
    """Merge several runs into one evaluation; a rollout counts once.

    The same whatever the order, and however often a summary is given.

    Raises:
        ConfigError: if verdicts were not decided in the same way, or if two runs have different
            verdicts on the same rollout.
    """
    origins = sorted(
        {_text(origin): origin for s in summaries for origin in s.origins}.items(),
    )
    numbers = {text: number for number, (text, _) in enumerate(origins)}
    merged: dict[RolloutKey, tuple[RolloutRecord, Summary]] = {}
    so_far = summaries[0]
    for summary in summaries:
        check_alike(so_far, summary)
        decisive = {**so_far.decisive, **summary.decisive}
        so_far = dataclasses.replace(so_far, decisive=decisive)
        for record in summary.records:
            own = dataclasses.replace(record)
            if record.provenance is not None:
                own.provenance = numbers[_text(summary.origins[record.provenance])]
            known = merged.get(record.key)
            joined = _joined(*known, own, summary) if known else own
            merged[record.key] = joined, summary
    return Summary(
        tuple(sorted({place for s in summaries for place in s.places})),
        tuple(merged[key][0] for key in sorted(merged)),
        so_far.decisive,
        tuple(origin for _, origin in origins),
        tuple(sorted({shard for s in summaries for shard in s.shards})),
        any(s.partial for s in summaries),
        {name: rule for s in summaries for name, rule in s.rules.items()},
        floor=next((s.floor for s in summaries if s.floor), ()),
        searches=merged_searches(own for s in summaries for own in s.searches),
    )


def _joined(
    one: RolloutRecord, first: Summary, other: RolloutRecord, second: Summary
) -> RolloutRecord:
    """Merge two records of a rollout: a verdict wins over none."""
    if one.complete != other.complete:
        return one if one.complete else other
    if not one.complete:
        # Neither was run to its end: what is said about it must not depend on the order.
        return max(one, other, key=lambda r: (r.error, _text(r.to_json())))
    for name in one.properties.keys() & other.properties.keys():
        if one.properties[name] != other.properties[name]:
            raise ConfigError(_conflict(one, f"on {name} ", first, second))
    facts = ("success", "acting_steps", "truncated", "suite", "horizon", "provenance")
    if any(getattr(one, fact) != getattr(other, fact) for fact in facts):
        raise ConfigError(_conflict(one, "", first, second))
    chosen = max(one, other, key=lambda r: (r.recording, _text(dict(r.served)), r.reused))
    properties = {**one.properties, **other.properties}
    unjudged = {**one.unjudged, **other.unjudged}
    deselected = {**one.deselected, **other.deselected}
    asked = {*properties, *unjudged}
    return dataclasses.replace(
        chosen,
        properties={name: properties[name] for name in sorted(properties)},
        unjudged={k: unjudged[k] for k in sorted(unjudged) if k not in properties},
        deselected={k: deselected[k] for k in sorted(deselected) if k not in asked},
        packs=dict(sorted({**one.packs, **other.packs}.items())),
    )


def _conflict(record: RolloutRecord, what: str, first: Summary, second: Summary) -> str:
    return (
        f"{first.place} and {second.place} differ {what}in the rollout of {record.task}, policy "
        f"{record.policy}, seed {record.seed}: two runs of it cannot count as one; leave one out, "
        "or give one other seeds"
    )


def _text(value: Any) -> str:
    return json.dumps(value, sort_keys=True)
