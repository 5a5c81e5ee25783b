"""``safemanip merge``."""

from __future__ import annotations

import argparse
from pathlib import Path

from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.metrics.merging import merge
from pytest_safemanip.metrics.shards import missing_line
from pytest_safemanip.metrics.summaries import NAME, read
from pytest_safemanip.report import document
from pytest_safemanip.report.numbers import counted

EXAMPLE = "safemanip merge runs/a runs/b -o runs/all && safemanip report runs/all"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "runs", nargs="+", type=Path, metavar="RUN", help="the folder of a run, or its summary"
    )
    parser.add_argument(
        "-o", "--out", type=Path, metavar="DIR", required=True, help="where summary.json is written"
    )


def run(options: argparse.Namespace) -> int:
    """Write one summary; a rollout that is in several runs counts once."""
    found = merge([read(path) for path in options.runs])
    path = options.out / NAME
    document.write(document.merged(found, measure_each(found.records), options.out), path)
    print(
        f"{counted(len(found.records), 'rollout')} of {counted(len(found.places), 'run')}: {path}"
    )
    if gone := missing_line(found.shards):
        print(gone)
    return 0
