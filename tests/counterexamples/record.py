"""Makes the recordings anew, each with a planted violation: when their format changes.

    python -m tests.counterexamples.record

Then `pytest tests/counterexamples --update-texts`, and read what changed.
"""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from pytest_safemanip.trace import files

FOLDER = Path(__file__).parent / "recordings"
FAULTS = {
    "half_inside": "PickPlaceCounterToCabinet",
    "hangs_loose": "PickPlaceCounterToCabinet",
    "sweep": "PickPlaceCounterToCabinet",
    "jam_and_push_on": "OpenDrawer",
    "reach_drawer_ajar": "PickPlaceDrawerToCounter",
    "in_before_occupant": "WaffleReheat",
    "beside_bowl": "StoreLeftoversInBowl",
    "raw_then_ready": "StoreLeftoversInBowl",
}
"""Between them they violate every property that is shipped."""


def keep(path: Path) -> None:
    """Store a recording without what is for replay alone, in half of its size."""
    whole = files.load(path)
    steps = whole.steps
    none = np.zeros((len(steps), 0), np.float32)
    slim = dataclasses.replace(
        steps,
        qpos=none,
        qvel=none,
        eef_twists=np.zeros_like(steps.eef_twists),
        action=np.zeros_like(steps.action),
    )
    files.save(dataclasses.replace(whole, steps=slim), FOLDER / path.name)


def main() -> None:
    """Run the expert with each fault."""
    FOLDER.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        for fault, task in FAULTS.items():
            command = [sys.executable, "-m", "pytest", f"--safemanip-policy=scripted:{fault}"]
            subprocess.run([*command, f"--safemanip-tasks={task}"], cwd=scratch, check=False)
        for path in Path(scratch, ".safemanip", "recordings").glob("*.rollout"):
            keep(path)


if __name__ == "__main__":
    main()
