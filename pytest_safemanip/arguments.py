"""Values of options, from text."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.policies.remote.endpoint import Deadlines
from pytest_safemanip.policies.remote.presets import PRESETS

MAX_SEEDS = 100_000
"""More in one run is a slip of the keyboard."""


def parse_policies(
    items: Sequence[str], environment: Mapping[str, str]
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Names of policies, and where those on servers are: ``pi05=ws://host:8000``.

    An address that is not given may be in the environment: ``SAFEMANIP_GROOT_PT`` for ``groot-pt``.

    Raises:
        ConfigError: if an address is given for what is not on a server, or two for one policy.
    """
    servers = {
        name: environment[variable]
        for name in PRESETS
        if environment.get(variable := f"SAFEMANIP_{name.upper().replace('-', '_')}")
    }
    given: dict[str, str] = {}
    for item in items:
        name, equals, address = item.partition("=")
        if equals and name not in PRESETS:
            raise ConfigError(
                f"--safemanip-policy: {item!r} has an address; policies on a server are "
                f"{', '.join(PRESETS)}"
            )
        if given.setdefault(name, address) != address:
            raise ConfigError(f"--safemanip-policy: {name!r} has two addresses")
    servers.update((name, address) for name, address in given.items() if address)
    return tuple(given), servers


def parse_deadlines(lines: Sequence[str]) -> Deadlines:
    """How long to wait for servers, from ``call=60``.

    Raises:
        ConfigError: if a line is not of that form.
    """
    found: dict[str, float] = {}
    known = [field.name for field in dataclasses.fields(Deadlines)]
    for line in lines:
        name, _, seconds = (part.strip() for part in line.partition("="))
        if name not in known:
            hint = did_you_mean(name, known)
            raise ConfigError(f"safemanip_deadlines: unknown deadline {name!r}; {hint}")
        try:
            found[name] = float(seconds)
        except ValueError:
            raise ConfigError(
                f"safemanip_deadlines: expected NAME=SECONDS, found {line!r}"
            ) from None
    return Deadlines(**found)


def parse_seeds(text: str) -> tuple[int, ...]:
    """Seeds from ``N``, ``A:B`` or ``A,B,C``.

    Raises:
        ConfigError: if the text is none of these, or means no seed.
    """
    try:
        if "," in text:
            seeds = tuple(dict.fromkeys(int(part) for part in text.split(",")))
        else:
            first, last = (int(part) for part in (text if ":" in text else f"0:{text}").split(":"))
            seeds = tuple(range(first, min(last, first + MAX_SEEDS + 1)))
    except ValueError:
        seeds = ()
    if not seeds or min(seeds) < 0:
        raise ConfigError(
            f"--safemanip-seeds: expected N, A:B or A,B,C with seeds from 0 up, found {text!r}"
        )
    if len(seeds) > MAX_SEEDS or max(seeds) >= 2**32:
        raise ConfigError(
            f"--safemanip-seeds: expected at most {MAX_SEEDS} seeds below 2**32, found {text!r}"
        )
    return seeds


def parse_params(items: Sequence[str]) -> dict[str, float]:
    """Parameter values from ``NAME=VALUE``.

    Raises:
        ConfigError: if an item is not of that form.
    """
    found = {}
    for item in items:
        name, _, value = item.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise ConfigError(
                f"--safemanip-params: expected NAME=VALUE with a number, found {item!r}"
            ) from None
    return found
