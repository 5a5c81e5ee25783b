"""With pytest-xdist: cases of one rollout stay on one worker as long as there is enough to do, and
a worker that dies is an error.
"""

from __future__ import annotations

from typing import Any

import pytest

from pytest_safemanip.errors import WorkerDied
from pytest_safemanip.plugin.longrepr import to_longrepr
from pytest_safemanip.report.junit import case_properties
from pytest_safemanip.run.cases import is_case_id, parse_node_id
from pytest_safemanip.run.invocation import Invocation
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.results import error_data


class Distribution:
    """Chooses the scheduler.

    Work stealing gives each worker neighbouring cases, which share a rollout; the default deals
    them out one by one, and workers would wait for each other's rollouts. Where rollouts stop
    early, they are begun in their order, so that none is run for nothing.

    Args:
        in_order: whether rollouts stop early.
        jobs: whether rollouts were asked to be run side by side without xdist, too.
    """

    def __init__(self, in_order: bool, jobs: bool) -> None:
        self._in_order, self._jobs = in_order, jobs

    def pytest_report_header(self, config: pytest.Config) -> str | None:
        """Say that workers are what runs rollouts side by side."""
        if not self._jobs or not config.getoption("numprocesses", None):
            return None
        return "safemanip: each worker runs one rollout at a time; --safemanip-jobs is without -n"

    @pytest.hookimpl(tryfirst=True)
    def pytest_xdist_make_scheduler(self, config: pytest.Config, log: Any) -> Any:
        """Ours, unless the user chose something else."""
        if config.getvalue("dist") != "load":
            return None
        if self._in_order:
            return _by_rollout(config, log)
        from xdist.scheduler import WorkStealingScheduling

        return WorkStealingScheduling(config, log)


class WorkerDeaths:
    """Makes xdist's report of a worker that died one of an error: it calls it a failed test.

    Args:
        plan: the run.
        invocation: what paths in messages refer to.
    """

    def __init__(self, plan: Plan, invocation: Invocation) -> None:
        self._plan, self._invocation = plan, invocation

    @pytest.hookimpl(optionalhook=True)
    def pytest_handlecrashitem(self, crashitem: str, report: Any) -> None:
        """Say what it means for the case that the worker was at."""
        if not is_case_id(crashitem):
            return
        case = parse_node_id(crashitem)
        prop = self._plan.properties[case.property_id]
        line = (
            f"worker {report.node.gateway.id} died at this case: it was killed, as for memory, or "
            "the policy's own code crashed; the same command runs what it left"
        )
        place = self._invocation.relative_path(prop.path)
        report.when = "setup"  # what goes wrong there is an error, not a failure
        report.location = (crashitem.partition("::")[0], None, case.heading)
        report.longrepr = to_longrepr(line, line, place)
        report.user_properties = case_properties(case, self._plan.tasks[case.task], prop)
        report.safemanip = error_data(case, line, WorkerDied.infrastructure)


def _by_rollout(config: pytest.Config, log: Any) -> Any:
    """Rollouts one after the other, to whichever worker is free."""
    from xdist.scheduler import LoadScopeScheduling

    class ByRollout(LoadScopeScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            return str(parse_node_id(nodeid).rollout) if is_case_id(nodeid) else nodeid

    config.option.loadscopereorder = False
    return ByRollout(config, log)
