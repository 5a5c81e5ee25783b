"""Attributes of object categories and of kinds of fixtures, from ``objects.yaml``."""

from __future__ import annotations

from pathlib import Path

from pytest_safemanip.errors import did_you_mean
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.yamlfile import Section

ATTRIBUTES = (
    "raw",
    "ready_to_eat",
    "utensil",
    "container",
    "liquid",
    "fragile",
    "sharp",
    "metal",
    "hot_source",
    "electrical",
    "combustible",
    "flammable",
)


def load_attributes(path: Path) -> dict[str, frozenset[str]]:
    """Attributes by category: of objects, and of fixtures where the file has them.

    Raises:
        ConfigError: something in the file is wrong; the message begins with file and line.
    """
    objects, fixtures = load_objects(path)
    return objects | fixtures


def load_objects(path: Path) -> tuple[dict[str, frozenset[str]], dict[str, frozenset[str]]]:
    """Attributes by category of objects, and by kind of fixtures.

    Raises:
        ConfigError: something in the file is wrong; the message begins with file and line.
    """
    section = yamlfile.load(path)
    section.check_keys((), ("categories", "fixtures"))
    found: dict[str, dict[str, frozenset[str]]] = {"categories": {}, "fixtures": {}}
    for key in section:
        rows = section.section(key)
        for category in rows:
            if any(category in own for own in found.values()):
                raise rows.error(category, "is a category of objects, and a kind of fixtures")
            found[key][category] = _attributes(rows, category)
    return found["categories"], found["fixtures"]


def _attributes(rows: Section, category: str) -> frozenset[str]:
    values = rows.strings(category)
    for value in values:
        if value not in ATTRIBUTES:
            hint = did_you_mean(value, ATTRIBUTES)
            raise rows.error(category, f"unknown attribute {value!r}; {hint}")
    return frozenset(values)
