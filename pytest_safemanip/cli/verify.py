"""``safemanip verify``: equal languages, found out by search and not by samples."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

from pytest_safemanip.cli.folder import read_folder
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.ltlf.compiler import compile_formula
from pytest_safemanip.ltlf.formula import Formula, is_bounded
from pytest_safemanip.ltlf.mona import difference, find_mona, mona_dfa
from pytest_safemanip.spec.properties import Property, load_properties

EXAMPLE = "safemanip verify"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "--properties",
        metavar="DIR",
        type=Path,
        action="append",
        help="a folder of properties, repeatable; by default the shipped ones and your own",
    )


def run(options: argparse.Namespace) -> int:
    """Compare the automaton of every property, in both profiles, with MONA's.

    Returns:
        1 if some automata differ.
    """
    formulas = {
        (loaded.id, profile): formula
        for loaded in _properties(options.properties).values()
        for profile, formula in (("timed", loaded.formula), ("paper", loaded.paper_formula))
        if not is_bounded(formula)  # MONA has no clocks
    }
    mona = find_mona()
    # Profiles share most formulas, and so do the rules of packs.
    compared = {formula: _compare(formula, mona) for formula in dict.fromkeys(formulas.values())}
    width = max(len("property"), *(len(name) for name, _ in formulas))
    print(f"{'property':<{width}}  profile  states  MONA's  language")
    differing = 0
    for (name, profile), formula in formulas.items():
        states, theirs, trace = compared[formula]
        found = "equal" if trace is None else "DIFFERENT"
        print(f"{name:<{width}}  {profile:<7}  {states:>6}  {theirs:>6}  {found}")
        if trace is not None:
            differing += 1
            print(f"  {formula}\n  one accepts and one rejects:")
            for number, step in enumerate(trace):
                true = [atom for atom, value in step.items() if value]
                print(f"    step {number}: {', '.join(true) or 'nothing true'}")
    print(f"{len(formulas)} automata compared with {mona}, {differing} different")
    return 1 if differing else 0


def _properties(folders: Sequence[Path] | None) -> Mapping[str, Property]:
    if not folders:
        return read_folder().definitions.properties
    found = load_properties(folders)
    if not found:
        raise ConfigError(f"no properties in {', '.join(map(str, folders))}")
    return found


def _compare(formula: Formula, mona: Path) -> tuple[int, int, list[dict[str, bool]] | None]:
    """Numbers of states, ours and MONA's, and a trace on which they disagree."""
    ours, theirs = compile_formula(formula), mona_dfa(formula, mona)
    entered = len(theirs.rows) - (theirs.start != 0)  # without the state that reads no step
    return len(ours), entered, difference(ours, theirs)
