"""A run as SARIF 2.1.0: a rule for each property, a result for each violation."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from pytest_safemanip import __version__
from pytest_safemanip.errors import printable
from pytest_safemanip.report.ci.places import below, source_root
from pytest_safemanip.report.ci.reading import Run, Violation, read_run, violations
from pytest_safemanip.report.whole import write_whole

NAME = "summary.sarif"
SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
MAX_RESULTS = 25_000
"""What GitHub takes of a run, the worst; others are counted in a notification."""
CHECKOUT, SHIPPED = "SRCROOT", "PYTEST_SAFEMANIP"
"""What locations are relative to: the repository; the folder of this package's own properties."""


def write_sarif(folder: Path) -> Path:
    """Write `summary.sarif` into the output folder of a run.

    Raises:
        ConfigError: if the run's summary cannot be read.
        OSError: if the file cannot be written.
    """
    path = folder / NAME
    document = sarif(read_run(folder), source_root())
    write_whole(path, (json.dumps(document, allow_nan=False), "\n"))
    return path


def sarif(run: Run, root: Path) -> dict[str, Any]:
    """The document in plain builtins.

    Args:
        run: the run.
        root: the folder of the checkout, which locations are relative to.
    """
    known = run.summary.rules
    judged = {
        verdict.property: verdict.category
        for record in run.summary.records
        for verdict in record.properties.values()
    }
    rules = [_rule(name, judged.get(name, ""), known.get(name, {})) for name in {**known, **judged}]
    index = {rule["id"]: number for number, rule in enumerate(rules)}
    found = list(violations(run.summary.records))
    ranked = sorted(range(len(found)), key=lambda n: -found[n].severity)[:MAX_RESULTS]
    results = [
        _result(v, index[v.property_id], known.get(v.property_id, {}), root)
        for v in (found[number] for number in sorted(ranked))
    ]
    driver = {"name": "pytest-safemanip", "version": __version__, "rules": rules}
    return {
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [
            {
                "tool": {"driver": driver},
                "columnKind": "unicodeCodePoints",
                "originalUriBaseIds": {
                    CHECKOUT: {"description": {"text": "The checkout of the repository."}},
                    SHIPPED: {"description": {"text": "The properties of pytest-safemanip."}},
                },
                "invocations": [
                    {
                        "executionSuccessful": all(
                            record.complete and not record.unjudged
                            for record in run.summary.records
                        ),
                        "toolExecutionNotifications": _notifications(run, len(found)),
                    }
                ],
                "results": results,
            }
        ],
    }


def message(text: str) -> str:
    """Text of anybody's as SARIF's plain text: no placeholder and no link."""
    for mark in "\\[]":
        text = text.replace(mark, f"\\{mark}")
    return text.replace("{", "{{").replace("}", "}}")


def _rule(name: str, category: str, rule: Mapping[str, str]) -> dict[str, Any]:
    title = rule.get("title", "") or name
    formula = rule.get("formula", "")
    source = rule.get("source", "")
    told = "\n".join(part for part in (title, source, formula) if part)
    return {
        "id": name,
        "name": "".join(word.capitalize() for word in name.split("_")),
        "shortDescription": {"text": message(title)},
        "fullDescription": {"text": message(f"{title} ({source})" if source else title)},
        "help": {"text": message(told)},
        "defaultConfiguration": {"level": "error"},
        "properties": {
            "tags": ["safety", rule.get("category", "") or category],
            "formula": formula,
        },
    }


def _result(
    violation: Violation, rule: int, about: Mapping[str, str], root: Path
) -> dict[str, Any]:
    record, found = violation.record, violation.found
    episode = f"{record.task}, policy {record.policy}, seed {record.seed}"
    return {
        "ruleId": violation.property_id,
        "ruleIndex": rule,
        "kind": "fail",
        "level": "error",
        "rank": min(10.0 * violation.severity, 100.0),
        "message": {"text": message(printable(f"{episode}: {violation.what}", 2000))},
        "locations": [
            {
                "physicalLocation": {
                    "artifactLocation": _location(violation.property_id, about, root),
                    "region": {"startLine": 1},
                },
                "logicalLocations": [{"fullyQualifiedName": violation.node_id, "kind": "function"}],
            }
        ],
        "partialFingerprints": {"safemanipViolation/v1": _fingerprint(violation)},
        "properties": {
            "task": record.task,
            "policy": record.policy,
            "seed": record.seed,
            "entities": list(found["entities"]),
            "first": found["first"],
            "last": found["last"],
            "duration_s": found["duration_s"],
            "reason": found["reason"],
            "severity": violation.severity,
            "measured": dict(found.get("measured", {})),
            "success": record.success,
        },
    }


def _location(name: str, about: Mapping[str, str], root: Path) -> dict[str, str]:
    """The file of the property in the repository; of a shipped one, in the package."""
    place = below(Path(about["file"]), root) if about.get("file") else None
    if place is not None:
        return {"uri": quote(str(place)), "uriBaseId": CHECKOUT}
    return {"uri": quote(f"properties/{name}.yaml"), "uriBaseId": SHIPPED}


def _fingerprint(violation: Violation) -> str:
    """The same for the same violation in another run, though it happens at another step."""
    twins = [
        own["entities"]
        for own in violation.record.properties[violation.property_id].violations[: violation.number]
    ]
    number = twins.count(violation.found["entities"])
    key = [violation.node_id, violation.found["entities"], number]
    return hashlib.sha256(json.dumps(key).encode()).hexdigest()[:32]


def _notifications(run: Run, found: int) -> list[dict[str, Any]]:
    """Rollouts without a verdict, and results that are left out."""
    failed = [
        {
            "level": "error",
            "message": {
                "text": message(
                    printable(f"{r.task}, policy {r.policy}, seed {r.seed}: {r.reason}", 2000)
                )
            },
        }
        for r in run.summary.records
        if r.error
    ][:1000]
    left = found - MAX_RESULTS
    if left > 0:
        text = f"{left} more violations are in summary.json"
        failed.append({"level": "warning", "message": {"text": text}})
    return failed
