"""Round trips to a policy's server on this machine, beside a plain client of openpi's protocol.

    python -m benchmarks.speed.policies

One observation (three images, the state, an instruction) goes to a server in a process of its own
that computes nothing, and a chunk of actions comes back. The reference is openpi-client where it is
installed, else a client of a few lines with the same encoding: it neither bounds nor checks what it
receives, and has no deadlines. All rows have the same number of calls, in turn.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import io
import pickle  # to write what torch.save writes; the package reads it as data
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import zmq
from websockets.sync.client import connect
from websockets.sync.server import serve

from pytest_safemanip.policies.remote import groot, openpi, vlaeval
from pytest_safemanip.policies.remote.actions import PARTS
from pytest_safemanip.policies.remote.client import Beginning, Client
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.observation import CAMERAS, blank
from pytest_safemanip.policies.remote.presets import PRESETS
from pytest_safemanip.policies.remote.wire.packing import (
    groot_array,
    openpi_array,
    pack,
    vlaeval_array,
)
from pytest_safemanip.sim.backend import Options, Request
from pytest_safemanip.sim.robocasa.factory import create

CHUNK = np.full((50, 12), 0.25)
ACTIONS = {f"action.{part}": CHUNK[None, :16, where] for part, where in PARTS.items()}


def torch_file(value: Any) -> bytes:
    """A file as ``torch.save`` writes it."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("archive/data.pkl", pickle.dumps(value, protocol=2))
    return stream.getvalue()


REPLIES = {
    "openpi": pack({"actions": CHUNK, "policy_timing": {"infer_ms": 0.0}}, openpi_array),
    "groot": pack(ACTIONS, groot_array),
    "groot-torch": torch_file(ACTIONS),
    "vla-eval": pack({"actions": CHUNK[0]}, vlaeval_array),
}


