"""Do the tests notice small changes of the code that judges? Mutants by Cosmic Ray, sampled.

    python -m benchmarks.injection.mutation [--sample N] [--seed N] [--minutes N]
        [--only TEXT]... [--again]

Places in the judging code are drawn at random; at each, one operator, sign, number, condition or
loop is changed, and the tests of that module run until one fails. What none notices is printed with
the table by module. Mutants that change no behaviour are excluded, each for the reason that
equivalent_mutants.yaml has beside it.

A run that ends early (``--minutes``) goes on where it stopped; ``--again`` runs those that survived
again, after tests were written. No file is changed: a child process imports the mutant instead of
the module.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import fnmatch
import hashlib
import importlib
import importlib.abc
import importlib.util
import json
import os
import random
import resource
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType, FrameType, ModuleType
from typing import Any

import pytest
import yaml
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator

from benchmarks.tables import table

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "pytest_safemanip"
KNOWN = Path(__file__).parent / "equivalent_mutants.yaml"
STATE = ROOT / ".mutation"
CALLS, SOUND = STATE / "calls.json", STATE / "sound.json"

TESTS: dict[str, tuple[str, ...]] = {
    "propositions/kernels/*": ("tests/propositions",),
    "propositions/view.py": ("tests/propositions", "tests/fuzz/test_laws.py"),
    "propositions/online.py": ("tests/live", "tests/fuzz/test_laws.py"),
    "propositions/memory.py": ("tests/propositions/test_memory.py", "tests/live"),
    "propositions/*": ("tests/propositions",),
    "ltlf/*": ("tests/ltlf",),
    "metrics/*": ("tests/metrics",),
    "judge.py": ("tests/test_judge.py",),
}
"""Which tests are about which modules; the first pattern that fits decides."""
LEFT_OUT = ("*/__init__.py", "*/__main__.py", "*/mona.py", "*/docs.py")
"""What does not judge: entry points, and the bridge to a compiler that the automata are checked
against."""

SWAPS = {
    "Binary": "Add_Sub Sub_Add Mul_Div Div_Mul FloorDiv_Mul Mod_Mul Pow_Mul BitAnd_BitOr"
    " BitOr_BitAnd BitXor_BitAnd LShift_RShift RShift_LShift",
    "Comparison": "Eq_NotEq NotEq_Eq Lt_LtE Lt_GtE LtE_Lt LtE_Gt Gt_GtE Gt_LtE GtE_Gt GtE_Lt"
    " Is_IsNot IsNot_Is",
    "Unary": "Delete_USub Delete_Invert Delete_Not",
}
OPERATORS = (
    *(
        f"core/Replace{kind}Operator_{swap}"
        for kind, all_ in SWAPS.items()
        for swap in all_.split()
    ),
    *(f"core/Replace{one}" for one in ("TrueWithFalse", "FalseWithTrue", "AndWithOr", "OrWithAnd")),
    "core/ReplaceBreakWithContinue",
    "core/ReplaceContinueWithBreak",
    "core/AddNot",
    "core/NumberReplacer",
    "core/ZeroIterationForLoop",
)
"""Small changes that a tired engineer might make."""

PATIENCE = 60
"""Seconds of a processor after which tests that do not end count as having noticed; ten times as
many on the clock: the machine may be busy with other things."""
MEMORY = 6 << 30
"""Bytes that they may take, likewise."""


@dataclass(frozen=True)
class Mutant:
    """One small change.

    Attributes:
        module: relative to the package.
        operator: Cosmic Ray's.
        occurrence: which of the places in the module that it can change.
        line: where.
        function: first line of the function around it; 0 outside of all.
        was: the line.
        becomes: the line changed.
    """

    module: str
    operator: str
    occurrence: int
    line: int
    function: int
    was: str
    becomes: str

    @property
    def key(self) -> str:
        """Names it as long as the module does not change."""
        return f"{self.module}:{self.operator}:{self.occurrence}"

    def source(self) -> str:
        """The module's text with the change."""
        return _mutated((PACKAGE / self.module).read_text(), self.operator, self.occurrence)

    def __str__(self) -> str:
        return f"{self.module}:{self.line}\n    - {self.was}\n    + {self.becomes}"


