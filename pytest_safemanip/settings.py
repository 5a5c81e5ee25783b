"""What the user asked for, parsed from the command line and the ini file."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest

from pytest_safemanip.cases import is_case_id, is_law_id
from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.options import OPTIONS, value_of
from pytest_safemanip.policies.prompts import read_prompt
from pytest_safemanip.policies.remote.endpoint import Deadlines
from pytest_safemanip.policies.remote.presets import PRESETS

MAX_SEEDS = 100_000
"""More in one run is a slip of the keyboard."""
MAX_EXAMPLES = 1_000_000


@dataclass(frozen=True)
class Settings:
    """What the user asked for, parsed. Attributes follow the options; see ``pytest --help``."""

    policies: tuple[str, ...]
    servers: Mapping[str, str]
    deadlines: Deadlines
    tasks: tuple[str, ...]
    properties: tuple[str, ...]
    seeds: tuple[int, ...] | None
    backend: str
    scenes: str
    assets: Literal["auto", "official", "primitive"]
    recordings: Path | None
    semantics: Literal["timed", "paper"]
    stop: Literal["success", "horizon"]
    horizon_scale: float
    prompt: str
    violations: str
    unresolved: str
    vacuous: str
    out: Path
    params: Mapping[str, float]
    fuzz: bool
    fuzz_examples: int | None
    property_paths: tuple[Path, ...]
    task_paths: tuple[Path, ...]
    select: tuple[str, ...]
    laws: tuple[str, ...]

    @property
    def fuzzes(self) -> bool:
        """Whether laws are tried. Node ids of cases alone mean those cases alone."""
        return bool(self.laws) or (self.fuzz and not self._names_cases)

    @property
    def judges(self) -> bool:
        """Whether rollouts are judged. Node ids of laws alone mean those laws alone."""
        if self.laws and not self.select:
            return False
        return bool(self.policies or self.recordings or self._names_cases or not self.fuzz)

    @property
    def _names_cases(self) -> bool:
        return any(is_case_id(text) for text in self.select)


def read_settings(config: pytest.Config) -> Settings:
    """Combine command line and ini.

    Raises:
        ConfigError: naming the option and what is wrong with its value.
    """
    values = {option.ini: value_of(config, option) for option in OPTIONS}
    recordings = values["safemanip_recordings"]
    selected = config.getoption("safemanip_select") or ()
    policies, servers = parse_policies(_names(values["safemanip_policy"]), os.environ)
    return Settings(
        policies=policies,
        servers=servers,
        deadlines=parse_deadlines(config.getini("safemanip_deadlines")),
        tasks=_names(values["safemanip_tasks"]),
        properties=_names(values["safemanip_properties"]),
        seeds=parse_seeds(values["safemanip_seeds"]) if values["safemanip_seeds"] else None,
        backend=values["safemanip_backend"],
        scenes=values["safemanip_scenes"],
        assets=_assets(values["safemanip_assets"]),
        recordings=_folder(config, recordings) if recordings else None,
        semantics="paper" if values["safemanip_semantics"] == "paper" else "timed",
        stop="horizon" if values["safemanip_stop"] == "horizon" else "success",
        horizon_scale=_positive("--safemanip-horizon-scale", values["safemanip_horizon_scale"]),
        prompt=read_prompt(values["safemanip_prompt"], Path(config.invocation_params.dir)),
        violations=values["safemanip_violations"],
        unresolved=values["safemanip_unresolved"],
        vacuous=values["safemanip_vacuous"],
        out=_folder(config, values["safemanip_out"]),
        params=parse_params(_names(values["safemanip_params"])),
        fuzz=bool(values["safemanip_fuzz"]),
        fuzz_examples=_count("--safemanip-fuzz-examples", values["safemanip_fuzz_examples"]),
        property_paths=tuple(config.getini("safemanip_property_paths")),
        task_paths=tuple(config.getini("safemanip_task_paths")),
        select=tuple(text for text in selected if not is_law_id(text)),
        laws=tuple(text for text in selected if is_law_id(text)),
    )


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


def _assets(text: str) -> Literal["auto", "official", "primitive"]:
    return "official" if text == "official" else "primitive" if text == "primitive" else "auto"


def _names(text: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))


def _positive(flag: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0.0 < value < float("inf"):
        raise ConfigError(f"{flag}: expected a number above 0, found {text!r}")
    return value


def _count(flag: str, text: str) -> int | None:
    if not text:
        return None
    if not text.isdecimal() or not 0 < int(text) <= MAX_EXAMPLES:
        raise ConfigError(f"{flag}: expected a number from 1 to {MAX_EXAMPLES}, found {text!r}")
    return int(text)


def _folder(config: pytest.Config, text: str) -> Path:
    return Path(config.invocation_params.dir) / os.path.expanduser(text)
