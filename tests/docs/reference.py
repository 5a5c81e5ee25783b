"""The pages of docs/reference/, printed from code."""

from __future__ import annotations

import ast
import contextlib
import functools
import inspect
import io
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from unittest import mock

import numpy as np

import pytest_safemanip
from pytest_safemanip.cli.main import COMMANDS, main
from pytest_safemanip.ltlf import Monitor, compile_formula
from pytest_safemanip.metrics.measures import FIGURES, SHARES
from pytest_safemanip.plugin.options import OPTIONS, Option, add_options
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.search.kinds.catalogue import SHIPPED
from pytest_safemanip.search.units import show
from pytest_safemanip.spec.patterns import PATTERNS, Asked, read_pattern
from pytest_safemanip.spec.scopes import SCOPES
from pytest_safemanip.spec.tasks import HORIZONS
from pytest_safemanip.trace.elements import (
    ActionEntry,
    Body,
    Box,
    Entity,
    Gripper,
    Joint,
    Part,
    Surface,
    Switch,
)
from pytest_safemanip.trace.episode import Episode
from pytest_safemanip.trace.files import _DIGEST, _HEADER, _NAMES, _SURFACES, SCHEMA
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Contacts, Step, Steps
from tests.docs.packs import broken, listed, packs
from tests.physics import severities

PACKAGE = Path(pytest_safemanip.__file__).parent
WRITTEN = "Written from the code by `pytest tests/docs --update-docs`."


def options() -> str:
    """The options of pytest, and what only an ini file has."""
    rows = [(f"`{_flag(option)}`", _explained(option), _default(option)) for option in OPTIONS]
    ini = [(f"`{name}`", text) for name, text in _ini_only()]
    return "\n".join(
        (
            f"# Options\n\n{WRITTEN}\n",
            "Each option has an ini twin with underscores and no leading dashes:",
            "`safemanip_policy = scripted`. The command line wins.\n",
            _table(("option", "meaning", "default"), rows),
            "\n## Of the ini file only\n",
            _table(("name", "meaning"), ini),
            "\n## Of pytest\n",
            "`-k`, `-x`, `--lf`, `--deselect`, `--collect-only`, `-n` (pytest-xdist), `--junitxml`",
            "work as in any run; `-rs` prints why cases were skipped, and `--xfail-tb`",
            "counterexamples where gates decide and violations are `xfailed`.",
            "",
        )
    )


def _flag(option: Option) -> str:
    if option.switch:
        return option.flag
    return f"{option.flag} {option.metavar or '|'.join(option.choices)}".replace("|", "\\|")


def _explained(option: Option) -> str:
    text = option.help.replace("%%", "%").partition(" (default: ")[0]
    return _cell(text)


def _default(option: Option) -> str:
    if option.default:
        return f"`{option.default}`"
    return _cell(option.help.partition(" (default: ")[2].rstrip(")"))


def _ini_only() -> list[tuple[str, str]]:
    """What is declared for the ini file and is no option's twin."""
    found: dict[str, str] = {}
    parser = mock.Mock()
    parser.addini = lambda name, text, **rest: found.setdefault(name, text)
    add_options(parser)
    twins = {option.ini for option in OPTIONS}
    return [(name, _cell(text)) for name, text in found.items() if name not in twins]


def commands() -> str:
    """What ``--help`` says of the command and of each subcommand."""
    sections = [f"# The command safemanip\n\n{WRITTEN}\n\n{_fenced(_help())}"]
    sections += [f"## {name}\n\n{_fenced(_help(name))}" for name in COMMANDS]
    return "\n".join(sections)


def _help(*arguments: str) -> str:
    printed = io.StringIO()
    with mock.patch.dict("os.environ", COLUMNS="88"), contextlib.redirect_stdout(printed):
        main([*arguments, "--help"])
    return printed.getvalue()


def propositions() -> str:
    """The exact condition of each proposition, with its numbers."""
    from pytest_safemanip.cli.propositions import markdown

    catalogue = _defined().catalogue
    return markdown(catalogue.values(), catalogue.parameters({}))


def properties() -> str:
    """The shipped properties with their formulas."""
    defined = _defined()
    sections = [f"# Properties\n\n{WRITTEN}\n"]
    for prop in (p for p in defined.properties.values() if not p.pack):
        tasks = [task.name for task in defined.unstaged.values() if prop.id in task.properties]
        formula, paper = str(prop.formula), str(prop.paper_formula)
        sections += [
            f"## `{prop.id}`\n\n{prop.title} ({prop.source}).\n",
            f"```text\n{formula}\n```\n",
        ]
        if paper != formula:
            sections += [f"In SafeManip, and with `--safemanip-semantics=paper`: `{paper}`.\n"]
        rows = [(f"`{atom}`", f"`{call}`") for atom, call in prop.atoms.items()]
        sections += [_table(("atom", "proposition"), rows)]
        over = f"`{prop.for_each}`" if prop.ranges else "none"
        deadline = f"{prop.deadline_s:g} s" if prop.deadline_s else "none"
        sections += [
            f"\nFor each: {over}. Deadline: {deadline}. Discharged by: {prop.discharged_by}. "
            f"Severity: {prop.severity:g} at least. "
            f"Applies to {len(tasks)} of {len(defined.unstaged)} tasks.\n"
        ]
    return "\n".join(sections)


