"""The properties of a test case in JUnit files."""

from __future__ import annotations

from pathlib import Path

from pytest_safemanip.judge import Verdict
from pytest_safemanip.metrics.comparability import NOT_COMPARABLE, is_on_standins
from pytest_safemanip.metrics.comparing import Comparison
from pytest_safemanip.metrics.decisions import Decision
from pytest_safemanip.run.cases import Case
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace.recording import Recording

UserProperties = list[tuple[str, str | int | float | bool]]
"""Plain builtins: numpy's numbers break the transport of reports between processes."""


def case_properties(case: Case, task: Task, prop: Property) -> UserProperties:
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


def verdict_properties(verdict: Verdict, recording: Recording, path: Path) -> UserProperties:
    """What the verdict adds. Without a violation there is no first violation step."""
    pairs: UserProperties = [
        ("safemanip.outcome", verdict.outcome.label),
        ("safemanip.success", recording.success),
        ("safemanip.triggered", verdict.triggered),
        ("safemanip.violations", len(verdict.findings)),
        ("safemanip.exposure", round(float(verdict.exposure), 6)),
        ("safemanip.formula", verdict.formula),
        ("safemanip.recording", str(path)),
    ]
    episode = recording.episode
    if is_on_standins(episode.served, episode.assets):
        pairs.append(("safemanip.comparable", NOT_COMPARABLE))
    if verdict.findings:
        pairs.append(("safemanip.first_violation_step", verdict.findings[0].first))
    return pairs


def gate_properties(decision: Decision) -> UserProperties:
    """What a gate was decided by; what is undefined is left out."""
    found: UserProperties = [
        ("safemanip.gate", str(decision.gate)),
        ("safemanip.policy", decision.policy),
        ("safemanip.verdict", decision.verdict),
    ]
    if not decision.comparable:
        found.append(("safemanip.comparable", NOT_COMPARABLE))
    if decision.value is not None:
        found.append(("safemanip.value", decision.value))
    if decision.interval is not None:
        found.append(("safemanip.interval", "{} to {}".format(*decision.interval)))
    return found


def comparison_properties(comparison: Comparison, comparable: bool = True) -> UserProperties:
    """What a comparison with the baseline was decided by, and whether it can be compared."""
    found: UserProperties = [
        ("safemanip.comparison", comparison.name),
        ("safemanip.policy", comparison.policy),
        ("safemanip.verdict", comparison.verdict),
        ("safemanip.pairs", comparison.pairs.total),
    ]
    if not comparable:
        found.append(("safemanip.comparable", NOT_COMPARABLE))
    if comparison.pairs.total:
        found += [
            ("safemanip.before", comparison.pairs.before),
            ("safemanip.now", comparison.pairs.now),
            ("safemanip.p_worse", comparison.worse),
        ]
    return found
