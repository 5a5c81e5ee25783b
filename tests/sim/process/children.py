"""Simulators for the child process that behave and misbehave in known ways."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError, TaskError
from pytest_safemanip.sim.backend import Request, Start
from pytest_safemanip.trace import Step
from tests.toy import World

HANGS_AT, FAILS_AT, DIES_AT, BLIND = 2, 3, 4, 5
"""Seeds of episodes whose first step goes wrong, or of which nothing can be seen."""


class Simulator(World):
    """The toy world, noisy; some seeds go wrong."""

    def reset(self, request: Request) -> Start:
        sys.stdout.write("noise on standard output\n")
        os.write(1, b"noise below python\n")
        sys.stderr.write("noise on standard error\n")
        os.environ["SIMULATOR_WAS_HERE"] = "1"
        if request.task == "Missing":
            raise ConfigError("there is no task 'Missing'")
        if request.task == "Crowded":
            raise TaskError("the vase has no room")
        return super().reset(request)

    def step(self, action: Any) -> Step:
        seed = self.requests[-1].seed
        if seed == HANGS_AT:
            time.sleep(600.0)
        if seed == FAILS_AT:
            raise ZeroDivisionError("the physics exploded")
        if seed == DIES_AT:
            sys.stderr.write("last words\n")
            sys.stderr.flush()
            os._exit(7)
        return super().step(action)

    def observe(self) -> dict[str, Any]:
        if self.requests[-1].seed == BLIND:
            raise ZeroDivisionError("the lens broke")
        seen: dict[str, Any] = super().observe()
        return seen


def simulator() -> Simulator:
    return Simulator()


def environment(path: str) -> Simulator:
    """Notes what it finds itself in."""
    names = ("OPENBLAS_NUM_THREADS", "PYTHONHASHSEED", "MUJOCO_GL", "PYOPENGL_PLATFORM")
    Path(path).write_text(repr({name: os.environ.get(name) for name in names}))
    return Simulator()


def unusable() -> Simulator:
    raise ConfigError("the simulator is not installed; install it with: pip install it")


def killed_at_first(path: str) -> Simulator:
    if not Path(path).exists():
        Path(path).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return Simulator()


def slow() -> Simulator:
    time.sleep(600.0)
    return Simulator()
