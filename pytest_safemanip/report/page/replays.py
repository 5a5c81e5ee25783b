"""The replay in 3D within the page, as far as this installation has one."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from pytest_safemanip.judge import Verdict
from pytest_safemanip.trace.recording import Recording

MOST = 200
"""Rollouts with a replay, the worst: each is some tens of kB."""
_PLACE = "pytest_safemanip.report.replay"
SCRIPTS, STYLES = ("three.min.js", "replay.js"), ("replay.css",)


def available() -> bool:
    """Whether rollouts can be replayed."""
    return find_spec(_PLACE) is not None


def replay(recording: Recording, verdicts: Mapping[str, Verdict]) -> dict[str, Any]:
    """What ``SafemanipReplay.mount`` shows of a rollout; plain builtins."""
    packed: dict[str, Any] = import_module(_PLACE).pack(recording, verdicts)
    return packed


def browser_files(names: tuple[str, ...]) -> list[str]:
    """The texts of scripts or styles of the replay."""
    standalone = import_module(f"{_PLACE}.standalone")
    return [standalone.browser_file(name) for name in names]
