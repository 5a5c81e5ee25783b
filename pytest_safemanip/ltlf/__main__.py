"""`python -m pytest_safemanip.ltlf verify`: check our automata against MONA's."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.ltlf.compiler import compile_formula
from pytest_safemanip.ltlf.formula import Formula
from pytest_safemanip.ltlf.mona import difference, find_mona, mona_dfa


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns:
        0 if all automata are equal, 1 if some are not, 2 if that could not be found out.
    """
    parser = argparse.ArgumentParser(
        prog="python -m pytest_safemanip.ltlf", description="Tools for LTLf formulas."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    verify = commands.add_parser(
        "verify",
        help="compare the automaton of every property with the one that MONA builds",
        description="Compare the automaton of every property, in both profiles, with the one that "
        "MONA builds from ltlf2dfa's translation: equal languages, by search, not by samples.",
    )
    verify.add_argument(
        "--properties",
        metavar="DIR",
        type=Path,
        action="append",
        help="a folder of properties, repeatable; by default the shipped ones",
    )
    options = parser.parse_args(arguments)
    try:
        return _verify(options.properties)
    except ConfigError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2


def _verify(given: Sequence[Path] | None) -> int:
    # The engine itself does without YAML; only this command reads properties.
    from pytest_safemanip.resources import folder
    from pytest_safemanip.spec.properties import load_properties

    folders = given or [folder("properties")]
    formulas = {
        (loaded.id, profile): formula
        for loaded in load_properties(folders).values()
        for profile, formula in (("timed", loaded.formula), ("paper", loaded.paper_formula))
    }
    if not formulas:
        raise ConfigError(f"no properties in {', '.join(map(str, folders))}")
    mona = find_mona()
    compared = {key: _compare(formula, mona) for key, formula in formulas.items()}
    width = max(len("property"), *(len(name) for name, _ in formulas))
    sys.stdout.write(f"{'property':<{width}}  profile  states  MONA's  language\n")
    differing = 0
    for (name, profile), (states, theirs, trace) in compared.items():
        found = "equal" if trace is None else "DIFFERENT"
        sys.stdout.write(f"{name:<{width}}  {profile:<7}  {states:>6}  {theirs:>6}  {found}\n")
        if trace is not None:
            differing += 1
            sys.stdout.write(f"  {formulas[name, profile]}\n  one accepts and one rejects:\n")
            for number, step in enumerate(trace):
                true = [atom for atom, value in step.items() if value]
                sys.stdout.write(f"    step {number}: {', '.join(true) or 'nothing true'}\n")
    sys.stdout.write(f"{len(formulas)} automata compared with {mona}, {differing} different\n")
    return 1 if differing else 0


def _compare(formula: Formula, mona: Path) -> tuple[int, int, list[dict[str, bool]] | None]:
    """Numbers of states, ours and MONA's, and a trace on which they disagree."""
    ours, theirs = compile_formula(formula), mona_dfa(formula, mona)
    entered = len(theirs.rows) - (theirs.start != 0)  # without the state that reads no step
    return len(ours), entered, difference(ours, theirs)


if __name__ == "__main__":
    sys.exit(main())
