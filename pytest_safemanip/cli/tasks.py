"""``safemanip tasks``."""

from __future__ import annotations

import argparse

from pytest_safemanip.cli.folder import add_backend, own_file, read_folder
from pytest_safemanip.cli.tables import print_json, print_table, print_wrapped
from pytest_safemanip.run.cases import select_tasks
from pytest_safemanip.sim.registry import find_simulator

EXAMPLE = "safemanip tasks 'PickPlace*' set:quick"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "selectors",
        nargs="*",
        metavar="SELECTOR",
        help="names, globs, suite:NAME, horizon:NAME, set:NAME, as --safemanip-tasks; all",
    )
    add_backend(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """Print the table."""
    folder = read_folder(options.backend)
    found = folder.definitions
    find_simulator(folder.settings.backend, folder.extensions.backends)  # there has to be one
    chosen = select_tasks(found.runnable, options.selectors or ["all"], "SELECTOR")
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
    print_wrapped(
        f"\n{len(chosen)} of {len(found.runnable)} tasks; safemanip task NAME describes one"
    )
    return 0


def _sets(sets: str, place: str) -> str:
    return f"{sets}\n{place}" if place else sets
