"""A run of the suite in one process: the plan, what does it, and how it is told."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

from pytest_safemanip.cases import Case
from pytest_safemanip.plan import Plan
from pytest_safemanip.session import SafetySession
from pytest_safemanip.sim.backend import Backend
from pytest_safemanip.stopping import Stopping


def shown(path: Path, folder: Path) -> Path:
    """A path as somebody in a folder would type it."""
    return path.relative_to(folder) if path.is_relative_to(folder) else path


@dataclass(frozen=True)
class Run:
    """A run of the suite in this process.

    Attributes:
        plan: what there is to do.
        session: does it.
        backend: None when recordings are judged or cases only listed.
        stopping: knows which rollouts are still needed; None if all are run.
        command: the beginning of the command that runs one case again.
        folder: where pytest was started.
    """

    plan: Plan
    session: SafetySession
    backend: Backend | None
    stopping: Stopping | None
    command: str
    folder: Path

    def shown(self, path: Path) -> Path:
        """A path as the user would type it."""
        return shown(path, self.folder)

    def again(self, case: Case) -> str:
        """The command that runs a case again."""
        return f"{self.command} {shlex.quote(case.node_id)}"
