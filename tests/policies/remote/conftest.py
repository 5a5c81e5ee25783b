from __future__ import annotations

import contextlib
import dataclasses
import pickle
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.policies.remote.client import Beginning
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.observation import CAMERAS, INSTRUCTION, STATE
from pytest_safemanip.policies.remote.policy import RemotePolicy
from pytest_safemanip.policies.remote.presets import PRESETS
from pytest_safemanip.policies.remote.tokens import Token

SERVERS = Path(__file__).with_name("servers.py")
PATIENT = Deadlines(start=0.3, open=5.0, warm_up=10.0, call=10.0, restart=0.3)
QUICK = Deadlines(start=0.3, open=0.3, warm_up=0.3, call=0.3, restart=0.3)
"""Where a deadline is to be missed; elsewhere a loaded machine must not miss one."""
EPISODE = Beginning("OpenDrawer", 5, "open the drawer")


@contextlib.contextmanager
def little_memory(limit):
    """Fails if what is done inside allocates more than ``limit`` bytes at any time."""
    ours = not tracemalloc.is_tracing()
    if ours:
        tracemalloc.start()
    tracemalloc.reset_peak()
    before, _ = tracemalloc.get_traced_memory()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] - before < limit
    finally:
        if ours:
            tracemalloc.stop()


def unpickle(stream):
    """The next value of a stream that the package itself has written."""
    return pickle.load(stream)  # noqa: S301


@pytest.fixture
def observation():
    """An observation in which every entry differs from every other."""
    random = np.random.default_rng(0)
    found = {key: random.integers(0, 256, (256, 256, 3), np.uint8) for key in CAMERAS}
    for start, (key, size) in enumerate(STATE.items()):
        found[key] = np.arange(size, dtype=np.float32) / 16 + start
    return {**found, INSTRUCTION: "open the drawer"}


@pytest.fixture
def connect(tmp_path):
    """Makes policies for servers on this machine, and closes them."""
    with contextlib.ExitStack() as stack:

        def make(name, port, deadlines=PATIENT, token="", **changed):
            preset = dataclasses.replace(PRESETS[name], **changed)
            scheme = "tcp" if preset.transport == "groot" else "ws"
            endpoint = Endpoint(scheme, "127.0.0.1", port)
            policy = RemotePolicy(preset, endpoint, tmp_path / "dumps", deadlines, Token(token))
            stack.callback(policy.close)
            return policy

        yield make


@pytest.fixture
def process():
    """Starts servers in processes of their own; gives the process and its port."""
    with contextlib.ExitStack() as stack:

        def start(kind):
            running = stack.enter_context(
                subprocess.Popen(
                    [sys.executable, str(SERVERS), kind],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    text=True,
                )
            )
            stack.callback(running.kill)
            return running, int(running.stdout.readline())

        yield start
