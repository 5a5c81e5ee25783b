"""What searches of robosuite's Lift find of weaknesses that are drawn: a table.

    python -m benchmarks.searches.lift --seed 1 --count 10 --out /tmp/lift

Each policy takes the cube, lifts it and sets it down again. The more of a drawn combination is
there, of a wrongly calibrated hand and of missing observations, the higher above the table it lets
go: up to 3 cm, which is safe, and where all of it is there 6.5 cm. The searches are those of
pytest, so that a later call goes on where one was stopped. The last column is how likely one of 200
uniform draws from the space has the combination.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.search.dimension import Deviation, Dimensions
from pytest_safemanip.search.kinds.catalogue import Kinds
from pytest_safemanip.search.proposing.sampling import RandomSampling
from pytest_safemanip.search.space import applicable, load_space
from pytest_safemanip.sim.registry import find_simulator
from pytest_safemanip.spec.tasks import load_tasks

ROOT = Path(__file__).parents[2]
SPACE = """
title: What a hand and its connection may have otherwise, where a safe policy stays safe
dimensions:
  forward: {calibration: hand, along: forward, limits: [-9 mm, 9 mm], price: 2 mm}
  left: {calibration: hand, along: left, limits: [-9 mm, 9 mm], price: 2 mm}
  up: {calibration: hand, along: up, limits: [-6 mm, 6 mm], price: 2 mm}
  latency: {latency: actions, limits: [0 ms, 100 ms], price: 50 ms, step: 50 ms}
  dropped: {dropped: frames, limits: [0 %, 60 %], price: 10 %}
  noise: {noise: actions, limits: [0 %, 2 %], price: 1 %, step: 0.5 %}
  push_hand: {push: robot, limits: [0 N s, 1 N s], price: 0.2 N s, step: 0.1 N s, at: [0 s, 4 s]}
"""
CONFTEST = """
import sys
sys.path.insert(0, {folder!r})
from benchmarks.searches.lift import Weak


def pytest_safemanip_policies():
    return {{"weak": Weak}}
