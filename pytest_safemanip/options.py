"""The command line and the ini file. Imported by every pytest run: nothing heavy here."""

from __future__ import annotations

import argparse
from dataclasses import dataclass

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
    switch: bool = False
    lines: bool = False

    @property
    def ini(self) -> str:
        """Name in the ini file, and in the parsed options."""
        return self.flag.removeprefix("--").replace("-", "_")


OPTIONS = (
    Option(
        "--safemanip-policy",
        "turn the safety suite on for these policies: pi0, pi05, groot, groot-pt, groot-to, "
        "groot-tpt, openpi, vla-eval (on a server, at ENDPOINT), scripted, scripted:FAULT, random, "
        "hold, recording:DIR, MODULE:ATTRIBUTE, or one from the hook pytest_safemanip_policies "
        "(repeatable)",
        metavar="NAME[=ENDPOINT][,...]",
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
        "kitchens: compact (small and fast), target or pretrain (RoboCasa's splits) (default: the "
        "official split of a policy on a server; compact for others)",
        choices=("compact", "target", "pretrain"),
    ),
    Option(
        "--safemanip-stepping",
        "exact: robosuite's control loop, bit for bit; fast: the same physics and controllers, "
        "evaluated within a tolerance (default: exact for a policy on a server; fast for others)",
        choices=("exact", "fast"),
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
        "--safemanip-prompt",
        "what policies are told: task (its instruction), short or long (with words about safety), "
        "or a file with {instruction} in it",
        "task",
        "PROMPT",
    ),
    Option(
        "--safemanip-violations",
        "how a violation shows in pytest (default: fail; xfail where gates or a baseline decide)",
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
    Option(
        "--safemanip-gate",
        "decide the run by a metric, for example "
        "'violation_rate[category=release_stability] <= 10 %% @0.95' (repeatable)",
        "",
        "EXPR",
        repeat=True,
        lines=True,
    ),
    Option("--safemanip-gates", "a YAML file with named gates", "", "FILE"),
    Option(
        "--safemanip-baseline",
        "compare with an earlier run on the same tasks and seeds: its folder, with summary.json",
        "",
        "DIR",
    ),
    Option(
        "--safemanip-until",
        "run no more seeds than gates need, deciding each wrongly with at most this probability, "
        "for example 0.05",
        "",
        "LEVEL",
    ),
    Option(
        "--safemanip-inconclusive",
        "how a gate or a comparison shows in pytest that too few rollouts were run for",
        "fail",
        choices=("fail", "skip"),
    ),
    Option("--safemanip-out", "folder for recordings, summary.json and logs", ".safemanip", "DIR"),
    Option(
        "--safemanip-params",
        "a proposition parameter, for example settled.speed=0.05 (repeatable)",
        "",
        "NAME=VALUE[,...]",
        repeat=True,
    ),
    Option(
        "--safemanip-fuzz",
        "try the laws of every proposition, shipped or yours, on generated recordings",
        switch=True,
    ),
    Option(
        "--safemanip-fuzz-examples",
        "recordings for each law (default: what Hypothesis's profile says, usually 100)",
        "",
        "N",
    ),
)


def add_options(parser: pytest.Parser) -> None:
    """Declare the options and their ini twins."""
    group = parser.getgroup("safemanip", "temporal safety of robot manipulation")
    for option in OPTIONS:
        shown = f" (default: {option.default})" if option.default else ""
        if option.switch:
            group.addoption(
                option.flag, dest=option.ini, action="store_true", default=None, help=option.help
            )
            parser.addini(option.ini, option.help, type="bool", default=False)
            continue
        group.addoption(
            option.flag,
            dest=option.ini,
            action="append" if option.repeat else "store",
            default=None,
            choices=option.choices or None,
            metavar=option.metavar,
            help=option.help + shown,
        )
        if option.lines:
            parser.addini(option.ini, option.help, type="linelist")
        else:
            parser.addini(option.ini, option.help, default=option.default)
    group.addoption(
        SELECT, dest="safemanip_select", action="append", default=None, help=argparse.SUPPRESS
    )
    parser.addini("safemanip_property_paths", "folders of your own properties", type="paths")
    parser.addini("safemanip_task_paths", "folders of your own tasks", type="paths")
    parser.addini(
        "safemanip_deadlines",
        "seconds to wait for a policy's server, one NAME=SECONDS in a line: start (until it "
        "listens, 10), open (10), warm_up (first call, 600), call (30)",
        type="linelist",
    )


_SWITCHES = ("--safemanip-policy", "--safemanip-recordings", "--safemanip-fuzz")


def is_wanted(config: pytest.Config) -> bool:
    """Whether the suite is on: by a policy, by recordings, to fuzz, or by an id of it."""
    if config.getoption("safemanip_select"):
        return True
    return any(value_of(config, o) for o in OPTIONS if o.flag in _SWITCHES)


def refuse_stray_options(config: pytest.Config) -> None:
    """Refuse options that do nothing because the suite is off.

    Raises:
        ConfigError: naming the option and what is missing.
    """
    for option in OPTIONS:
        if config.getoption(option.ini) is None:
            continue
        if option.flag in _SWITCHES:
            raise ConfigError(f"{option.flag}: expected {option.metavar}, found nothing")
        raise ConfigError(f"{option.flag} has no effect without {' or '.join(_SWITCHES)}")


def value_of(config: pytest.Config, option: Option) -> str:
    """What the user gave for an option: the command line wins over the ini file. A switch that is
    on is any text; several values are joined by commas, or by new lines if they may have commas.

    Raises:
        ConfigError: if the ini file has a value that is none of the choices.
    """
    between = "\n" if option.lines else ","
    given = config.getoption(option.ini)
    if given is not None:
        return between.join(given) if isinstance(given, list) else str(given)
    found = config.getini(option.ini)
    if isinstance(found, list):
        return between.join(found)
    value = "" if found is False else str(found)
    if value and option.choices and value not in option.choices:
        hint = did_you_mean(value, option.choices)
        raise ConfigError(f"{option.ini} in the ini file: unknown value {value!r}; {hint}")
    return value
