"""Main loop of the child process that steps the simulator.

It answers requests on standard input and output. Whatever else a simulator prints goes to
standard error, which the parent keeps in a log.
"""

from __future__ import annotations

import importlib
import os
import select
import signal
import sys
import threading
import time
import traceback
from collections.abc import Mapping
from typing import IO, Any

import numpy as np

from pytest_safemanip.errors import CannotStage, ConfigError, TaskError
from pytest_safemanip.sim import aside, clearance, codec, pushing, wire
from pytest_safemanip.sim.backend import Backend

GRACE = 4.0
"""Seconds in which a simulator has to end by itself once nobody asks any more; its parent gives it
a little longer."""

_ASKED = {ConfigError: "config", TaskError: "task", CannotStage: "staging"}
"""Errors of what was asked for, and their names in an answer; all others are the simulator's."""


def main(factory: str, arguments: Mapping[str, Any]) -> None:
    """Serve until the parent closes the connection.

    Args:
        factory: ``module:function`` that makes the backend.
        arguments: its keyword arguments, plain values.
    """
    # Ctrl-C reaches the whole process group; the parent decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests, replies = _take_over_standard_streams()
    threading.Thread(target=_end_with_parent, args=(requests.fileno(),), daemon=True).start()
    try:
        module, _, name = factory.partition(":")
        backend: Backend = getattr(importlib.import_module(module), name)(**arguments)
    except Exception as error:  # the parent raises it again
        wire.send(replies, _failure(error))
        return
    wire.send(replies, wire.Message({"ready": True}))
    try:
        _serve(backend, requests, replies)
    except wire.WireError:
        return  # the parent closed the connection or is gone
    finally:
        backend.close()


def _serve(backend: Backend, requests: IO[bytes], replies: IO[bytes]) -> None:
    while True:
        request = wire.receive(requests)
        if request.values["op"] == "go back":
            aside.go_back(int(request.values["levels"]))
        if request.values["op"] == "put aside":
            wire.send(replies, _put_aside(backend))
        else:
            wire.send(replies, _answer(backend, request))


def _put_aside(backend: Backend) -> wire.Message:
    """The answer that the state is put aside, and later, that it is the present one again."""
    try:
        if isinstance(backend, aside.Draws):
            backend.stop_drawing()
        return wire.Message({"present": aside.put_aside()})
    except Exception as error:  # the parent raises it again
        return _failure(error)


def _answer(backend: Backend, request: wire.Message) -> wire.Message:
    try:
        if request.values["op"] == "reset":
            start = backend.reset(codec.decode_request(request.values["request"]))
            return codec.encode_start(start)
        if request.values["op"] == "observe":
            return codec.encode_observation(backend.observe())
        if request.values["op"] == "clearance":
            return _clearance(backend, request)
        for entity, *force in request.values["pushes"]:
            _push(backend, entity, force)
        return codec.encode_step(backend.step(np.array(request.arrays["action"])))
    except Exception as error:  # the parent raises it again
        return _failure(error)


def _clearance(backend: Backend, request: wire.Message) -> wire.Message:
    if not isinstance(backend, clearance.Foresees):
        raise ConfigError(clearance.BLIND)
    paths = clearance.decode_paths(request.values["paths"], request.arrays)
    plain, arrays = clearance.encode_clearances(backend.clearance(paths))
    return wire.Message({"answers": plain}, arrays)


def _push(backend: Backend, entity: str, force: list[float]) -> None:
    if not isinstance(backend, pushing.Pushes):
        raise ConfigError("this simulator pushes nothing")
    backend.push(entity, np.array(force))


def _failure(error: Exception) -> wire.Message:
    traceback.print_exception(error, file=sys.stderr)
    sys.stderr.flush()
    kind = next((name for kind, name in _ASKED.items() if isinstance(error, kind)), "rollout")
    text = str(error) if kind != "rollout" else f"{type(error).__name__}: {error}"
    return wire.Message({"error": text, "kind": kind})


def _end_with_parent(requests: int) -> None:
    """End this process if the parent is gone, whatever the simulator is busy with."""
    watch = select.poll()
    watch.register(requests, 0)  # which reports the end of the connection alone
    watch.poll()
    time.sleep(GRACE)
    os._exit(1)


def _take_over_standard_streams() -> tuple[IO[bytes], IO[bytes]]:
    requests = os.fdopen(os.dup(0), "rb")
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
    return requests, replies
