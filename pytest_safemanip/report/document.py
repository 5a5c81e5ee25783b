"""`summary.json`: everything that a run found out, and everything that decided it."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import uuid
from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from pytest_safemanip import resources
from pytest_safemanip.metrics.comparability import NOT_COMPARABLE, not_comparable
from pytest_safemanip.metrics.groups import Metrics, measure
from pytest_safemanip.metrics.records import RolloutRecord, by_policy
from pytest_safemanip.metrics.summaries import DECISIVE_SETTINGS, SCHEMA, Summary, decisive_of
from pytest_safemanip.metrics.tables import tables
from pytest_safemanip.propositions.catalogue import SHIPPED
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.provenance import functions_digest, source_digest, versions
from pytest_safemanip.report.numbers import one_line
from pytest_safemanip.report.whole import write_whole
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.results import Results
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task

JUDGING = ("cost.py", "judge.py", "ltlf", "propositions", "severity.py", "spec", "trace")
"""The parts of the package that decide the verdicts on a recording."""
NOT_DECISIVE: Mapping[type, Collection[str]] = {
    Property: (
        "id",
        "pack",
        "category",
        "title",
        "source",
        "path",
        "lines",
        "_automata",
        "says_cost",
    ),
    Task: ("name", "path", "sets", "suite", "horizon", "properties", "not_grounded", "derived"),
}
"""Fields that decide no verdict: they name, describe, select and group. All others do."""
_UNKNOWN = f"without a source file, in run {uuid.uuid4().hex[:16]}"
"""Nobody can tell whether a proposition without a source file is still the same."""


def summary(
    plan: Plan,
    results: Results,
    metrics: Mapping[str, Metrics],
    floor: Sequence[RolloutRecord] = (),
) -> dict[str, Any]:
    """The document, in plain builtins; paths of recordings are relative to the output folder.

    Keys: ``schema``, ``versions``, ``settings``, ``hashes`` (of what judges), ``provenance`` (of
    the recordings; a rollout refers to it by index), ``properties``, ``cases``, ``policies``
    (restarts, failures of the infrastructure, whether they can be compared), ``rollouts``,
    ``metrics``, ``tables``; ``floor`` (``rollouts`` and ``metrics`` of demonstrations) if there is
    one.
    """
    return {
        **head(),
        "settings": _settings(plan),
        "hashes": _hashes(plan),
        "provenance": [dict(origin) for origin in results.provenance],
        "properties": _rules(plan),
        "cases": {
            "partial": is_partial(plan, results),
            "expected": len(results.expected),
            "missing": [case.node_id for case in results.missing],
            "errors": {case.node_id: error for case, error in results.errors.items()},
            "skipped_rollouts": len(results.skipped),
            "reused_rollouts": results.reused,
        },
        **findings(results.records, results.provenance, metrics, plan.settings.out),
        **({"floor": floor_of(floor)} if floor else {}),
    }


def floor_of(records: Sequence[RolloutRecord]) -> dict[str, Any]:
    """Demonstrations, and what is computed from them."""
    return {
        "rollouts": [record.to_json() for record in records],
        "metrics": measure(records).to_json(),
    }


def is_partial(plan: Plan, results: Results) -> bool:
    """Whether pytest's options or node ids left cases of the suite out."""
    return plan.settings.picks_cases or results.narrowed


def head() -> dict[str, Any]:
    """What wrote the document."""
    return {
        "schema": SCHEMA,
        "versions": {
            **versions(["pytest-safemanip", "pytest", "numpy", "scipy"]),
            "python": platform.python_version(),
        },
    }


def findings(
    records: Sequence[RolloutRecord],
    origins: Sequence[Mapping[str, Any]],
    metrics: Mapping[str, Metrics],
    folder: Path,
) -> dict[str, Any]:
    """The rollouts, and what is computed from them alone."""
    return {
        "policies": _policies(records, origins),
        "rollouts": [_rollout(record, folder) for record in records],
        "metrics": {name: found.to_json() for name, found in metrics.items()},
        "tables": tables(metrics),
    }


def merged(found: Summary, metrics: Mapping[str, Metrics], folder: Path) -> dict[str, Any]:
    """The document of several runs; it can be read, and merged, like that of one."""
    return {
        **head(),
        "merged": list(found.places),
        "partial": found.partial,
        "shards": [str(shard) for shard in found.shards],
        "settings": {name: found.decisive.get(name) for name in DECISIVE_SETTINGS},
        "hashes": {k: v for k, v in found.decisive.items() if k not in DECISIVE_SETTINGS},
        "provenance": [dict(origin) for origin in found.origins],
        "properties": {
            name: {**rule, "file": _from(Path(rule["file"]), folder) if rule["file"] else ""}
            for name, rule in found.rules.items()
        },
        **findings(found.records, found.origins, metrics, folder),
        **({"floor": floor_of(found.floor)} if found.floor else {}),
        **({"searches": _searches(found, folder)} if found.searches else {}),
    }


