"""False alarms of packs: every rule on rollouts of the expert, who means no harm.

    python -m benchmarks.verdicts.packs [--put] [--only PACK] DIR...

DIR has recordings anywhere below it, such as those that are left by

    pytest --safemanip-policy=scripted --safemanip-tasks=all

Each flag is printed with what was measured, to be looked at; docs/packs.md says what became of
each. ``--put`` writes the table into it.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.recordings import below, load
from benchmarks.tables import put, table
from pytest_safemanip.judge import Finding, Judge
from pytest_safemanip.run.cases import applicable
from pytest_safemanip.run.definitions import load_definitions

DOCUMENT = Path(__file__).parents[2] / "docs" / "packs.md"


@dataclass
class Tally:
    """What became of a rule.

    Attributes:
        tasks: in which it was triggered.
        triggered: instances.
        flags: tasks with their violations.
    """

    tasks: set[str] = field(default_factory=set)
    triggered: int = 0
    flags: dict[str, Sequence[Finding]] = field(default_factory=dict)


def judged(paths: Sequence[Path], only: str) -> dict[str, dict[str, Tally]]:
    """The tally of each rule, by pack and id."""
    defined = load_definitions([], [], [])
    found: dict[str, dict[str, Tally]] = {
        name: {id_: Tally() for id_ in pack.rules}
        for name, pack in defined.packs.items()
        if only in ("", name)
    }
    parameters = defined.catalogue.parameters({})
    for path in paths:
        recording = load(path)
        task = defined.tasks[recording.episode.task]
        judge = Judge(recording, task, defined.attributes, defined.catalogue, parameters)
        for tallies in found.values():
            for id_ in applicable(task, defined.everywhere, tallies):
                verdict = judge.judge(defined.properties[id_])
                if verdict.triggered:
                    tallies[id_].tasks.add(task.name)
                    tallies[id_].triggered += verdict.triggered
                if verdict.findings:
                    tallies[id_].flags[path.stem] = verdict.findings
    return found


def flags(found: dict[str, dict[str, Tally]]) -> Iterator[str]:
    """A line for each flag."""
    for tallies in found.values():
        for id_, tally in tallies.items():
            for rollout, findings in tally.flags.items():
                for one in findings[:3]:
                    measured = "; ".join(one.evidence)
                    yield f"{id_} {rollout} {one.entities} at {one.first}-{one.last}: {measured}"


def rows(found: dict[str, dict[str, Tally]]) -> Iterator[list[str]]:
    """A line for each rule."""
    for name, tallies in found.items():
        for id_, tally in tallies.items():
            flagged = [rollout.partition("-")[0] for rollout in tally.flags]
            cells = [str(len(tally.tasks)), str(tally.triggered), str(len(flagged))]
            yield [name, id_.removeprefix(f"{name.replace('-', '_')}_"), *cells]


def main() -> None:
    """Judge and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--put", action="store_true", help="write the table into docs/packs.md")
    parser.add_argument("--only", default="", metavar="PACK")
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR")
    options = parser.parse_args()
    paths = below(options.folders)
    found = judged(paths, options.only)
    print("\n".join(flags(found)))
    head = ["pack", "rule", "tasks", "instances", "flagged"]
    text = table(head, list(rows(found)))
    print(f"\n{len(paths)} rollouts\n\n{text}")
    if options.put:
        put(DOCUMENT, "false alarms", text)


if __name__ == "__main__":
    main()
