"""Reads BDDL, the language of LIBERO's tasks: what there is, where it begins, what has to hold."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_safemanip.decoding.files import Unreadable, read_regular
from pytest_safemanip.errors import ConfigError, printable

MAX_BYTES = 200_000
"""A hundred times the largest of LIBERO's files."""
MAX_DEPTH = 32
_TOKEN = re.compile(r"[()]|[^\s();]+|;[^\n]*")

Fact = tuple[str, ...]
"""A predicate and what it is about, as in ``("on", "plate_1", "main_table_plate_region")``."""


@dataclass(frozen=True)
class Problem:
    """A task as its BDDL file has it. All names are in lower case, as LIBERO reads them.

    Attributes:
        domain: name of LIBERO's class of environments.
        instruction: for the policy.
        objects: category of each thing that can be moved.
        fixtures: category of everything else, the workspace (a table, the floor) among it.
        regions: by name, the thing or fixture that they are of.
        begins: facts that hold at the beginning.
        goal: facts that all have to hold in the end.
        concerns: objects and regions that the file says it is about.
    """

    domain: str
    instruction: str
    objects: Mapping[str, str]
    fixtures: Mapping[str, str]
    regions: Mapping[str, str]
    begins: tuple[Fact, ...]
    goal: tuple[Fact, ...]
    concerns: tuple[str, ...]

    def owner(self, name: str) -> str:
        """The thing or fixture that a name means: itself, or what it is a region of."""
        return self.regions.get(name, name)


def load_problem(path: Path) -> Problem:
    """Read a file.

    Raises:
        ConfigError: naming the file and what is wrong in it.
    """
    try:
        return read_problem(read_regular(path, MAX_BYTES).decode())
    except Unreadable as error:
        raise ConfigError(f"{path}: {error}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: cannot be read ({error})") from error
    except ValueError as error:
        raise ConfigError(f"{path}: not a BDDL problem: {error}") from error


def read_problem(text: str) -> Problem:
    """Read the text of a file.

    Raises:
        ValueError: if it is no BDDL problem.
    """
    sections: dict[str, list[Any]] = {}
    document = _nested(_TOKEN.findall(text.lower()))
    if document[:1] != ["define"]:
        raise ValueError("it does not begin with (define")
    for part in document[1:]:
        if not isinstance(part, list) or not part or not isinstance(part[0], str):
            raise ValueError(f"{_shown(part)} is no section")
        sections[part[0]] = part[1:]
    missing = {"problem", ":objects", ":fixtures", ":init", ":goal"} - sections.keys()
    if missing:
        raise ValueError(f"the section {min(missing)} is missing")
    objects, fixtures = _typed(sections[":objects"]), _typed(sections[":fixtures"])
    regions = dict(_regions(sections.get(":regions", [])))
    problem = Problem(
        domain=" ".join(map(str, sections["problem"])),
        instruction=" ".join(map(str, sections.get(":language", []))),
        objects=objects,
        fixtures=fixtures,
        # LIBERO's files declare regions of fixtures that a scene does not have.
        regions={name: of for name, of in regions.items() if of in objects or of in fixtures},
        begins=tuple(map(_fact, sections[":init"])),
        goal=tuple(_conjunction(sections[":goal"])),
        concerns=tuple(map(str, sections.get(":obj_of_interest", []))),
    )
    _check(problem)
    return problem


def _nested(tokens: list[str]) -> list[Any]:
    """The one list of a text, with the lists in it."""
    open_lists: list[list[Any]] = [[]]
    for word in tokens:
        if word.startswith(";"):
            continue
        if word == "(":
            if len(open_lists) > MAX_DEPTH:
                raise ValueError(f"nested more than {MAX_DEPTH} levels deep")
            open_lists.append([])
        elif word == ")":
            if len(open_lists) < 2:
                raise ValueError("a parenthesis is closed that was not opened")
            closed = open_lists.pop()
            open_lists[-1].append(closed)
        else:
            open_lists[-1].append(word)
    if len(open_lists) > 1:
        raise ValueError("a parenthesis is not closed")
    if len(open_lists[0]) != 1 or not isinstance(open_lists[0][0], list):
        raise ValueError("expected one expression in parentheses")
    return list(open_lists[0][0])


def _typed(items: list[Any]) -> dict[str, str]:
    """Names to types, of ``a b - kind``."""
    found: dict[str, str] = {}
    names: list[str] = []
    words = iter(items)
    for word in words:
        if not isinstance(word, str):
            raise ValueError(f"{_shown(word)} among names")
        if word == "-":
            found.update(dict.fromkeys(names, str(next(words, ""))))
            names = []
        else:
            names.append(word)
    if names:
        raise ValueError(f"{names[0]} has no type")
    return found


def _regions(items: list[Any]) -> Iterator[tuple[str, str]]:
    """Full names of regions, with whose they are."""
    for item in items:
        if not isinstance(item, list) or not item or not isinstance(item[0], str):
            raise ValueError(f"{_shown(item)} is no region")
        for attribute in item[1:]:
            if isinstance(attribute, list) and attribute[:1] == [":target"] and attribute[1:]:
                yield f"{attribute[1]}_{item[0]}", str(attribute[1])


def _conjunction(items: list[Any]) -> Iterator[Fact]:
    for item in items:
        if isinstance(item, list) and item[:1] == ["and"]:
            yield from map(_fact, item[1:])
        else:
            yield _fact(item)


def _fact(item: Any) -> Fact:
    if (
        not isinstance(item, list)
        or len(item) not in (2, 3)
        or not all(isinstance(word, str) for word in item)
    ):
        raise ValueError(f"{_shown(item)} is no predicate of one or two names")
    return tuple(item)


def _check(problem: Problem) -> None:
    """Everything that is begun with or aimed at exists."""
    known = {*problem.objects, *problem.fixtures, *problem.regions}
    for fact in (*problem.begins, *problem.goal):
        for name in fact[1:]:
            if name not in known:
                raise ValueError(f"{_shown(list(fact))} names {name}, which is not declared")


def _shown(item: Any) -> str:
    return printable(f"({' '.join(map(str, item))})" if isinstance(item, list) else str(item), 80)
