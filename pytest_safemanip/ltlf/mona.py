"""A second opinion on our automata: those that MONA builds from ltlf2dfa's translation.

ltlf2dfa is used for its parser and its translation to MONA's language only. Its own way of running
MONA goes through one file in its installation, which processes overwrite for each other, and takes
a failed run for an automaton; here every run has a folder of its own and is checked.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
import threading
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from pytest_safemanip.errors import ConfigError, install_command
from pytest_safemanip.ltlf.dfa import Dfa
from pytest_safemanip.ltlf.formula import (
    Always,
    Atom,
    Binary,
    Formula,
    Or,
    Unary,
    Until,
    WeakUntil,
    atoms_of,
)

_PARSING = threading.Lock()  # CPython 3.11 miscounts when threads build syntax trees at once
_TIMEOUT_S = 60
_TRANSITION = re.compile(r"State (\d+): ([01X]*) -> state (\d+)")
_VARIABLES = re.compile(r"DFA for formula with free variables:(.*)")
_ACCEPTING = re.compile(r"Accepting states:(.*)")


@dataclass(frozen=True, slots=True)
class MonaDfa:
    """An automaton as MONA gave it.

    Attributes:
        start: its initial state, behind the one that reads no step.
        accepting: its accepting states.
        rows: next states by state and letter; bit i of a letter is the value of `atoms_of` the
            formula.
    """

    start: int
    accepting: frozenset[int]
    rows: dict[int, list[int]]


def find_mona() -> Path:
    """The MONA program.

    Raises:
        ConfigError: there is none, or what is called so is another program.
    """
    found = shutil.which("mona")
    if found is None:
        raise ConfigError("MONA is missing; install it, for example: apt-get install mona")
    path = Path(found).resolve()
    banner = _run([str(path)]).stdout
    if not banner.startswith("MONA v"):
        raise ConfigError(
            f"{path} is not the MONA of WS1S; a package of that name on PyPI is another program: "
            "remove it (pip uninstall mona) and install MONA (apt-get install mona)"
        )
    return path


def translate(formula: Formula) -> str:
    """A formula in MONA's language, by way of ltlf2dfa.

    Atoms are renamed, since ltlf2dfa refuses some names, and everything is put in parentheses,
    since it binds some operators differently.

    Raises:
        ConfigError: ltlf2dfa is missing.
    """
    try:
        from ltlf2dfa.base import MonaProgram
        from ltlf2dfa.parser.ltlf import LTLfParser
    except ImportError as error:
        raise ConfigError(
            f"ltlf2dfa is missing; install it: {install_command('verify')}"
        ) from error
    names = {name: f"p{number}" for number, name in enumerate(atoms_of(formula))}
    with _PARSING:
        return str(MonaProgram(LTLfParser()(_spelled(formula, names))).mona_program())


def mona_dfa(formula: Formula, mona: Path) -> MonaDfa:
    """Compile a formula with MONA.

    Args:
        formula: what to compile.
        mona: the program, from `find_mona`.

    Raises:
        ConfigError: ltlf2dfa is missing, or MONA failed or took too long.
    """
    program = translate(formula)
    with tempfile.TemporaryDirectory(prefix="safemanip-mona-") as folder:
        source = Path(folder) / "formula.mona"
        source.write_text(program, encoding="utf-8")
        result = _run([str(mona), "-q", "-u", "-w", str(source)])
    if result.returncode != 0 or not _VARIABLES.search(result.stdout):
        said = (result.stderr or result.stdout).strip()
        raise ConfigError(f"MONA failed on '{formula}' (exit code {result.returncode}): {said}")
    return _read(result.stdout, len(atoms_of(formula)))


def difference(dfa: Dfa, other: MonaDfa) -> list[dict[str, bool]] | None:
    """A shortest trace on which two automata disagree, or None if their languages are equal.

    All pairs of states that some trace leads to are compared.

    Args:
        dfa: our automaton, over exactly the sorted atoms of its formula.
        other: MONA's automaton of the same formula.
    """
    start = (0, other.start)
    reached_by: dict[tuple[int, int], tuple[tuple[int, int], int] | None] = {start: None}
    queue = deque([start])
    while queue:
        pair = queue.popleft()
        for letter, (ours, theirs) in enumerate(
            zip(dfa.rows[pair[0]], other.rows[pair[1]], strict=True)
        ):
            if bool(dfa.accepting[ours]) != (theirs in other.accepting):
                letters = [letter, *_way_back(reached_by, pair)][::-1]
                return [
                    {atom: bool(x >> bit & 1) for bit, atom in enumerate(dfa.atoms)}
                    for x in letters
                ]
            if (ours, theirs) not in reached_by:
                reached_by[ours, theirs] = (pair, letter)
                queue.append((ours, theirs))
    return None


def _way_back(
    reached_by: dict[tuple[int, int], tuple[tuple[int, int], int] | None], pair: tuple[int, int]
) -> list[int]:
    letters = []
    while (step := reached_by[pair]) is not None:
        pair, letter = step
        letters.append(letter)
    return letters


def _spelled(formula: Formula, names: dict[str, str]) -> str:
    match formula:
        case Atom(name):
            return names[name]
        case WeakUntil(p, q):  # unknown to ltlf2dfa
            return _spelled(Or(Until(p, q), Always(p)), names)
        case Unary(operand):
            return f"{formula.symbol}({_spelled(operand, names)})"
        case Binary(left, right):
            return f"({_spelled(left, names)}) {formula.symbol} ({_spelled(right, names)})"
    return str(formula)


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(
            command, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise ConfigError(f"MONA did not finish within {_TIMEOUT_S} s") from error
    except OSError as error:
        raise ConfigError(f"{command[0]} cannot be run: {error.strerror}") from error


def _read(output: str, atoms: int) -> MonaDfa:
    """The automaton in MONA's text output.

    MONA names its variables in the order of its tracks; state 0 reads a column without meaning.
    """
    variables, accepting = _VARIABLES.search(output), _ACCEPTING.search(output)
    if variables is None or accepting is None:
        raise ConfigError(f"MONA's output is not understood:\n{output}")
    tracks = [int(name.removeprefix("P")) for name in variables[1].split()]
    rows: dict[int, list[int]] = {}
    for source, guard, target in _TRANSITION.findall(output):
        row = rows.setdefault(int(source), [-1] * (1 << atoms))
        care = sum(1 << track for track, bit in zip(tracks, guard, strict=True) if bit != "X")
        want = sum(1 << track for track, bit in zip(tracks, guard, strict=True) if bit == "1")
        for letter in range(1 << atoms):
            if letter & care == want:
                row[letter] = int(target)
    if any(-1 in row for row in rows.values()) or len(set(rows.get(0, []))) != 1:
        raise ConfigError(f"MONA's output is not understood:\n{output}")
    return MonaDfa(rows[0][0], frozenset(map(int, accepting[1].split())), rows)