def patterns() -> str:
    """The patterns and scopes of properties, with formulas and examples."""
    sections = [f"# Patterns\n\n{WRITTEN} {_PATTERNS}\n\n## Scopes\n"]
    asked = read_pattern("absence(p)", {})
    rows = [
        (f"`{_call(name, scope.events.split())}`", scope.says, f"`{_cell(str(inside.formula))}`")
        for name, scope in SCOPES.items()
        for inside in [asked.within(_call(name, scope.events.split()))]
    ]
    sections += [_table(("scope", "stretches of the rollout", "`absence(p)` there"), rows)]
    sections += [
        "\n",
        _examples({_call(n, s.events.split()): s.examples for n, s in SCOPES.items()}),
    ]
    for pattern in PATTERNS.values():
        names = pattern.parameters
        call = _call(pattern.name, (*names, "...") if pattern.any_number else names)
        keys = "".join(f", `{key}: {value:g}`" for key, value in pattern.keys.items())
        whole = read_pattern(_call(pattern.name, names), pattern.keys)
        rows = [
            (f"`{where}`", f"`{_cell(str(whole.within(where).formula))}`")
            for where in ("globally", "before(r)", "after(q)", "between(q, r)", "after_until(q, r)")
        ]
        traces = _outcomes(whole, pattern.examples)
        sections += [
            f"\n## `{call}`\n\n{pattern.says} ({pattern.source}{keys})\n",
            _table(("scope", "formula"), rows),
            "",
            _table(("trace", "outcome"), traces),
        ]
    return "\n".join(sections) + "\n"


def _call(name: str, arguments: Sequence[str]) -> str:
    return f"{name}({', '.join(arguments)})" if arguments else name


def _examples(scopes: Mapping[str, Sequence[str]]) -> str:
    """What `absence(p)` says of traces in each scope."""
    asked = read_pattern("absence(p)", {})
    rows = [
        (f"`{where}`", *row)
        for where, examples in scopes.items()
        for row in _outcomes(asked.within(where), examples)
    ]
    return _table(("scope", "trace", "outcome of `absence(p)`"), rows)


def _outcomes(asked: Asked, examples: Sequence[str]) -> list[tuple[str, str]]:
    """The examples, and what becomes of them at a step a second."""
    dfa = compile_formula(asked.formula, dt=1.0)
    found = []
    for trace in examples:
        values = np.array([[[atom in step for atom in dfa.atoms]] for step in trace.split()])
        (verdict,) = Monitor(dfa, 1, dt=1.0, trigger=asked.trigger).run(values)
        said = verdict.outcome.value + (", not tested" if verdict.vacuous else "")
        found.append((f"`{trace}`", said))
    return found


def tasks() -> str:
    """The shipped tasks with what they bind."""
    rows = [
        (
            f"`{task.name}`",
            task.suite,
            task.horizon,
            ", ".join(task.sets),
            ", ".join(f"`{role}`" for role in (*task.objects, *task.enclosures)),
            ", ".join(f"`{prop}`" for prop in task.properties),
        )
        for task in sorted(
            (t for t in _defined().tasks.values() if not t.base),
            key=lambda t: (HORIZONS.index(t.horizon), t.name),
        )
    ]
    head = ("task", "suite", "horizon", "sets", "objects, enclosures", "properties")
    hint = "`safemanip task NAME` has the roles of one."
    return f"# Tasks\n\n{WRITTEN} {hint}\n\n{_table(head, rows)}\n"


def recording() -> str:
    """The fields of a recording, from the docstrings of its dataclasses."""
    sections = [f"# Recording\n\n{WRITTEN}\n\n{_RECORDING}\n"]
    for kind in RECORDED:
        title, fields = _documented(kind)
        rows = [(f"`{name}`", _cell(text.replace("``", "`"))) for name, text in fields.items()]
        table = _table(("field", "what it is"), rows)
        sections.append(f"## {kind.__name__}\n\n{title}\n\n{table}\n")
    members = ", ".join(f"`{name}.npy`" for name in _NAMES)
    sections.append(
        f"## File\n\nA zip of `{_HEADER}` (schema {SCHEMA}: episode and scene), `{_SURFACES}` "
        f"(half extents and pose of each surface), a `{_DIGEST}` over all of it, and plain NumPy "
        f"arrays: {members}. `pytest_safemanip.trace.files` reads and writes it.\n"
    )
    return "\n".join(sections)


def _documented(kind: type) -> tuple[str, dict[str, str]]:
    """What a dataclass is, and its fields, from its docstring."""
    title, _, rest = str(inspect.getdoc(kind)).partition("\n\nAttributes:\n")
    fields: dict[str, str] = {}
    for line in rest.splitlines():
        if match := re.match(r" {4}(\w+): (.*)", line):
            fields[match[1]] = match[2]
        elif line.startswith(" " * 8) and fields:
            fields[list(fields)[-1]] += " " + line.strip()
    return title.replace("``", "`"), fields


