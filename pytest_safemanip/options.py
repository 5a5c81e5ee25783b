"""The command line and the ini file. Imported by every pytest run: nothing heavy here."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest

from pytest_safemanip.errors import ConfigError, did_you_mean

SELECT = "--safemanip-select"
"""Where node ids of the suite on the command line are kept; not shown in --help."""


@dataclass(frozen=True)
class Option:
    """One option; its ini name is the same with underscores and no leading dashes."""

    flag: str
    help: str
    default: str = ""
    metavar: str | None = None
    choices: tuple[str, ...] = ()
    repeat: bool = False

    @property
    def ini(self) -> str:
        """Name in the ini file, and in the parsed options."""
        return self.flag.removeprefix("--").replace("-", "_")


OPTIONS = (
    Option(
        "--safemanip-policy",
        "turn the safety suite on for these policies: scripted, scripted:FAULT, random, hold, "
        "MODULE:ATTRIBUTE, or one from the hook pytest_safemanip_policies (repeatable)",
        metavar="NAME[,...]",
        repeat=True,
    ),
    Option(
        "--safemanip-tasks",
        "task names, globs, suite:NAME, horizon:NAME, set:NAME, quick, or all",
        "all",
        "SELECTOR[,...]",
        repeat=True,
    ),
    Option(
        "--safemanip-properties",
        "property ids, globs, or category:NAME (default: all that apply)",
        "",
        "ID[,...]",
        repeat=True,
    ),
    Option(
        "--safemanip-seeds",
        "N means 0..N-1; A:B means A..B-1; A,B,C (default: 1; of recordings, all)",
        "",
        "SEEDS",
    ),
    Option("--safemanip-backend", "robocasa, or one from a hook", "robocasa", "NAME"),
    Option(
        "--safemanip-scenes",
        "kitchens: compact (small and fast), target or pretrain (RoboCasa's splits)",
        "compact",
        choices=("compact", "target", "pretrain"),
    ),
    Option(
        "--safemanip-assets",
        "auto (official where installed, else generated primitives), official, primitive",
        "auto",
        choices=("auto", "official", "primitive"),
    ),
    Option(
        "--safemanip-recordings",
        "judge the recordings in this folder, no simulator; policies, tasks and seeds select",
        "",
        "DIR",
    ),
    Option(
        "--safemanip-semantics",
        "timed: deadlines, unresolved endings; paper: the printed formulas, plain acceptance",
        "timed",
        choices=("timed", "paper"),
    ),
    Option(
        "--safemanip-stop",
        "end a rollout at success or only at its horizon",
        "success",
        choices=("success", "horizon"),
    ),
    Option("--safemanip-horizon-scale", "factor on the task's own horizon", "1.0", "X"),
    Option(
        "--safemanip-violations",
        "how a violation shows in pytest",
        "fail",
        choices=("fail", "xfail"),
    ),
    Option(
        "--safemanip-unresolved",
        "how an obligation that is still open at the end shows in pytest",
        "skip",
        choices=("skip", "fail"),
    ),
    Option(
        "--safemanip-vacuous",
        "how a property that was never triggered shows in pytest",
        "skip",
        choices=("skip", "pass"),
    ),
    Option("--safemanip-out", "folder for recordings, summary.json and logs", ".safemanip", "DIR"),
    Option(
        "--safemanip-params",
        "a proposition parameter, for example settled.speed=0.05 (repeatable)",
        "",
        "NAME=VALUE[,...]",
        repeat=True,
    ),
)


def add_options(parser: pytest.Parser) -> None:
    """Declare the options and their ini twins."""
    group = parser.getgroup("safemanip", "temporal safety of robot manipulation")
    for option in OPTIONS:
        shown = f" (default: {option.default})" if option.default else ""
        group.addoption(
            option.flag,
            dest=option.ini,
            action="append" if option.repeat else "store",
            default=None,
            choices=option.choices or None,
            metavar=option.metavar,
            help=option.help + shown,
        )
        parser.addini(option.ini, option.help, default=option.default)
    group.addoption(
        SELECT, dest="safemanip_select", action="append", default=None, help=argparse.SUPPRESS
    )
    parser.addini("safemanip_property_paths", "folders of your own properties", type="paths")
    parser.addini("safemanip_task_paths", "folders of your own tasks", type="paths")


@dataclass(frozen=True)
class Settings:
    """What the user asked for, parsed. Attributes follow the options; see ``pytest --help``."""

    policies: tuple[str, ...]
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
    violations: str
    unresolved: str
    vacuous: str
    out: Path
    params: Mapping[str, float]
    property_paths: tuple[Path, ...]
    task_paths: tuple[Path, ...]
    select: tuple[str, ...]


def read_settings(config: pytest.Config) -> Settings:
    """Combine command line and ini.

    Raises:
        ConfigError: naming the option and what is wrong with its value.
    """
    values = {option.ini: _value(config, option) for option in OPTIONS}
    recordings = values["safemanip_recordings"]
    return Settings(
        policies=_names(values["safemanip_policy"]),
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
        violations=values["safemanip_violations"],
        unresolved=values["safemanip_unresolved"],
        vacuous=values["safemanip_vacuous"],
        out=_folder(config, values["safemanip_out"]),
        params=parse_params(_names(values["safemanip_params"])),
        property_paths=tuple(config.getini("safemanip_property_paths")),
        task_paths=tuple(config.getini("safemanip_task_paths")),
        select=tuple(config.getoption("safemanip_select") or ()),
    )


def is_wanted(config: pytest.Config) -> bool:
    """Whether the suite is switched on: by a policy, by recordings or by an id of it."""
    if config.getoption("safemanip_select"):
        return True
    return any(_value(config, o) for o in OPTIONS if o.flag in _SWITCHES)


_SWITCHES = ("--safemanip-policy", "--safemanip-recordings")


def refuse_stray_options(config: pytest.Config) -> None:
    """Refuse options that do nothing because the suite is off.

    Raises:
        ConfigError: naming the option and what is missing.
    """
    for option in OPTIONS:
        if config.getoption(option.ini) is not None:
            raise ConfigError(
                f"{option.flag} has no effect without --safemanip-policy or --safemanip-recordings"
            )


def parse_seeds(text: str) -> tuple[int, ...]:
    """Seeds from ``N``, ``A:B`` or ``A,B,C``.

    Raises:
        ConfigError: if the text is none of these, or means no seed.
    """
    try:
        if ":" in text:
            first, last = (int(part) for part in text.split(":"))
            seeds = tuple(range(first, last))
        elif "," in text:
            seeds = tuple(dict.fromkeys(int(part) for part in text.split(",")))
        else:
            seeds = tuple(range(int(text)))
    except ValueError:
        seeds = ()
    if not seeds or min(seeds) < 0:
        raise ConfigError(
            f"--safemanip-seeds: expected N, A:B or A,B,C with seeds from 0 up, found {text!r}"
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


def _value(config: pytest.Config, option: Option) -> str:
    given = config.getoption(option.ini)
    if given is not None:
        return ",".join(given) if isinstance(given, list) else str(given)
    value = str(config.getini(option.ini))
    if option.choices and value not in option.choices:
        hint = did_you_mean(value, option.choices)
        raise ConfigError(f"{option.ini} in the ini file: unknown value {value!r}; {hint}")
    return value


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


def _folder(config: pytest.Config, text: str) -> Path:
    return Path(config.invocation_params.dir) / os.path.expanduser(text)
