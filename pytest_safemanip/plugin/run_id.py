"""Which test run a process belongs to."""

from __future__ import annotations

import pytest

_RUN_ID: pytest.StashKey[str] = pytest.StashKey()
WORKER_INPUT = "safemanip_run"
"""Where a worker of pytest-xdist finds it. xdist's own id can be given by the user, to two runs
the same."""


def run_id_of(config: pytest.Config) -> str:
    """Identifies the test run, the same in all of its processes."""
    if hasattr(config, "workerinput"):
        return str(config.workerinput[WORKER_INPUT])
    if _RUN_ID not in config.stash:
        import uuid

        config.stash[_RUN_ID] = uuid.uuid4().hex
    return config.stash[_RUN_ID]
