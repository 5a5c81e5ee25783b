"""The libraries that only policies on a server need."""

from __future__ import annotations

import importlib
from typing import Any

from pytest_safemanip.errors import ConfigError, install_command

REMEDY = install_command("servers")


def need(module: str) -> Any:
    """Import a module of the extra ``servers``.

    Raises:
        ConfigError: if it is not installed; says what to install.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ConfigError(
            f"a policy on a server needs {module.partition('.')[0]!r}: {REMEDY} ({error})"
        ) from error
