"""With pytest-xdist: cases of one rollout stay on one worker as long as there is enough to do."""

from __future__ import annotations

from typing import Any

import pytest

from pytest_safemanip.cases import is_case_id, parse_node_id


class Distribution:
    """Chooses the scheduler.

    Work stealing gives each worker neighbouring cases, which share a rollout; the default deals
    them out one by one, and workers would wait for each other's rollouts. Where rollouts stop
    early, they are begun in their order, so that none is run for nothing.

    Args:
        in_order: whether rollouts stop early.
    """

    def __init__(self, in_order: bool) -> None:
        self._in_order = in_order

    @pytest.hookimpl(tryfirst=True)
    def pytest_xdist_make_scheduler(self, config: pytest.Config, log: Any) -> Any:
        """Ours, unless the user chose something else."""
        if config.getvalue("dist") != "load":
            return None
        if self._in_order:
            return _by_rollout(config, log)
        from xdist.scheduler import WorkStealingScheduling

        return WorkStealingScheduling(config, log)


def _by_rollout(config: pytest.Config, log: Any) -> Any:
    """Rollouts one after the other, to whichever worker is free."""
    from xdist.scheduler import LoadScopeScheduling

    class ByRollout(LoadScopeScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            return str(parse_node_id(nodeid).rollout) if is_case_id(nodeid) else nodeid

    config.option.loadscopereorder = False
    return ByRollout(config, log)
