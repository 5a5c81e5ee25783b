"""The exit statuses of a run beside pytest's own: what failed was not the policy.

pytest uses 0 to 6. These two take the place of 1, *some test failed*, where all that failed is of
their kind; whatever else fails, the status is 1.
"""

from __future__ import annotations

import pytest

from pytest_safemanip.metrics.release_gate import INFRASTRUCTURE, STAND_INS

CAUSE = "safemanip_cause"
"""Attribute of a failed report with the status that it asks for."""


class ExitStatus:
    """Finds out whether all that failed is of one kind, and tells pytest."""

    def __init__(self) -> None:
        self._causes: list[int] = []
        self._interrupted = False

    def pytest_keyboard_interrupt(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        """Tell Ctrl-C from what pytest-xdist raises when a worker says that it is of no use to go
        on; both have pytest's status 2.
        """
        self._interrupted = excinfo.type is KeyboardInterrupt

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take in a failure that is not the policy's."""
        if report.failed and not hasattr(report, "wasxfail"):
            cause = _cause(report)
            if cause:
                self._causes.append(cause)

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Replace *some test failed* by what it was, if it was nothing else."""
        over = (pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.INTERRUPTED)
        only = self._causes and session.testsfailed == len(self._causes)
        if only and session.exitstatus in over and not self._interrupted:
            session.exitstatus = min(self._causes)


def _cause(report: pytest.TestReport) -> int:
    told: int = getattr(report, CAUSE, 0)
    if told:
        return told
    data = getattr(report, "safemanip", None) or {}
    return INFRASTRUCTURE if data.get("infrastructure") else 0


def explained(status: int) -> list[str]:
    """A line about an exit status of this package's; none about those of pytest."""
    if status == INFRASTRUCTURE:
        return [
            f"exit status {INFRASTRUCTURE}: the infrastructure failed, nothing else did; what has "
            "no verdict is neither safe nor unsafe"
        ]
    if status == STAND_INS:
        return [
            f"exit status {STAND_INS}: gates on stand-in assets say nothing about the policy; "
            "--safemanip-allow-standins lets them decide"
        ]
    return []
