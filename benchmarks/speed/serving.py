"""What rollouts side by side make of a policy's server: how busy it is, and how long a run takes.

    python -m benchmarks.speed.serving [--robocasa]

The server speaks openpi's protocol around a policy that sleeps, as a model computes on a GPU of
its own; it answers one request after the other, or two at a time. The simulator sleeps too,
unless it is RoboCasa's: kitchens and images at the pace of a machine with a GPU, which leaves the
cores to what is measured. With ``--robocasa`` it is the real one, with what it costs here.

``busy`` is the share of the time from the first request to the last reply in which the policy
computes, of as many as it could; ``ratio`` compares with one rollout at a time. Both include
everything around the calls. The overhead of a call is measured with a policy that takes no time.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import platform
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from websockets.sync.server import serve

from pytest_safemanip.policies.remote.client import Turn
from pytest_safemanip.policies.remote.endpoint import Endpoint
from pytest_safemanip.policies.remote.observation import blank
from pytest_safemanip.policies.remote.policy import RemotePolicy
from pytest_safemanip.policies.remote.presets import PRESETS
from pytest_safemanip.policies.remote.wire.packing import from_openpi, openpi_array, pack, unpack
from pytest_safemanip.policies.slots import Slots

PROJECT = Path(__file__).parents[2]
CALLS = 200
"""Calls whose overhead is measured."""
CONFTEST = f"""
import dataclasses, sys, time
sys.path.insert(0, {str(PROJECT)!r})
from tests import toy

class Paced(toy.World):
    '''Takes its time: seconds for a reset, a control step and an observation.'''
    def reset(self, request):
        time.sleep(RESET)
        return super().reset(request)
    def step(self, action):
        time.sleep(STEP)
        return super().step(action)
    def observe(self):
        time.sleep(OBSERVE)
        return super().observe()

def pytest_safemanip_backends():
    make = lambda options: Paced(succeeds_at=None, horizon=HORIZON)
    return {{"paced": dataclasses.replace(toy.simulator(make))}}
"""
INI = """
[pytest]
safemanip_policy = openpi
safemanip_scenes = compact
safemanip_assets = primitive
safemanip_deadlines =
    call = 60
"""
PACED = """safemanip_backend = paced
safemanip_tasks = PickPlaceCounterToCabinet
"""
ROBOCASA = """safemanip_tasks = PickPlaceCounterToCabinet
safemanip_horizon_scale = {scale}
safemanip_stepping = fast
"""


@dataclass(frozen=True)
class Load:
    """What is run against a server.

    Attributes:
        title: of its table.
        seconds: that the policy takes for an answer.
        rollouts: number of them.
        steps: control steps of each, five for each call.
        sides: servers by the requests that they answer at a time.
        jobs: numbers of rollouts side by side.
        pace: seconds of the simulator for a reset, a control step and an observation.
    """

    title: str
    seconds: float
    rollouts: int
    steps: int
    sides: tuple[int, ...]
    jobs: tuple[int, ...]
    pace: tuple[float, float, float]


LOADS = (
    Load("a policy of 90 ms, 32 rollouts", 0.09, 32, 100, (1,), (1, 4, 8, 16), (2.0, 0.008, 0.03)),
    # A large kitchen, drawn without a GPU.
    Load("a policy of 1 s, 4 rollouts", 1.0, 4, 60, (1, 2), (1, 2, 4), (5.0, 0.02, 0.25)),
)


class Server:
    """A server around a policy that sleeps, in a process of its own.

    Args:
        seconds: for an answer.
        together: requests that are answered at a time.
        log: file with the beginning and the end of every answer.
    """

    def __init__(self, seconds: float, together: int, log: Path) -> None:
        self.seconds, self.log = seconds, log
        self.turns = threading.Semaphore(together)

    def converse(self, connection: Any) -> None:
        """Answer one client."""
        reply = pack({"actions": np.full((50, 12), 0.01)}, openpi_array)
        connection.send(pack({}, openpi_array))
        for frame in connection:
            unpack(frame, from_openpi)
            with self.turns:
                began = time.monotonic()
                if self.seconds:
                    time.sleep(self.seconds)
                self.note(began)
            connection.send(reply)

    def note(self, began: float) -> None:
        """Log an answer; one line is written whole."""
        line = f"{began} {time.monotonic()}\n".encode()
        handle = os.open(self.log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
        os.write(handle, line)
        os.close(handle)


@contextlib.contextmanager
def serving(seconds: float, together: int, log: Path) -> Iterator[int]:
    """A server in a process of its own; gives its port."""
    command = [sys.executable, "-m", "benchmarks.speed.serving", "--serve"]
    command += [str(seconds), str(together), str(log)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield int(process.stdout.readline())
        finally:
            process.kill()


def run(load: Load, together: int, mode: tuple[str, ...], robocasa: bool) -> tuple[float, float]:
    """One run of the suite: wall time in seconds, and the server's busy share."""
    with tempfile.TemporaryDirectory() as scratch:
        folder, log = Path(scratch), Path(scratch, "log")
        pace = dict(zip(("RESET", "STEP", "OBSERVE"), load.pace, strict=True))
        text = CONFTEST
        for name, value in {**pace, "HORIZON": load.steps}.items():
            text = text.replace(name, str(value))
        (folder / "conftest.py").write_text("" if robocasa else text)
        own = ROBOCASA.format(scale=load.steps / 500) if robocasa else PACED
        inflight = f"safemanip_inflight =\n    openpi = {together}\n"
        (folder / "pytest.ini").write_text(INI + inflight + own)
        with serving(load.seconds, together, log) as port:
            command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
            command += [f"--safemanip-policy=openpi=ws://127.0.0.1:{port}", "--safemanip-fresh"]
            command += [f"--safemanip-seeds={load.rollouts}", "--safemanip-violations=xfail"]
            began = time.monotonic()
            command += mode
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
            wall = time.monotonic() - began
        recorded = [*folder.glob(".safemanip/recordings/*.rollout")]
        if done.returncode or len(recorded) < load.rollouts:
            raise SystemExit(f"{' '.join(mode)} failed:\n{done.stdout[-2000:]}{done.stderr}")
        spans = [tuple(map(float, line.split())) for line in log.read_text().splitlines()]
    computing = sum(end - start for start, end in spans)
    window = max(end for _, end in spans) - min(start for start, _ in spans)
    return wall, computing / (together * window)


