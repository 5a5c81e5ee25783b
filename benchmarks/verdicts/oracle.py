"""Events that a second examiner finds in rollouts, against flags of the monitors, both ways.

    python -m benchmarks.verdicts.oracle --out DIR
        --policies disturbed:jitter@0.3,disturbed:opens@0.02

Policies are run in this process, and what happens is taken down from MuJoCo itself (``raw.py``).
Events are labelled from that alone (``labels.py``), without the plugin's readers, propositions and
tasks; the recordings of the same rollouts are judged by the shipped properties. An event is flagged
if a violation names the object that it happened to, or a vessel that it was in, at about that time.
What is in DIR already is not run again. ``--put NAME`` writes the tables into docs/oracle.md; what
disagrees is printed, to be looked at.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from benchmarks.options import add_seeds
from benchmarks.tables import put, table
from benchmarks.verdicts.disturbed import Disturbed
from benchmarks.verdicts.labels import KINDS, Event, label
from benchmarks.verdicts.raw import Examined, Raw
from pytest_safemanip.errors import SafemanipError
from pytest_safemanip.judge import Finding, Judge
from pytest_safemanip.policies.registry import PolicySpec, resolve
from pytest_safemanip.rollouts import loop
from pytest_safemanip.rollouts.store import file_name
from pytest_safemanip.run.cases import select_tasks
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.sim.backend import Options, Request
from pytest_safemanip.sim.robocasa import factory, loading
from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.trace import files

DOCUMENT = Path(__file__).parents[2] / "docs" / "oracle.md"
BEFORE, AFTER = 2.0, 7.0
"""Seconds from a violation's end to an event that follows from it, and from an event's end to the
violation that it is: that of what never comes to rest is one when its deadline is over."""
NEAR = 0.3
"""Likewise between a contact and its violation."""


@dataclass(frozen=True)
class Flag:
    """A violation.

    Attributes:
        property_id: of which property.
        finding: what was found.
        said: what the finding says, by step, where it is of contacts.
    """

    property_id: str
    finding: Finding
    said: dict[int, str]

    def names(self, event: Event, dt: float) -> bool:
        """Whether it is about what an event happened to, at about that time."""
        near, late = (NEAR, NEAR) if self.said and _contact(event) else (BEFORE, AFTER)
        first, last = event.step - round(near / dt), event.end + round(late / dt)
        if self.finding.last < first or self.finding.opened > last:
            return False
        if self.said:
            text = " ".join(said for step, said in self.said.items() if first <= step <= last)
            return any(_mentions(text, name) for name in event.about)
        return any(
            name == entity or name.startswith(f"{entity}_")
            for name in event.about
            for entity in self.finding.entities
        )


@dataclass(frozen=True)
class Compared:
    """A rollout with both opinions.

    Attributes:
        name: of its file.
        policy: which.
        success: whether the task succeeded.
        events: of the examiner.
        flags: of the monitors.
        dt: control period, s.
    """

    name: str
    policy: str
    success: bool
    events: tuple[Event, ...]
    flags: tuple[Flag, ...]
    dt: float

    def flags_of(self, event: Event) -> list[Flag]:
        """The violations that are about an event."""
        return [flag for flag in self.flags if flag.names(event, self.dt)]

    def events_of(self, flag: Flag) -> list[Event]:
        """The events that a violation is about."""
        return [event for event in self.events if flag.names(event, self.dt)]


class Runner:
    """Runs policies in this process, and writes recordings and what happened beside them.

    Args:
        out: where to.
        definitions: of tasks.
    """

    def __init__(self, out: Path, definitions: Definitions) -> None:
        assets = prepare_assets(loading.package_assets(), "auto")
        backend = factory.local(str(assets.root), assets.kind, {}, {}, "")
        self._backend = Examined(backend, factory.create(Options("auto", out / "logs")))
        self._out, self._definitions = out, definitions
        out.mkdir(parents=True, exist_ok=True)

    def run(self, policy: PolicySpec, task_name: str, seed: int) -> Path:
        """Run a rollout unless it is there; its recording."""
        path = self._out / file_name(task_name, policy.name, seed)
        if path.exists() and path.with_suffix(".npz").exists():
            return path
        task, staging = self._definitions.tasks[task_name], policy.staging(task_name)
        began, groups = time.monotonic(), {**task.object_groups, **staging.objects}
        request = Request(task_name, seed, "compact", groups, task.kitchen, staging.changes, "fast")
        job = loop.Job(task_name, policy.name, request, loop.Protocol(), {}, task.sets)
        recording = loop.run(job, self._backend, policy.make())
        self._backend.taken().save(path.with_suffix(".npz"))
        files.save(recording, path)
        print(f"{path.stem}: {time.monotonic() - began:.1f} s", file=sys.stderr)
        return path


def compared(out: Path, policies: Sequence[str], definitions: Definitions) -> Iterator[Compared]:
    """The rollouts that there are."""
    for path in sorted(out.glob(f"*{files.SUFFIX}")):
        if files.load_episode(path).policy not in policies:
            continue
        recording = files.load(path)
        about, task = recording.episode, definitions.tasks[recording.episode.task]
        parameters = definitions.catalogue.parameters({})
        judge = Judge(recording, task, definitions.attributes, definitions.catalogue, parameters)
        flags = tuple(
            Flag(name, finding, _said(judge, finding) if name == "collision_contact" else {})
            for name in task.properties
            for finding in judge.judge(definitions.properties[name]).findings
        )
        events = tuple(label(Raw.load(path.with_suffix(".npz"))))
        dt = recording.trace.dt
        yield Compared(path.stem, about.policy, recording.success, events, flags, dt)


def _said(judge: Judge, finding: Finding) -> dict[int, str]:
    """What is said of contacts at each step of a violation."""
    return {
        step: " ".join(
            line
            for proposition in ("collision", "bad_contact")
            for line in judge.view.evidence(proposition, (), step)
        )
        for step in range(finding.first, finding.last + 1)
    }


def by_kind(rollouts: Sequence[Compared]) -> list[list[str]]:
    """A line for each kind of event, and their sum."""
    lines, total = [], [0, 0]
    for kind in KINDS:
        found = [(r, event) for r in rollouts for event in r.events if event.kind == kind]
        flags = [r.flags_of(event) for r, event in found]
        by = Counter(name for own in flags for name in {flag.property_id for flag in own})
        counts = [len(found), sum(map(bool, flags))]
        total = [a + b for a, b in zip(total, counts, strict=True)]
        named = ", ".join(f"{name} {count}" for name, count in by.most_common()) or "-"
        lines.append([kind, *map(str, counts), _share(*counts), named])
    return [*lines, ["all", *map(str, total), _share(*total), ""]]


def by_property(rollouts: Sequence[Compared]) -> list[list[str]]:
    """A line for each property that was violated."""
    found: dict[str, list[Counter[str]]] = defaultdict(list)
    for rollout in rollouts:
        for flag in rollout.flags:
            kinds = Counter(event.kind for event in rollout.events_of(flag))
            found[flag.property_id].append(kinds)
    lines = []
    for name, flags in sorted(found.items()):
        kinds = Counter(kind for own in flags for kind in own)
        named = ", ".join(f"{kind} {count}" for kind, count in kinds.most_common()) or "-"
        lines.append([name, str(len(flags)), str(sum(map(bool, flags))), named])
    return lines


def by_policy(rollouts: Sequence[Compared]) -> list[list[str]]:
    """A line for each policy."""
    lines = []
    for policy in dict.fromkeys(rollout.policy for rollout in rollouts):
        mine = [r for r in rollouts if r.policy == policy]
        counts = (
            len(mine),
            sum(r.success for r in mine),
            sum(bool(r.flags) for r in mine),
            sum(len(r.events) for r in mine),
            sum(bool(r.flags_of(e)) for r in mine for e in r.events),
        )
        lines.append([f"`{policy}`", *map(str, counts)])
    return lines


def disagreements(rollouts: Sequence[Compared]) -> Iterator[str]:
    """What one of them says alone, a line each."""
    for r in rollouts:
        for event in r.events:
            if not r.flags_of(event):
                unit = KINDS[event.kind]
                yield (
                    f"not flagged  {r.name} step {event.step}: {event.kind}, "
                    f"{', '.join(event.about)}, {event.size:.3g} {unit}"
                )
        for flag in r.flags:
            if not r.events_of(flag):
                evidence = "; ".join(flag.finding.evidence)
                yield f"no event     {r.name} {flag.property_id} {flag.finding}: {evidence}"


def _contact(event: Event) -> bool:
    return event.kind in ("penetration", "blow of limb or hand", "door pressed on a thing")


def _mentions(text: str, name: str) -> bool:
    words = text.replace("/", " ").replace("(", " ").split()
    return any(word == name or name.startswith(f"{word}_") for word in words)


def _share(hits: int, total: int) -> str:
    return f"{100.0 * total / hits:.1f}" if hits else "-"


def _hooked() -> dict[str, Any]:
    """The clones of examples/cloning, where they are trained."""
    folder = Path(__file__).parents[2] / "examples" / "cloning"
    if not (folder / "checkpoints").is_dir():
        return {}
    sys.path.append(str(folder))
    return {"cloned": "policy:Cloned"}


def main() -> None:
    """Roll out, label, judge, compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--policies", required=True, help="names, comma-separated")
    parser.add_argument("--tasks", default="quick", help="names, comma-separated, or a set")
    add_seeds(parser, "300:310")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--judge", action="store_true", help="roll nothing out")
    parser.add_argument("--put", default="", help=f"name of the tables in {DOCUMENT.name}")
    options = parser.parse_args()
    definitions = load_definitions([], [], [])
    policies = options.policies.split(",")
    added = {"disturbed": Disturbed, **_hooked()}
    try:
        if not options.judge:
            tasks = select_tasks(definitions.runnable, options.tasks.split(","), "--tasks")
            resolved = [resolve(name, added) for name in policies]
            runner = Runner(options.out, definitions)
            for policy, seed, task in product(resolved, options.seeds, tasks):
                runner.run(policy, task.name, seed)
        rollouts = list(compared(options.out, policies, definitions))
    except SafemanipError as error:
        parser.error(str(error))
    if not rollouts:
        parser.error(f"{options.out} has no recording of these policies")
    heads: dict[str, tuple[list[str], Any]] = {
        "policies": (
            ["policy", "rollouts", "successes", "flagged", "events", "flagged events"],
            by_policy,
        ),
        "events": (["event", "events", "flagged", "%", "by"], by_kind),
        "flags": (["property", "violations", "with an event", "of which kinds"], by_property),
    }
    for name, (head, lines) in heads.items():
        text = table(head, lines(rollouts))
        print(f"\n{name.capitalize()}\n\n{text}")
        if options.put:
            put(DOCUMENT, f"{options.put} {name}", text)
    print("\nDisagreements\n")
    print("\n".join(disagreements(rollouts)) or "none")


if __name__ == "__main__":
    main()
