"""``safemanip properties``."""

from __future__ import annotations

import argparse
from collections.abc import Iterable

from pytest_safemanip.cli.folder import own_file, read_folder
from pytest_safemanip.cli.tables import print_json, print_table, print_wrapped
from pytest_safemanip.ltlf import FormulaError
from pytest_safemanip.run.cases import applicable, select_properties
from pytest_safemanip.run.definitions import Definitions
from pytest_safemanip.run.option_values import parse_names
from pytest_safemanip.sim.backend import USUAL_PERIOD
from pytest_safemanip.spec.packs import Pack
from pytest_safemanip.spec.properties import LEAST_SEVERITY, Property

EXAMPLE = "safemanip properties pack:safebox"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "selectors",
        nargs="*",
        metavar="SELECTOR[,...]",
        help="ids, globs, category:NAME, pack:NAME, as --safemanip-properties; default",
    )
    parser.add_argument("--packs", action="store_true", help="list the packs instead")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(options: argparse.Namespace) -> int:
    """Print the table."""
    found = read_folder().definitions
    if options.packs:
        return _list(found.packs.values(), options.json)
    asked = parse_names(",".join(options.selectors))
    wanted = select_properties(found.properties, asked, "SELECTOR")
    chosen = [found.properties[name] for name in found.properties if name in wanted]
    tasks = {prop.id: _tasks(prop, found) for prop in chosen}
    if options.json:
        print_json([_plain(prop, tasks[prop.id]) for prop in chosen])
        return 0
    about = {prop.id: [*_about(prop), *(_too_large(prop) if asked else ())] for prop in chosen}
    rows = [(name, str(len(tasks[name])), "\n".join(lines)) for name, lines in about.items()]
    print_table(("property", "tasks", "what it asks"), rows)
    print_wrapped(
        f"\n{len(chosen)} of {len(found.properties)} properties, for {len(found.unstaged)} tasks; "
        "timed formulas"
    )
    return 0


def _tasks(prop: Property, found: Definitions) -> list[str]:
    """The tasks of the backend that a property applies to."""
    every = found.unstaged.values()
    return [task.name for task in every if applicable(task, found.everywhere, {prop.id})]


def _list(packs: Iterable[Pack], as_json: bool) -> int:
    """Print what packs there are, with their rules."""
    if as_json:
        print_json([{**_described(pack), "rules": list(pack.rules)} for pack in packs])
        return 0
    rows = [
        (f"pack:{pack.name}", str(len(pack.rules)), f"{pack.title}\n{pack.source}")
        for pack in packs
    ]
    print_table(("pack", "rules", "what it asks"), rows)
    print_wrapped("\n'safemanip properties pack:NAME' prints the rules of one")
    return 0


def _described(pack: Pack) -> dict[str, object]:
    plain = {"pack": pack.name, "title": pack.title, "source": pack.source, "about": pack.about}
    return {**plain, "not_expressed": dict(pack.not_expressed)}


def _about(prop: Property) -> list[str]:
    facts = [f"category {prop.category}"]
    if prop.ranges:
        facts.append(f"for each {prop.for_each}")
    if prop.deadline_s is not None:
        facts.append(f"within {prop.deadline_s:g} s")
    if prop.severity != LEAST_SEVERITY:
        facts.append(f"severity {prop.severity:g} at least")
    if prop.cost != prop.severity:
        facts.append(f"cost {prop.cost:g}")
    place = own_file(prop.path)
    return [prop.title, str(prop.formula), "; ".join(facts), *([place] if place else [])]


def _too_large(prop: Property) -> list[str]:
    """Why it cannot be judged at the usual control period; nothing if it can."""
    try:
        prop.check(USUAL_PERIOD)
    except FormulaError as error:
        return [f"cannot be judged at {1 / USUAL_PERIOD:g} Hz: {error}"]
    return []


def _plain(prop: Property, tasks: list[str]) -> dict[str, object]:
    return {
        "id": prop.id,
        "category": prop.category,
        "pack": prop.pack or None,
        "title": prop.title,
        "source": prop.source,
        "variables": prop.variables,
        "for_each": prop.for_each or None,
        "formula": str(prop.formula),
        "paper_formula": str(prop.paper_formula),
        "atoms": {atom: str(call) for atom, call in prop.atoms.items()},
        "deadline_s": prop.deadline_s,
        "discharged_by": prop.discharged_by,
        "severity": prop.severity,
        "cost": prop.cost,
        "tasks": tasks,
        "path": str(prop.path),
    }
