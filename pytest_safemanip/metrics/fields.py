"""Typed access to parsed JSON that may come from anywhere."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pytest_safemanip.errors import ConfigError, printable

MAX_COUNT = 2**53
"""No step and no seed is larger; a duration of this many seconds is none."""
MAX_TOLD = 20_000
"""Characters of a text for people."""


class Fields:
    """A mapping of a JSON document.

    Attributes:
        place: the file and the keys that lead here.
        values: what it holds.
    """

    def __init__(self, place: str, values: Any) -> None:
        if not isinstance(values, dict):
            raise ConfigError(f"{place}: expected a mapping, found {_shown(values)}")
        self.place = place
        self.values: Mapping[str, Any] = values

    def text(self, key: str, *, empty: bool = False) -> str:
        """Text; null counts as empty.

        Raises:
            ConfigError: if it is missing or something else; likewise in the methods below.
        """
        value = self.values.get(key)
        if value is None and empty:
            return ""
        if not isinstance(value, str) or not (value or empty):
            raise self.expected(key, "text")
        return value

    def name(self, key: str) -> str:
        """Text that a terminal shows as it is, and that is looked up: escapes would change it."""
        value = self.text(key)
        if not value.isprintable():
            raise self.expected(key, "printable text")
        return value

    def told(self, key: str, *, empty: bool = False) -> str:
        """Text for people, in one or more lines, with escapes for what is not printable."""
        return printable(self.text(key, empty=empty), MAX_TOLD, lines=True)

    def facts(self, key: str) -> dict[str, str]:
        """A mapping of names to values for people."""
        return {
            printable(name, MAX_TOLD): printable(str(value), MAX_TOLD)
            for name, value in self.section(key).values.items()
        }

    def texts(self, key: str) -> list[str]:
        """A list of texts."""
        value = self.values.get(key)
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self.expected(key, "a list of texts")
        return value

    def count(self, key: str) -> int:
        """A whole number from 0 up."""
        value = self.values.get(key)
        if type(value) is not int or not 0 <= value <= MAX_COUNT:
            raise self.expected(key, "a whole number from 0 up")
        return value

    def number(self, key: str) -> float:
        """A number from 0 up."""
        value = self.values.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.expected(key, "a number")
        if not 0 <= value <= MAX_COUNT:
            raise self.expected(key, "a number from 0 up")
        return float(value)

    def boolean(self, key: str) -> bool:
        """True or false."""
        value = self.values.get(key)
        if not isinstance(value, bool):
            raise self.expected(key, "true or false")
        return value

    def section(self, key: str) -> Fields:
        """A mapping inside this one."""
        return Fields(f"{self.place}: {key}", self.values.get(key))

    def fields(self, key: str) -> list[Fields]:
        """A list of mappings."""
        value = self.values.get(key)
        if not isinstance(value, list):
            raise self.expected(key, "a list")
        return [Fields(f"{self.place}: {key}[{n}]", item) for n, item in enumerate(value)]

    def expected(self, key: str, wanted: str) -> ConfigError:
        """An error about the value of a key, to be raised by the caller."""
        found = _shown(self.values.get(key))
        return ConfigError(f"{self.place}: {printable(key)}: expected {wanted}, found {found}")


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) < 60 else f"{text[:60]}..."
