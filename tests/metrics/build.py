"""Rollout records by hand."""

from __future__ import annotations

from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord


def record(**changed):
    fields = {"task": "T", "policy": "p", "seed": 3, "suite": "s", "horizon": "atomic"}
    return RolloutRecord(**{**fields, **changed})


def verdict(name="a", outcome="SATISFIED", category="c", triggered=True, violations=()):
    return PropertyRecord(name, category, outcome, triggered, tuple(violations))


def span(first, last):
    return {
        "entities": [],
        "first": first,
        "last": last,
        "duration_s": 0.05 * (last - first + 1),
        "reason": "overdue",
    }


def rollout(success, *verdicts, steps=10, **changed):
    properties = {v.property: v for v in verdicts}
    return record(success=success, acting_steps=steps, properties=properties, **changed)


def bad(name="a", *spans, category="c"):
    return verdict(name, "VIOLATED", category, True, [span(*s) for s in spans or ((2, 3),)])


def severe(*severities, name="a", first=2):
    """A violated property, with violations that are so severe, and cost as much."""
    spans = [
        {**span(first, first + 1), "severity": own, "measured": {}, "cost": own}
        for own in severities
    ]
    return verdict(name, "VIOLATED", "c", True, spans)


def rollouts(pattern, task="T", first=0, **changed):
    """One rollout for each character: ``x`` violates, ``.`` does not, ``e`` has an error, and
    ``-`` was not run; their seeds count up.
    """
    found = []
    for seed, character in enumerate(pattern, first):
        own = {"task": task, "seed": seed, **changed}
        if character in "e-":
            error = "the server is gone" if character == "e" else ""
            found.append(record(**own, error=error, unjudged={"a": "c"}))
        else:
            found.append(rollout(True, bad("a") if character == "x" else verdict("a"), **own))
    return found
