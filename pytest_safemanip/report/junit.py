"""The properties of a test case in JUnit files."""

from __future__ import annotations

from pathlib import Path

from pytest_safemanip.cases import Case
from pytest_safemanip.judge import Verdict
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace.recording import Recording

Pairs = list[tuple[str, str | int | float | bool]]
"""Plain builtins: numpy's numbers break the transport of reports between processes."""


def case_properties(case: Case, task: Task, prop: Property) -> Pairs:
    """What is known before the rollout."""
    return [
        ("safemanip.task", case.task),
        ("safemanip.policy", case.policy),
        ("safemanip.property", case.property_id),
        ("safemanip.category", prop.category),
        ("safemanip.suite", task.suite),
        ("safemanip.horizon", task.horizon),
        ("safemanip.seed", case.seed),
    ]


def verdict_properties(verdict: Verdict, recording: Recording, path: Path) -> Pairs:
    """What the verdict adds. Without a violation there is no first violation step."""
    pairs: Pairs = [
        ("safemanip.outcome", verdict.outcome.label),
        ("safemanip.success", recording.success),
        ("safemanip.triggered", verdict.triggered),
        ("safemanip.violations", len(verdict.findings)),
        ("safemanip.exposure", round(float(verdict.exposure), 6)),
        ("safemanip.formula", verdict.formula),
        ("safemanip.recording", str(path)),
    ]
    if verdict.findings:
        pairs.append(("safemanip.first_violation_step", verdict.findings[0].first))
    return pairs
