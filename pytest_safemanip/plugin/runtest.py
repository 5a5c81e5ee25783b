"""What happens around the suite's items in the process that runs them."""

from __future__ import annotations

import sys
from collections.abc import Generator
from typing import Any

import pytest

from pytest_safemanip.errors import ConfigError, RolloutError, SafemanipError
from pytest_safemanip.plugin.items import SafetyItem
from pytest_safemanip.plugin.longrepr import to_longrepr
from pytest_safemanip.plugin.markers import label_for_allure
from pytest_safemanip.report.failure import ErrorTexts
from pytest_safemanip.run.early_stopping import EarlyStopping
from pytest_safemanip.run.session import SafetySession


class Executing:
    """Puts the suite's data into test reports, and ends what rollouts are run with.

    Args:
        rollouts: runs and judges the rollouts.
        stopping: knows which rollouts are still needed; None if all are run.
    """

    def __init__(self, rollouts: SafetySession, stopping: EarlyStopping | None) -> None:
        self._rollouts, self._stopping = rollouts, stopping
        self._errors = ErrorTexts()
        self._only_cases = False

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Attach what is known about the case; say plainly what went wrong."""
        report = yield
        if not isinstance(item, SafetyItem):
            return report
        if call.when == "call" or (call.when == "setup" and not report.passed):
            vars(report)["safemanip"] = item.data
        if call.when == "setup" and call.excinfo and isinstance(call.excinfo.value, SafemanipError):
            error = call.excinfo.value
            line = str(error).splitlines()[0]
            style = item.config.option.tbstyle
            report.longrepr = to_longrepr(self._errors.text(error), line, item.place, style)
            if self._only_cases and self._rollouts.is_fatal(error):
                # It holds for all cases; said once, it is read.
                item.session.shouldfail = (
                    "no rollout can be run"
                    if isinstance(error, ConfigError)
                    else "no server can be used for any rollout"
                )
        if report.skipped and isinstance(report.longrepr, tuple):
            # There is no line of a file to point at.
            report.longrepr = ("safemanip", None, report.longrepr[2])  # type: ignore[assignment]
        return report

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Every process knows all cases, and with them the seeds of each gate."""
        items = [item for item in session.items if isinstance(item, SafetyItem)]
        self._only_cases = len(items) == len(session.items)
        cases = [item.case for item in items]
        if self._stopping is not None:
            self._stopping.expect(cases)
            self._rollouts.expect(cases, self._stopping.undecided)
        else:
            self._rollouts.expect(cases)
        if session.config.getoption("allure_report_dir", None):
            for item in items:
                label_for_allure(item, item.case, item.property.category)

    @pytest.hookimpl(optionalhook=True, tryfirst=True)
    def pytest_timeout_set_timer(self, item: pytest.Item) -> Any:
        """pytest-timeout has no say in cases: the first of a rollout waits for all of it.

        A rollout ends at its horizon, a server's answer is awaited no longer than its deadline.
        """
        return True if isinstance(item, SafetyItem) else None

    def pytest_unconfigure(self, config: pytest.Config) -> None:
        """End the connections to policies, also after Ctrl-C. The run is over: what a policy does
        wrong at that changes nothing of it, and is told.
        """
        try:
            self._rollouts.close()
        except RolloutError as error:
            sys.stderr.write(f"safemanip: {error}\n")
        if self._stopping is not None and not hasattr(config, "workerinput"):
            self._stopping.close()
