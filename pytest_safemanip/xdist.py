"""With pytest-xdist: cases of one rollout stay on one worker as long as there is enough to do."""

from __future__ import annotations

from typing import Any

import pytest


class Distribution:
    """Chooses the scheduler.

    Work stealing gives each worker neighbouring cases, which share a rollout; the default deals
    them out one by one, and workers would wait for each other's rollouts.
    """

    @pytest.hookimpl(tryfirst=True)
    def pytest_xdist_make_scheduler(self, config: pytest.Config, log: Any) -> Any:
        """Work stealing unless the user chose something else."""
        if config.getvalue("dist") != "load":
            return None
        from xdist.scheduler import WorkStealingScheduling

        return WorkStealingScheduling(config, log)
