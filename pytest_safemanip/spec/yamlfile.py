"""Reads a YAML file without executing anything, and keeps the line of every value.

Values are asked for by key and type; what is not as asked becomes an error that names the file,
the line, the key, what was expected and what was found. Only plain YAML is read: no tags, no
anchors, one document per file, and no key twice.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from pytest_safemanip.decoding.files import Unreadable, read_regular
from pytest_safemanip.errors import ConfigError, did_you_mean

MAX_BYTES = 1_000_000
MAX_DEPTH = 16

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml, ten times as fast
_TEXT = "tag:yaml.org,2002:str"
_WORDS = ("on", "off", "yes", "no")
"""Keys that are text although YAML 1.1 takes them for booleans."""
_SPACES = "\n\t\u00a0\u202f"
"""Line breaks and spaces that are not printable but harmless."""
_AS_TEXT = "text (in quotes, if YAML reads it otherwise)"


@dataclass(frozen=True, slots=True)
class _Node:
    """A value: text, a list, or a mapping whose keys are nodes of text."""

    line: int
    value: str | list[_Node] | dict[str, tuple[int, _Node]]
    is_text: bool = False  # quoted, or nothing that YAML takes for a number, a date or the like

    def __str__(self) -> str:
        if isinstance(self.value, str):
            return repr(self.value) if self.value or self.is_text else "nothing"
        return "a list" if isinstance(self.value, list) else "a mapping"


Texts = str | list["Texts"] | dict[str, "Texts"]
"""A text, or texts in lists and mappings."""


class Section:
    """A mapping of a YAML file.

    Attributes:
        path: the file.
        line: where the mapping starts, counted from 1.
        name: keys that lead here, joined by dots; empty for the file as a whole.
    """

    def __init__(self, path: Path, node: _Node, name: str = "") -> None:
        self.path = path
        self.line = node.line
        self.name = name
        self._items = node.value if isinstance(node.value, dict) else {}

    def __contains__(self, key: str) -> bool:
        return key in self._items

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def over(self, base: Section) -> Section:
        """The mapping of another file, with the keys that are here as they are here."""
        _, node = next(iter(self._items.values()))
        return Section(self.path, _Node(node.line, {**base._items, **self._items}))

    def check_keys(self, required: Collection[str], optional: Collection[str] = ()) -> None:
        """Refuse keys that are unknown or missing.

        Raises:
            ConfigError: there is such a key.
        """
        for key, (line, _) in self._items.items():
            if key not in required and key not in optional:
                hint = did_you_mean(key, {*required, *optional})
                raise ConfigError(f"{self.path}:{line}: unknown {self._key(key)}; {hint}")
        for key in required:
            if key not in self._items:
                raise ConfigError(f"{self.path}:{self.line}: {self._key(key)} is missing")

    def string(self, key: str) -> str:
        """Text that is not empty.

        Raises:
            ConfigError: the value is missing or something else; likewise in the methods below.
        """
        return self._text(key, self._node(key))

    def one_line(self, key: str) -> str:
        """Text in one line: each break of a line is a space."""
        return " ".join(self.string(key).split())

    def strings(self, key: str) -> tuple[str, ...]:
        """A list of different texts, which may be empty."""
        node = self._node(key)
        if not isinstance(node.value, list):
            raise self._expected(key, "a list", node)
        found: list[str] = []
        for item in node.value:
            text = self._text(key, item)
            if text in found:
                raise ConfigError(
                    f"{self.path}:{item.line}: {self._key(key)}: {text!r} is given twice"
                )
            found.append(text)
        return tuple(found)

    def number(
        self,
        key: str,
        *,
        positive: bool = False,
        least: float = -math.inf,
        most: float = math.inf,
    ) -> float:
        """A finite number, from ``least`` to ``most``; above 0 if it has to be ``positive``."""
        node = self._node(key)
        wanted = "a positive number" if positive else "a number"
        if -math.inf < least and most < math.inf:
            wanted += f" from {least:g} to {most:g}"
        elif -math.inf < least:
            wanted += f", at least {least:g}"
        elif most < math.inf:
            wanted += f", at most {most:g}"
        try:
            # Python's numbers have more forms than people mean: other digits, and '_' between them.
            plain = isinstance(node.value, str) and node.value.isascii() and "_" not in node.value
            number = float(str(node.value)) if plain else math.nan
        except ValueError:
            number = math.nan
        fits = math.isfinite(number) and least <= number <= most
        if not fits or (positive and number <= 0):
            raise self._expected(key, wanted, node)
        return number

    def boolean(self, key: str) -> bool:
        """`true` or `false`."""
        node = self._node(key)
        if node.value not in ("true", "false") or node.is_text:
            raise self._expected(key, "true or false", node)
        return node.value == "true"

    def section(self, key: str) -> Section:
        """A mapping inside this one."""
        node = self._node(key)
        if not isinstance(node.value, dict):
            raise self._expected(key, "a mapping", node)
        return Section(self.path, node, self._dotted(key))

    def sections(self, key: str) -> tuple[Section, ...]:
        """A list of mappings, which may be empty."""
        node = self._node(key)
        if not isinstance(node.value, list):
            raise self._expected(key, "a list", node)
        for item in node.value:
            if not isinstance(item.value, dict):
                raise self._expected(key, "mappings", item)
        return tuple(Section(self.path, item, self._dotted(key)) for item in node.value)

    def texts(self, key: str) -> Texts:
        """Texts in lists and mappings that have no form of their own; none of them is empty."""
        return self._texts(key, self._node(key))

    def whole(self, key: str) -> int:
        """A whole number of at least 0."""
        value = self.number(key)
        if value < 0 or value != int(value):
            raise self._expected(key, "a whole number of at least 0", self._node(key))
        return int(value)

    def is_mapping(self, key: str) -> bool:
        """Whether a value is a mapping."""
        return isinstance(self._node(key).value, dict)

    def place(self, key: str) -> str:
        """`path:line` of a value, to begin a message with."""
        return f"{self.path}:{self.line_of(key)}"

    def line_of(self, key: str) -> int:
        """Line of a value, counted from 1."""
        return self._node(key).line

    def error(self, key: str, message: str) -> ConfigError:
        """An error about the value of a key, to be raised by the caller."""
        return ConfigError(f"{self.place(key)}: {self._key(key)}: {message}")

    def _node(self, key: str) -> _Node:
        if key not in self._items:
            raise ConfigError(f"{self.path}:{self.line}: {self._key(key)} is missing")
        return self._items[key][1]

    def _text(self, key: str, node: _Node) -> str:
        if not isinstance(node.value, str) or not node.value.strip():
            raise self._expected(key, "text", node)
        if not node.is_text:
            raise self._expected(key, _AS_TEXT, node)
        return node.value

    def _texts(self, key: str, node: _Node) -> Texts:
        if isinstance(node.value, str):
            return self._text(key, node)
        if not node.value:
            raise self._expected(key, "something in it", node)
        if isinstance(node.value, list):
            return [self._texts(key, item) for item in node.value]
        return {name: self._texts(key, item) for name, (_, item) in node.value.items()}

    def _expected(self, key: str, wanted: str, node: _Node) -> ConfigError:
        place = f"{self.path}:{node.line}"
        return ConfigError(f"{place}: {self._key(key)}: expected {wanted}, found {node}")

    def _key(self, key: str) -> str:
        return f"key {self._dotted(key)!r}"

    def _dotted(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key


def load(path: Path) -> Section:
    """Read a YAML file whose top level is a mapping.

    Raises:
        ConfigError: the file cannot be read, is larger than `MAX_BYTES`, or is not plain YAML.
    """
    try:
        return parse(read_regular(path, MAX_BYTES), path)
    except Unreadable as error:
        raise ConfigError(f"{path}: {error}") from error


def parse(data: bytes, path: Path) -> Section:
    """Read the content of a YAML file whose top level is a mapping.

    Raises:
        ConfigError: it is larger than `MAX_BYTES`, or is not plain YAML.
    """
    if len(data) > MAX_BYTES:
        raise ConfigError(f"{path}: larger than {MAX_BYTES} bytes")
    try:
        node = _document(path, data.decode("utf-8"), _Loader)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ConfigError(f"{path}:{line}: not UTF-8 text") from error
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f"{path}:{mark.line + 1}" if mark else str(path)
        problem = getattr(error, "problem", None) or str(error).partition("\n")[0]
        raise ConfigError(f"{place}: not valid YAML: {problem}") from error
    if not isinstance(node.value, dict):
        raise ConfigError(f"{path}:{node.line}: expected a mapping of keys to values, found {node}")
    return Section(path, node)


@functools.lru_cache(maxsize=512)  # several runs of one process read the shipped files each
def _document(path: Path, text: str, loader: Any) -> _Node:
    return _Reader(path, loader(text)).document()


class _Reader:
    """Builds nodes from the parser's events, so that no constructor ever runs."""

    def __init__(self, path: Path, loader: Any) -> None:
        self.path, self.loader = path, loader

    def document(self) -> _Node:
        """The one document of the file."""
        self.loader.get_event()  # the stream starts
        if self.loader.check_event(yaml.StreamEndEvent):
            raise ConfigError(f"{self.path}:1: the file is empty")
        self.loader.get_event()  # the document starts
        node = self._node(self.loader.get_event(), 0)
        self.loader.get_event()  # the document ends
        if not self.loader.check_event(yaml.StreamEndEvent):
            line = self.loader.get_event().start_mark.line + 1
            raise ConfigError(f"{self.path}:{line}: a second document; one per file is read")
        return node

    def _node(self, event: Any, depth: int) -> _Node:
        line = event.start_mark.line + 1
        if getattr(event, "anchor", None) is not None:
            raise ConfigError(f"{self.path}:{line}: anchors and aliases are not supported")
        if event.tag is not None:
            raise ConfigError(f"{self.path}:{line}: tag {event.tag!r} is not supported")
        if depth > MAX_DEPTH:
            raise ConfigError(f"{self.path}:{line}: nested more than {MAX_DEPTH} levels deep")
        if isinstance(event, yaml.ScalarEvent):
            self._check_shown(event.value, line)
            resolved = self.loader.resolve(yaml.ScalarNode, event.value, event.implicit)
            return _Node(line, event.value, is_text=resolved == _TEXT)
        if isinstance(event, yaml.SequenceStartEvent):
            return _Node(line, [self._node(item, depth + 1) for item in self._until_end()])
        return _Node(line, self._mapping(depth))

    def _check_shown(self, text: str, line: int) -> None:
        """Refuse what moves a terminal's cursor, or turns the direction of reading: texts of files
        are shown to people.
        """
        for letter in () if text.isprintable() else text:
            if not letter.isprintable() and letter not in _SPACES:
                raise ConfigError(
                    f"{self.path}:{line}: {text[:80]!r} has the character {letter!r}, "
                    "which a terminal obeys or hides; leave it out"
                )

    def _until_end(self) -> Iterator[Any]:
        while not isinstance(event := self.loader.get_event(), yaml.CollectionEndEvent):
            yield event

    def _mapping(self, depth: int) -> dict[str, tuple[int, _Node]]:
        found: dict[str, tuple[int, _Node]] = {}
        for event in self._until_end():
            key = self._node(event, depth + 1)
            if not isinstance(key.value, str) or not (key.is_text or key.value in _WORDS):
                raise ConfigError(
                    f"{self.path}:{key.line}: expected a key as {_AS_TEXT}, found {key}"
                )
            if key.value in found:
                first = f"first on line {found[key.value][0]}"
                raise ConfigError(
                    f"{self.path}:{key.line}: key {key.value!r} is given twice, {first}"
                )
            found[key.value] = (key.line, self._node(self.loader.get_event(), depth + 1))
        return found
