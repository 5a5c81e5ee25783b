"""The hooks that every pytest run loads. They import nothing heavy until the suite is asked for."""

from __future__ import annotations

from typing import Any

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.options import SELECT, add_options, is_wanted

NODE_PREFIX = "safemanip::"


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
        if worker is None:
            config.option.safemanip_scope = _scope(config)
        if config.option.safemanip_scope == "off":
            return
        from pytest_safemanip.activation import activate

        activate(config, worker["testrunuid"] if worker else None)
    except ConfigError as error:
        raise pytest.UsageError(str(error)) from None


def _scope(config: pytest.Config) -> str:
    """What the suite is to be: ``off``, ``alone``, or ``beside`` the tests of the given paths.

    It is decided where the command line is known, and kept in the options: workers get those.
    """
    has_paths = config.args_source is pytest.Config.ArgsSource.ARGS
    if not is_wanted(config):
        from pytest_safemanip.options import refuse_stray_options

        refuse_stray_options(config)
        return "off"
    if not has_paths:
        return "alone"
    return "beside" if config.getoption("safemanip_select") else "off"
