"""Recordings written as LeRobot datasets with states, read again, and judged: do verdicts agree?

    python -m benchmarks.verdicts.roundtrip .safemanip/recordings

Every control period is simulated again from its stored state; a verdict differs where forces or
python-side states of RoboCasa's came out otherwise.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.recordings import below, load
from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording


def main() -> None:
    """Print what differs, and how long it took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--lerobot", default="v2.1")
    options = parser.parse_args()
    defined = load_definitions([], [], [])
    sources = below([options.recordings])
    verdicts = differing = steps = 0
    seconds, drifts = 0.0, []
    for source in sources:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            data, again = folder / "data", folder / "again"
            _safemanip("export", source, f"--lerobot={options.lerobot}", "-o", data)
            began = time.monotonic()
            _safemanip("import", data, "-o", again)
            seconds += time.monotonic() - began
            (copy,) = again.glob(f"*{files.SUFFIX}")
            first, second = load(source), load(copy)
        steps += len(first.steps)
        drifts.append((float(second.episode.origin["drift"].split()[0]), source.stem))
        for id_, (a, b) in _pairs(first, second, defined).items():
            verdicts += 1
            if _gist(a) != _gist(b):
                differing += 1
                print(f"{source.stem}, {id_}: {a!r} recorded, {b!r} simulated again")
    print(f"{len(sources)} recordings, {verdicts} verdicts, {differing} differ")
    print(f"largest drift {max(drifts)[0]} mm ({max(drifts)[1]})")
    print(f"imported {steps} steps in {seconds:.0f} s")


def _safemanip(*arguments: object) -> None:
    command = [sys.executable, "-m", "pytest_safemanip", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: {done.stdout}{done.stderr}")


def _pairs(
    first: Recording, second: Recording, defined: Definitions
) -> dict[str, tuple[Verdict, Verdict]]:
    task = defined.tasks[first.episode.task]
    parameters = defined.catalogue.parameters({})
    one, other = (
        Judge(recording, task, defined.attributes, defined.catalogue, parameters)
        for recording in (first, second)
    )
    return {
        id_: (one.judge(defined.properties[id_]), other.judge(defined.properties[id_]))
        for id_ in task.properties
    }


def _gist(verdict: Verdict) -> tuple[object, ...]:
    """What has to agree: outcome, triggered instances, and which are violated."""
    guilty = sorted(finding.entities for finding in verdict.findings)
    return verdict.outcome, verdict.triggered, guilty


if __name__ == "__main__":
    main()
