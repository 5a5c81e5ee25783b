"""The importers, by name; each is imported when it is asked for."""

from __future__ import annotations

import importlib

from pytest_safemanip.errors import ConfigError, install_command
from pytest_safemanip.importers.base import Importer
from pytest_safemanip.importers.source import Source

IMPORTERS = {
    "robocasa": "pytest_safemanip.importers.lerobot.robocasa:RoboCasaImporter",
    "lerobot": "pytest_safemanip.importers.lerobot.logs:LogImporter",
    "robosuite": "pytest_safemanip.importers.robosuite.importer:RobosuiteImporter",
}
"""The class of each importer, by the name of what it reads; the first that recognizes a source
imports it."""
READS = {
    "robocasa": "LeRobot datasets of RoboCasa's, with extras/",
    "lerobot": "other LeRobot datasets, by meta/info.json",
    "robosuite": "robosuite's and robomimic's .hdf5 and .h5",
}
"""What each reads, for people."""


def _load(name: str) -> Importer:
    module, _, attribute = IMPORTERS[name].partition(":")
    try:
        importer: Importer = getattr(importlib.import_module(module), attribute)()
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"{error.name} is not installed; install it with: {install_command('import')}"
        ) from error
    return importer


def find_importer(source: Source, name: str = "") -> Importer:
    """The importer that a source is for.

    Args:
        source: what there is.
        name: of the one that the user wants; empty for the first that recognizes the source.

    Raises:
        ConfigError: if none, or that one, finds nothing in it, or needs what is not installed.
    """
    for candidate in [name] if name else IMPORTERS:
        importer = _load(candidate)
        if importer.recognizes(source):
            return importer
    wanted = {name: READS[name]} if name else READS
    known = "; ".join(f"{name} ({what})" for name, what in wanted.items())
    raise ConfigError(f"{source.path}: nothing to import; importers: {known}")
