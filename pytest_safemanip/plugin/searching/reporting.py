"""What is reported of searches: progress through test reports to the terminal and the summary."""

from __future__ import annotations

import contextlib
from collections.abc import Generator
from typing import Any

import pytest

from pytest_safemanip.errors import SafemanipError
from pytest_safemanip.plugin.longrepr import to_longrepr
from pytest_safemanip.plugin.searching.items import RegressionItem, SearchItem
from pytest_safemanip.plugin.searching.telling import Telling
from pytest_safemanip.report.failure import ErrorTexts
from pytest_safemanip.report.numbers import counted
from pytest_safemanip.report.searching import SearchData, search_lines
from pytest_safemanip.run.searching.plan import SearchPlan
from pytest_safemanip.run.session import SafetySession


class SearchExecuting:
    """Puts what searches found into test reports; says plainly what went wrong.

    Args:
        rollouts: ends with pytest.
    """

    def __init__(self, rollouts: SafetySession) -> None:
        self._rollouts = rollouts
        self._errors = ErrorTexts()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Attach what was found."""
        report = yield
        if not isinstance(item, SearchItem | RegressionItem):
            return report
        if call.when == "call" and item.data is not None:
            vars(report)["safemanip_search"] = item.data
        if call.when == "setup" and call.excinfo and isinstance(call.excinfo.value, SafemanipError):
            error = call.excinfo.value
            style = item.config.option.tbstyle
            line = str(error).splitlines()[0]
            report.longrepr = to_longrepr(self._errors.text(error), line, item.place, style)
        return report

    @pytest.hookimpl(optionalhook=True, tryfirst=True)
    def pytest_timeout_set_timer(self, item: pytest.Item) -> Any:
        """pytest-timeout has no say in searches: the first of a policy and a task runs them all."""
        return True if isinstance(item, SearchItem | RegressionItem) else None


class SearchReporting:
    """Collects what searches found, from this process and from workers.

    Args:
        searches: those of the run.
        telling: tells what they found.

    Attributes:
        found: of each search.
    """

    def __init__(self, searches: SearchPlan, telling: Telling) -> None:
        self._searches, self._telling = searches, telling
        self.found: list[SearchData] = []

    def pytest_report_header(self) -> list[str]:
        """What is about to be looked for."""
        lines = []
        if self._searches.cases:
            effort = self._searches.effort
            number = len(self._searches.cases)
            lines.append(f"safemanip: searches: {number}, up to {effort.rollouts} rollouts each")
        if self._searches.regressions:
            kept = counted(len(self._searches.regressions), "kept failure")
            lines.append(f"safemanip: {kept} of {self._searches.folder.name}/ tried again")
        return lines

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take in what a search found."""
        data = getattr(report, "safemanip_search", None)
        if data is not None:
            self.found.append(data)

    @pytest.hookimpl(wrapper=True)
    def pytest_sessionfinish(self) -> Generator[None, None, None]:
        """Take in what searches found by now that Ctrl-C has ended, before anything is written."""
        told = {(own["task"], own["policy"], own["property"]) for own in self.found}
        for case in self._searches.cases:
            found = self._telling.running.so_far.get((case.task, case.policy))
            key = case.task, case.policy, case.property_id
            if found is not None and key not in told:
                # What cannot be told is an error of its item already.
                with contextlib.suppress(SafemanipError, OSError):
                    self.found.append(self._telling.tell(case, found)[0])
        return (yield)

    @pytest.hookimpl(trylast=True)
    def pytest_terminal_summary(self, terminalreporter: Any, config: pytest.Config) -> None:
        """Show what was found, and what was looked at."""
        if config.option.no_summary or config.get_verbosity() < -1 or not self.found:
            return
        terminalreporter.write_sep("=", "searches")
        for line in search_lines(self.found, config.get_terminal_writer().fullwidth):
            terminalreporter.write_line(line)
