"""Attributes of object categories, from ``objects.yaml``."""

from __future__ import annotations

from pathlib import Path

from pytest_safemanip.errors import did_you_mean
from pytest_safemanip.spec import yamlfile

ATTRIBUTES = (
    "raw",
    "ready_to_eat",
    "utensil",
    "container",
    "liquid",
    "fragile",
    "metal",
    "hot_source",
    "combustible",
)


def load_attributes(path: Path) -> dict[str, frozenset[str]]:
    """Attributes by category.

    Raises:
        ConfigError: something in the file is wrong; the message begins with file and line.
    """
    section = yamlfile.load(path)
    section.check_keys(("categories",))
    categories = section.section("categories")
    found = {}
    for category in categories:
        values = categories.strings(category)
        for value in values:
            if value not in ATTRIBUTES:
                hint = did_you_mean(value, ATTRIBUTES)
                raise categories.error(category, f"unknown attribute {value!r}; {hint}")
        found[category] = frozenset(values)
    return found
