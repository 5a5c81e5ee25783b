"""What the monitors find, what they miss, and what they say about rollouts that are safe.

    python -m benchmarks.verdicts.recall --seeds 100:150 [--only GLOB,...]
        [--stepping exact] [--out DIR]

The scripted policy's faults know from their plans and the physics when their hazard begins; its
near misses and its expert are safe. All are rolled out (what DIR already has is used again) and
judged by the shipped properties. A rollout of a fault whose hazard did not come about is left out
of its recall, and counted: truth and monitors read the same steps, and what neither can read is in
no recall, so the exit status is 1 where fewer come about than ``--least`` asks for, or of one
property's than ``--least-each`` and more than one does not. ``--put expert`` writes that table into
docs/recall.md.
"""

from __future__ import annotations

import argparse
import fnmatch
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from benchmarks.options import add_seeds, as_option
from benchmarks.tables import put, table
from pytest_safemanip.errors import did_you_mean
from pytest_safemanip.faults import library
from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.metrics.recall import Detection, detect
from pytest_safemanip.metrics.statistics.intervals import wilson
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.resources import folder
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.tasks import load_tasks
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording

EXPERT, ALL = "scripted", "all"
PROPERTIES = load_properties([folder("properties")])
FAULTS = {name: fault for name, fault in library.FAULTS.items() if fault.property_id in PROPERTIES}
"""Those of the release's properties, and of no pack's."""
DOCUMENT = Path(__file__).parents[2] / "docs" / "recall.md"


@dataclass(frozen=True)
class Judged:
    """A rollout, judged.

    Attributes:
        policy: ``scripted`` or ``scripted:FAULT``.
        task: its name.
        success: whether the task succeeded.
        detections: what became of its hazards.
        alarms: properties that were violated by anything else.
        triggered: properties that were put to the test.
    """

    policy: str
    task: str
    success: bool
    detections: tuple[Detection, ...]
    alarms: frozenset[str]
    triggered: frozenset[str]

    @property
    def fault(self) -> str:
        """Name of the fault; empty for the expert."""
        return self.policy.partition(":")[2]


class Judging:
    """The shipped properties, on recordings."""

    def __init__(self) -> None:
        self.tasks = load_tasks([folder("tasks")])
        self.properties = PROPERTIES
        self._attributes = load_attributes(folder("tasks") / "objects.yaml")
        self._catalogue = Catalogue()
        self._parameters = self._catalogue.parameters({})
        self._deadlines = {
            name: prop.deadline_s for name, prop in self.properties.items() if prop.deadline_s
        }

    def verdicts(self, recording: Recording) -> dict[str, Verdict]:
        """The verdicts on a rollout by all properties that apply to its task."""
        task = self.tasks[recording.episode.task]
        judge = Judge(recording, task, self._attributes, self._catalogue, self._parameters)
        return {name: judge.judge(self.properties[name]) for name in task.properties}

    def __call__(self, recording: Recording) -> Judged:
        """Judge a rollout, and find its hazards."""
        about, verdicts = recording.episode, self.verdicts(recording)
        detections, alarms = detect(
            about.hazards,
            {name: verdict.findings for name, verdict in verdicts.items()},
            self._deadlines,
            recording.trace.dt,
        )
        triggered = frozenset(name for name, verdict in verdicts.items() if verdict.triggered)
        return Judged(
            about.policy,
            about.task,
            recording.success,
            tuple(detections),
            frozenset(alarms),
            triggered,
        )


def record(
    policies: Sequence[str], seeds: Sequence[int], out: Path, stepping: str, processes: int
) -> None:
    """Roll out what is not there yet; a line of pytest's own tells how it gets on."""
    chosen = ",".join(policies)
    command = [sys.executable, "-m", "pytest", "-q", "--tb=no", "-p", "no:cacheprovider"]
    command += [f"--safemanip-policy={chosen}", f"--safemanip-seeds={as_option(seeds)}"]
    command += [f"--safemanip-out={out}", "--safemanip-violations=xfail", f"-n{processes}"]
    command += [f"--safemanip-stepping={stepping}"]
    status = subprocess.run(command, check=False).returncode
    if status not in (0, 1):
        sys.exit(f"the rollouts did not run through (pytest exit status {status})")


