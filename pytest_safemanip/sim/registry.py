"""Finds a backend by name: shipped ones, and those from a hook."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.sim.backend import Simulator

BUILT_IN: Mapping[str, str] = MappingProxyType(
    {
        "robocasa": "pytest_safemanip.sim.robocasa.factory:SIMULATOR",
        "libero": "pytest_safemanip.sim.libero.factory:SIMULATOR",
        "robosuite": "pytest_safemanip.sim.robosuite.factory:simulator",
    }
)
"""The shipped backends, as ``module:attribute``, imported at first use: a
:class:`~pytest_safemanip.sim.backend.Simulator`, or a function that gives one of what stands behind
``NAME:``.
"""


def check_backend(name: str, added: Collection[str], place: str) -> None:
    """See whether there is a backend of a name, without its library.

    Args:
        name: as given to ``--safemanip-backend``.
        added: names of those from the hook ``pytest_safemanip_backends``.
        place: where it is named.

    Raises:
        ConfigError: naming the place, if there is none.
    """
    if name not in added and name.partition(":")[0] not in BUILT_IN:
        hint = did_you_mean(name, {*BUILT_IN, *added})
        raise ConfigError(f"{place}: unknown backend {name!r}; {hint}")


def find_simulator(name: str, added: Mapping[str, Simulator]) -> Simulator:
    """The backend of a name.

    Args:
        name: as given to ``--safemanip-backend``: ``NAME``, or ``NAME:VARIANT`` of one that has
            variants.
        added: those from the hook ``pytest_safemanip_backends``.

    Raises:
        ConfigError: if there is none of this name or variant, or the hook gives something else.
    """
    if name in added:
        found = added[name]
        if not isinstance(found, Simulator):
            raise ConfigError(
                f"backend {name!r}: the hook gives a {type(found).__name__}, expected "
                "pytest_safemanip.sim.backend.Simulator(spec, create)"
            )
        return found
    check_backend(name, added, "--safemanip-backend")
    base, _, variant = name.partition(":")
    module, _, attribute = BUILT_IN[base].partition(":")
    shipped: Simulator | Callable[[str], Simulator] = getattr(
        importlib.import_module(module), attribute
    )
    if not isinstance(shipped, Simulator):
        return shipped(variant)
    if variant:
        raise ConfigError(f"--safemanip-backend: {base!r} has no variants, found {name!r}")
    return shipped