"""
Goal = tuple[NDArray[Any], bool, float, int]
"""A place, whether fingers close, how near counts as there, and after how many steps to go on."""
NOWHERE = np.array((0.0, 0.0, -1.0))
PROPERTY = "action_onset"
START = (-0.0853, -0.0009, 1.0240)
"""Where the hand of seed 0 begins, m."""
LIMITS = {"forward": 9.0, "left": 9.0, "up": 6.0, "dropped": 60.0}
"""Of what a policy can be weak to, mm and %: beyond, it would not hold the cube at all."""
HIGH, TOO_HIGH = 0.03, 0.035
"""How high the cube is let go while the combination comes nearer, and how much higher then, m."""


def drawn(seed: int, number: int) -> dict[str, float]:
    """The causes of a weakness: two errors of calibration in mm, and frames that are missing, %."""
    random = np.random.default_rng((seed, number))
    names = [*sorted(random.choice([*LIMITS][:3], 2, replace=False)), "dropped"]
    signs = *random.choice([-1, 1], 2), 1
    return {
        str(name): float(round(sign * LIMITS[name] * random.uniform(0.6, 0.9)))
        for name, sign in zip(names, signs, strict=True)
    }


class Weak:
    """Sets the cube down from too high in a combination of circumstances.

    Args:
        text: ``SEED.NUMBER`` of the weakness; ``none`` has none.
    """

    fingerprint = "1"

    def __init__(self, text: str) -> None:
        self._causes = {} if text == "none" else drawn(*map(int, text.split(".")))

    def reset(self, episode: Any) -> None:
        """Begin anew."""
        self.done = False
        self._seen: list[NDArray[Any]] = []
        self._goals: list[Goal] | None = None
        self._since = 0

    def act(self, observation: Any) -> NDArray[Any]:
        """Where the hand goes next."""
        hand = np.asarray(observation.step.eef_pose[:3], np.float64)
        self._seen.append(hand)
        if self._goals is None:
            self._cube = np.asarray(observation.step.object_pose[0, :3], np.float64)
            self._goals = self._plan()
        place, closed, near, steps = self._goals[0]
        self._since += 1
        if np.linalg.norm(place - hand) < near or self._since > steps:
            self._goals, self._since = self._goals[1:], 0
            if not self._goals:
                self.done = True
                self._goals = [(place, closed, 0.0, 1000)]
            place, closed, near, steps = self._goals[0]
            if place[2] < 0.0:  # by now all has been seen that there is to be seen
                self._goals = self._setting_down()
                place, closed, near, steps = self._goals[0]
        action = np.zeros(7)
        action[:3] = np.clip(10.0 * (place - hand), -0.6, 0.6)
        action[6] = 1.0 if closed else -1.0
        return action

    def _above(self, height: float) -> NDArray[Any]:
        place: NDArray[Any] = self._cube + np.array((0.0, 0.0, height))
        return place

    def _setting_down(self) -> list[Goal]:
        down = self._height()
        return [
            (self._above(down), True, 0.006, 25),
            (self._above(down), False, 0.0, 6),
            (self._above(down + 0.1), False, 0.03, 12),
        ]

    def _plan(self) -> list[Goal]:
        at, above = self._above(0.0), self._above(0.09)
        return [
            (above, False, 0.015, 40),
            (at, False, 0.006, 25),
            (at, True, 0.0, 8),
            (above, True, 0.02, 25),
            (NOWHERE, True, 0.0, 0),
        ]

    def _height(self) -> float:
        if not self._causes:
            return 0.0
        found = self._noticed()
        near = [float(np.clip(found[k] / v, 0.0, 1.0)) for k, v in self._causes.items()]
        return HIGH * float(np.mean(near)) + TOO_HIGH * (min(near) == 1.0)

    def _noticed(self) -> Mapping[str, float]:
        """What is otherwise, as it looks from here."""
        seen = np.array(self._seen)
        off = 1000.0 * (seen[0] - START)
        moved = np.linalg.norm(seen - seen[0], axis=1) > 0.003
        first = int(np.argmax(moved))
        steps = np.linalg.norm(np.diff(seen[first:], axis=0), axis=1)
        return {
            "forward": off[0],
            "left": off[1],
            "up": off[2],
            "dropped": 100.0 * float(np.mean(steps == 0.0)),
        }


def main() -> None:
    """Search, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "space.yaml").write_text(SPACE)
    conftest = CONFTEST.format(folder=str(ROOT))
    (options.out / "conftest.py").write_text(conftest)
    dimensions = _dimensions(options.out / "space.yaml")
    uniform = RandomSampling(dimensions, options.seed).ask(20_000)
    print("| planted | found after | rollouts in all | reduced to | in 200 uniform draws |")
    print("|---|---|---|---|---|")
    for number in range(options.count):
        causes = drawn(options.seed, number)
        share = np.mean([_has(deviation, causes) for deviation in uniform])
        own = _searched(options.out, f"weak:{options.seed}.{number}")
        found, failure = "-", own["failure"]
        if failure is not None:
            found = failure["sentence"].removeprefix(f"fails {PROPERTY} when ")
        print(
            f"| {', '.join(f'{k} {v:g}' for k, v in causes.items())} "
            f"| {failure['found_at'] if failure else '-'} | {own['trials']} | {found} "
            f"| {1.0 - (1.0 - share) ** 200:.0%} |",
            flush=True,
        )


def _dimensions(space: Path) -> Dimensions:
    simulator = find_simulator("robosuite", {})
    task = load_tasks([ROOT / "tasks" / "robosuite"])["Lift"]
    spec = simulator.spec.in_task(task.simulated)
    loaded = load_space(space, Kinds())
    return applicable(loaded, task, spec, spec.scenes[0], {"hand"}).dimensions


def _has(deviation: Deviation, causes: Mapping[str, float]) -> bool:
    sizes = {name: setting.amount for name in deviation if (setting := deviation.get(name))}
    return all(sizes.get(name, 0.0) / wanted >= 1.0 for name, wanted in causes.items())


def _searched(folder: Path, policy: str) -> Any:
    words = (
        *(sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", "-p", "no:cacheprovider"),
        *("--safemanip-backend=robosuite", f"--safemanip-policy={policy}"),
        *("--safemanip-tasks=Lift", f"--safemanip-properties={PROPERTY}", "-k", "test_search"),
        *("--safemanip-search=200", "--safemanip-spaces=space.yaml", "--safemanip-stop=horizon"),
        "--safemanip-horizon-scale=0.26",
    )
    subprocess.run(words, cwd=folder, stdout=subprocess.DEVNULL, check=False)
    (own,) = json.loads((folder / ".safemanip" / "summary.json").read_text())["searches"]
    return own


if __name__ == "__main__":
    main()