def _searches(found: Summary, folder: Path) -> list[dict[str, Any]]:
    places = [_from(Path(own.recording), folder) if own.recording else "" for own in found.searches]
    return [own.to_json(place) for own, place in zip(found.searches, places, strict=True)]


def as_summary(plan: Plan, results: Results) -> Summary:
    """The run as metrics see it, without the way through a file."""
    records = (*results.records, *results.left_out)
    return Summary(("this run",), records, decisive(plan), tuple(results.provenance))


def decisive(plan: Plan) -> dict[str, Any]:
    """What decides the verdicts of a run, by dotted name."""
    return decisive_of(_settings(plan), _hashes(plan))


def write(document: Mapping[str, Any], path: Path) -> None:
    """Write it whole or not at all.

    Raises:
        OSError: if it cannot be written.
    """
    write_whole(path, (json.dumps(document, indent=1, allow_nan=False), "\n"))


def _policies(
    records: Sequence[RolloutRecord], origins: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """What went wrong around each policy, and whether it saw the world that it was trained in."""
    elsewhere = not_comparable(records, origins)
    return {
        name: {
            "restarts": sum(record.restarts for record in own),
            "infrastructure_failures": sum(record.infrastructure for record in own),
            "comparable": name not in elsewhere,
            "note": NOT_COMPARABLE if name in elsewhere else "",
        }
        for name, own in by_policy(records).items()
    }


def _rollout(record: RolloutRecord, folder: Path) -> dict[str, Any]:
    """With a path that stays true when the folder is moved or copied from another machine."""
    place = _from(Path(record.recording), folder) if record.recording else None
    return {**record.to_json(), "recording": place}


def _from(path: Path, folder: Path) -> str:
    if path.is_relative_to(folder) or not (path.is_absolute() or folder.is_absolute()):
        path = Path(os.path.relpath(path, folder))
    return str(path)


def _rules(plan: Plan) -> dict[str, dict[str, str]]:
    """The properties of the run; only the user's have a file that readers may have, too."""
    shipped, folder = resources.folder("properties"), plan.settings.out
    found = {}
    for name in dict.fromkeys(case.property_id for case in plan.cases):
        prop = plan.properties[name]
        own = prop.path.parent != shipped
        formula = prop.paper_formula if plan.settings.semantics == "paper" else prop.formula
        found[name] = {
            "category": prop.category,
            "title": one_line(prop.title),
            "source": one_line(prop.source),
            "formula": str(formula),
            "file": os.path.relpath(prop.path, folder) if own else "",
        }
    return found


def _settings(plan: Plan) -> dict[str, Any]:
    chosen, specs = plan.settings, plan.policies
    return {
        "policies": {name: spec.fingerprint for name, spec in specs.items()},
        "seeds": sorted({case.seed for case in plan.cases}),
        "backend": chosen.backend,
        "scenes": {name: plan.scenes(name) for name in specs},
        "stepping": {name: plan.stepping(name) for name in specs},
        "served": {name: dict(spec.claim) for name, spec in specs.items() if spec.claim},
        "prompt": chosen.prompt,
        "shard": str(chosen.shard) if chosen.shard else None,
        "assets": chosen.assets,
        "semantics": chosen.semantics,
        "stop": chosen.stop,
        "horizon_scale": chosen.horizon_scale,
        "recordings": str(chosen.recordings) if chosen.recordings else None,
    }


def _hashes(plan: Plan) -> dict[str, Any]:
    """What decides verdicts beside the settings; its names are those of a refused baseline."""
    used = dict.fromkeys(case.property_id for case in plan.cases)
    tasks = dict.fromkeys(case.task for case in plan.cases)
    own = plan.catalogue.keys() - {shipped.name for shipped in SHIPPED}
    return {
        "code": {part: source_digest(part) for part in JUDGING},
        "parameters": dict(plan.parameters),
        "propositions": {name: _proposition_digest(plan.catalogue[name]) for name in sorted(own)},
        "properties": {name: _fields_digest(plan.properties[name]) for name in used},
        "tasks": {name: _fields_digest(plan.tasks[name]) for name in tasks},
        "attributes": {k: ", ".join(sorted(v)) or "none" for k, v in plan.attributes.items()},
    }


def _proposition_digest(proposition: Proposition) -> str:
    """Of a user's proposition: its source, and what is said about it beside parameters."""
    functions = (
        proposition.evaluate,
        proposition.window,
        proposition.debounce,
        proposition.margin,
    )
    source = functions_digest(f for f in functions if f is not None)
    if source is None:
        return _UNKNOWN
    return _digest([source, proposition.arguments, proposition.act, proposition.sparse])


def _fields_digest(described: Property | Task) -> str:
    left_out = NOT_DECISIVE[type(described)]
    names = [f.name for f in fields(described) if f.name not in left_out]
    return _digest({name: getattr(described, name) for name in names})


def _digest(content: Any) -> str:
    text = json.dumps(content, sort_keys=True, default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _plain(value: object) -> dict[str, Any] | str:
    """Mappings as such; formulas and calls of propositions as they are written."""
    return dict(value) if isinstance(value, Mapping) else str(value)
