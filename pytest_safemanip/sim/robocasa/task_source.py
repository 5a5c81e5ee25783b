"""RoboCasa's tasks, read from its source without importing it: importing takes seconds.

A task is a class that descends from ``Kitchen``; which fixtures play its roles stands in calls of
``register_fixture_ref`` and ``get_fixture``, which objects do in what ``_get_obj_cfgs`` returns.
Nothing is executed.
"""

from __future__ import annotations

import ast
import functools
import importlib.util
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

ROOT = "Kitchen"
UNREGISTERED = ("PickPlace", "ManipulateDoor", "OpenDoor", "CloseDoor")
"""Base classes that RoboCasa does not register as tasks (``KitchenEnvMeta``)."""

_ADDED = {"try_to_place_in": "_container", "auxiliary_obj_enable": "_auxiliary"}
"""What RoboCasa appends to an object's name to call what it stands in and its lid, by the key that
asks for these."""
_OBJECTS = "_get_obj_cfgs"

_ATTRIBUTE = re.compile(r"\bself\.(\w+) = ")
_CLASS = re.compile(r"^class (\w+)\(([\w.,= ]*)\):", re.MULTILINE)

Kinds = frozenset[str] | None
"""Names of RoboCasa's ``FixtureType``; None where only running the code would tell."""


def environments() -> Path | None:
    """The folder of the installed RoboCasa's tasks, or None if it is not installed."""
    spec = importlib.util.find_spec("robocasa")
    if spec is None or not spec.submodule_search_locations:
        return None
    return Path(next(iter(spec.submodule_search_locations))) / "environments"


@functools.cache
def task_names(folder: Path) -> frozenset[str]:
    """The names of all tasks that RoboCasa registers."""
    found = {name for name in _classes(folder) if ROOT in _ancestry(folder, name)}
    return frozenset(found - set(UNREGISTERED))


def fixture_roles(folder: Path, task: str) -> dict[str, Kinds]:
    """The roles that fixtures play in a task, with the kinds of fixture that can play each."""
    facts = _facts_of(folder, task)
    return {
        role: facts.kinds(calls, frozenset()) or None
        for role, calls in sorted(facts.references.items())
    }


def object_roles(folder: Path, task: str) -> tuple[str, ...] | None:
    """The roles that objects play in a task, for ``fnmatch``; None where only running the code
    would tell. Where an object stands in another, or has a lid, that has a role of its own.
    """
    found: set[str] = set()
    for made, expressions in _facts_of(folder, task).objects.items():
        patterns = {_pattern(name) for name in expressions}
        if None in patterns:
            return None
        found |= {f"{pattern}{made}" for pattern in patterns}
    return tuple(sorted(found))


def attributes(folder: Path, task: str) -> frozenset[str]:
    """Names of what a task may keep a fixture in, its own and the fixtures' attributes: those that
    :func:`fixture_roles` does not find are among them.
    """
    kept = _facts_of(folder, task).attributes
    return frozenset(kept) | _fixture_attributes(folder.parent / "models" / "fixtures")


@functools.cache
def _fixture_attributes(folder: Path) -> frozenset[str]:
    texts = (path.read_text(encoding="utf-8") for path in folder.glob("*.py"))
    return frozenset(name for text in texts for name in _ATTRIBUTE.findall(text))


def categories() -> Path | None:
    """The installed RoboCasa's table of categories, or None if it is not installed."""
    folder = environments()
    return folder.parent / "models" / "objects" / "kitchen_objects.py" if folder else None


@functools.cache
def object_kinds(table: Path) -> frozenset[str]:
    """Names of the categories and groups that objects can be drawn from.

    Args:
        table: RoboCasa's, as :func:`categories` finds it.
    """
    found: set[str] = set()
    for node in ast.walk(ast.parse(table.read_text(encoding="utf-8"))):
        match node:
            case ast.Assign([ast.Name("OBJ_CATEGORIES" | "OBJ_GROUPS")], ast.Call() as call):
                found |= {word.arg for word in call.keywords if word.arg is not None}
            case ast.Assign([ast.Subscript(ast.Name("OBJ_GROUPS"), ast.Constant(str(group)))]):
                found.add(group)
            case ast.keyword("types", value):
                found |= {
                    one.value
                    for one in ast.walk(value)
                    if isinstance(one, ast.Constant) and isinstance(one.value, str)
                }
    return frozenset(found)


def _facts_of(folder: Path, task: str) -> _Facts:
    """What a task's class and those that it descends from say."""
    facts = _Facts()
    for name in _ancestry(folder, task):
        for path, _ in _classes(folder).get(name, ()):
            facts.merge(_facts_in(path)[name])
    return facts


@functools.cache
def _classes(folder: Path) -> Mapping[str, list[tuple[Path, tuple[str, ...]]]]:
    """File and bases of each class; one name may be defined in several files."""
    found = defaultdict(list)
    for path in sorted(folder.rglob("*.py")):
        for name, bases in _CLASS.findall(path.read_text(encoding="utf-8")):
            found[name].append((path, tuple(base.strip() for base in bases.split(","))))
    return dict(found)


def _ancestry(folder: Path, name: str) -> list[str]:
    """A class and those that it descends from, as far as they are in the folder."""
    chain, todo = [], [name]
    while todo:
        one = todo.pop()
        if one not in chain and one in _classes(folder):
            chain.append(one)
            todo += [base for _, bases in _classes(folder)[one] for base in bases]
    return chain


