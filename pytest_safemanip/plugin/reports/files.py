"""The reports that `--safemanip-report` asks for, written when the session ends."""

from __future__ import annotations

from pathlib import Path

from pytest_safemanip.errors import first_line, printable
from pytest_safemanip.metrics.summaries import NAME
from pytest_safemanip.report.writers import write_report
from pytest_safemanip.run.definitions import Definitions
from pytest_safemanip.run.invocation import Invocation
from pytest_safemanip.run.plan import Plan


class ReportFiles:
    """Writes reports, and remembers what became of each.

    Args:
        plan: the run; says which reports are wanted.
        invocation: what paths in messages refer to.
    """

    def __init__(self, plan: Plan, invocation: Invocation) -> None:
        self._plan, self._invocation = plan, invocation
        self.lines: list[str] = []
        self.failed = False

    def write(self, summary: Path) -> None:
        """Write them all, each whatever becomes of the others.

        Args:
            summary: the file that was written of the run; of a part of a run beside a whole one,
                there are no reports: those of the whole run are kept.
        """
        plan = self._plan
        judged_by = Definitions(plan.catalogue, plan.tasks, plan.properties, {}, plan.attributes)
        for name in plan.settings.reports:
            if summary.name != NAME:
                self.lines.append(f"report {name}: not written for a part of a run, nor replaced")
                continue
            try:
                path = write_report(name, summary.parent, judged_by)
            except Exception as error:  # whatever a writer raises, verdicts stand
                self.failed = True
                why = printable(first_line(error), 300)
                self.lines.append(f"report {name}: cannot be written: {why}")
            else:
                self.lines.append(f"report {name}: {self._invocation.relative_path(path)}")
