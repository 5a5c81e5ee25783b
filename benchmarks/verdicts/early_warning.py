"""How long before violations there are warnings, and how often there are false ones.

    python -m benchmarks.verdicts.early_warning DIR [DIR ...]

DIR has recordings of the backend ``robocasa``, such as recall.py leaves: the scripted
expert's, and those of its faults and near misses. Each is watched step by step as it was recorded,
and before each step it is asked what is near, given the action that follows. A violation was warned
of if a warning for the same property and entities came before its first unsafe step; the lead is
the time between, from the first warning of the last run of them. A warning is false if nothing that
it is about is violated within :data:`LATER` after it; runs of false warnings are counted, and
rollouts that have any.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.recordings import below, load
from benchmarks.tables import put, table
from benchmarks.verdicts.recall import FAULTS
from pytest_safemanip.live import EarlyWarning, LiveJudge
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.resources import folder
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.tasks import load_tasks
from pytest_safemanip.trace.recording import Recording

DOCUMENT = Path(__file__).parents[2] / "docs" / "warnings.md"
HORIZONS = (0.1, 0.25, 0.5)
"""Seconds."""
LATER = 1.0
"""Seconds within which what was warned of has to come about, past the time that was predicted."""

Key = tuple[str, tuple[str, ...]]


@dataclass
class Watched:
    """A rollout that was watched.

    Attributes:
        policy: ``scripted`` or ``scripted:FAULT``.
        acting: seconds that the robot acted.
        unsafe: first steps of violations, by property and entities.
        warned: at which steps which warning was given, likewise.
        cost: seconds of all questions.
        asked: how many there were.
        dt: control period, s.
    """

    policy: str
    acting: float
    dt: float
    unsafe: dict[Key, list[int]] = field(default_factory=dict)
    warned: dict[Key, list[tuple[int, EarlyWarning]]] = field(default_factory=dict)
    cost: float = 0.0
    asked: int = 0

    def runs(self, key: Key, horizon: float) -> Iterator[tuple[int, int, EarlyWarning]]:
        """First and last step of each run of warnings about something, and its first warning."""
        first = last = -math.inf
        told: EarlyWarning | None = None
        for step, one in self.warned.get(key, []):
            if one.last_chance > horizon:
                continue
            if step > last + 1:
                if told is not None:
                    yield int(first), int(last), told
                first, told = step, one
            last = step
        if told is not None:
            yield int(first), int(last), told

    def lead(self, key: Key, unsafe: int, horizon: float) -> float | None:
        """Seconds from a warning to a violation; None if there was none."""
        before = [
            first
            for first, last, told in self.runs(key, horizon)
            if first < unsafe and self._means(unsafe, last, told)
        ]
        return (unsafe - before[-1]) * self.dt if before else None

    def false(self, key: Key, horizon: float) -> int:
        """Runs of warnings that nothing followed."""
        return sum(
            not any(
                self._during(unsafe, first) or (first < unsafe and self._means(unsafe, last, told))
                for unsafe in self.unsafe.get(key, [])
            )
            for first, last, told in self.runs(key, horizon)
        )

    def _means(self, unsafe: int, last: int, told: EarlyWarning) -> bool:
        """Whether a violation is what a run of warnings was about."""
        return unsafe * self.dt <= last * self.dt + told.time_to_violation + LATER

    def _during(self, unsafe: int, first: int) -> bool:
        """Whether a run began as what was violated had not ended long ago."""
        return 0 <= (first - unsafe) * self.dt <= LATER


class Watching:
    """The shipped properties and tasks, to watch recordings by."""

    def __init__(self) -> None:
        self._tasks = load_tasks([folder("tasks")])
        self._properties = load_properties([folder("properties")])
        self._attributes = load_attributes(folder("tasks") / "objects.yaml")
        self._catalogue = Catalogue()

    def __call__(self, recording: Recording) -> Watched:
        """Watch a rollout."""
        task, steps = self._tasks[recording.episode.task], recording.steps
        binding = task.bind(recording.scene, self._attributes)
        judge = LiveJudge(
            recording.scene,
            binding,
            [self._properties[name] for name in task.properties],
            self._catalogue,
            self._catalogue.parameters({}),
        )
        dt, acting = recording.scene.control_period, recording.acting
        found, seen = Watched(recording.episode.policy, acting * dt, dt), set[Key]()
        rows = {name: self._properties[name].rows(binding) for name in task.properties}
        for n, (step, action, acts) in enumerate(steps):
            unsafe = {
                (name, rows[name][k])
                for name, told in judge.step(step, action, acts).items()
                for k, one in enumerate(told)
                if one.unsafe
            }
            for key in unsafe - seen:
                found.unsafe.setdefault(key, []).append(n)
            seen = unsafe
            if n + 1 < acting:
                pace = SPEC.robot.pace(steps.action[n + 1], [*steps.action[1 : n + 1]])
                start = time.perf_counter()
                told = judge.warnings(steps.commands[n + 1], pace, max(HORIZONS))
                found.cost += time.perf_counter() - start
                found.asked += 1
                for one in told:
                    found.warned.setdefault((one.property_id, one.entities), []).append((n, one))
        for name, verdicts in judge.verdicts().items():
            for row, verdict in zip(rows[name], verdicts, strict=True):
                for violation in verdict.violations:
                    if violation.at_end:
                        found.unsafe.setdefault((name, row), []).append(violation.first)
        return found


def watched(folders: Sequence[Path]) -> list[Watched]:
    """All rollouts of some folders, watched."""
    watch = Watching()
    return [watch(load(path)) for path in below(folders)]


def is_safe(rollout: Watched) -> bool:
    """Whether it is the expert's, or a near miss."""
    fault = rollout.policy.partition(":")[2]
    return not fault or FAULTS[fault].near_miss