def judged(policies: Iterable[str], seeds: Sequence[int], out: Path) -> Iterator[Judged]:
    """The rollouts of these policies and seeds that are on disk."""
    judge, wanted = Judging(), set(policies)
    for path in sorted((out / "recordings").glob(f"*{files.SUFFIX}")):
        about = files.load_episode(path)
        if about.policy in wanted and about.seed in seeds:
            yield judge(files.load(path))


@dataclass(frozen=True)
class Found:
    """How often faults came about and were found.

    Attributes:
        rollouts: of faults.
        injected: those whose hazard came about.
        found: those of them in which every hazard of the fault's own property was found.
        latencies: of all detections, s.
        others: how often which other property was violated by something that is no hazard.
    """

    rollouts: int
    injected: int
    found: int
    latencies: list[float]
    others: Counter[str]

    @classmethod
    def count(cls, rollouts: Iterable[Judged]) -> Found:
        """From rollouts of faults."""
        rows = list(rollouts)
        own = [
            [d for d in row.detections if d.hazard.property_id == FAULTS[row.fault].property_id]
            for row in rows
        ]
        return cls(
            len(rows),
            sum(bool(found) for found in own),
            sum(bool(found) and all(d.step is not None for d in found) for found in own),
            [d.latency_s for found in own for d in found if d.latency_s is not None],
            Counter(name for row in rows for name in sorted(row.alarms)),
        )

    def cells(self) -> list[str]:
        """Rollouts, injected, found, recall, median and largest latency."""
        latency = [f"{f(self.latencies):.2f}" if self.latencies else "-" for f in (median, max)]
        counts = [str(n) for n in (self.rollouts, self.injected, self.found)]
        return [*counts, share(self.found, self.injected), *latency]


def share(hits: int, total: int) -> str:
    """A share with its interval, in percent."""
    if not total:
        return "-"
    low, high = wilson(hits, total)
    return f"{100 * hits / total:.1f} ({100 * low:.0f}-{100 * high:.0f})"


def by_property(rollouts: Sequence[Judged]) -> list[list[str]]:
    """A line for each property, and their sum."""
    names = sorted({fault.property_id for fault in FAULTS.values()})
    lines = []
    for name in [*names, ""]:
        mine = [r for r in rollouts if r.fault and name in ("", FAULTS[r.fault].property_id)]
        faults = [r for r in mine if not FAULTS[r.fault].near_miss]
        near = [r for r in mine if FAULTS[r.fault].near_miss]
        tested = [r for r in rollouts if not r.fault and (not name or name in r.triggered)]
        alarms = [
            sum((name in r.alarms) if name else bool(r.alarms) for r in group)
            for group in (near, tested)
        ]
        lines.append(
            [
                name or ALL,
                str(len({r.fault for r in faults})),
                *Found.count(faults).cells(),
                f"{alarms[0]} of {len(near)}",
                f"{alarms[1]} of {len(tested)}",
            ]
        )
    return lines


def came_about(rollouts: Sequence[Judged]) -> dict[str, Found]:
    """What was found in the rollouts of each property's faults, and of all."""
    groups: dict[str, list[Judged]] = {}
    for row in rollouts:
        if row.fault and not FAULTS[row.fault].near_miss:
            groups.setdefault(FAULTS[row.fault].property_id, []).append(row)
            groups.setdefault(ALL, []).append(row)
    return {name: Found.count(rows) for name, rows in groups.items()}


