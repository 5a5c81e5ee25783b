"""``safemanip replay``: a recording in 3D, as a page for any browser."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from pytest_safemanip.cli.evaluation import add_judging, evaluate
from pytest_safemanip.report.replay import pack, page

EXAMPLE = "safemanip replay .safemanip/recordings/OpenDrawer-scripted-seed0.rollout -o drawer.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_judging(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="default: the recording's name with .html, in the working folder",
    )


def run(options: argparse.Namespace) -> int:
    """Write the page, and print its path."""
    found = evaluate(options)
    path = options.output or Path(f"{options.recording.stem}.html")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page(pack(found.recording, found.verdicts)), encoding="utf-8")
    print(path)
    for id_, error in found.errors.items():
        print(f"safemanip replay: {id_} is not shown, it has no verdict: {error}", file=sys.stderr)
    return 0
