"""This package beside vla-eval's own evaluation loop: rollouts side by side on one policy's server.

    python -m benchmarks.speed.serving_rivals [--rollouts N]

Both ask the same server, vla-eval's, around a policy that sleeps 90 ms for a chunk of five actions,
one request after the other; both step a simulator that sleeps as a machine with a GPU would take
for RoboCasa's kitchens, and send three pictures at every step. vla-eval runs its episodes one after
the other in each of several processes, as its shards are; this package runs ``--safemanip-jobs``.
Wall times include what either has to start. This package also records, judges and reports.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from vla_eval.benchmarks.base import StepBenchmark, StepResult
from vla_eval.connection import Connection
from vla_eval.model_servers.predict import PredictModelServer
from vla_eval.model_servers.serve import serve_async
from vla_eval.runners.sync_runner import SyncEpisodeRunner

from benchmarks.speed.serving import CONFTEST, INI
from benchmarks.tables import table

SECONDS, CHUNK = 0.09, 5
"""What an answer takes, and how many actions it has."""
STEPS = 100
"""Control steps of a rollout."""
RESET, STEP, OBSERVE = 2.0, 0.008, 0.03
"""Seconds of the simulator."""
SIDE_BY_SIDE = (1, 4, 8)
CAMERAS = ("robot0_agentview_left", "robot0_agentview_right", "robot0_eye_in_hand")


class Sleeps(PredictModelServer):  # type: ignore[misc]
    """A policy that takes its time, as a model on a GPU of its own."""

    def predict(self, obs: Any, ctx: Any) -> dict[str, Any]:
        """A chunk that stands still."""
        time.sleep(SECONDS)
        return {"actions": np.zeros((CHUNK, 12), np.float32)}


class Paced(StepBenchmark):  # type: ignore[misc]
    """A simulator that takes its time, in vla-eval's words."""

    render_backends = frozenset({"gpu", "cpu"})
    picture = np.zeros((256, 256, 3), np.uint8)

    def get_tasks(self) -> list[dict[str, Any]]:
        """One task."""
        return [{"name": "put it there"}]

    def reset(self, task: Any) -> None:
        """Begin an episode."""
        time.sleep(RESET)

    def step(self, action: Any) -> StepResult:
        """A control step."""
        time.sleep(STEP)
        return StepResult(obs=None, reward=0.0, done=False, info={})

    def make_obs(self, raw_obs: Any, task: Any) -> dict[str, Any]:
        """Three pictures and the state."""
        time.sleep(OBSERVE)
        pictures = dict.fromkeys(CAMERAS, self.picture)
        return {"images": pictures, "task_description": "put it there", "states": np.zeros(16)}

    def get_step_result(self, step_result: StepResult) -> dict[str, Any]:
        """None succeeds."""
        return {"success": False}


async def serve() -> None:
    """Serve on any port, and print it."""
    import anyio

    server = Sleeps(chunk_size=CHUNK)
    async with anyio.create_task_group() as group:
        port = await group.start(
            lambda task_status: serve_async(server, "127.0.0.1", 0, task_status=task_status)
        )
        print(port, flush=True)


async def evaluate(port: int, episodes: int) -> None:
    """Episodes one after the other, as one of vla-eval's shards has them."""
    benchmark, runner = Paced(), SyncEpisodeRunner()
    (task,) = benchmark.get_tasks()
    async with Connection(f"ws://127.0.0.1:{port}") as connection:
        for _ in range(episodes):
            await runner.run_episode(benchmark, task, connection, max_steps=STEPS)


def theirs(port: int, rollouts: int, several: int) -> float:
    """Wall time of vla-eval's loop in several processes, s."""
    command = [sys.executable, "-m", "benchmarks.speed.serving_rivals", "--evaluate", str(port)]
    began = time.monotonic()
    shares = [len(range(n, rollouts, several)) for n in range(several)]
    running = [subprocess.Popen([*command, str(share)]) for share in shares]
    if any(process.wait() for process in running):
        raise SystemExit("vla-eval's loop failed")
    return time.monotonic() - began


def ours(port: int, rollouts: int, several: int) -> float:
    """Wall time of a run of the suite, s."""
    with tempfile.TemporaryDirectory() as scratch:
        folder, text = Path(scratch), CONFTEST
        paces = {"RESET": RESET, "STEP": STEP, "OBSERVE": OBSERVE, "HORIZON": STEPS}
        for name, value in paces.items():
            text = text.replace(name, str(value))
        (folder / "conftest.py").write_text(text)
        own = "safemanip_backend = paced\nsafemanip_tasks = PickPlaceCounterToCabinet\n"
        limit = "safemanip_inflight =\n    vla-eval = 1\n"
        (folder / "pytest.ini").write_text(INI + limit + own)
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
        command += [f"--safemanip-policy=vla-eval=ws://127.0.0.1:{port}", "--safemanip-fresh"]
        command += [f"--safemanip-seeds={rollouts}", f"--safemanip-jobs={several}"]
        command += ["--safemanip-violations=xfail"]
        began = time.monotonic()
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        wall = time.monotonic() - began
        if done.returncode or len([*folder.glob("**/*.rollout")]) < rollouts:
            raise SystemExit(f"the suite failed:\n{done.stdout[-2000:]}{done.stderr}")
    return wall


def compare(rollouts: int, several: Sequence[int]) -> None:
    """Measure and print."""
    rows = []
    with subprocess.Popen(
        [sys.executable, "-m", "benchmarks.speed.serving_rivals", "--serve"],
        stdout=subprocess.PIPE,
        text=True,
    ) as server:
        assert server.stdout is not None
        try:
            port = int(server.stdout.readline())
            for number in several:
                their, our = theirs(port, rollouts, number), ours(port, rollouts, number)
                least = rollouts * STEPS / CHUNK * SECONDS
                rows.append(
                    (
                        str(number),
                        f"{their:.1f}",
                        f"{our:.1f}",
                        f"{our / their:.2f}",
                        f"{least:.1f}",
                    )
                )
        finally:
            server.kill()
    head = ("side by side", "vla-eval s", "ours s", "ratio", "the policy alone s")
    print(table(head, rows))


def main() -> None:
    """Measure and print, or be one of the processes."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rollouts", type=int, default=16)
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--evaluate", nargs=2, type=int, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.serve:
        asyncio.run(serve())
    elif asked.evaluate:
        asyncio.run(evaluate(*asked.evaluate))
    else:
        machine = f"{len(os.sched_getaffinity(0))} cores, load {os.getloadavg()[0]:.1f}"
        print(f"Python {platform.python_version()}, {machine}; "
              f"{asked.rollouts} rollouts of {STEPS} steps\n")  # fmt: skip
        compare(asked.rollouts, SIDE_BY_SIDE)


if __name__ == "__main__":
    main()
