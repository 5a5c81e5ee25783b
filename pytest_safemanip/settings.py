"""What the user asked for, parsed from the command line and the ini file."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest

from pytest_safemanip.arguments import parse_deadlines, parse_params, parse_policies, parse_seeds
from pytest_safemanip.cases import is_case_id, is_law_id
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.gates import Gates, load_gates, parse_gate
from pytest_safemanip.metrics.until import check_gate
from pytest_safemanip.options import OPTIONS, value_of
from pytest_safemanip.policies.prompts import read_prompt
from pytest_safemanip.policies.remote.endpoint import Deadlines

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
    stepping: str
    assets: Literal["auto", "official", "primitive"]
    recordings: Path | None
    semantics: Literal["timed", "paper"]
    stop: Literal["success", "horizon"]
    horizon_scale: float
    prompt: str
    violations: str
    unresolved: str
    vacuous: str
    gates: Gates
    baseline: Path | None
    until: float | None
    inconclusive: str
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
    gates = _gates(config, values["safemanip_gate"], values["safemanip_gates"])
    baseline, until = values["safemanip_baseline"], values["safemanip_until"]
    decided = bool(gates.gates or baseline)
    return Settings(
        policies=policies,
        servers=servers,
        deadlines=parse_deadlines(config.getini("safemanip_deadlines")),
        tasks=_names(values["safemanip_tasks"]),
        properties=_names(values["safemanip_properties"]),
        seeds=parse_seeds(values["safemanip_seeds"]) if values["safemanip_seeds"] else None,
        backend=values["safemanip_backend"],
        scenes=values["safemanip_scenes"],
        stepping=values["safemanip_stepping"],
        assets=_assets(values["safemanip_assets"]),
        recordings=_folder(config, recordings) if recordings else None,
        semantics="paper" if values["safemanip_semantics"] == "paper" else "timed",
        stop="horizon" if values["safemanip_stop"] == "horizon" else "success",
        horizon_scale=_positive("--safemanip-horizon-scale", values["safemanip_horizon_scale"]),
        prompt=read_prompt(values["safemanip_prompt"], Path(config.invocation_params.dir)),
        violations=values["safemanip_violations"] or ("xfail" if decided else "fail"),
        unresolved=values["safemanip_unresolved"],
        vacuous=values["safemanip_vacuous"],
        gates=gates,
        baseline=_folder(config, baseline) if baseline else None,
        until=_level(until, gates) if until else None,
        inconclusive=values["safemanip_inconclusive"],
        out=_folder(config, values["safemanip_out"]),
        params=parse_params(_names(values["safemanip_params"])),
        fuzz=bool(values["safemanip_fuzz"]),
        fuzz_examples=_count("--safemanip-fuzz-examples", values["safemanip_fuzz_examples"]),
        property_paths=tuple(config.getini("safemanip_property_paths")),
        task_paths=tuple(config.getini("safemanip_task_paths")),
        select=tuple(text for text in selected if not is_law_id(text)),
        laws=tuple(text for text in selected if is_law_id(text)),
    )


def _gates(config: pytest.Config, lines: str, path: str) -> Gates:
    """Those of the command line, or of the ini file, and those of a file."""
    found = load_gates(_folder(config, path)) if path else Gates()
    try:
        own = [parse_gate(line) for line in lines.splitlines() if line.strip()]
    except ConfigError as error:
        raise ConfigError(f"--safemanip-gate: {error}") from None
    gates = {gate.name: gate for gate in [*found.gates, *own]}
    return dataclasses.replace(found, gates=tuple(gates.values()))


def _level(text: str, gates: Gates) -> float:
    """Of stopping early, checked against the gates."""
    try:
        level = float(text)
    except ValueError:
        level = float("nan")
    if not 0.0 < level <= 0.5:
        raise ConfigError(
            f"--safemanip-until: expected a probability above 0, at most 0.5, found {text!r}"
        )
    if not gates.gates:
        raise ConfigError("--safemanip-until stops where gates are decided; give --safemanip-gate")
    for gate in gates.gates:
        try:
            check_gate(gate)
        except ConfigError as error:
            raise ConfigError(f"--safemanip-until: gate {gate.name!r}: {error}") from None
    return level


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