@dataclass
class _Facts:
    """Statements about fixtures in the classes of one task.

    Attributes:
        references: the calls that find each role's fixture.
        attributes: what is assigned to each attribute of ``self``.
        arguments: defaults of constructors' parameters, and what subclasses give for them.
        objects: the names of the objects that are made, by what is appended to them.
    """

    references: dict[str, list[ast.expr]] = field(default_factory=lambda: defaultdict(list))
    attributes: dict[str, list[ast.expr]] = field(default_factory=lambda: defaultdict(list))
    arguments: dict[str, list[ast.expr]] = field(default_factory=lambda: defaultdict(list))
    objects: dict[str, list[ast.expr]] = field(default_factory=lambda: defaultdict(list))

    def add(self, cls: ast.ClassDef) -> None:
        """Take in what a class says."""
        for node in ast.walk(cls):
            match node:
                case ast.Assign(targets=[ast.Attribute(ast.Name("self"), name)], value=value):
                    self.attributes[name].append(value)
                    if _fixture_id(value) is not None:
                        self.references[name].append(value)
                case ast.Call(
                    ast.Attribute(_, "register_fixture_ref"), [ast.Constant(str(role)), *_]
                ):
                    self.references[role].append(node)
                case ast.Call(ast.Attribute(_, "__init__")):
                    for word in node.keywords:
                        if word.arg is not None:
                            self.arguments[word.arg].append(word.value)
                case ast.FunctionDef("__init__"):
                    given = node.args
                    for one, value in zip(given.args[::-1], given.defaults[::-1], strict=False):
                        self.arguments[one.arg].append(value)
                case ast.FunctionDef(name) if name == _OBJECTS:
                    for made, expression in _made(node):
                        self.objects[made].append(expression)
                case ast.Subscript(ast.Attribute(_, "fixture_refs"), ast.Constant(str(role))):
                    self.attributes[role].append(node)

    def merge(self, other: _Facts) -> None:
        """Take in what another class says."""
        for mine, its in zip(vars(self).values(), vars(other).values(), strict=True):
            for name, values in its.items():
                mine[name] += values

    def kinds(self, values: Iterable[ast.expr], seen: frozenset[str]) -> Kinds:
        """The kinds of fixture that one of these expressions can stand for.

        Args:
            values: the expressions.
            seen: attributes and parameters that are being looked up: ``self.drawer`` may be found
                by what it was before.
        """
        found: set[str] = set()
        for value in values:
            kinds = self._kinds(value, seen)
            if kinds is None:
                return None
            found |= kinds
        return frozenset(found)

    def _kinds(self, value: ast.expr, seen: frozenset[str]) -> Kinds:
        match value:
            case ast.Attribute(ast.Name("FixtureType"), kind):
                return frozenset({kind})
            case ast.Attribute(ast.Name("self"), name):
                key, known = f"self.{name}", self.attributes.get(name, ())
            case ast.Name(name):
                key, known = name, self.arguments.get(name, ())
            case _:
                inner = _fixture_id(value)
                return None if inner is None else self._kinds(inner, seen)
        if key in seen:
            return frozenset()
        return self.kinds(known, seen | {key}) if known else None


@functools.cache
def _facts_in(path: Path) -> Mapping[str, _Facts]:
    """What each class of a file says."""
    found: dict[str, _Facts] = defaultdict(_Facts)
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef):
            found[node.name].add(node)
    return found


def _made(function: ast.FunctionDef) -> Iterator[tuple[str, ast.expr]]:
    """Names of the objects that a function describes, and what is appended to them; an ellipsis for
    what it calls to do so.
    """
    for node in ast.walk(function):
        match node:
            case ast.Call(ast.Name("dict"), [], words):
                keys = {word.arg: word.value for word in words}
            case ast.Dict(names, values):
                texts = [n.value if isinstance(n, ast.Constant) else None for n in names]
                keys = dict(zip(map(str, texts), values, strict=True))
            case ast.Call(ast.Attribute(ast.Call(ast.Name("super")), name)) if name == _OBJECTS:
                continue
            case ast.Call(ast.Attribute(_, name) | ast.Name(name)) if "cfg" in name:
                yield "", ast.Constant(...)
                continue
            case _:
                continue
        if "obj_groups" in keys or "placement" in keys:
            expression = keys.get("name", _NAMELESS)
            said = re.findall(r"\w+", ast.unparse(node))
            yield "", expression
            yield from ((made, expression) for key, made in _ADDED.items() if key in said)


_NAMELESS = ast.JoinedStr([ast.Constant("obj_"), ast.FormattedValue(ast.Constant(0), -1)])
"""How RoboCasa calls an object without a name."""


def _pattern(name: ast.expr) -> str | None:
    """What a name can be, for ``fnmatch``; None for anything."""
    match name:
        case ast.Constant(str(text)):
            return text
        case ast.JoinedStr(parts):
            texts = [str(p.value) if isinstance(p, ast.Constant) else "*" for p in parts]
            return "".join(texts)
    return None


def _fixture_id(value: ast.expr) -> ast.expr | None:
    """The id by which an expression looks up a fixture, if it does."""
    match value:
        case ast.Call(ast.Attribute(_, "get_fixture"), [found, *_]):
            return found
        case ast.Call(ast.Attribute(_, "get_fixture"), [], words):
            pass
        case ast.Call(ast.Attribute(_, "register_fixture_ref"), [_, ast.Call(keywords=words)]):
            pass
        case _:
            return None
    return next((word.value for word in words if word.arg == "id"), None)
