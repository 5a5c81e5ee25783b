"""``safemanip propositions``."""

from __future__ import annotations

import argparse
import inspect
import math
import re
import sys
from collections.abc import Iterable, Iterator, Mapping

from pytest_safemanip.cli.folder import read_folder
from pytest_safemanip.cli.tables import print_json, print_table, print_wrapped
from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.report.numbers import counted

EXAMPLE = "safemanip propositions settled obj_grasped --markdown"
_CLAUSE = re.compile(r"(?<=[.;:])\s+|\n\n")
_HEAD = """# Propositions

What the atoms of a property mean. A value at a step depends on the steps before it within the
window, never on later ones. An *act* is of the robot, and false in the settle tail. A *margin* is
how far it is from its threshold, in units of that: positive where it is true, 1 at twice the
limit. Of conditions that all have to hold the least margin counts; one without a threshold is one
unit from it. Every number can be changed: `--safemanip-params=settled.speed=0.05` judges
recordings again with another one. A *place* is a robot's hand, an object, a fixture or a zone; an
*appliance* is a fixture with a switch.
Printed by `safemanip propositions --markdown`."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("names", nargs="*", metavar="NAME", help="of propositions; all")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(
        "--markdown", action="store_true", help="print exact conditions and all parameters"
    )


def run(options: argparse.Namespace) -> int:
    """Print the table, or the page."""
    folder = read_folder()
    catalogue = folder.definitions.catalogue
    parameters = catalogue.parameters(folder.settings.params)
    for name in options.names:
        if name not in catalogue:
            hint = did_you_mean(name, catalogue, "safemanip propositions")
            raise ConfigError(f"unknown proposition {name!r}; {hint}")
    chosen = [p for p in catalogue.values() if not options.names or p.name in options.names]
    if options.markdown:
        sys.stdout.write(markdown(chosen, parameters))
    elif options.json:
        print_json([_plain(p, parameters) for p in chosen])
    else:
        rows = [(_signature(p), _memory(p, parameters), _first(p)) for p in chosen]
        print_table(("proposition", "looks back", "true when"), rows)
        number = counted(len(chosen), "proposition")
        print_wrapped(f"\n{number}; --markdown has conditions and parameters")
    return 0


def markdown(chosen: Iterable[Proposition], parameters: Mapping[str, float]) -> str:
    """A page about some propositions, with the defaults of all parameters.

    Args:
        chosen: the propositions.
        parameters: that windows are computed from.
    """
    return "\n".join((_HEAD, *(line for p in chosen for line in _section(p, parameters)))) + "\n"


def _section(proposition: Proposition, parameters: Mapping[str, float]) -> Iterator[str]:
    window = _memory(proposition, parameters)
    memory = "remembers all" if window == "all" else f"window {window}"
    yield f"\n## `{_signature(proposition)}`\n"
    yield inspect.cleandoc(proposition.doc).replace("``", "`")
    yield f"\n*{memory}{', an act' if proposition.act else ''}*"
    yield f"\n{_margin(proposition)}"
    for law, reason in proposition.exempt.items():
        yield f"\nNot subject to the law `{law}`: {reason}."
    if proposition.parameters:
        yield "\n| parameter | default | why |\n|---|---|---|"
        for p in proposition.parameters:
            yield f"| `{p.name}` | {p.default:.4g} {p.unit} | {p.reason} |".replace("  ", " ")


def _margin(proposition: Proposition) -> str:
    """What its margin is, or why it has none."""
    if proposition.margin is None:
        return f"No margin: {proposition.no_margin or 'none is defined'}."
    said = inspect.cleandoc(proposition.margin.__doc__ or "defined in Python").replace("``", "`")
    return f"Margin: {said.replace(' (T,)', '')}"


def _plain(proposition: Proposition, parameters: Mapping[str, float]) -> dict[str, object]:
    window = proposition.window(parameters)
    return {
        "name": proposition.name,
        "arguments": proposition.arguments,
        "window_s": None if math.isinf(window) else window,
        "act": proposition.act,
        "margin": proposition.margin is not None,
        "condition": inspect.cleandoc(proposition.doc),
        "parameters": [
            {"name": p.name, "unit": p.unit, "value": parameters[p.name], "why": p.reason}
            for p in proposition.parameters
        ],
    }


def _signature(proposition: Proposition) -> str:
    arguments = f"({', '.join(proposition.arguments)})" if proposition.arguments else ""
    return f"{proposition.name}{arguments}"


def _memory(proposition: Proposition, parameters: Mapping[str, float]) -> str:
    window = proposition.window(parameters)
    return "all" if math.isinf(window) else f"{window:g} s"


def _first(proposition: Proposition) -> str:
    """The first clause of the condition, in one line."""
    clause = _CLAUSE.split(inspect.cleandoc(proposition.doc), maxsplit=1)[0]
    line = " ".join(clause.replace("``", "").split())
    return line if line.endswith(".") else f"{line.rstrip(';:')} ..."
