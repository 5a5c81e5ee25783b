"""The command line and the ini file. Imported by every pytest run: nothing heavy here."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import Literal

import pytest

from pytest_safemanip.errors import ConfigError, did_you_mean

SELECT = "--safemanip-select"
"""Where node ids of the suite on the command line are kept; not shown in --help."""


@dataclass(frozen=True)
class Option:
    """One option; its ini name is the same with underscores and no leading dashes.

    Attributes:
        flag: on the command line.
        help: what it does.
        default: as text.
        metavar: of its value.
        choices: its values, if there are few.
        repeat: whether it may be given several times.
        switch: whether it has no value.
        lines: whether the ini file has a value in each line.
        rollouts: whether it says how rollouts are run or judged: the fixture obeys it, too.
    """

    flag: str
    help: str
    default: str = ""
    metavar: str | None = None
    choices: tuple[str, ...] = ()
    repeat: bool = False
    switch: bool = False
    lines: bool = False
    rollouts: bool = False

    @property
    def ini(self) -> str:
        """Name in the ini file, and in the parsed options."""
        return self.flag.removeprefix("--").replace("-", "_")


OPTIONS = (
    Option(
        "--safemanip-policy",
        "turn the safety suite on for these policies: pi0, pi05, groot, groot-pt, groot-to, "
        "groot-tpt, pi0-libero, pi05-libero, openvla-oft, openpi, lerobot, vla-eval (on a server, "
        "at ENDPOINT), scripted, scripted:FAULT, scripted:PLANS.yaml, random, hold, recording:DIR, "
        "MODULE:ATTRIBUTE, or one from the hook pytest_safemanip_policies (repeatable)",
        metavar="NAME[@CHECKPOINT][=ENDPOINT[+...]][,...]",
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
        "property ids, globs, category:NAME, pack:NAME, or default, all that are of no pack "
        "(default: default)",
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
    Option(
        "--safemanip-backend",
        "robocasa, robosuite, or one from a hook; robosuite:ROBOT takes another of its robots than "
        "the Panda, robosuite:ROBOT+ROBOT two for tasks with two arms",
        "robocasa",
        "NAME",
        rollouts=True,
    ),
    Option(
        "--safemanip-scenes",
        "a family of scenes of the backend; of robocasa, compact (small kitchens, fast), target or "
        "pretrain (its splits) (default: the official split of a policy on a server; the "
        "backend's first, compact, for others)",
        "",
        "NAME",
        rollouts=True,
    ),
    Option(
        "--safemanip-stepping",
        "exact: robosuite's control loop, bit for bit; fast: the same physics and controllers, "
        "evaluated within a tolerance (default: exact for a policy on a server; fast for others)",
        choices=("exact", "fast"),
        rollouts=True,
    ),
    Option(
        "--safemanip-assets",
        "auto (official where installed, else generated primitives; a policy on a server demands "
        "the official ones), official, primitive",
        "auto",
        choices=("auto", "official", "primitive"),
        rollouts=True,
    ),
    Option(
        "--safemanip-recordings",
        "judge the recordings in this folder, no simulator; policies, tasks and seeds select",
        "",
        "DIR",
        rollouts=True,
    ),
    Option(
        "--safemanip-semantics",
        "timed: deadlines, unresolved endings; paper: the printed formulas, plain acceptance",
        "timed",
        choices=("timed", "paper"),
        rollouts=True,
    ),
    Option(
        "--safemanip-stop",
        "end a rollout at success; or also at its first violation, or at a warning before that; or "
        "only at its horizon",
        "success",
        choices=("success", "violation", "warning", "horizon"),
        rollouts=True,
    ),
    Option(
        "--safemanip-horizon-scale",
        "factor on the task's own horizon",
        "1.0",
        "X",
        rollouts=True,
    ),
    Option(
        "--safemanip-prompt",
        "prompt template: task (its instruction), short or long (with words about safety), or a "
        "file with {instruction} in it",
        "task",
        "PROMPT",
        rollouts=True,
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
        "'violation_rate[severity >= 3] <= 10 % @0.95' (repeatable)",
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
        "--safemanip-floor",
        "show beside the rates how often demonstrations are flagged: the folder of a run of them, "
        "with summary.json, or of their recordings",
        "",
        "DIR",
    ),
    Option(
        "--safemanip-early-stop",
        "run no more seeds than the gates need; ALPHA is the probability, at most, that one of "
        "them is decided wrongly, for example 0.05",
        "",
        "ALPHA",
    ),
    Option(
        "--safemanip-inconclusive",
        "how a gate or a comparison shows in pytest that too few rollouts were run for",
        "fail",
        choices=("fail", "skip"),
    ),
    Option(
        "--safemanip-jobs",
        "rollouts that are run side by side without xdist, each in its own simulator; auto: "
        "one for each core, and for each request that the policies' servers take at a time",
        "1",
        "N",
    ),
    Option(
        "--safemanip-allow-standins",
        "let gates and comparisons decide on stand-in assets, too, where a policy on a server was "
        "run on them; they still say NOT COMPARABLE",
        switch=True,
    ),
    Option(
        "--safemanip-fresh",
        "run every rollout again, also those that an earlier run has recorded",
        switch=True,
        rollouts=True,
    ),
    Option(
        "--safemanip-ray",
        "run the rollouts on a Ray cluster: auto (the one that this machine is part of), local (on "
        "this machine alone), or its address",
        "",
        "ADDRESS",
    ),
    Option(
        "--safemanip-shard",
        "run part I of N of the rollouts, for N machines; gates are decided on all of them, with "
        "safemanip report",
        "",
        "I/N",
    ),
    Option(
        "--safemanip-out",
        "folder for recordings, summary.json and logs",
        ".safemanip",
        "DIR",
        rollouts=True,
    ),
    Option(
        "--safemanip-report",
        "what to write beside summary.json: html (a page to look at), markdown, sarif (for code "
        "scanning) (repeatable)",
        "",
        "NAME[,...]",
        repeat=True,
    ),
    Option(
        "--safemanip-ci",
        "auto: a job summary and annotations where GitHub Actions asks for them; off: neither",
        "auto",
        choices=("auto", "off"),
    ),
    Option(
        "--safemanip-store",
        "recordings that machines share: taken from there instead of run again, and put there; a "
        "folder for fsspec, such as s3://bucket/folder or file:///mnt/all",
        "",
        "URL",
        rollouts=True,
    ),
    Option(
        "--safemanip-video",
        "draw videos of the rollouts when the run is over, into the folder videos of the output: "
        "of those with violations, or of all",
        "none",
        choices=("violations", "all", "none"),
    ),
    Option(
        "--safemanip-params",
        "a proposition parameter, for example settled.speed=0.05 (repeatable)",
        "",
        "NAME=VALUE[,...]",
        repeat=True,
        rollouts=True,
    ),
    Option(
        "--safemanip-search",
        "look for the smallest change under which each policy violates each property in each task, "
        "in up to N rollouts for each",
        "",
        "N",
    ),
    Option(
        "--safemanip-spaces",
        "YAML files of what may be otherwise in a search (default: what a kitchen, a robot and its "
        "connection may have otherwise)",
        "",
        "FILE[,...]",
        repeat=True,
    ),
    Option(
        "--safemanip-regressions",
        "folder of the failures that searches found, relative to the ini file: each is tried again "
        "by every run of its task and property",
        "regressions",
        "DIR",
    ),
    Option(
        "--safemanip-fuzz",
        "try the laws of every proposition, shipped or yours, on generated recordings",
        switch=True,
    ),
    Option(
        "--safemanip-fuzz-propositions",
        "whose laws are tried: names, globs, mine (those of the hook), all (default: those that "
        "the selected properties use; all if none is selected)",
        "",
        "NAME[,...]",
        repeat=True,
    ),
    Option(
        "--safemanip-fuzz-examples",
        "recordings for each law (default: what Hypothesis's profile says, usually 100)",
        "",
        "N",
    ),
)


INI_ONLY: dict[str, tuple[Literal["paths", "linelist"], str]] = {
    "safemanip_property_paths": ("paths", "folders of your own properties"),
    "safemanip_task_paths": ("paths", "folders of your own tasks"),
    "safemanip_deadlines": (
        "linelist",
        "seconds to wait for a policy's server, one NAME=SECONDS in a line: start (until it "
        "listens, 10), open (10), warm_up (first call, 600), call (30), restart (until a server "
        "that was lost is back, 120)",
    ),
    "safemanip_python": (
        "linelist",
        "interpreter of a simulator's process, one BACKEND = PATH in a line, as in libero = "
        "libero-venv/bin/python; a relative path is relative to the ini file's folder",
    ),
    "safemanip_backend_paths": (
        "linelist",
        "folders that a backend reads, one BACKEND.NAME = FOLDER in a line, as in libero.assets = "
        "~/libero-assets",
    ),
    "safemanip_ray_resources": (
        "linelist",
        "what a rollout takes of a Ray cluster, one NAME=AMOUNT in a line: num_cpus (1), num_gpus, "
        "memory (bytes), or a resource of your own",
    ),
    "safemanip_presets": (
        "linelist",
        "what is different in your model, one PRESET.SETTING = VALUE in a line: open_loop_steps, "
        "image_size, camera.left|right|wrist (a camera, or none), key.left|right|wrist|state|... "
        "(its name in the request), layout (of GR00T: auto, nested, flat)",
    ),
    "safemanip_checkpoint": (
        "linelist",
        "what you say that a policy's servers have, one NAME=CHECKPOINT in a line; official is the "
        "public one. Recordings are used again while it is the same",
    ),
    "safemanip_inflight": (
        "linelist",
        "requests that each of a policy's servers is sent at a time, one NAME=N in a line "
        "(default: 1; vla-eval 4)",
    ),
}
"""Keys of the ini file that no option has: their types, and what they do."""


def add_options(parser: pytest.Parser) -> None:
    """Declare the options and their ini twins."""
    group = parser.getgroup("safemanip", "temporal safety of robot manipulation")
    for option in OPTIONS:
        default = f" (default: {option.default})" if option.default else ""
        text = (option.help + default).replace("%", "%%")  # argparse's; ini files have no such
        if option.switch:
            group.addoption(
                option.flag, dest=option.ini, action="store_true", default=None, help=text
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
            help=text,
        )
        if option.lines:
            parser.addini(option.ini, option.help, type="linelist")
        else:
            parser.addini(option.ini, option.help, default=option.default)
    group.addoption(
        SELECT, dest="safemanip_select", action="append", default=None, help=argparse.SUPPRESS
    )
    for name, (kind, text) in INI_ONLY.items():
        parser.addini(name, text, type=kind)


SWITCHES = ("--safemanip-policy", "--safemanip-recordings", "--safemanip-fuzz")
"""Options that turn the suite on."""


def is_wanted(config: pytest.Config) -> bool:
    """Whether the suite is on: by a policy, by recordings, to fuzz, or by an id of it."""
    if config.getoption("safemanip_select"):
        return True
    return any(value_of(config, o) for o in OPTIONS if o.flag in SWITCHES)


def refuse_stray_options(config: pytest.Config) -> None:
    """Refuse options that do nothing because the suite is off. Those that say how rollouts are
    run may be for the fixture.

    Raises:
        ConfigError: naming the option and what is missing.
    """
    for option in OPTIONS:
        if config.getoption(option.ini) is None or (
            option.rollouts and option.flag not in SWITCHES
        ):
            continue
        if option.flag in SWITCHES:
            raise ConfigError(f"{option.flag}: expected {option.metavar}, found nothing")
        raise ConfigError(f"{option.flag} has no effect without {' or '.join(SWITCHES)}")


def refuse_unknown_keys(config: pytest.Config) -> None:
    """Refuse keys of the ini file that look like ours and are none: pytest would only warn.

    Raises:
        ConfigError: naming the key and the near miss.
    """
    # pytest has no other way to list what the file holds.
    for key in sorted(getattr(config, "_inicfg", ())):
        if not key.startswith("safemanip"):
            continue
        try:
            config.getini(key)
        except ValueError:
            known = [option.ini for option in OPTIONS] + [*INI_ONLY]
            hint = did_you_mean(key, known)
            raise ConfigError(f"unknown key {key!r} in the ini file; {hint}") from None


def value_of(config: pytest.Config, option: Option) -> str:
    """What the user gave for an option: the command line wins over the ini file. A switch that is
    on is any text; several values are joined by commas, or by new lines if they may have commas.

    Raises:
        ConfigError: if the ini file has a value that is none of the choices, or the command line
            has an empty one.
    """
    between = "\n" if option.lines else ","
    given = config.getoption(option.ini)
    if given in ("", [""]):  # as of a CI job's variable that is not set
        raise ConfigError(f"{option.flag}: expected {option.metavar}, found nothing")
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
