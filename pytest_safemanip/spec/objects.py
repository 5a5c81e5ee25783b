"""Attributes of object categories, from ``objects.yaml``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pytest_safemanip.errors import ConfigError, did_you_mean
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


def load_all_attributes(shipped: Path, folders: Sequence[Path]) -> dict[str, frozenset[str]]:
    """Attributes by category, the shipped ones and those of the user's folders of tasks.

    Args:
        shipped: the file of the shipped ones.
        folders: of the user's tasks; those with a file of the same name add its categories.

    Raises:
        ConfigError: if a file is wrong, or a category is in two of them.
    """
    found = load_attributes(shipped)
    for folder in folders:
        path = folder / shipped.name
        if not path.is_file():
            continue
        own = load_attributes(path)
        for category in own:
            if category in found:
                raise ConfigError(f"{path}: category {category!r} is already defined; rename it")
        found |= own
    return found
