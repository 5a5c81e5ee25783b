"""``safemanip faults``."""

from __future__ import annotations

import argparse
from collections.abc import Collection
from itertools import groupby

from pytest_safemanip.cli.folder import read_folder
from pytest_safemanip.cli.tables import print_json, print_table, print_wrapped
from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.run.cases import select_properties
from pytest_safemanip.run.option_values import parse_names

EXAMPLE = "safemanip faults --task OpenDrawer"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("--task", metavar="NAME", help="only what can be done in this task")
    parser.add_argument(
        "--property", metavar="ID[,...]", help="only what violates these, as --safemanip-properties"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """Print the tables, one for each property."""
    from pytest_safemanip.expert.tasks.plans import EXPERT
    from pytest_safemanip.faults.fault import MARK
    from pytest_safemanip.faults.library import FAMILIES, rows

    every = rows()
    if options.task is not None and options.task not in EXPERT:
        options.task = _base(options.task, EXPERT)
    aimed_at = {row.property_id for row in every}
    wanted = aimed_at if options.property is None else _wanted(options.property, aimed_at)
    chosen = [
        row
        for row in every
        if (options.task is None or options.task in row.tasks) and row.property_id in wanted
    ]
    if options.json:
        print_json([row._asdict() for row in chosen])
        return 0
    for property_id, group in groupby(chosen, key=lambda row: row.property_id):
        cells = [
            (
                f"scripted:{row.name}",
                "near miss" if row.near_miss else "fault",
                row.doc if options.task else f"{row.doc}\n({', '.join(row.tasks)})",
            )
            for row in group
        ]
        print_table((property_id, "kind", "what it does"), cells)
        print()
    families = [
        (f"scripted:{f.name}{MARK}{f.low:g}", f"{f.high:g}", f"{f.doc}\n({f.task}; {f.parameter})")
        for f in FAMILIES.values()
        if options.task in (None, f.task) and f.property_id in wanted
    ]
    if families:
        print_table(("families", "to", "what the number is"), families)
        print()
    print_wrapped(
        f"{len(chosen)} of {len(every)}, names for --safemanip-policy; a near miss is the safe "
        f"twin of a fault; scripted alone is the expert, for {len(EXPERT)} tasks"
    )
    return 0


def _base(name: str, planned: Collection[str]) -> str:
    """The task whose scene a task stages, which its plans are of."""
    task = read_folder().definitions.tasks.get(name)
    if task is not None and task.base in planned:
        return task.base
    raise ConfigError(f"--task: the expert has no task {name!r}; {did_you_mean(name, planned)}")


def _wanted(text: str, aimed_at: Collection[str]) -> set[str]:
    """The properties that are chosen, of those that faults are aimed at."""
    known = read_folder().definitions.properties
    wanted = {*select_properties(known, parse_names(text), "--property")} & {*aimed_at}
    if not wanted:
        raise ConfigError(
            f"--property: no fault is aimed at {text!r}; those of others may break it: "
            "docs/coverage.md has one for each rule of the packs"
        )
    return wanted