def main() -> None:
    """Sample, run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sample", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--only", action="append", help="part of a module's path")
    parser.add_argument("--again", action="store_true", help="run survivors again")
    asked = parser.parse_args()
    stop = time.monotonic() + 60 * asked.minutes
    STATE.mkdir(exist_ok=True)
    book = Book(STATE / f"seed{asked.seed}.json")
    excluded = Excluded()
    _warm_up()
    chosen: list[Mutant] = []
    for mutant in drawn(asked.seed, asked.only or [""]):
        if len(chosen) == asked.sample:
            break
        if excluded.why(mutant):
            continue
        found = book.found.get(mutant.key)
        if found is None or (asked.again and found["by"] is None):
            if time.monotonic() > stop:
                break  # what is not looked at yet
            tests = tests_of(mutant.module)
            check_sound(tests)
            book.note(mutant, noticed_by(mutant, files_about(mutant, tests) or tests))
        chosen.append(mutant)
    show(chosen, book, excluded)


def show(chosen: Sequence[Mutant], book: Book, excluded: Excluded) -> None:
    """Print survivors and the table by module."""
    tally: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    for mutant in chosen:
        survived = book.found[mutant.key]["by"] is None
        for name in (mutant.module, "all"):
            tally[name][0] += 1
            tally[name][1] += survived
        if survived:
            print(mutant)
    total = tally.pop("all", [0, 0])
    rows = [[name, str(n), str(left)] for name, (n, left) in sorted(tally.items())]
    rows.append(["all", str(total[0]), f"{total[1]} ({total[1] / max(total[0], 1):.0%})"])
    print(table(["module", "mutants", "unnoticed"], rows))
    print(f"{excluded.count} more were excluded: they change no behaviour.")


class Book:
    """What was found out about mutants, on disk."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.found: dict[str, dict[str, Any]] = {}
        if path.exists():
            self.found = json.loads(path.read_text())

    def note(self, mutant: Mutant, by: str | None) -> None:
        """Write down which test noticed a mutant; None if none did."""
        self.found[mutant.key] = {"by": by, "was": mutant.was, "becomes": mutant.becomes}
        self._path.write_text(json.dumps(self.found, indent=1))
        print(f"{'SURVIVED' if by is None else 'noticed'}  {mutant}\n    {by or ''}", flush=True)


class Excluded:
    """Mutants that were looked at and change no behaviour."""

    def __init__(self) -> None:
        listed = yaml.safe_load(KNOWN.read_text()) if KNOWN.exists() else []
        self._why = {(m["module"], m["was"], m["becomes"]): m["why"] for m in listed or []}
        self.count = 0

    def why(self, mutant: Mutant) -> str | None:
        """Why a mutant does not count; None if it does."""
        found = self._why.get((mutant.module, mutant.was, mutant.becomes))
        self.count += found is not None
        return found


def drawn(seed: int, only: Sequence[str]) -> Iterator[Mutant]:
    """Mutants in random order: a place first, then one of the changes that are possible there."""
    paths = [p.relative_to(PACKAGE).as_posix() for p in sorted(PACKAGE.rglob("*.py"))]
    modules = [
        path
        for path in paths
        if any(fnmatch.fnmatch(path, pattern) for pattern in TESTS)
        and not any(fnmatch.fnmatch(path, pattern) for pattern in LEFT_OUT)
    ]
    texts = {module: (PACKAGE / module).read_text() for module in modules}
    places: dict[tuple[str, tuple[int, int]], list[tuple[str, int]]] = defaultdict(list)
    for module, text in texts.items():
        nodes = list(ast_nodes(get_ast(text)))
        for name in OPERATORS:
            operator = get_operator(name)()
            spots = (start for node in nodes for start, _ in operator.mutation_positions(node))
            for occurrence, start in enumerate(spots):
                places[module, start].append((name, occurrence))
    functions = {module: _functions(text) for module, text in texts.items()}
    order = sorted(places)
    dice = random.Random(seed)  # noqa: S311 - no secret
    dice.shuffle(order)
    for module, start in order:
        name, occurrence = dice.choice(sorted(places[module, start]))
        if not any(part in module for part in only):
            continue
        text = texts[module]
        mutated = _mutated(text, name, occurrence)
        if _behaviour(mutated) in (None, _behaviour(text)):
            continue
        before, after = text.splitlines(), mutated.splitlines()
        line = next(n for n, (a, b) in enumerate(zip(before, after, strict=False)) if a != b)
        around = [f for f in functions[module] if f[0] <= start[0] <= f[1]]
        first = max(around, default=(0, 0))[0]
        was, becomes = before[line].strip(), after[line].strip()
        yield Mutant(module, name, occurrence, line + 1, first, was, becomes)


