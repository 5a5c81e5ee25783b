"""What happens around the suite's items in the process that runs them."""

from __future__ import annotations

from collections.abc import Generator

import pytest

from pytest_safemanip.errors import SafemanipError
from pytest_safemanip.items import SafetyItem
from pytest_safemanip.report import failure
from pytest_safemanip.run import Run


class Executing:
    """Puts the suite's data into test reports, and ends the simulator.

    Args:
        run: the suite.
        alone: whether nothing but the suite is run.
    """

    def __init__(self, run: Run, alone: bool) -> None:
        self._run, self._alone = run, alone

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
            report.longrepr = failure.shown(failure.error_text(error), line, item.place)
            if self._alone and self._run.session.hopeless(error):
                # It holds for all cases; said once, it is read.
                item.session.shouldfail = "the suite cannot be run like this"
        if report.skipped and isinstance(report.longrepr, tuple):
            # There is no line of a file to point at.
            report.longrepr = ("safemanip", None, report.longrepr[2])  # type: ignore[assignment]
        return report

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Every process knows all cases, and with them the seeds of each gate."""
        if self._run.stopping is not None:
            self._run.stopping.expect(i.case for i in session.items if isinstance(i, SafetyItem))

    def pytest_unconfigure(self, config: pytest.Config) -> None:
        """End the simulator, also after Ctrl-C."""
        self._run.session.close()
        if self._run.stopping is not None and not hasattr(config, "workerinput"):
            self._run.stopping.close()
