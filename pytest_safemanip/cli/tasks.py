"""``safemanip tasks``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from pytest_safemanip.cli.folder import add_backend, own_file, read_folder
from pytest_safemanip.cli.tables import print_json, print_table, print_wrapped
from pytest_safemanip.run.cases import select_tasks
from pytest_safemanip.run.definitions import Definitions
from pytest_safemanip.run.option_values import parse_names
from pytest_safemanip.sim.registry import find_simulator
from pytest_safemanip.spec.task import Task

EXAMPLE = "safemanip tasks 'PickPlace*' set:quick"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "selectors",
        nargs="*",
        metavar="SELECTOR[,...]",
        help="names, globs, suite:NAME, horizon:NAME, set:NAME, as --safemanip-tasks; all",
    )
    add_backend(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """Print the table."""
    folder = read_folder(options.backend)
    found = folder.definitions
    find_simulator(folder.settings.backend, folder.extensions.backends)  # there has to be one
    asked = parse_names(",".join(options.selectors)) or ("all",)
    chosen = select_tasks(found.runnable, asked, "SELECTOR")
    if options.json:
        names = ("name", "suite", "horizon", "sets", "properties")
        rows = [{key: getattr(task, key) for key in names} for task in chosen]
        print_json(
            [{**row, "path": str(task.path)} for row, task in zip(rows, chosen, strict=True)]
        )
        return 0
    print_table(
        ("task", "suite", "horizon", "sets"),
        [
            (task.name, task.suite, task.horizon, _sets(", ".join(task.sets), own_file(task.path)))
            for task in chosen
        ],
    )
    print_wrapped(f"\n{_count(chosen, found)}; safemanip task NAME describes one")
    return 0


def _count(chosen: Sequence[Task], found: Definitions) -> str:
    """How many of all tasks there are, and of those that stage the scene of one."""
    staged = [task for task in found.runnable.values() if task.base]
    some = sum(bool(task.base) for task in chosen)
    tasks = f"{len(chosen) - some} of {len(found.unstaged)} tasks"
    if not staged:
        return tasks
    sets = ", ".join(f"set:{name}" for name in dict.fromkeys(s for t in staged for s in t.sets))
    which = f", which 'all' leaves out: {sets}" if sets else ""
    return f"{tasks}, {some} of {len(staged)} staged scenes{which}"


def _sets(sets: str, place: str) -> str:
    return f"{sets}\n{place}" if place else sets
