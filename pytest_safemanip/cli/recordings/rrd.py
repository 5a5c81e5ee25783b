"""``safemanip rrd``: a recording for Rerun."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.cli.evaluation import Evaluation, evaluate
from pytest_safemanip.cli.recordings.meshes import add_viewing, looks, output
from pytest_safemanip.report.replay.rerun_file import MOST_SERIES, load_rerun, write_rrd

EXAMPLE = "safemanip rrd .safemanip/recordings/OpenDrawer-scripted-seed0.rollout -o drawer.rrd"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_viewing(parser, ".rrd")


def run(options: argparse.Namespace) -> int:
    """Write the file, and print its path."""
    load_rerun()
    found = evaluate(options)
    path = output(options, ".rrd")
    meshes = looks(options, found)
    print(write_rrd(found.recording, found.verdicts, _propositions(found), path, meshes))
    for id_, error in found.errors.items():
        print(f"safemanip rrd: {id_} is not shown, it has no verdict: {error}", file=sys.stderr)
    return 0


def _propositions(found: Evaluation) -> Mapping[tuple[str, ...], NDArray[np.bool_]]:
    """Truth values (T,) of what the judged properties are made of, for all of their instances;
    those of violated instances first, in case there are too many.
    """
    binding = found.task.bind(found.recording.scene, found.folder.definitions.attributes)
    calls: dict[tuple[str, ...], None] = {}
    rows = [(id_, f.entities) for id_, verdict in found.verdicts.items() for f in verdict.findings]
    for id_ in found.verdicts:
        rows += [(id_, row) for row in found.properties[id_].rows(binding)]
    for id_, row in rows:
        calls.update(dict.fromkeys(found.properties[id_].calls(row)))
    return {call: found.judge.view(*call) for call in list(calls)[:MOST_SERIES]}
