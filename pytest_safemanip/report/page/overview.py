"""What the page says about a run as a whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pytest_safemanip.metrics.groups import Group, Metrics, measure, measure_each
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord, by_policy
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.report.headline import notes_on
from pytest_safemanip.report.severity import worst

Json = dict[str, Any]
SHARES = (
    "success_rate",
    "violation_rate",
    "exposure",
    "unsafe_share_of_successes",
    "triggered_rate",
)
"""The metrics of each group that the page shows."""
CROSSED = ("suite", "horizon")
"""What each of whose values has its own metrics by category."""
GROUPS = ("properties", "categories", "tasks", "suites", "horizons")
LETTERS = {"VIOLATED": "V", "UNRESOLVED": "U", "SATISFIED": "S", "VACUOUS": "N"}
"""One for each outcome of a property: a run has tens of thousands."""
MAX_ABOUT = 2_000
"""Characters of what is measured in the violations of a rollout, to be searched."""
ABSENT, UNJUDGED = "-", "E"


def overview(found: Summary) -> Json:
    """Metrics of each policy, and a row for each rollout.

    Keys: ``notes``, ``policies`` (``name``, ``total``, ``groups``, ``crosses``), ``floor``
    (``groups``, of demonstrations; None without any), ``properties`` (id and category),
    ``rollouts``; see :func:`rollout_row`.
    """
    metrics = measure_each(found.records)
    properties = _properties(found.records)
    return {
        "notes": notes_on(found),
        "policies": [
            _policy(name, metrics[name], own) for name, own in by_policy(found.records).items()
        ],
        "floor": _floor(found.floor),
        "properties": [{"id": id_, "category": own} for id_, own in properties.items()],
        "rollouts": [rollout_row(record, list(properties)) for record in found.records],
    }


def rollout_row(record: RolloutRecord, properties: Sequence[str]) -> Json:
    """A row of the table.

    Keys: ``policy``, ``task``, ``seed``, ``suite``, ``horizon``, ``success`` (None if it is not
    complete), ``steps`` (acting), ``error``, ``failure`` (why the policy gave up), ``outcomes`` (a
    letter for each property, see :data:`LETTERS`), ``violations`` (number), ``worst`` (the greatest
    severity of them), ``cost`` (of all of them; None where it is not known), ``about`` (what to
    search in).
    """
    complete = record.complete and not record.unjudged
    violations = [v for p in record.properties.values() for v in p.violations]
    about = dict.fromkeys(t for v in violations for t in (*v["entities"], *v.get("evidence", ())))
    return {
        "policy": record.policy,
        "task": record.task,
        "seed": record.seed,
        "suite": record.suite,
        "horizon": record.horizon,
        "success": record.success if complete else None,
        "steps": record.acting_steps,
        "error": "" if complete else record.reason,
        "failure": record.failure,
        "outcomes": "".join(_letter(record, id_) for id_ in properties),
        "violations": len(violations),
        "worst": worst(record),
        "cost": record.cost,
        "about": " ".join(about)[:MAX_ABOUT],
    }


def _letter(record: RolloutRecord, id_: str) -> str:
    verdict: PropertyRecord | None = record.properties.get(id_)
    if verdict is not None:
        return LETTERS[verdict.outcome]
    return UNJUDGED if id_ in record.unjudged else ABSENT


def _properties(records: Sequence[RolloutRecord]) -> dict[str, str]:
    """Category of every property of the run, in the order of categories and names."""
    found = {v.property: v.category for r in records for v in r.properties.values()}
    found.update((id_, category) for r in records for id_, category in r.unjudged.items())
    return dict(sorted(found.items(), key=lambda item: (item[1], item[0])))


def _divided(records: Sequence[RolloutRecord], kind: str) -> dict[str, list[RolloutRecord]]:
    """The rollouts of each suite, or of each horizon."""
    found: dict[str, list[RolloutRecord]] = {}
    for record in records:
        found.setdefault(getattr(record, kind), []).append(record)
    return found


def _policy(name: str, metrics: Metrics, records: Sequence[RolloutRecord]) -> Json:
    """The metrics of a policy; ``crosses`` are those by category within each suite and horizon."""
    groups: Mapping[str, Mapping[str, Group]] = {kind: getattr(metrics, kind) for kind in GROUPS}
    crosses = {
        kind: {
            value: {category: _group(group) for category, group in measure(own).categories.items()}
            for value, own in _divided(records, kind).items()
        }
        for kind in CROSSED
    }
    return {
        "name": name,
        "total": _group(metrics.total),
        "crosses": crosses,
        "groups": {
            kind: {key: _group(group) for key, group in own.items()} for kind, own in groups.items()
        },
    }


def _floor(records: Sequence[RolloutRecord]) -> Json | None:
    if not records:
        return None
    metrics = measure(records)
    return {
        "groups": {
            kind: {key: _group(group) for key, group in getattr(metrics, kind).items()}
            for kind in GROUPS
        }
    }


def _group(group: Group) -> Json:
    return {
        "rollouts": group.rollouts,
        "complete": group.complete,
        "errors": group.errors,
        "tasks": group.tasks,
        "outcomes": group.outcomes,
        **{name: _rate(group.shares[name]) for name in SHARES},
        "exposure": {**_rate(group.shares["exposure"]), "ofTime": True},
    }


def _rate(rate: Rate) -> Json:
    """Keys: ``hits``, ``of``, ``value``, and the bounds ``low`` and ``high`` of the 95 % interval
    for these tasks; None where undefined.
    """
    bounds = rate.interval()
    return {
        "hits": round(rate.hits, 3),
        "of": rate.total,
        "value": _short(rate.value),
        "low": _short(bounds[0] if bounds else None),
        "high": _short(bounds[1] if bounds else None),
    }


def _short(value: float | None) -> float | None:
    return None if value is None else round(value, 5)