def by_fault(rollouts: Sequence[Judged]) -> list[list[str]]:
    """A line for each fault and each near miss."""
    lines = []
    for fault in sorted(FAULTS.values(), key=lambda f: (f.property_id, f.near_miss)):
        mine = [r for r in rollouts if r.fault == fault.name]
        if not mine:
            continue
        found = Found.count(mine)
        cells = [str(len(mine)), *["-"] * 5] if fault.near_miss else found.cells()
        others = ", ".join(f"{name} {count}" for name, count in found.others.most_common())
        lines.append([f"{fault.name}", fault.property_id, *cells, others or "-"])
    return lines


def by_task(rollouts: Sequence[Judged]) -> list[list[str]]:
    """A line for each of the expert's tasks."""
    lines = []
    for task in sorted({r.task for r in rollouts if not r.fault}):
        mine = [r for r in rollouts if not r.fault and r.task == task]
        alarms = Counter(name for r in mine for name in sorted(r.alarms))
        said = ", ".join(f"{name} {count}" for name, count in alarms.most_common())
        lines.append([task, str(len(mine)), str(sum(r.success for r in mine)), said or "-"])
    return lines


def main() -> None:
    """Roll out, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "100:150")
    parser.add_argument("--only", default="*", help="globs of scripted, scripted:FAULT")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path(".safemanip/recall"),
        help="folder of recordings; what is there is kept (default: %(default)s)",
    )
    parser.add_argument(
        "--stepping",
        choices=("fast", "exact"),
        default="fast",
        help="of the simulator, as --safemanip-stepping (default: %(default)s)",
    )
    parser.add_argument(
        "--judge", action="store_true", help="judge what is there, roll nothing out"
    )
    parser.add_argument(
        "--put",
        action="append",
        default=[],
        choices=("by property", "by fault", "expert"),
        help=f"a table to write into {DOCUMENT.name}",
    )
    parser.add_argument(
        "--least",
        type=float,
        default=95.0,
        help="percent of all faults that have to come about (default: %(default)s)",
    )
    parser.add_argument(
        "--least-each",
        type=float,
        default=85.0,
        help="percent of each property's, which are few (default: %(default)s)",
    )
    parser.add_argument("-n", type=int, default=2, help="processes (default: %(default)s)")
    options = parser.parse_args()
    known = [EXPERT, *(f"scripted:{name}" for name in FAULTS)]
    globs = options.only.split(",")
    policies = [name for name in known if any(fnmatch.fnmatch(name, glob) for glob in globs)]
    if not policies:
        hint = did_you_mean(options.only, known, "safemanip faults")
        parser.error(f"--only {options.only}: nothing of that name; {hint}")
    if not options.judge:
        record(policies, options.seeds, options.out, options.stepping, options.n)
    rollouts = list(judged(policies, options.seeds, options.out))
    if not rollouts:
        parser.error(f"{options.out} has no recording of these policies and seeds")
    counts = ["rollouts", "injected", "found", "recall % (95 %)", "median s", "max s"]
    last = ["near misses flagged", "expert flagged (triggered)"]
    tables = {
        "by property": table(["property", "faults", *counts, *last], by_property(rollouts)),
        "by fault": table(["fault", "property", *counts, "what else fired"], by_fault(rollouts)),
        "expert": table(["task", "rollouts", "successes", "violations"], by_task(rollouts)),
    }
    for name, text in tables.items():
        print(f"\n{name.capitalize()}\n\n{text}")
        if name in options.put:
            put(DOCUMENT, name, text)
    found = came_about(rollouts)
    rates = {name: 100.0 * each.injected / each.rollouts for name, each in found.items()}
    print("\nCame about: " + ", ".join(f"{name} {rate:.1f} %" for name, rate in rates.items()))
    least = {name: options.least if name == ALL else options.least_each for name in rates}
    # Of five rollouts, one that does not come about says nothing of the property's faults.
    few = [
        f"{least[name]:g} % of {name}"
        for name, rate in rates.items()
        if rate < least[name] and (name == ALL or found[name].rollouts - found[name].injected > 1)
    ]
    if few:
        sys.exit(f"of the faults fewer came about than {', '.join(few)}")


if __name__ == "__main__":
    main()
