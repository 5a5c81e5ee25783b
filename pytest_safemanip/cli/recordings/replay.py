"""``safemanip replay``: a recording in 3D, as a page for any browser."""

from __future__ import annotations

import argparse
import sys

from pytest_safemanip.cli.evaluation import evaluate
from pytest_safemanip.cli.recordings.meshes import add_viewing, looks, output
from pytest_safemanip.report.replay import pack, page
from pytest_safemanip.report.whole import write_whole

EXAMPLE = "safemanip replay .safemanip/recordings/OpenDrawer-scripted-seed0.rollout -o drawer.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_viewing(parser, ".html")


def run(options: argparse.Namespace) -> int:
    """Write the page, and print its path."""
    found = evaluate(options)
    path = output(options, ".html")
    data = pack(found.recording, found.verdicts, looks(options, found))
    print(write_whole(path, (page(data),)))
    for id_, error in found.errors.items():
        print(f"safemanip replay: {id_} is not shown, it has no verdict: {error}", file=sys.stderr)
    return 0
