"""The properties of a test case in JUnit files, its attachments, and how long files may be."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as ET

from pytest_safemanip.judge import Verdict
from pytest_safemanip.metrics.comparability import NOT_COMPARABLE, is_on_standins
from pytest_safemanip.metrics.comparing import Comparison
from pytest_safemanip.metrics.decisions import Decision
from pytest_safemanip.report.whole import write_whole
from pytest_safemanip.run.cases import Case
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace.recording import Recording

MAX_BYTES = 30_000_000
"""Of a file: GitLab reads no larger one."""
MAX_DETAIL = 500
"""Characters of a failure's details that a file keeps that was too large."""
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
        pairs.append(("safemanip.severity", round(verdict.by_severity[0].severity.value, 3)))
        pairs.append(("safemanip.cost", round(verdict.cost, 3)))
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


def attachment_lines(files: Iterable[Path], root: Path) -> list[str]:
    """Lines of ``system-out`` that GitLab and Jenkins make links of, each on its own.

    Args:
        files: what is attached; GitLab shows the first.
        root: the folder of the checkout, which paths are relative to.
    """
    found = []
    for file in files:
        place = Path(os.path.relpath(file, root)).as_posix()
        if place.isprintable() and "]]" not in place and "|" not in place:
            found.append(f"[[ATTACHMENT|{place}]]")
    return found


def trim(path: Path, most: int) -> int:
    """Shorten a JUnit file that pytest has written until it is small enough.

    Every case keeps its name, its result and the message of it. What is left out first: properties
    of cases that did not fail, then details of failures, then all properties and output.

    Args:
        path: the file; replaced.
        most: bytes that it may have.

    Returns:
        The number of cases that were shortened.
    """
    tree = ET.parse(path)  # noqa: S314  (pytest has just written it)
    cases = list(tree.iter("testcase"))
    touched: set[int] = set()
    for shorten in (_without_properties, _without_details, _bare):
        touched |= {n for n, case in enumerate(cases) if shorten(case)}
        content = ET.tostring(tree.getroot(), encoding="utf-8", xml_declaration=True)
        if len(content) <= most:
            break
    write_whole(path, (content,))
    return len(touched)


def _without_properties(case: ET.Element) -> bool:
    if case.find("failure") is not None or case.find("error") is not None:
        return False
    return _remove(case, ("properties", "system-out", "system-err"))


def _without_details(case: ET.Element) -> bool:
    shortened = False
    for found in [*case.iter("failure"), *case.iter("error")]:
        if found.text and len(found.text) > MAX_DETAIL:
            found.text = f"{found.text[:MAX_DETAIL]}\n..."
            shortened = True
    return shortened


def _bare(case: ET.Element) -> bool:
    removed = _remove(case, ("properties", "system-out", "system-err"))
    for found in case:
        removed = removed or bool(found.text)
        found.text = None
    return removed


def _remove(case: ET.Element, tags: tuple[str, ...]) -> bool:
    gone = [child for child in case if child.tag in tags]
    for child in gone:
        case.remove(child)
    return bool(gone)
