"""The reports that `--safemanip-report` asks for, written when the session ends."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

import pytest

from pytest_safemanip.errors import SafemanipError, printable, raised_as
from pytest_safemanip.metrics.summaries import NAME
from pytest_safemanip.plugin.reports.github import GitHub
from pytest_safemanip.report.writers import stale_line, write_report
from pytest_safemanip.run.definitions import Definitions
from pytest_safemanip.run.invocation import Invocation
from pytest_safemanip.run.plan import Plan


class ReportFiles:
    """Writes reports, and remembers what became of each.

    Args:
        plan: the run; says which reports are wanted.
        invocation: what paths in messages refer to.
        github: is told, too; None where it is not to be.

    Attributes:
        summary: the file that was written of the run; None until it is, and if it cannot be. Of a
            part of a run beside a whole one there are no reports: those of the whole are kept.
        lines: what became of each report.
        interrupted: whether somebody did not want to wait for them.
    """

    def __init__(self, plan: Plan, invocation: Invocation, github: GitHub | None) -> None:
        self._plan, self._invocation, self._github = plan, invocation, github
        self.summary: Path | None = None
        self.lines: list[str] = []
        self._failed = self.interrupted = False

    @pytest.hookimpl(wrapper=True, trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> Generator[None, None, None]:
        """Write them when all else is there that they may show, before pytest's own summary."""
        try:
            yield
        finally:  # another plugin may fail to write its own
            if self.summary is not None:
                self._write(self.summary)
                unwritten = self._github.tell(self.summary) if self._github is not None else []
                self.lines += unwritten
                self._failed = self._failed or bool(unwritten)
            if self.interrupted:
                session.exitstatus = pytest.ExitCode.INTERRUPTED
            elif self._failed:
                session.exitstatus = session.exitstatus or pytest.ExitCode.TESTS_FAILED

    def _write(self, summary: Path) -> None:
        """Each whatever becomes of the others."""
        plan = self._plan
        judged_by = Definitions(plan.catalogue, plan.tasks, plan.properties, {}, plan.attributes)
        for name in plan.settings.reports:
            if self.interrupted:
                self.lines.append(f"report {name}: not written, the run was interrupted")
                continue
            if summary.name != NAME:
                self.lines.append(f"report {name}: not written for a part of a run, nor replaced")
                continue
            try:
                with raised_as(SafemanipError, "cannot be written"):
                    path = write_report(name, summary.parent, judged_by)
            except SafemanipError as error:  # whatever a writer raises, verdicts stand
                self._failed = True
                why = printable(str(error).partition("\n")[0], 300)
                self.lines.append(f"report {name}: {why}")
            except KeyboardInterrupt:
                self.interrupted = True
                self.lines.append(f"report {name}: not written, interrupted")
            else:
                self.lines.append(f"report {name}: {self._invocation.relative_path(path)}")
        stale = stale_line(summary.parent, plan.settings.reports) if summary.name == NAME else ""
        self.lines += [stale] if stale else []
