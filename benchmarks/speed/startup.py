"""What the installed plugin costs a pytest run that has nothing to do with it.

    python -m benchmarks.speed.startup

One passing test, run in a fresh process with the plugin and without, in turn, and without any other
plugin; then beside Hypothesis, which asks every package at the end of a run for its strategies. The
figures are CPU times of the whole process.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from statistics import median

HYPOTHESIS = ("-p", "_hypothesis_pytestplugin")
OURS = ("-p", "pytest_safemanip.plugin")
RUNS: Mapping[str, tuple[tuple[str, ...], Mapping[str, str]]] = {
    "pytest": ((), {}),
    "pytest with the plugin": (OURS, {}),
    "Hypothesis": (HYPOTHESIS, {"HYPOTHESIS_NO_PLUGINS": "1"}),
    "Hypothesis and the plugin": ((*OURS, *HYPOTHESIS), {}),
}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=30, metavar="N")
    rounds = parser.parse_args().rounds
    times: dict[str, list[float]] = {name: [] for name in RUNS}
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "test_it.py").write_text("def test_it():\n    pass\n")
        for run in RUNS.values():
            _run(Path(folder), *run)  # writes the bytecode
        for _ in range(rounds):
            for name, run in RUNS.items():
                times[name].append(_run(Path(folder), *run))
    reference = median(times["pytest"])
    print(f"{'one test, ' + str(rounds) + ' rounds':<26}{'median ms':>10}{'ratio':>8}{'added':>9}")
    for name, measured in times.items():
        ms = median(measured) * 1000
        added = ms - reference * 1000
        print(f"{name:<26}{ms:>10.1f}{ms / reference / 1000:>8.3f}{added:>6.1f} ms")


def _run(folder: Path, arguments: tuple[str, ...], more: Mapping[str, str]) -> float:
    """CPU seconds of a pytest run."""
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", **more}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments],
        cwd=folder,
        env=environment,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
