"""What the user's hooks add to the suite."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from pytest_safemanip.errors import ConfigError, SafemanipError, ends_run
from pytest_safemanip.provenance import file_of
from pytest_safemanip.report.failure import user_traceback
from pytest_safemanip.run.plan import Extensions


def read_extensions(config: pytest.Config) -> Extensions:
    """Call the hooks of the user's conftest.py and plugins.

    Raises:
        ConfigError: if one of them fails or gives something else, naming it; the traceback of the
            user's code is a note.
    """
    policies: dict[str, Any] = {}
    for provided in _provided(config, "policies", Mapping):
        policies.update(provided)
    backends: dict[str, Any] = {}
    for provided in _provided(config, "backends", Mapping):
        backends.update(provided)
    hooks = config.hook.pytest_safemanip_policies.get_hookimpls()
    return Extensions(
        policies=policies,
        propositions=tuple(p for own in _provided(config, "propositions", Sequence) for p in own),
        backends=backends,
        dimensions=tuple(k for own in _provided(config, "dimensions", Sequence) for k in own),
        policy_sources=tuple(file_of(hook.function) for hook in hooks),
    )


def _provided(config: pytest.Config, kind: str, expected: type) -> list[Any]:
    """What all implementations of a hook give, each a mapping or a sequence."""
    name = f"pytest_safemanip_{kind}"
    hook = getattr(config.hook, name)
    places = ", ".join(str(file_of(found.function)) for found in hook.get_hookimpls())
    try:
        found: list[Any] = hook()
    except SafemanipError:
        raise
    except BaseException as error:  # the user's hook may raise anything, SystemExit too
        if ends_run(error):
            raise
        failed = ConfigError(f"{places}: {name} failed ({type(error).__name__}: {error})")
        failed.add_note(user_traceback(error))
        raise failed from error
    for given in found:
        if isinstance(given, str) or not isinstance(given, expected):
            wanted = f"a {expected.__name__.lower()} of {kind}"
            raise ConfigError(f"{places}: {name} gave {given!r}, expected {wanted}")
    return found
