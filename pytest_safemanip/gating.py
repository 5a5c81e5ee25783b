"""Gates and comparisons as test cases of the main process: they need the whole run."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip.cases import SUITE
from pytest_safemanip.metrics.comparing import Comparison
from pytest_safemanip.metrics.deciding import Decision
from pytest_safemanip.plan import Plan
from pytest_safemanip.release import OPEN, Release, Ruling
from pytest_safemanip.report import failure
from pytest_safemanip.report.document import as_summary
from pytest_safemanip.report.junit import Pairs, comparison_properties, gate_properties
from pytest_safemanip.report.results import Results
from pytest_safemanip.report.rulings import (
    comparison_line,
    comparison_text,
    gate_line,
    gate_text,
)

PREFIXES = (f"{SUITE}::gate[", f"{SUITE}::baseline")


class Gating:
    """Decides when everything has been run, and tells pytest.

    Args:
        plan: the run.
        release: what decides.
        results: what was found out.
    """

    def __init__(self, plan: Plan, release: Release, results: Results) -> None:
        self._plan, self._release, self._results = plan, release, results
        self.ruling: Ruling | None = None
        self._telling = False

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> Generator[None, Any, Any]:
        """Add test cases after the others, whatever ended them."""
        try:
            return (yield)
        finally:
            if not session.config.option.collectonly:
                self.ruling = self._release.rule(as_summary(self._plan, self._results))
                self._telling = True
                for report in self._reports(self.ruling):
                    session.config.hook.pytest_runtest_logreport(report=report)
                self._telling = False

    @pytest.hookimpl(tryfirst=True)
    def pytest_report_teststatus(self, report: pytest.TestReport) -> tuple[str, str, str] | None:
        """Counted, but without a letter among those of the cases: the summary has a line each."""
        if not report.nodeid.startswith(PREFIXES):
            return None
        if report.when != "call" and report.passed:
            return "", "", ""
        category: str = report.outcome
        if hasattr(report, "wasxfail"):
            category = "xfailed"
        elif report.failed and report.when == "setup":
            category = "error"
        return category, "", "" if self._telling else category.upper()

    def _reports(self, ruling: Ruling) -> Generator[pytest.TestReport]:
        for decision in ruling.decisions:
            yield from self._gate(decision)
        if ruling.refused:
            node = f"{SUITE}::baseline"
            yield from self._case(node, "INCOMPLETE", ruling.refused, ruling.refused, True, [])
        if ruling.contrast:
            for comparison in ruling.contrast.comparisons:
                if comparison.required:
                    text = comparison_text(comparison, ruling.contrast)
                    yield from self._comparison(comparison, text)

    def _gate(self, decision: Decision) -> Generator[pytest.TestReport]:
        node, required = f"{SUITE}::gate[{decision.name}]", decision.gate.required
        line, text = gate_line(decision), gate_text(decision)
        about = gate_properties(decision)
        yield from self._case(node, decision.verdict, line, text, required, about)

    def _comparison(self, comparison: Comparison, text: str) -> Generator[pytest.TestReport]:
        node = f"{SUITE}::baseline[{comparison.case}]"
        line, about = comparison_line(comparison), comparison_properties(comparison)
        yield from self._case(node, comparison.verdict, line, text, True, about)

    def _case(
        self, node: str, verdict: str, line: str, text: str, required: bool, about: Pairs
    ) -> Generator[pytest.TestReport]:
        """The three phases of a test case; what has no verdict is an error."""
        location = (SUITE, None, node.removeprefix(f"{SUITE}::"))
        phase: Any = "setup" if verdict == "INCOMPLETE" and required else "call"
        for when in ("setup", "call", "teardown"):
            report = pytest.TestReport(
                node, location, {SUITE: 1}, "passed", None, when, user_properties=about
            )
            if when == phase:
                self._mark(report, verdict, line, text, required)
            if not (when == "call" and phase == "setup"):
                yield report

    def _mark(
        self, report: pytest.TestReport, verdict: str, line: str, text: str, required: bool
    ) -> None:
        if verdict in ("PASS", "HELD", "IMPROVED"):
            return
        reason = f"{verdict}: {line}"
        if not required:
            report.outcome, report.wasxfail = "skipped", f"not required: {reason}"
            report.longrepr = (SUITE, 0, reason)
        elif verdict in OPEN and self._plan.settings.inconclusive == "skip":
            report.outcome, report.longrepr = "skipped", (SUITE, 0, f"Skipped: {reason}")
        else:
            report.outcome = "failed"
            report.longrepr = failure.shown(text, reason, Path(SUITE))
