"""Metrics, gates and a comparison at the scale of the paper: 6 policies x 50 tasks x 50 seeds.

Each row's time is put beside that of ``json.loads`` on the same summary, in the same run.
"""

from __future__ import annotations

import json
import random
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pytest_safemanip.metrics.baseline import contrast
from pytest_safemanip.metrics.decisions import decide
from pytest_safemanip.metrics.gates import parse_gate
from pytest_safemanip.metrics.groups import measure
from pytest_safemanip.metrics.merging import merge
from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord, by_policy
from pytest_safemanip.metrics.summaries import SCHEMA, read
from pytest_safemanip.metrics.tables import tables

POLICIES, TASKS, SEEDS, PROPERTIES = 6, 50, 50, 10


def evaluation(drawn: random.Random) -> list[RolloutRecord]:
    """Rollouts of all policies, a third of them with violations."""
    return [
        rollout(drawn, f"policy{policy}", task, seed)
        for policy in range(POLICIES)
        for task in range(TASKS)
        for seed in range(SEEDS)
    ]


def rollout(drawn: random.Random, policy: str, task: int, seed: int) -> RolloutRecord:
    """One rollout with a verdict on each property."""
    verdicts = {}
    for number in range(PROPERTIES):
        first, violated = drawn.randrange(400), drawn.random() < 0.04
        span = {
            "entities": ["obj", "cab_2_main_group"],
            "first": first,
            "last": first + 9,
            "duration_s": 0.5,
            "reason": "bad prefix",
        }
        verdicts[f"property{number}"] = PropertyRecord(
            f"property{number}",
            f"category{number % 8}",
            "VIOLATED" if violated else "SATISFIED",
            True,
            (span,) if violated else (),
        )
    return RolloutRecord(
        task=f"Task{task}",
        policy=policy,
        seed=seed,
        suite=f"suite{task % 9}",
        horizon=("atomic", "short", "medium", "long")[task % 4],
        success=drawn.random() < 0.4,
        acting_steps=500,
        recording=f"recordings/Task{task}-{policy}-seed{seed}.rollout",
        provenance=0,
        properties=verdicts,
    )


def timed(act: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds, and what came of it."""
    start = time.perf_counter()
    found = act()
    return time.perf_counter() - start, found


def main() -> None:
    """Print the table."""
    records = evaluation(random.Random(0))  # noqa: S311 (nothing secret)
    document = {
        "schema": SCHEMA,
        "settings": {},
        "hashes": {},
        "provenance": [{"backend": "toy"}],
        "rollouts": [record.to_json() for record in records],
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "summary.json"
        path.write_text(json.dumps(document))
        text = path.read_text()
        reference, _ = timed(lambda: json.loads(text))
        reading, summary = timed(lambda: read(path))
    own = by_policy(records)
    gate = parse_gate("violation_rate[category=category1] <= 5 % @0.95")
    rows = {
        "json.loads (reference)": reference,
        "read and check": reading,
        "merge with itself": timed(lambda: merge([summary, summary]))[0],
        "all metrics and tables": timed(lambda: tables({p: measure(r) for p, r in own.items()}))[0],
        "one gate": timed(lambda: [decide(gate, p, r) for p, r in own.items()])[0],
        "comparison with itself": timed(lambda: contrast(summary, summary, (), 0.1))[0],
    }
    print(
        f"{len(records)} rollouts, {len(records) * PROPERTIES} verdicts, {len(text) / 1e6:.0f} MB"
    )
    for name, seconds in rows.items():
        print(f"{name:<26} {seconds:7.2f} s {seconds / reference:7.1f} x")


if __name__ == "__main__":
    main()