def by_property(rollouts: Sequence[Watched], horizon: float) -> list[list[str]]:
    """A line for each property, and their sum."""
    names = sorted({fault.property_id for fault in FAULTS.values()})
    return [_line(rollouts, name, horizon) for name in (*names, "")]


def _line(rollouts: Sequence[Watched], name: str, horizon: float) -> list[str]:
    leads: list[float | None] = []
    for one in rollouts:
        for key, steps in one.unsafe.items():
            if name in ("", key[0]):
                leads += [one.lead(key, step, horizon) for step in steps]
    known = [lead for lead in leads if lead is not None]
    quartiles = [f"{q:.2f}" for q in np.quantile(known, (0.25, 0.5, 0.75))] if known else ["-"] * 3
    safe = list(filter(is_safe, rollouts))
    false = [
        sum(one.false(key, horizon) for key in one.warned if name in ("", key[0])) for one in safe
    ]
    minutes = sum(one.acting for one in safe) / 60.0
    return [
        name or "all",
        str(len(leads)),
        f"{len(known)} ({100 * len(known) / len(leads):.0f} %)" if leads else "-",
        " / ".join(quartiles),
        f"{sum(map(bool, false))} of {len(safe)}",
        f"{sum(false) / minutes:.2f}" if minutes else "-",
    ]


HEAD = ["property", "violations", "warned before", "lead s, quartiles", "rollouts with a false one",
        "false per minute"]  # fmt: skip


def main() -> None:
    """Watch, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path, help="folders with recordings")
    parser.add_argument("--put", action="store_true", help=f"write tables into {DOCUMENT.name}")
    options = parser.parse_args()
    rollouts = watched(options.folders)
    for horizon in HORIZONS:
        text = table(HEAD, by_property(rollouts, horizon))
        print(f"\nHorizon {horizon:g} s\n\n{text}")
        if options.put:
            put(DOCUMENT, f"horizon {horizon:g}", text)
    asked, cost = sum(one.asked for one in rollouts), sum(one.cost for one in rollouts)
    print(
        f"\n{len(rollouts)} rollouts, {sum(map(is_safe, rollouts))} of them safe; "
        f"{1e3 * cost / asked:.2f} ms a question, {asked} asked"
    )


if __name__ == "__main__":
    main()
