"""What large runs cost beside their rollouts: collecting the cases, and reporting each.

    python -m benchmarks.speed.scale

Collecting is `pytest --collect-only` in a fresh process, beside as many cases of a plain
parametrized test; seconds and memory are of the whole process, its start among them. The cost of a
case is what `pytest --junitxml` takes longer, on recordings that are there, than loading and
judging them without pytest does.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.tables import table

ALL_TASKS = ("--safemanip-policy=hold", "--safemanip-assets=primitive", "--collect-only", "-qq")
PLAIN = "import pytest\n@pytest.mark.parametrize('n', range({}))\ndef test_it(n):\n    pass\n"
SHORT = (
    "--safemanip-policy=hold",
    "--safemanip-tasks=quick",
    "--safemanip-assets=primitive",
    "--safemanip-horizon-scale=0.01",
)


def run(folder: Path, *arguments: str) -> tuple[float, float, str]:
    """Seconds and MB of a pytest run, and what it printed."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments]
    began = time.perf_counter()
    child = subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    assert child.stdout is not None
    text = child.stdout.read().decode()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode not in (0, 5):
        sys.exit(text[-3000:])
    return time.perf_counter() - began, usage.ru_maxrss / 1024, text


def collecting(folder: Path, wanted: int) -> list[list[str]]:
    """Rows about collecting so many cases at least."""
    per_seed = run(folder, *ALL_TASKS, "-v")[2].count("test_safety")
    if not per_seed:
        sys.exit("no case was collected")
    seeds = -(-wanted // per_seed)
    cases = seeds * per_seed
    (folder / "test_plain.py").write_text(PLAIN.format(cases))
    plain = ("test_plain.py", "--collect-only", "-qq", "-p", "no:safemanip")
    run(folder, *plain)
    reference, megabytes, _ = run(folder, *plain)
    ours, our_megabytes, _ = run(folder, *ALL_TASKS, f"--safemanip-seeds={seeds}")
    (folder / "test_plain.py").unlink()
    return [
        [f"{cases} parametrized", f"{reference:.2f}", "1.00", f"{megabytes:.0f}"],
        [f"{cases} cases", f"{ours:.2f}", f"{ours / reference:.2f}", f"{our_megabytes:.0f}"],
    ]


def reporting(folder: Path, seeds: int) -> list[str]:
    """The row about judging what is recorded."""
    run(folder, *SHORT, f"--safemanip-seeds={seeds}", "--safemanip-vacuous=pass")
    recorded = (f"--safemanip-recordings={folder / '.safemanip/recordings'}", "-q")
    command = (*recorded, "--safemanip-vacuous=pass", "--junitxml=safety.xml")
    cases = run(folder, *recorded, "--collect-only")[2].count("test_safety")
    start = run(folder, *recorded, "--collect-only", "-qq")[0]
    whole = run(folder, *command)[0]
    began = time.perf_counter()
    judged = judge(folder / ".safemanip/recordings")
    alone = time.perf_counter() - began
    if judged != cases:
        sys.exit(f"{judged} verdicts, {cases} cases")
    return [
        f"{cases}",
        f"{whole - start:.2f}",
        f"{alone:.2f}",
        f"{(whole - start - alone) / cases * 1000:.2f}",
    ]


def judge(recordings: Path) -> int:
    """The number of verdicts on the recordings, reached without pytest."""
    from pytest_safemanip.judge import Judge
    from pytest_safemanip.run.cases import applicable, select_properties
    from pytest_safemanip.run.definitions import load_definitions
    from pytest_safemanip.trace import files

    found = load_definitions((), (), ())
    wanted = select_properties(found.properties, ())
    verdicts = 0
    for path in sorted(recordings.glob(f"*{files.SUFFIX}")):
        recording = files.load(path)
        task = found.tasks[recording.episode.task]
        parameters = found.catalogue.parameters({})
        judging = Judge(recording, task, found.attributes, found.catalogue, parameters, "timed")
        for name in applicable(task, found.everywhere, wanted):
            judging.judge(found.properties[name])
            verdicts += 1
    return verdicts


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cases", type=int, nargs="+", default=[25_000, 150_000], metavar="N")
    parser.add_argument("--seeds", type=int, default=40, metavar="N", help="of recorded rollouts")
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp())
    try:
        rows = [row for wanted in options.cases for row in collecting(folder, wanted)]
        print(table(["collected", "s", "ratio", "MB"], rows))
        print()
        head = ["cases", "pytest s", "judging alone s", "ms per case, with JUnit"]
        print(table(head, [reporting(folder, options.seeds)]))
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
