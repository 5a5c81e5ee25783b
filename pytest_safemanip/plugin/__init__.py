"""The hooks that every pytest run loads. They import nothing heavy until the suite is asked for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.plugin.options import (
    SELECT,
    SWITCHES,
    add_options,
    is_wanted,
    refuse_stray_options,
    refuse_unknown_keys,
)
from pytest_safemanip.plugin.run_id import WORKER_INPUT, run_id_of

if TYPE_CHECKING:
    from pytest_safemanip.plugin.fixture import RolloutProvider

NODE_PREFIX = "safemanip::"
_MODE: pytest.StashKey[str] = pytest.StashKey()


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
    config.addinivalue_line("markers", "safemanip: cases and laws of the safety suite")
    try:
        refuse_unknown_keys(config)
        mode = config.stash[_MODE] = _mode(config)
        if mode not in ("exclusive", "appended"):
            return
        from pytest_safemanip.plugin.configure import activate

        activate(config, mode == "exclusive", hasattr(config, "workerinput"))
    except ConfigError as error:
        notes = getattr(error, "__notes__", [])  # the traceback of a hook
        raise pytest.UsageError("\n\n".join([str(error), *notes])) from None


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Tell a worker of pytest-xdist which run it belongs to."""
    node.workerinput[WORKER_INPUT] = run_id_of(node.config)


def _mode(config: pytest.Config) -> str:
    """What becomes of the suite: ``off``; ``exclusive``, nothing else is collected; ``appended``
    to the repository's own tests or those of given paths; ``not collected``.
    """
    if not is_wanted(config):
        refuse_stray_options(config)
        return "off"
    selected = config.getoption("safemanip_select")
    if config.args_source is pytest.Config.ArgsSource.ARGS:
        return "appended" if selected else "not collected"
    given = {str(argument).partition("=")[0] for argument in config.invocation_params.args}
    return "exclusive" if selected or given & {*SWITCHES} else "appended"


def pytest_report_header(config: pytest.Config) -> str | None:
    """Say why a suite that one may expect does not run."""
    mode = config.stash.get(_MODE, "")
    if mode == "not collected":
        return f"safemanip: not collected: paths were given; add {NODE_PREFIX} to run it too"
    if mode == "off" and (config.getoption("lf", False) or config.getoption("failedfirst", False)):
        assert config.cache is not None  # noqa: S101  (the option is the cache's own)
        known = config.cache.get("cache/lastfailed", {})
        cases = sum(node_id.startswith(NODE_PREFIX) for node_id in known)
        if cases:
            return (
                f"safemanip: {cases} of the last failures are of the safety suite, which is off: "
                "repeat its options, or put safemanip_policy into the ini file"
            )
    return None


@pytest.fixture(scope="session")
def safemanip_rollout(pytestconfig: pytest.Config) -> Iterator[RolloutProvider]:
    """Recordings of rollouts with their verdicts, for tests of your own.

    ``safemanip_rollout("OpenDrawer", policy="scripted", seed=0)`` returns an
    :class:`~pytest_safemanip.run.session.EvaluatedRollout`: its ``recording``, its ``path``, and
    ``verdict("release_stability")``. A rollout is run once, whoever asks; the options that say how
    rollouts are run apply.
    """
    from pytest_safemanip.plugin.fixture import RolloutProvider

    provider = RolloutProvider(pytestconfig)
    yield provider
    provider.close()
