"""What the main process tells: the header, the summary, `summary.json`."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import pytest

from pytest_safemanip.cases import is_case_id, parse_node_id
from pytest_safemanip.gating import Gating
from pytest_safemanip.items import SafetyItem
from pytest_safemanip.metrics.groups import Metrics, measure_each
from pytest_safemanip.report import document
from pytest_safemanip.report.header import header_lines, not_grounded_lines
from pytest_safemanip.report.numbers import counted
from pytest_safemanip.report.results import Results, error_data
from pytest_safemanip.report.rulings import ruling_lines
from pytest_safemanip.report.table import summary_lines
from pytest_safemanip.run import Run

_CRASH: Any = "???"
"""The phase in xdist's report about a worker that died."""


class Reporting:
    """Collects the data of all test reports, from this process and from workers.

    Args:
        run: the suite.
        results: takes in what is found out.
        gating: decides on it; None without gates and without a baseline.
    """

    def __init__(self, run: Run, results: Results, gating: Gating | None) -> None:
        self._run, self._results, self._gating = run, results, gating
        self._path = run.plan.settings.out / "summary.json"

    def pytest_report_header(self) -> list[str]:
        """What is about to be done."""
        source = self._run.backend.provenance if self._run.backend else None
        lines = header_lines(self._run.plan, source)
        # Asked for a list of cases, one wants to know which are not on it.
        return lines + (not_grounded_lines(self._run.plan) if source is None else [])

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
        if not session.config.option.collectonly and self._results.begun:
            found = document.summary(self._run.plan, self._results, self._metrics)
            ruling = self._gating.ruling if self._gating else None
            if ruling is not None:
                found["release"] = ruling.to_json()
            document.write(found, self._path)

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """Show the metrics, and what they decide."""
        lines = self._lines()
        if lines:
            terminalreporter.write_sep("=", "safety")
            for line in lines:
                terminalreporter.write_line(line)

    @cached_property
    def _metrics(self) -> dict[str, Metrics]:
        """Computed once, when everything has been run."""
        return measure_each(self._results.records)

    def _lines(self) -> list[str]:
        ruling = self._gating.ruling if self._gating else None
        decided = ["", *ruling_lines(ruling)] if ruling else []
        if not self._results.begun:
            return decided[1:]
        missing, expected = len(self._results.missing), len(self._results.expected)
        saved = len(self._results.saved)
        return [
            *summary_lines(self._results.records, self._metrics),
            *(["", f"{missing} of {expected} cases were not run"] if missing else []),
            *decided,
            *([f"  {counted(saved, 'rollout')} saved by deciding early"] if saved else []),
            "",
            f"summary: {self._run.shown(self._path)}",
        ]