def overhead() -> None:
    """What a call costs beside the model, without slots and with them."""
    with tempfile.TemporaryDirectory() as scratch:
        slots = Slots(Path(scratch) / "locks", "server")
        with serving(0.0, 1, Path(scratch, "log")) as port:
            endpoint = Endpoint("ws", "127.0.0.1", port)
            turns: dict[str, Turn] = {
                "without a slot": contextlib.nullcontext,
                "with a slot": lambda: slots.one(1),
            }
            policies = {
                name: RemotePolicy(PRESETS["openpi"], endpoint, Path(scratch), turn=turn)
                for name, turn in turns.items()
            }
            times: dict[str, list[float]] = {name: [] for name in turns}
            for policy in policies.values():
                policy.probe()
            for _ in range(CALLS):
                for name, policy in policies.items():
                    began = time.perf_counter()
                    policy.act(blank(), 0)
                    times[name].append(time.perf_counter() - began)
            taken = []
            for _ in range(CALLS):
                began = time.perf_counter()
                with slots.one(1):
                    taken.append(time.perf_counter() - began)
            for policy in policies.values():
                policy.close()
    print("a call of a policy that takes no time, median ms:")
    for name, measured in times.items():
        print(f"  {name:<16}{1e3 * median(measured):7.2f}")
    print(f"  the slot alone  {1e3 * median(taken):7.3f}\n")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--robocasa", action="store_true", help="simulate RoboCasa's kitchens")
    parser.add_argument("--only", type=float, metavar="S", help="the policy of S seconds alone")
    parser.add_argument("--serve", nargs=3, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.serve:
        seconds, together, log = asked.serve
        server = Server(float(seconds), int(together), Path(log))
        with serve(server.converse, "127.0.0.1", 0, compression=None, max_size=None) as listening:
            print(listening.socket.getsockname()[1], flush=True)
            listening.serve_forever()
        return
    print(f"Python {platform.python_version()}, {len(os.sched_getaffinity(0))} cores, "
          f"load {os.getloadavg()[0]:.1f}\n")  # fmt: skip
    overhead()
    for load in LOADS:
        if asked.only not in (None, load.seconds):
            continue
        print(load.title)
        print(f"{'at a time':>10}{'':4}{'run':<22}{'wall s':>8}{'ratio':>7}{'busy':>7}")
        for together in load.sides:
            modes: dict[str, tuple[str, ...]]
            modes = {f"--safemanip-jobs={n}": (f"--safemanip-jobs={n}",) for n in load.jobs}
            modes["-n 2"] = ("-n", "2")
            first = 0.0
            for name, mode in modes.items():
                wall, busy = run(load, together, mode, asked.robocasa)
                first = first or wall
                print(f"{together:>10}{'':4}{name:<22}{wall:>8.1f}{first / wall:>7.2f}{busy:>7.0%}",
                      flush=True)  # fmt: skip
        print()


if __name__ == "__main__":
    main()