def _functions(text: str) -> list[tuple[int, int]]:
    """First and last lines of all functions, as their code objects have them."""
    return [
        (min([f.lineno, *(d.lineno for d in f.decorator_list)]), f.end_lineno or f.lineno)
        for f in ast.walk(ast.parse(text))
        if isinstance(f, ast.FunctionDef)
    ]


def _mutated(text: str, operator: str, occurrence: int) -> str:
    found = mutate_code(text, get_operator(operator)(), occurrence)
    if found is None:
        raise ValueError(f"{operator} has no occurrence {occurrence}")
    return str(found)


def _behaviour(text: str) -> str | None:
    """The code without annotations, decorators of classes and guards; None if it is none."""
    try:
        tree = ast.parse(text)
    except SyntaxError:  # a star is no product
        return None
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.returns = None
            for argument in ast.walk(node.args):
                if isinstance(argument, ast.arg):
                    argument.annotation = None
        elif isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(None)
        elif isinstance(node, ast.ClassDef):  # nobody tries to change what is frozen
            node.decorator_list = []
        elif isinstance(node, ast.keyword) and node.arg == "strict":  # a guard: no two lengths
            node.value = ast.Constant(None)
    return ast.dump(tree)


def tests_of(module: str) -> tuple[str, ...]:
    """Folders and files of the tests that are about a module."""
    return next(tests for pattern, tests in TESTS.items() if fnmatch.fnmatch(module, pattern))


def files_about(mutant: Mutant, tests: tuple[str, ...]) -> list[str]:
    """Those of some test files with a test that calls the function that is changed; none for a
    module's own code.

    What a cache answers is not called: of such a function, fewer tests are seen to do so.
    """
    calls = json.loads(CALLS.read_text())[0] if mutant.function else {}
    concerned = {
        test.partition("::")[0]
        for test, called in calls.items()
        if mutant.function in called.get(mutant.module, ())
    }
    return sorted(file for file in concerned if file.startswith(tests) and (ROOT / file).exists())


def check_sound(tests: tuple[str, ...]) -> None:
    """Run tests without any change, unless they passed before; end the run if one fails."""
    files = [*ROOT.glob("tests/**/*.py"), *PACKAGE.rglob("*.py")]
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(files))).hexdigest()
    known = json.loads(SOUND.read_text()) if SOUND.exists() else {}
    if known.get("digest") != digest:
        known = {"digest": digest, "passed": []}
    if list(tests) not in known["passed"]:
        if by := noticed_by(None, tests):
            sys.exit(f"{by} fails without any change")
        known["passed"].append(tests)
        SOUND.write_text(json.dumps(known))


def noticed_by(mutant: Mutant | None, tests: Sequence[str]) -> str | None:
    """The test that fails; None if all pass.

    Args:
        mutant: what they run on; None for the code as it is.
        tests: folders and files.
    """
    report = STATE / "report"
    report.write_text("")
    child = os.fork()
    if not child:
        _run(mutant, tests, report)
    end = time.monotonic() + 10 * PATIENCE
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            break
        if time.monotonic() > end:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return "it took too long"
        time.sleep(0.02)
    code = os.waitstatus_to_exitcode(status)
    if code == 0:
        return None
    too_long = "it took too long" if code == -signal.SIGXCPU else ""
    return report.read_text() or too_long or f"exit status {code}"


def _warm_up() -> None:
    """Import what tests import, but for the package: children have it already."""
    os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = str(STATE / "hypothesis")
    for name in ("numpy", "scipy.special", "scipy.stats"):
        importlib.import_module(name)


