"""The importers, by name; each is imported when it is asked for."""

from __future__ import annotations

import importlib

from pytest_safemanip.errors import ConfigError, did_you_mean, install_command
from pytest_safemanip.importers.base import Importer
from pytest_safemanip.importers.source import Source

IMPORTERS = {
    "robosuite": "pytest_safemanip.importers.robosuite.importer:RobosuiteImporter",
}
"""The class of each importer, by the name of what it reads; the first that recognizes a source
imports it."""


def load_importer(name: str) -> Importer:
    """An importer by its name.

    Raises:
        ConfigError: if there is none, or what it needs is not installed.
    """
    if name not in IMPORTERS:
        raise ConfigError(f"unknown importer {name!r}; {did_you_mean(name, IMPORTERS)}")
    module, _, attribute = IMPORTERS[name].partition(":")
    try:
        importer: Importer = getattr(importlib.import_module(module), attribute)()
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"{error.name} is not installed; install it with: {install_command('import')}"
        ) from error
    return importer


def find_importer(source: Source) -> Importer:
    """The importer that a source is for.

    Raises:
        ConfigError: if none recognizes it.
    """
    for name in IMPORTERS:
        importer = load_importer(name)
        if importer.recognizes(source):
            return importer
    raise ConfigError(
        f"{source.path}: no importer recognizes it; there are importers for {', '.join(IMPORTERS)}"
    )
