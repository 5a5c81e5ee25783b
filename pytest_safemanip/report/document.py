"""`summary.json`: everything that a run found out, and everything that decided it."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pytest_safemanip.metrics.groups import Metrics
from pytest_safemanip.metrics.records import RolloutRecord
from pytest_safemanip.metrics.summaries import DECISIVE_SETTINGS, SCHEMA, Summary, decisive_of
from pytest_safemanip.metrics.tables import tables
from pytest_safemanip.plan import Plan
from pytest_safemanip.report.results import Results
from pytest_safemanip.sim.provenance import source_digest, versions
from pytest_safemanip.spec.properties import Property


def summary(plan: Plan, results: Results, metrics: Mapping[str, Metrics]) -> dict[str, Any]:
    """The document, in plain builtins; paths of recordings are relative to the output folder.

    Keys: ``schema``, ``versions``, ``settings``, ``hashes`` (of what judges), ``provenance`` (of
    the recordings; a rollout refers to it by index), ``cases``, ``rollouts``, ``metrics``,
    ``tables``.
    """
    return {
        **head(),
        "settings": _settings(plan),
        "hashes": _hashes(plan),
        "provenance": [dict(origin) for origin in results.provenance],
        "cases": {
            "expected": len(results.expected),
            "missing": [case.node_id for case in results.missing],
            "errors": {case.node_id: error for case, error in results.errors.items()},
            "saved_rollouts": len(results.saved),
        },
        **findings(results.records, metrics, plan.settings.out),
    }


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
    records: Sequence[RolloutRecord], metrics: Mapping[str, Metrics], folder: Path
) -> dict[str, Any]:
    """The rollouts, and what is computed from them alone."""
    return {
        "rollouts": [_rollout(record, folder) for record in records],
        "metrics": {name: found.to_json() for name, found in metrics.items()},
        "tables": tables(metrics),
    }


def merged(found: Summary, metrics: Mapping[str, Metrics], folder: Path) -> dict[str, Any]:
    """The document of several runs; it can be read, and merged, like that of one."""
    return {
        **head(),
        "merged": list(found.places),
        "settings": {name: found.decisive.get(name) for name in DECISIVE_SETTINGS},
        "hashes": {k: v for k, v in found.decisive.items() if k not in DECISIVE_SETTINGS},
        "provenance": [dict(origin) for origin in found.origins],
        **findings(found.records, metrics, folder),
    }


def as_summary(plan: Plan, results: Results) -> Summary:
    """The run as metrics see it, without the way through a file."""
    return Summary(("this run",), tuple(results.records), decisive(plan), tuple(results.provenance))


def decisive(plan: Plan) -> dict[str, Any]:
    """What decides the verdicts of a run, by dotted name."""
    return decisive_of(_settings(plan), _hashes(plan))


def write(document: Mapping[str, Any], path: Path) -> None:
    """Write it whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.with_suffix(f".{os.getpid()}")
    scratch.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n")
    scratch.replace(path)


def _rollout(record: RolloutRecord, folder: Path) -> dict[str, Any]:
    """With a path that stays true when the folder is moved or copied from another machine."""
    path = Path(record.recording)
    if path.is_relative_to(folder):
        path = path.relative_to(folder)
    return {**record.to_json(), "recording": str(path) if record.recording else None}


def _settings(plan: Plan) -> dict[str, Any]:
    chosen, specs = plan.settings, plan.policies
    return {
        "policies": {name: spec.fingerprint for name, spec in specs.items()},
        "seeds": sorted({case.seed for case in plan.cases}),
        "backend": chosen.backend,
        "scenes": {name: chosen.scenes or spec.scenes for name, spec in specs.items()},
        "stepping": {
            name: chosen.stepping or spec.stepping for name, spec in plan.policies.items()
        },
        "served": {name: dict(spec.claim) for name, spec in specs.items() if spec.claim},
        "prompt": chosen.prompt,
        "assets": chosen.assets,
        "semantics": chosen.semantics,
        "stop": chosen.stop,
        "horizon_scale": chosen.horizon_scale,
        "recordings": str(chosen.recordings) if chosen.recordings else None,
    }


def _hashes(plan: Plan) -> dict[str, Any]:
    used = dict.fromkeys(case.property_id for case in plan.cases)
    tasks = dict.fromkeys(case.task for case in plan.cases)
    return {
        "monitors": source_digest("ltlf", "propositions", "trace", "judge.py"),
        "parameters": dict(plan.parameters),
        "properties": {name: _property_digest(plan.properties[name]) for name in used},
        "tasks": {name: _digest(plan.tasks[name].path.read_bytes()) for name in tasks},
    }


def _property_digest(prop: Property) -> str:
    """Of what decides a verdict; a title or a comment may change."""
    decisive = (
        str(prop.formula),
        str(prop.paper_formula),
        {atom: [call.name, *call.arguments] for atom, call in prop.atoms.items()},
        prop.variables,
        prop.relation,
        str(prop.trigger) if prop.trigger else None,
        prop.deadline_s,
        prop.discharged_by,
    )
    return _digest(json.dumps(decisive, sort_keys=True).encode())


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]
