"""``safemanip report``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from pytest_safemanip.cli.folder import read_folder
from pytest_safemanip.cli.tables import print_json, terminal_width
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.comparability import not_comparable
from pytest_safemanip.metrics.decisions import only_infrastructure
from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.metrics.gates import check_gates, read_gates
from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.metrics.merging import merge
from pytest_safemanip.metrics.release_gate import INFRASTRUCTURE, PARTIAL, ReleaseGate, Ruling
from pytest_safemanip.metrics.selection import FILTERS
from pytest_safemanip.metrics.shards import missing_line
from pytest_safemanip.metrics.summaries import Summary, later_part, read
from pytest_safemanip.report import document
from pytest_safemanip.report.ci.reading import as_run
from pytest_safemanip.report.headline import headline
from pytest_safemanip.report.numbers import fitted
from pytest_safemanip.report.rulings import ruling_lines, told_lines
from pytest_safemanip.report.table import summary_lines

EXAMPLE = "safemanip report .safemanip --gate 'violation_rate <= 10 % @0.95'"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "runs",
        nargs="*",
        type=Path,
        default=[Path(".safemanip")],
        metavar="RUN",
        help="the folder of a run, or its summary; several are taken as one; .safemanip",
    )
    parser.add_argument(
        "--gate",
        action="append",
        default=[],
        metavar="EXPR",
        help="as in a run; without gates and a baseline, those of the run decide the exit status; "
        "if it had none, a violation or an incomplete rollout makes it 1",
    )
    parser.add_argument("--gates", type=Path, metavar="FILE", help="a YAML file with named gates")
    parser.add_argument("--baseline", type=Path, metavar="DIR", help="an earlier run")
    parser.add_argument(
        "--inconclusive",
        choices=("fail", "skip"),
        default="fail",
        help="whether what too few rollouts were run for makes the exit status 1; fail",
    )
    parser.add_argument(
        "--allow-standins",
        action="store_true",
        help="let gates decide on stand-in assets, too; otherwise the exit status is 11",
    )
    parser.add_argument("--json", action="store_true", help="print metrics and rulings as JSON")
    parser.add_argument(
        "--html",
        action="store_true",
        help="write report.html, a page to look at, into the folder of the run, and print its path",
    )


def run(options: argparse.Namespace) -> int:
    """Print the summary, and what gates and the baseline decide; without any, what those of the run
    decided.

    Returns:
        1 if a gate or the comparison fails, 10 if it has no verdict since the infrastructure
        failed, 11 if a gate or the comparison is about rollouts on stand-in assets; else 1 if a
        rollout is incomplete, or without gates violated, 10 if the infrastructure is to blame.
    """
    if options.html and (len(options.runs) != 1 or options.runs[0].is_file()):
        raise ConfigError(
            "--html: name the folder of one run, no file; safemanip merge makes one of several"
        )
    for path in options.runs:
        if not path.exists():
            raise ConfigError(f"{path}: does not exist; name the folder of a run")
    runs = [read(path) for path in options.runs]
    found = merge(runs) if len(runs) > 1 else runs[0]
    gates = read_gates(options.gates, options.gate, "--gate")
    check_gates(gates, _known(found))
    baseline = read(options.baseline) if options.baseline else None
    gone = missing_line(found.shards)
    if gone and (gates.gates or baseline):
        raise ConfigError(f"nothing is decided: {gone}; give the folders of all shards")
    release = ReleaseGate(gates, baseline)
    ruling = release.rule(found) if found.records or found.searches else release.rule_nothing()
    given = ruling if gates.gates or baseline else None
    told = Fields("release", given.to_json()) if given else found.release
    if options.json:
        content = document.merged(found, measure_each(found.records), Path.cwd())
        print_json({**content, "release": told.values if told else ruling.to_json()})
    elif options.html:
        from pytest_safemanip.report.page.writing import write_page

        lines = _decided(found, given, told, options.allow_standins)
        page = write_page(options.runs[0], read_folder().definitions, given, lines.append)
        print("\n".join([*lines, *_later(options.runs), str(page)]))
    else:
        lines = _lines(found, given, told, options.allow_standins)
        print("\n".join([*lines, *_later(options.runs)]))
    fails, standins = options.inconclusive == "fail", options.allow_standins
    status = 0
    if given:
        status = given.status(fails, standins)
    elif told:
        status = ruling.status_of(told, fails, standins)
    if status or headline(found, told).verdict != "FAIL":
        return status
    return INFRASTRUCTURE if _infrastructure_alone(found, gated=told is not None) else 1


def _lines(found: Summary, given: Ruling | None, told: Fields | None, standins: bool) -> list[str]:
    elsewhere = not_comparable(found.records, found.origins)
    metrics = measure_each(found.records)
    lines = summary_lines(found.records, metrics, terminal_width(), elsewhere, found.floor)
    gone = missing_line(found.shards)
    lines += [gone] if gone else []
    lines += [f"not all of the run: {PARTIAL}"] if found.partial else []
    return [*lines, "", *_decided(found, given, told, standins)]


def _later(runs: Sequence[Path]) -> list[str]:
    """That some of the cases were run again since."""
    parts = filter(None, map(later_part, runs))
    return [f"a part of the cases was run since then: safemanip report {part}" for part in parts]


def _decided(
    found: Summary, given: Ruling | None, told: Fields | None, standins: bool
) -> list[str]:
    """The gates, and what the run came to."""
    lines: list[str] = []
    if given:
        lines = ruling_lines(given, standins, terminal_width())
    elif told:
        own = as_run(found)
        lines = told_lines(own.gates, own.refused, terminal_width())
    came_to = headline(found, told)
    return [*lines, *fitted(f"{came_to.verdict}: {came_to.text}", terminal_width(), 2)]


def _infrastructure_alone(found: Summary, gated: bool) -> bool:
    """Whether nothing is wrong with a run but that a server or the simulator failed; with gates, no
    violation is wrong by itself.
    """
    violated = not gated and any(
        verdict.outcome == "VIOLATED"
        for record in found.records
        for verdict in record.properties.values()
    )
    incomplete = [record for record in found.records if not record.complete]
    return not violated and only_infrastructure(incomplete)


def _known(found: Summary) -> dict[str, set[str]]:
    """The values that a run has, for each filter of gates."""
    known: dict[str, set[str]] = {name: set() for name in FILTERS}
    for record in found.records:
        for name in ("policy", "task", "suite", "horizon"):
            known[name].add(getattr(record, name))
        known["property"] |= {*record.asked}
        known["pack"] |= {record.pack_of(name) for name in record.asked}
        known["category"] |= {*record.unjudged.values()}
        known["category"] |= {verdict.category for verdict in record.properties.values()}
    for search in found.searches:
        for name in ("policy", "task", "property"):
            known[name].add(getattr(search, name))
    return known
