"""How the suite gets into what pytest collects."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence

import pytest

Maker = Callable[[pytest.Session], pytest.Collector]
"""Makes a suite of a session."""


class CollectExclusive:
    """The suite is all there is: the folder is not searched for tests."""

    def __init__(self, makers: Sequence[Maker]) -> None:
        self._makers = makers

    @pytest.hookimpl(tryfirst=True)
    def pytest_make_collect_report(
        self, collector: pytest.Collector
    ) -> pytest.CollectReport | None:
        """Answer for the session."""
        if not isinstance(collector, pytest.Session):
            return None
        suites: list[pytest.Item | pytest.Collector] = [make(collector) for make in self._makers]
        return pytest.CollectReport(collector.nodeid, "passed", None, suites)


class CollectAppended:
    """The suite comes after the tests that pytest finds."""

    def __init__(self, makers: Sequence[Maker]) -> None:
        self._makers = makers

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(
        self, collector: pytest.Collector
    ) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
        """Add to what the session found."""
        report = yield
        if isinstance(collector, pytest.Session) and report.passed:
            report.result = [*(report.result or []), *(make(collector) for make in self._makers)]
        return report