FRAMES = 15
CHUNKS = {
    "openpi": PRESETS["pi05"].steps,
    "GR00T": PRESETS["groot"].steps,
    "vla-eval": PRESETS["vla-eval"].steps,
}
"""Control steps for each call."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--calls", type=int, default=200, metavar="N")
    parser.add_argument("--serve", choices=REPLIES, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.serve:
        (_serve_zmq if asked.serve.startswith("groot") else _serve_websocket)(asked.serve)
        return
    with contextlib.ExitStack() as stack:
        rows = _rows(stack)
        times: dict[str, list[float]] = {name: [] for name in rows}
        for _ in range(asked.calls + 5):
            for name, (call, _, _) in rows.items():
                began = time.perf_counter()
                call()
                times[name].append(1000 * (time.perf_counter() - began))
    _print(rows, {name: measured[5:] for name, measured in times.items()})


Row = tuple[Callable[[], Any], int, int]


def _rows(stack: contextlib.ExitStack) -> dict[str, Row]:
    """What is measured: a call, and the bytes of its request and reply."""
    large, small = _observation(256), _observation(224)
    request = openpi.request_of(small)
    size = len(pack(request, openpi_array)), len(REPLIES["openpi"])
    port = stack.enter_context(_serving("openpi"))
    reference, name = _reference(port)
    ours = _client(stack, "openpi", port)
    msgpacked = _client(stack, "groot", stack.enter_context(_serving("groot")))
    torched = _client(stack, "groot", stack.enter_context(_serving("groot-torch")))
    stepped = _client(stack, "vla-eval", stack.enter_context(_serving("vla-eval")))
    asked = {"endpoint": "get_action", "data": groot.request_of(large)}
    return {
        f"{name}, 3 x 224": (lambda: reference(request), *size),
        "openpi, 3 x 224": (lambda: ours.ask(small, 10.0), *size),
        "openpi, 3 x 256, resized": (lambda: ours.ask(large, 10.0), *size),
        "GR00T msgpack, 3 x 256": (
            lambda: msgpacked.ask(large, 10.0),
            len(groot.MSGPACK.encode(asked)),
            len(REPLIES["groot"]),
        ),
        "GR00T torch, 3 x 256": (
            lambda: torched.ask(large, 10.0),
            len(groot.TORCH.encode(asked)),
            len(REPLIES["groot-torch"]),
        ),
        "vla-eval, 3 x 256": (
            lambda: stepped.ask(large, 10.0),
            len(pack(vlaeval.payload_of(large), vlaeval_array)),
            len(REPLIES["vla-eval"]),
        ),
    }


def _observation(size: int) -> dict[str, Any]:
    random = np.random.default_rng(0)
    images = {key: random.integers(0, 256, (size, size, 3), np.uint8) for key in CAMERAS}
    return {**blank(), **images}


def _client(stack: contextlib.ExitStack, name: str, port: int) -> Client:
    client: Client
    if name == "groot":
        endpoint = Endpoint("tcp", "127.0.0.1", port)
        client = groot.GrootClient(endpoint, Deadlines(), PRESETS["groot"])
    elif name == "openpi":
        client = openpi.OpenpiClient(Endpoint("ws", "127.0.0.1", port), Deadlines(), "")
    else:
        client = vlaeval.VlaEvalClient(Endpoint("ws", "127.0.0.1", port), Deadlines(), "")
    client.open()
    client.begin(Beginning("OpenDrawer", 0, "open the drawer"), 10.0)
    stack.callback(client.close)
    return client


def _reference(port: int) -> tuple[Callable[[Any], Any], str]:
    """openpi-client, or its encoding by hand."""
    try:
        theirs = importlib.import_module("openpi_client.websocket_client_policy")
    except ImportError:
        connection = connect(f"ws://127.0.0.1:{port}", compression=None, max_size=None)
        connection.__enter__()
        connection.recv()

        def call(request: Any) -> Any:
            connection.send(msgpack.packb(request, default=openpi_array))
            return msgpack.unpackb(connection.recv(), object_hook=_plain_array)

        return call, "plain client"
    return theirs.WebsocketClientPolicy("127.0.0.1", port).infer, "openpi-client"


def _plain_array(found: dict[Any, Any]) -> Any:
    if b"__ndarray__" in found:
        return np.ndarray(found[b"shape"], np.dtype(found[b"dtype"]), found[b"data"])
    return found


@contextlib.contextmanager
def _serving(name: str) -> Iterator[int]:
    """A server in a process of its own; gives its port."""
    command = [sys.executable, "-m", "benchmarks.speed.policies", "--serve", name]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield int(process.stdout.readline())
        finally:
            process.kill()


def _serve_zmq(name: str) -> None:
    """Answers like GR00T's server; msgpack is decoded before, torch's files are not."""
    encode = torch_file if name == "groot-torch" else lambda v: pack(v, groot_array)
    socket = zmq.Context().socket(zmq.REP)
    print(socket.bind_to_random_port("tcp://127.0.0.1"), flush=True)
    while True:
        request = socket.recv()
        if len(request) > 10_000:
            if name == "groot":
                msgpack.unpackb(request)
            socket.send(REPLIES[name])
        else:
            socket.send(encode({} if b"get_modality" in request else {"status": "ok"}))


def _serve_websocket(name: str) -> None:
    """Answers like openpi's or vla-eval's server, after it has decoded what it was asked."""

    def converse(connection: Any) -> None:
        if name == "openpi":
            connection.send(b"\x80")
        for frame in connection:
            message = msgpack.unpackb(frame)
            if name == "openpi":
                connection.send(REPLIES[name])
            elif message["type"] in ("hello", "observation"):
                hello = message["type"] == "hello"
                kind = {"type": "hello" if hello else "action", "seq": message["seq"]}
                payload = {"protocol_version": 1} if hello else msgpack.unpackb(REPLIES[name])
                connection.send(msgpack.packb({**kind, "payload": payload, "timestamp": 0.0}))

    with serve(converse, "127.0.0.1", 0, compression=None, max_size=None) as server:
        print(server.socket.getsockname()[1], flush=True)
        server.serve_forever()


def _simulating() -> tuple[float, float]:
    """Milliseconds of a control step, and of drawing what a model sees, in the compact scene."""
    hold = np.zeros(12)
    hold[[6, 11]] = -1.0
    spent: dict[str, list[float]] = {"step": [], "observe": []}
    with tempfile.TemporaryDirectory() as logs:
        backend = create(Options("primitive", Path(logs)))
        backend.reset(Request("OpenDrawer", 0, "compact"))
        for _ in range(FRAMES):
            for name, call in {
                "step": lambda: backend.step(hold),
                "observe": backend.observe,
            }.items():
                start = time.perf_counter()
                call()
                spent[name].append(1e3 * (time.perf_counter() - start))
        backend.close()
    return float(np.median(spent["step"])), float(np.median(spent["observe"]))


def _print(rows: dict[str, Row], times: dict[str, list[float]]) -> None:
    reference = float(np.median(next(iter(times.values()))))
    step, observe = _simulating()
    titles = ("round trip", "request B", "reply B", "median ms", "p95 ms", "ratio", "share")
    print("{:<28}{:>10}{:>9}{:>11}{:>8}{:>7}{:>8}".format(*titles))
    for name, (_, request, reply) in rows.items():
        median, late = np.percentile(times[name], [50, 95])
        ratio = median / reference
        chunk = next((steps for kind, steps in CHUNKS.items() if name.startswith(kind)), 5)
        share = median / (median + observe + chunk * step)
        print(f"{name:<28}{request:>10}{reply:>9}{median:>11.2f}{late:>8.2f}{ratio:>7.2f}", end="")
        print(f"{share:>8.1%}")
    print(
        f"\nshare: of a rollout's wall time without the model; a control step takes {step:.1f} ms, "
        f"drawing three images {observe:.0f} ms here"
    )


if __name__ == "__main__":
    main()
