"""What the main process tells: the header, the summary, `summary.json`."""

from __future__ import annotations

from typing import Any

import pytest

from pytest_safemanip.cases import is_case_id, parse_node_id
from pytest_safemanip.items import SafetyItem
from pytest_safemanip.report import document
from pytest_safemanip.report.results import Results, error_data
from pytest_safemanip.report.table import header_lines, summary_lines
from pytest_safemanip.run import Run

_CRASH: Any = "???"
"""The phase in xdist's report about a worker that died."""


class Reporting:
    """Collects the data of all test reports, from this process and from workers."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._results = Results(run.plan.tasks)
        self._path = run.plan.settings.out / "summary.json"

    def pytest_report_header(self) -> list[str]:
        """What is about to be done."""
        source = self._run.backend.provenance if self._run.backend else None
        return header_lines(self._run.plan, source)

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """What is left to run after deselection, without xdist."""
        self._results.expect(item.case for item in session.items if isinstance(item, SafetyItem))

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, ids: list[str]) -> None:
        """The same, as workers report it."""
        self._results.expect(parse_node_id(i) for i in ids if is_case_id(i))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take in a case."""
        data = getattr(report, "safemanip", None)
        if data is not None:
            self._results.add(data)
        elif is_case_id(report.nodeid) and report.when == _CRASH:
            case = parse_node_id(report.nodeid)
            self._results.add(error_data(case, "the worker process died"))

    def pytest_report_teststatus(self, report: pytest.TestReport) -> Any:
        """Violations are failures with a name of their own."""
        data = getattr(report, "safemanip", None)
        if data and report.failed and report.when == "call" and not hasattr(report, "wasxfail"):
            return "failed", "F", (data["outcome"], {"red": True})
        return None

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Write what is known, also after Ctrl-C."""
        if not session.config.option.collectonly and self._results.records:
            document.write(document.summary(self._run.plan, self._results), self._path)

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """Show the metrics."""
        if not self._results.records:
            return
        terminalreporter.write_sep("=", "safety")
        for line in summary_lines(self._results):
            terminalreporter.write_line(line)
        terminalreporter.write_line("")
        terminalreporter.write_line(f"summary: {self._run.shown(self._path)}")