def metrics() -> str:
    """The table of metrics."""
    rows = [(f"`{name}`", metric.says) for name, metric in {**SHARES, **FIGURES}.items()]
    return _table(("metric", "what it is"), rows)


def pairs() -> str:
    """The table of violations of which one is worse."""
    return _table(("violation", "worse", "why", "how"), severities.table())


def kinds() -> str:
    """The table of kinds of dimensions."""
    rows = []
    for kind in SHIPPED:
        limits = f"{show(kind.low, kind.unit)} to {show(kind.high, kind.unit)}" if kind.unit else ""
        more = ", ".join(f"`{name}`" for name in (*kind.keys[1:], *kind.details))
        rows.append((f"`{kind.name}`", kind.doc, limits or "choices", more or "-"))
    return _table(("kind", "what may be otherwise", "usual limits", "further keys"), rows)


def imports() -> str:
    """What each room of the package imports."""
    rows = [
        (f"`{_room(room)}`", ", ".join(own) or "-", ", ".join(others) or "-")
        for room, (own, others) in sorted(room_imports().items())
    ]
    return _table(("room", "imports of the package", "and of others"), rows)


@functools.cache
def room_imports() -> dict[str, tuple[list[str], list[str]]]:
    """Of each room of the package, the rooms that it imports and the packages of others."""
    rooms: dict[str, set[str]] = {}
    for path in PACKAGE.rglob("*.py"):
        room = path.relative_to(PACKAGE).parts[0]
        if not room.startswith("__"):
            rooms.setdefault(room, set()).update(_imported(ast.parse(path.read_text()), PACKAGE))
    return {
        room: (
            sorted(name for name in found - {room} if (PACKAGE / name).exists()),
            sorted(name for name in found - {room} if not (PACKAGE / name).exists()),
        )
        for room, found in rooms.items()
    }


def _room(name: str) -> str:
    return f"{name}/" if (PACKAGE / name).is_dir() else name


def _imported(node: ast.AST, package: Path) -> Iterator[str]:
    """Rooms, and packages of others, that a module imports anywhere but for types."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
            continue
        names = []
        if isinstance(child, ast.Import):
            names = [alias.name for alias in child.names]
        elif isinstance(child, ast.ImportFrom) and child.module == package.name:
            names = [f"{child.module}.{alias.name}" for alias in child.names]
        elif isinstance(child, ast.ImportFrom):
            names = [str(child.module)]
        for name in names:
            first, _, rest = name.partition(".")
            room = rest.partition(".")[0]
            if first == package.name and (package / f"{room}.py").exists():
                yield f"{room}.py"
            elif first == package.name and (package / room).is_dir() and room:
                yield room
            elif first != package.name and first not in sys.stdlib_module_names:
                yield first
        yield from _imported(child, package)


def _defined() -> Definitions:
    return load_definitions([], [], [])


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _fenced(text: str) -> str:
    return f"```text\n{text.rstrip()}\n```\n"


_PATTERNS = """\
A pattern is a rule by name: `pattern`, and if need be `scope` and the pattern's keys, in place of
`formula` in a [property](../properties.md#patterns). Arguments are formulas without temporal
operators over the atoms. In the examples a step is a second, the letters of what holds at it, or
`-`. "Unresolved" is what waits without a bound, and "not tested" what had no occasion."""
_RECORDING = """\
World frame, SI units, quaternions `wxyz`, time in front of every array; poses are position and
quaternion (7,), twists are linear and angular velocity (6,). Letters in shapes: T steps, G
grippers, N objects, J joints, B boxes, S switches, R contact points."""
RECORDED = (
    Episode,
    Scene,
    Entity,
    Gripper,
    ActionEntry,
    Body,
    Part,
    Joint,
    Box,
    Switch,
    Surface,
    Step,
    Steps,
    Contacts,
)
"""What a recording consists of."""

PAGES: Mapping[str, Callable[[], str]] = {
    "docs/reference/options.md": options,
    "docs/reference/cli.md": commands,
    "docs/reference/propositions.md": propositions,
    "docs/reference/properties.md": properties,
    "docs/reference/patterns.md": patterns,
    "docs/reference/tasks.md": tasks,
    "docs/reference/recording.md": recording,
    **packs(),
}
"""What prints each page, by its path."""

REGIONS: Mapping[tuple[str, str], Callable[[], str]] = {
    ("docs/severity.md", "pairs"): pairs,
    ("docs/metrics.md", "metrics"): metrics,
    ("docs/search.md", "kinds"): kinds,
    ("docs/architecture.md", "imports"): imports,
    ("docs/packs.md", "packs"): listed,
    ("docs/coverage.md", "packs"): broken,
}
"""What prints a part of a page, by the page's path and the comment before the part."""
