"""The hooks that every pytest run loads. They import nothing heavy until the suite is asked for."""

from __future__ import annotations

from typing import Any

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.options import SELECT, add_options, is_wanted, refuse_stray_options

NODE_PREFIX = "safemanip::"
_SCOPE: pytest.StashKey[str] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the options."""
    add_options(parser)


def pytest_addhooks(pluginmanager: pytest.PytestPluginManager) -> None:
    """Declare the hooks that users implement."""
    from pytest_safemanip import hookspecs

    pluginmanager.add_hookspecs(hookspecs)


@pytest.hookimpl(tryfirst=True)
def pytest_load_initial_conftests(early_config: pytest.Config, args: list[str]) -> None:
    """Node ids of the suite are no paths: pytest would look for files of that name."""
    ids = {a for a in early_config.known_args_namespace.file_or_dir if a.startswith(NODE_PREFIX)}
    args[:] = [f"{SELECT}={a}" if a in ids else a for a in args]


def pytest_configure(config: pytest.Config) -> None:
    """Switch the suite on if it is asked for; refuse what cannot be done, before it is tried."""
    worker: dict[str, Any] | None = getattr(config, "workerinput", None)
    try:
        scope = config.stash[_SCOPE] = _scope(config)
        if scope not in ("alone", "beside"):
            return
        from pytest_safemanip.activation import activate

        activate(config, scope == "alone", worker["testrunuid"] if worker else None)
    except ConfigError as error:
        raise pytest.UsageError(str(error)) from None


def _scope(config: pytest.Config) -> str:
    """What the suite is: ``alone``, ``beside`` the tests of given paths, ``left out``, ``off``."""
    has_paths = config.args_source is pytest.Config.ArgsSource.ARGS
    if not is_wanted(config):
        refuse_stray_options(config)
        return "off"
    if not has_paths:
        return "alone"
    return "beside" if config.getoption("safemanip_select") else "left out"


def pytest_report_header(config: pytest.Config) -> str | None:
    """Say why a suite that was asked for does not run."""
    if config.stash.get(_SCOPE, "") != "left out":
        return None
    return f"safemanip: left out, because paths are given; add {NODE_PREFIX} to run it beside them"
