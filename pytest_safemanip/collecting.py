"""How the suite gets into what pytest collects."""

from __future__ import annotations

from collections.abc import Generator

import pytest

from pytest_safemanip.items import make_suite
from pytest_safemanip.session import Run


class CollectAlone:
    """The suite is all there is: no path was given, and the folder is not searched for tests."""

    def __init__(self, run: Run) -> None:
        self._run = run

    @pytest.hookimpl(tryfirst=True)
    def pytest_make_collect_report(
        self, collector: pytest.Collector
    ) -> pytest.CollectReport | None:
        """Answer for the session."""
        if not isinstance(collector, pytest.Session):
            return None
        suite = make_suite(collector, self._run)
        return pytest.CollectReport(collector.nodeid, "passed", None, [suite])


class CollectBeside:
    """The suite comes after the tests of the given paths."""

    def __init__(self, run: Run) -> None:
        self._run = run

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(
        self, collector: pytest.Collector
    ) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
        """Add to what the session found."""
        report = yield
        if isinstance(collector, pytest.Session) and report.passed:
            report.result = [*(report.result or []), make_suite(collector, self._run)]
        return report
