"""``safemanip search``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from pytest_safemanip.cli.drawing import task_request
from pytest_safemanip.cli.folder import Folder, read_folder
from pytest_safemanip.cli.recordings.output import given_path
from pytest_safemanip.cli.tables import print_json, print_table
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.report.numbers import counted
from pytest_safemanip.report.whole import write_whole
from pytest_safemanip.search.kinds.catalogue import Kinds
from pytest_safemanip.search.regression import Regression, as_dimensions, load_regressions
from pytest_safemanip.search.scenes import scenes
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.registry import find_simulator

EXAMPLE = "safemanip search --export scenes.jsonl --count 20"
COUNT, MOST = 20, 100_000
"""Scenes of each failure, unless told, and at most."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "folder",
        nargs="?",
        type=given_path,
        metavar="DIR",
        help="of the failures that searches kept; by default that of the ini file, or regressions",
    )
    parser.add_argument(
        "--export",
        type=given_path,
        metavar="FILE",
        help="write scenes to train on, an episode around one of the failures in each line",
    )
    parser.add_argument(
        "--count", type=int, default=COUNT, metavar="N", help=f"of each failure ({COUNT})"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of their sizes (0)")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """List the failures, or write scenes around them."""
    folder = read_folder()
    place = options.folder or folder.settings.regressions
    kept = load_regressions(place, Kinds(folder.extensions.dimensions))
    if not kept:
        raise ConfigError(
            f"{place}: no failure is kept there; pytest --safemanip-search finds some"
        )
    if options.export is not None:
        return _export(options, folder, list(kept.values()))
    if options.json:
        print_json(
            [
                {
                    "name": own.name,
                    "task": own.task,
                    "property": own.property_id,
                    "seed": own.seed,
                    "changes": [change.to_plain() for change in own.changes],
                    "found": own.found,
                }
                for own in kept.values()
            ]
        )
        return 0
    rows = [(own.task, own.property_id, _when(own)) for own in kept.values()]
    print_table(("task", "fails", "when"), rows)
    return 0


def _when(kept: Regression) -> str:
    dimensions, deviation = as_dimensions(kept.changes)
    found = f" ({kept.found})" if kept.found else ""
    return f"{dimensions.say(deviation, lambda role: role)}, seed {kept.seed}{found}"


def _export(options: argparse.Namespace, folder: Folder, kept: list[Regression]) -> int:
    if not 0 < options.count <= MOST:
        raise ConfigError(f"--count: expected 1 to {MOST}, found {options.count}")
    lines = [json.dumps(scene) for own in kept for scene in _scenes(own, folder, options)]
    path: Path = write_whole(options.export, "".join(f"{line}\n" for line in lines))
    print(f"{path}: {counted(len(lines), 'scene')} around {counted(len(kept), 'failure')}")
    return 0


def _scenes(kept: Regression, folder: Folder, options: argparse.Namespace) -> list[object]:
    own = folder.with_backend(kept.backend)
    task = own.task(kept.task)
    spec = find_simulator(kept.backend, own.extensions.backends).spec.in_task(task.simulated)
    family = kept.scenes or spec.scenes[0]

    def plain(seed: int) -> Request:
        return task_request(task, seed, family, spec)

    return list(scenes(kept, plain, options.count, options.seed))
