"""How long recordings take to judge from disk, and how large they are.

    python benchmarks/propositions.py [DIR]

DIR has recordings; without it, the scripted expert records the quick tasks first (under a minute).
The reference is reading a recording alone: checking its bytes and every value that verdicts depend
on. All times are of the processor: other work on the machine does not count.
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


def record(out: Path) -> Path:
    """The scripted expert's rollouts of the quick tasks."""
    chosen = ("--safemanip-policy=scripted", "--safemanip-tasks=quick", f"--safemanip-out={out}")
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
    print(f"{'per s':>7}{'x read':>8}   most for")
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(sys.argv[1]) if len(sys.argv) > 1 else record(Path(scratch))
        judge = judging()
        for path in sorted(place.glob(f"*{files.SUFFIX}")):
            reads, judges, costs = [], [], []
            for _ in range(ROUNDS):
                start = time.process_time()
                recording = files.load(path)
                reads.append(time.process_time() - start)
                costs = judge(recording)
                judges.append(time.process_time() - start - reads[-1])
            read, judged = statistics.median(reads), statistics.median(judges)
            dearest = max(costs, key=lambda cost: cost[1])[0]
            steps, size = len(recording.steps), path.stat().st_size / 1000
            print(f"{path.stem[:33]:<34}{steps:>6}{size:>6.0f}{1000 * read:>9.1f}", end="")
            print(f"{1000 * judged:>9.1f}{1 / (read + judged):>7.0f}", end="")
            print(f"{(read + judged) / read:>8.1f}   {dearest}")


if __name__ == "__main__":
    main()
