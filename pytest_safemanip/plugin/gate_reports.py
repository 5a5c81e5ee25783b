"""Gates and comparisons as test cases of the main process: they need the whole run."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from pytest_safemanip.metrics.baseline import Contrast
from pytest_safemanip.metrics.comparability import marked
from pytest_safemanip.metrics.comparing import Comparison
from pytest_safemanip.metrics.decisions import Decision
from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.metrics.release_gate import OPEN, STAND_INS, ReleaseGate, Ruling
from pytest_safemanip.metrics.searches.records import read_searches
from pytest_safemanip.plugin.exit_status import CAUSE
from pytest_safemanip.plugin.longrepr import to_longrepr
from pytest_safemanip.plugin.short_summary import first_words
from pytest_safemanip.report.document import as_summary
from pytest_safemanip.report.junit import (
    UserProperties,
    comparison_properties,
    gate_properties,
)
from pytest_safemanip.report.rulings import (
    comparison_line,
    comparison_text,
    gate_reason,
    gate_text,
)
from pytest_safemanip.run.cases import SUITE
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.results import Results

PREFIXES = (f"{SUITE}::gate[", f"{SUITE}::baseline")


class _Told(NamedTuple):
    """What a test case says; ``cause`` is the exit status that it asks for, or 0."""

    verdict: str
    line: str
    text: str
    required: bool = True
    cause: int = 0
    comparable: bool = True


class Gating:
    """Decides when everything has been run, and tells pytest.

    Args:
        plan: the run.
        release: what decides.
        results: what was found out.
        searches: what searches found, in plain builtins, filled while they run.
    """

    def __init__(
        self,
        plan: Plan,
        release: ReleaseGate,
        results: Results,
        searches: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        self._plan, self._release, self._results = plan, release, results
        self._searches = searches
        self.ruling: Ruling | None = None
        self._standins = plan.settings.allow_standins
        self._telling = False

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> Generator[None, Any, Any]:
        """Add test cases after the others, whatever ended them."""
        try:
            return (yield)
        finally:
            if not session.config.option.collectonly:
                found = Fields("this run", {"searches": list(self._searches)})
                run = as_summary(self._plan, self._results)
                self.ruling = self._release.rule(replace(run, searches=read_searches(found)))
                self._telling = True
                for report in self._reports(self.ruling):
                    session.config.hook.pytest_runtest_logreport(report=report)
                self._telling = False

    @pytest.hookimpl(tryfirst=True)
    def pytest_report_teststatus(
        self, report: pytest.TestReport, config: pytest.Config
    ) -> tuple[str, str, str] | None:
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
        if self._telling:
            return category, "", ""
        word = category.upper()
        # The reason begins with a word of its own: the verdict.
        return category, "", first_words(word, report, config).removeprefix(f"{word} ")

    def _reports(self, ruling: Ruling) -> Generator[pytest.TestReport]:
        for decision in ruling.decisions:
            yield from self._gate(decision, ruling)
        if ruling.refused:
            node = f"{SUITE}::baseline"
            yield from self._case(node, _Told("INCOMPLETE", ruling.refused, ruling.refused), [])
        if ruling.contrast:
            for comparison in ruling.contrast.comparisons:
                if comparison.required:
                    yield from self._comparison(comparison, ruling, ruling.contrast)

    def _gate(self, decision: Decision, ruling: Ruling) -> Generator[pytest.TestReport]:
        told = _Told(
            decision.verdict,
            gate_reason(decision),
            gate_text(decision),
            decision.gate.required,
            ruling.cause(decision.policy, decision.blames_infrastructure, self._standins),
            decision.comparable,
        )
        node = f"{SUITE}::gate[{decision.name}]"
        yield from self._case(node, told, gate_properties(decision))

    def _comparison(
        self, comparison: Comparison, ruling: Ruling, contrast: Contrast
    ) -> Generator[pytest.TestReport]:
        comparable = comparison.policy not in ruling.not_comparable
        incomplete = comparison.verdict == "INCOMPLETE" and comparison.policy in ruling.no_verdict
        told = _Told(
            comparison.verdict,
            comparison_line(comparison),
            comparison_text(comparison, contrast),
            cause=ruling.cause(comparison.policy, incomplete, self._standins),
            comparable=comparable,
        )
        node = f"{SUITE}::baseline[{comparison.case}]"
        yield from self._case(node, told, comparison_properties(comparison, comparable))

    def _case(self, node: str, told: _Told, about: UserProperties) -> Generator[pytest.TestReport]:
        """The three phases of a test case; what has no verdict is an error."""
        verdict, required = told.verdict, told.required
        location = (SUITE, None, node.removeprefix(f"{SUITE}::"))
        phase: Any = "setup" if verdict == "INCOMPLETE" and required else "call"
        for when in ("setup", "call", "teardown"):
            report = pytest.TestReport(
                node, location, {SUITE: 1}, "passed", None, when, user_properties=about
            )
            if when == phase:
                self._mark(report, told)
            if not (when == "call" and phase == "setup"):
                yield report

    def _mark(self, report: pytest.TestReport, told: _Told) -> None:
        elsewhere = told.cause == STAND_INS
        verdict = told.verdict
        if verdict in ("PASS", "HELD", "IMPROVED") and not elsewhere:
            return
        reason = f"{marked(verdict, told.comparable, self._standins)}: {told.line}"
        if not told.required:
            report.outcome, report.wasxfail = "skipped", f"not required: {reason}"
            report.longrepr = (SUITE, 0, reason)
        elif verdict in OPEN and not elsewhere and self._plan.settings.inconclusive == "skip":
            report.outcome, report.longrepr = "skipped", (SUITE, 0, f"Skipped: {reason}")
        else:
            report.outcome = "failed"
            report.longrepr = to_longrepr(told.text, reason, Path(SUITE))
            vars(report)[CAUSE] = told.cause
