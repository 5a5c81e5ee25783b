"""What a property ranges over: the key ``for_each``.

A clause names variables, a relation of the task or of its scene, and which of its members count:

    o in objects with fragile
    f in fixtures of Microwave or Oven without electrical

Several clauses are a mapping, and the property is judged for every combination of different
entities:

    for_each:
      o: things with liquid
      f: fixtures with electrical
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.spec.objects import ATTRIBUTES
from pytest_safemanip.spec.task import Task
from pytest_safemanip.spec.yamlfile import Section

RELATIONS: Mapping[str, int] = MappingProxyType(
    {
        "objects": 1,
        "enclosures": 1,
        "exclusive_enclosures": 1,
        "mechanisms": 1,
        "tools": 1,
        "skills": 2,
        "placements": 2,
        "transfers": 2,
        "things": 1,
        "obstacles": 1,
        "fixtures": 1,
        "zones": 1,
        "filled": 1,
    }
)
"""What variables can range over, with their number: relations of a task's binding, and of the scene
that it is bound to."""
ZONES = "zones"
"""The relation whose members have names, and neither a category nor attributes."""
OF_SCENE = ("things", "obstacles", "fixtures")
"""Relations whose members only the scene of an episode knows."""
OBJECT, FIXTURE = "object", "fixture"
"""What a category is one of."""
_HAVE = {"things": OBJECT, "obstacles": OBJECT, "fixtures": FIXTURE}
"""What the members of some relations are, whatever the scene."""

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_CLAUSE = re.compile(r"\s*(.+?)\s+in\s+(.+?)\s*")
_WORDS = ("of", "with", "without")


@dataclass(frozen=True)
class Range:
    """Variables, and what they range over.

    Attributes:
        variables: their names.
        relation: whose members they are.
        kinds: categories of which a member has to be one, of zones their names; empty for any.
        having: attributes that it has to have, all of them.
        lacking: attributes of which it may have none.
    """

    variables: tuple[str, ...]
    relation: str
    kinds: tuple[str, ...] = ()
    having: tuple[str, ...] = ()
    lacking: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{', '.join(self.variables)} in {self.members}"

    @property
    def members(self) -> str:
        """What they range over, in the words of a clause."""
        words = {
            "of": " or ".join(self.kinds),
            "with": " and ".join(self.having),
            "without": " and ".join(self.lacking),
        }
        said = [f"{word} {names}" for word, names in words.items() if names]
        return " ".join((self.relation, *said))

    @property
    def is_open(self) -> bool:
        """Whether only the scene of an episode tells how many members there are, if any."""
        return self.relation in OF_SCENE or bool(self.kinds or self.having or self.lacking)

    def rows(self, binding: Binding) -> tuple[tuple[str, ...], ...]:
        """What the variables are bound to, one row for each member.

        Raises:
            TraceError: if it asks for attributes, and a fixture is of a kind that has no row.
        """
        rows = binding.relation(self.relation)
        if not self.is_open:
            return rows
        return tuple(row for row in rows if self._admits(row[0], binding))

    def _admits(self, entity: str, binding: Binding) -> bool:
        kind = entity if self.relation == ZONES else binding.kinds.get(entity)
        if self.kinds and kind not in self.kinds:
            return False
        if not self.having and not self.lacking:
            return True
        own = binding.attributes_of(entity)
        return own.issuperset(self.having) and own.isdisjoint(self.lacking)


def rows_of(ranges: Sequence[Range], binding: Binding) -> tuple[tuple[str, ...], ...]:
    """The instances of a property: what its variables are bound to; one empty row without any.

    Where there are several ranges, no entity stands for two variables of different ones.
    """
    if len(ranges) == 1:
        return ranges[0].rows(binding)
    combined = itertools.product(*(one.rows(binding) for one in ranges))
    return tuple(tuple(itertools.chain(*rows)) for rows in combined if _differ(rows))


def _differ(rows: Iterable[tuple[str, ...]]) -> bool:
    sets = [set(row) for row in rows]
    return sum(map(len, sets)) == len(set[str]().union(*sets))


def may_apply(ranges: Sequence[Range], task: Task) -> bool:
    """Whether a task may have an instance of a property, as far as that is known without a
    scene.
    """
    return all(one.relation in OF_SCENE or task.instances(one.relation) for one in ranges)


def read_for_each(
    section: Section, categories: Mapping[str, str] | None = None
) -> tuple[Range, ...]:
    """The ranges of the key ``for_each``; none if there is no such key.

    Args:
        section: the property's file.
        categories: every category that there is, with which it is of, `object` or `fixture`; None
            leaves them unchecked.

    Raises:
        ConfigError: a clause is malformed, a relation, an attribute or a category is unknown, or a
            relation has another number of variables.
    """
    if "for_each" not in section:
        return ()
    found = [_Clause(*clause, categories).range() for clause in _clauses(section)]
    names = [name for one in found for name in one.variables]
    for name in names:
        if not _NAME.fullmatch(name) or names.count(name) > 1:
            raise section.error("for_each", f"{name!r} cannot be a variable here")
    return tuple(found)


def _clauses(section: Section) -> Iterator[tuple[Section, str, str, str]]:
    """Where each clause is: section and key; its variables, and the rest of it."""
    if section.is_mapping("for_each"):
        inner = section.section("for_each")
        if not list(inner):
            raise section.error("for_each", "expected at least one variable")
        for key in inner:
            yield inner, key, key, inner.string(key)
        return
    text = section.string("for_each")
    match = _CLAUSE.fullmatch(text)
    if not match:
        raise section.error("for_each", f"expected 'VARIABLE, ... in RELATION', found {text!r}")
    yield section, "for_each", match[1], match[2]


@dataclass(frozen=True)
class _Clause:
    """A clause in its file.

    Attributes:
        section: of the file.
        key: where it is in it.
        names: its variables.
        text: what they range over.
        categories: those that there are; None if that is not known.
    """

    section: Section
    key: str
    names: str
    text: str
    categories: Mapping[str, str] | None

    def range(self) -> Range:
        relation, *words = self.text.split()
        if relation not in RELATIONS:
            hint = did_you_mean(relation, RELATIONS)
            raise self._error(f"unknown relation {relation!r}; {hint}")
        variables = tuple(part.strip() for part in self.names.split(","))
        wanted = RELATIONS[relation]
        if len(variables) != wanted:
            count = f"{wanted} variable" + ("" if wanted == 1 else "s")
            raise self._error(f"{relation!r} needs {count}, found {len(variables)}")
        said = self._said(words)
        if said and wanted != 1:
            raise self._error(f"{relation!r} has pairs: {next(iter(said))!r} has no meaning there")
        if relation == ZONES and set(said) - {"of"}:
            raise self._error("zones have names, as in 'zones of NAME', and no attributes")
        categories = None if relation == ZONES else self.categories
        found = Range(
            variables,
            relation,
            kinds=self._listed(said, "of", "or", categories, "category"),
            having=self._listed(said, "with", "and", ATTRIBUTES, "attribute"),
            lacking=self._listed(said, "without", "and", ATTRIBUTES, "attribute"),
        )
        self._check_kinds(found)
        for name in found.having:
            if name in found.lacking:
                raise self._error(f"nothing is with {name!r} and without it")
        return found

    def _check_kinds(self, found: Range) -> None:
        """No category is of what the members of the relation never are."""
        has, known = _HAVE.get(found.relation), self.categories
        if has is None or known is None:
            return
        for name in found.kinds:
            if known[name] != has:
                other = next(key for key, what in _HAVE.items() if what == known[name])
                raise self._error(
                    f"{name!r} is a category of {known[name]}s, and {found.relation!r} ranges over "
                    f"{has}s; expected '{other} of {name}'"
                )

    def _said(self, words: Sequence[str]) -> dict[str, list[str]]:
        """What follows each of the words of a clause."""
        said: dict[str, list[str]] = {}
        for word in words:
            if word in _WORDS and word not in said:
                said[word] = []
            elif not said or word in _WORDS:
                raise self._error(
                    f"{word!r} is not understood; expected RELATION, and after it at most one each "
                    "of 'of CATEGORY or ...', 'with ATTRIBUTE and ...', 'without ATTRIBUTE and ...'"
                )
            else:
                said[next(reversed(said))].append(word)
        return said

    def _listed(
        self,
        said: Mapping[str, Sequence[str]],
        word: str,
        between: str,
        known: Collection[str] | None,
        what: str,
    ) -> tuple[str, ...]:
        if word not in said:
            return ()
        names, joints = said[word][::2], said[word][1::2]
        if len(names) != len(joints) + 1 or any(joint != between for joint in joints):
            example = f"'{word} NAME {between} NAME'"
            raise self._error(f"expected {example}, found {' '.join((word, *said[word]))!r}")
        for name in names:
            if known is not None and name not in known:
                raise self._error(f"unknown {what} {name!r}; {did_you_mean(name, known)}")
        return tuple(names)

    def _error(self, message: str) -> ConfigError:
        return self.section.error(self.key, message)
