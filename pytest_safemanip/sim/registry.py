"""Finds a backend by name: shipped ones, and those from a hook."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from types import MappingProxyType

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.sim.backend import Simulator

BUILT_IN: Mapping[str, str] = MappingProxyType(
    {
        "robocasa": "pytest_safemanip.sim.robocasa.factory:SIMULATOR",
        "libero": "pytest_safemanip.sim.libero.factory:SIMULATOR",
    }
)
"""The shipped backends, as ``module:attribute``; imported at first use."""


def find_simulator(name: str, added: Mapping[str, Simulator]) -> Simulator:
    """The backend of a name.

    Args:
        name: as given to ``--safemanip-backend``.
        added: those from the hook ``pytest_safemanip_backends``.

    Raises:
        ConfigError: if there is none of this name, or the hook gives something else.
    """
    if name in added:
        found = added[name]
        if not isinstance(found, Simulator):
            raise ConfigError(
                f"backend {name!r}: the hook gives a {type(found).__name__}, expected "
                "pytest_safemanip.sim.backend.Simulator(spec, create)"
            )
        return found
    if name not in BUILT_IN:
        hint = did_you_mean(name, {*BUILT_IN, *added})
        raise ConfigError(f"--safemanip-backend: unknown backend {name!r}; {hint}")
    module, _, attribute = BUILT_IN[name].partition(":")
    shipped: Simulator = getattr(importlib.import_module(module), attribute)
    return shipped
