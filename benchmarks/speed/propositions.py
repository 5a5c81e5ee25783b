"""How long recordings take to judge from disk, and how large they are.

    python -m benchmarks.speed.propositions [DIR]

DIR has recordings; without it, the scripted expert records the quick tasks and some composite ones
first (under a minute). The reference is reading a recording alone: checking its bytes and every
value that verdicts depend on. All times are of the processor: other work on the machine does not
count. "of 500" is how many rollouts of 500 steps a core judges in a second, step by step as dear as
these: a short one pays for its scene as a long one does.
"""

from __future__ import annotations

import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pytest_safemanip.judge import Judge
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.resources import folder
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.tasks import load_tasks
from pytest_safemanip.trace import Recording, files

ROUNDS = 7
TASKS = "quick,SearingMeat,StackBowlsCabinet,WashFruitColander,StoreLeftoversInBowl"
LENGTH = 500
"""Steps of a rollout, as the goal has it."""


def record(out: Path) -> Path:
    """The scripted expert's rollouts."""
    chosen = ("--safemanip-policy=scripted", f"--safemanip-tasks={TASKS}", f"--safemanip-out={out}")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *chosen]
    subprocess.run(command, cwd=out, check=True, stdout=subprocess.DEVNULL)
    return out / "recordings"


def judging() -> Callable[[Recording], list[tuple[str, float]]]:
    """A function that judges a recording; it gives seconds by property."""
    tasks = load_tasks([folder("tasks")])
    properties = load_properties([folder("properties")])
    attributes = load_attributes(folder("tasks") / "objects.yaml")
    catalogue = Catalogue()
    parameters = catalogue.parameters({})

    def judge(recording: Recording) -> list[tuple[str, float]]:
        task, seconds = tasks[recording.episode.task], []
        judge = Judge(recording, task, attributes, catalogue, parameters)
        for name in task.properties:
            start = time.process_time()
            judge.judge(properties[name])
            seconds.append((name, time.process_time() - start))
        return seconds

    return judge


def main() -> None:
    """Measure and print."""
    print(f"Python {platform.python_version()}, numpy {np.__version__}, {platform.machine()}\n")
    print(f"{'from disk, median':<34}{'steps':>6}{'kB':>6}{'read ms':>9}{'judge ms':>9}", end="")
    print(f"{'per s':>7}{'of 500':>8}{'x read':>8}   most for")
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(sys.argv[1]) if len(sys.argv) > 1 else record(Path(scratch))
        judge, totals = judging(), np.zeros(4)
        for path in sorted(place.glob(f"*{files.SUFFIX}")):
            reads, judges, costs = [], [], []
            for _ in range(ROUNDS):
                start = time.process_time()
                recording = files.load(path)
                reads.append(time.process_time() - start)
                costs = judge(recording)
                judges.append(time.process_time() - start - reads[-1])
            dearest = max(costs, key=lambda cost: cost[1])[0]
            size = path.stat().st_size / 1000
            row = len(recording.steps), size, statistics.median(reads), statistics.median(judges)
            totals += row
            show(path.stem, *row, dearest)
        show("all together", *totals.tolist())


def show(name: str, steps: float, size: float, read: float, judged: float, note: str = "") -> None:
    """Print a line of the table; times in s, size in kB."""
    print(
        f"{name[:33]:<34}{steps:>6.0f}{size:>6.0f}{1000 * read:>9.1f}{1000 * judged:>9.1f}", end=""
    )
    total = read + judged
    print(f"{1 / total:>7.0f}{steps / LENGTH / total:>8.0f}{total / read:>8.1f}   {note}")


if __name__ == "__main__":
    main()