def _run(mutant: Mutant | None, tests: Sequence[str], report: Path) -> None:
    """Run the tests in this process, and end it."""
    os.setpgid(0, 0)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    if mutant is not None:  # nothing slows down what is tried on it, as finding out who calls does
        resource.setrlimit(resource.RLIMIT_CPU, (PATIENCE, PATIENCE + 9))
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    os.chdir(ROOT)
    if mutant is not None:
        name = "pytest_safemanip." + mutant.module.removesuffix(".py").replace("/", ".")
        path = str(PACKAGE / mutant.module)
        sys.meta_path.insert(0, _Finder(name, path, mutant.source()))
    # Rewritten asserts would have pytest import the module, and not the mutant.
    options = ["-x", "-q", "--assert=plain", "--tb=no", "-p", "no:cacheprovider", "-p", "no:xdist"]
    try:
        code = int(pytest.main([*options, *tests], plugins=[_Plugin(mutant, report)]))
    except BaseException as error:  # an import may fail in any way
        report.write_text(repr(error))
        code = 1
    os._exit(code)


class _Finder(importlib.abc.MetaPathFinder):
    """Finds one module with another text than the one on disk."""

    def __init__(self, name: str, path: str, text: str) -> None:
        self._name, self._path, self._text = name, path, text

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The module's, if it is the one."""
        if name != self._name:
            return None
        loader = _Loader(name, self._path, self._text)
        return importlib.util.spec_from_file_location(name, self._path, loader=loader)


class _Loader(SourceFileLoader):
    def __init__(self, name: str, path: str, text: str) -> None:
        super().__init__(name, path)
        self._text = text

    def get_code(self, fullname: str) -> CodeType:
        code: CodeType = compile(self._text, self.path, "exec", dont_inherit=True)
        return code


class _Plugin:
    """Tests that call what is changed first, quick ones before slow ones; none that simulates.

    Args:
        mutant: what they run on; None to find out who calls what.
        report: where to write which test failed.
    """

    def __init__(self, mutant: Mutant | None, report: Path) -> None:
        self._mutant, self._report = mutant, report
        self._calls: dict[str, dict[str, list[int]]] = {}
        self._seconds: dict[str, float] = {}
        if CALLS.exists():
            self._calls, self._seconds = json.loads(CALLS.read_text())

    def pytest_configure(self) -> None:
        """Have Hypothesis look for the same examples each time, however busy the machine is, and
        neither shrink nor keep any.
        """
        from hypothesis import Phase, settings

        phases = (Phase.explicit, Phase.generate)
        settings.register_profile(
            "mutation", phases=phases, derandomize=True, database=None, deadline=None
        )
        settings.load_profile("mutation")

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Choose and order."""
        items[:] = [
            item
            for item in items
            if "rollouts" not in getattr(item, "fixturenames", ()) and "mona" not in item.nodeid
        ]
        items.sort(key=lambda i: (not self._concerns(i.nodeid), self._seconds.get(i.nodeid, 0.0)))

    def _concerns(self, test: str) -> bool:
        """Whether a test called the function that is changed, when nothing was."""
        if self._mutant is None:
            return False
        called = self._calls.get(test, {}).get(self._mutant.module, ())
        return self._mutant.function in called

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Find out what a test calls."""
        if self._mutant is not None:
            return (yield)
        called: dict[str, set[int]] = defaultdict(set)
        prefix, before = f"{PACKAGE}/", sys.gettrace()

        def note(frame: FrameType, event: str, argument: object) -> None:
            name = frame.f_code.co_filename
            if name.startswith(prefix):
                called[name.removeprefix(prefix)].add(frame.f_code.co_firstlineno)

        sys.settrace(note)
        try:
            return (yield)
        finally:
            sys.settrace(before)
            self._calls[item.nodeid] = {name: sorted(lines) for name, lines in called.items()}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Say which test failed, and how long each takes."""
        if report.failed:
            self._report.write_text(report.nodeid)
        if report.when == "call":
            self._seconds[report.nodeid] = round(report.duration, 3)

    def pytest_sessionfinish(self) -> None:
        """Keep that for the mutants."""
        if self._mutant is None:
            CALLS.write_text(json.dumps((self._calls, self._seconds)))


if __name__ == "__main__":
    main()
