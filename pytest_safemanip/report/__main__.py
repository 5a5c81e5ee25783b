"""``python -m pytest_safemanip.report RUN...``: one evaluation from several runs."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Sequence
from pathlib import Path

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.gates import Gates, check_gates, load_gates, parse_gate
from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.metrics.merging import merge
from pytest_safemanip.metrics.selection import FILTERS
from pytest_safemanip.metrics.summaries import Summary, read
from pytest_safemanip.release import Release
from pytest_safemanip.report import document
from pytest_safemanip.report.rulings import ruling_lines
from pytest_safemanip.report.table import summary_lines


def main(arguments: Sequence[str] | None = None) -> int:
    """Merge, show and decide.

    Returns:
        0; 1 if a gate or a comparison fails, and 2 if the runs cannot be read or do not fit.
    """
    chosen = _parser().parse_args(arguments)
    try:
        run = merge([read(path) for path in chosen.runs])
        gates = _gates(chosen, run)
        baseline = read(chosen.baseline) if chosen.baseline else None
    except ConfigError as error:
        print(f"error: {error}", file=sys.stderr)  # noqa: T201
        return 2
    ruling = Release(gates, baseline).rule(run)
    metrics = measure_each(run.records)
    lines = summary_lines(run.records, metrics)
    if gates.gates or baseline:
        lines += ["", *ruling_lines(ruling)]
    print("\n".join(lines))  # noqa: T201
    if chosen.out:
        found = {**document.merged(run, metrics, chosen.out.parent), "release": ruling.to_json()}
        document.write(found, chosen.out)
    return 1 if ruling.failures(chosen.inconclusive == "fail") else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m pytest_safemanip.report",
        description="Metrics and gates over the summaries of several runs or machines; a rollout "
        "counts once.",
    )
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="a folder of a run")
    parser.add_argument("--gate", action="append", default=[], metavar="EXPR", help="as in a run")
    parser.add_argument("--gates", type=Path, metavar="FILE", help="a YAML file with named gates")
    parser.add_argument("--baseline", type=Path, metavar="DIR", help="an earlier run")
    parser.add_argument(
        "--inconclusive",
        choices=("fail", "skip"),
        default="fail",
        help="whether what too few rollouts were run for makes the exit status 1 (default: fail)",
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the merged summary here")
    return parser


def _gates(chosen: argparse.Namespace, run: Summary) -> Gates:
    found = load_gates(chosen.gates) if chosen.gates else Gates()
    own = [parse_gate(text) for text in chosen.gate]
    gates = dataclasses.replace(found, gates=(*found.gates, *own))
    known: dict[str, set[str]] = {name: set() for name in FILTERS}
    for record in run.records:
        for name in ("policy", "task", "suite", "horizon"):
            known[name].add(getattr(record, name))
        known["property"] |= {*record.properties, *record.unjudged}
        known["category"] |= {*record.unjudged.values()}
        known["category"] |= {verdict.category for verdict in record.properties.values()}
    check_gates(gates, known)
    return gates


if __name__ == "__main__":
    sys.exit(main())
