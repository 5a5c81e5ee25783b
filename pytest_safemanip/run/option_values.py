"""Values of options, from text."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.metrics.early_stopping import check_gate
from pytest_safemanip.metrics.gates import Gates
from pytest_safemanip.policies.remote.endpoint import Deadlines
from pytest_safemanip.policies.remote.presets import PRESETS
from pytest_safemanip.policies.remote.tokens import check_variables

MAX_SEEDS = 100_000
"""Sanity bound on the seeds of one run."""
MAX_JOBS = 1000
"""Sanity bound on what is run, or asked of a server, at a time."""
SEEDS = 2**32
"""How many there are: simulators take 32 bits."""
MAX_EXAMPLES = 1_000_000
"""Sanity bound on the examples of one law."""
MAX_SCALE = 1000
"""Sanity bound on the factor of a horizon: a rollout of a day at twenty steps a second."""
MAX_DEADLINE = 604_800
"""Sanity bound on the seconds that a server may take: a week."""


def parse_policies(
    items: Sequence[str], environment: Mapping[str, str]
) -> tuple[tuple[str, ...], dict[str, str], dict[str, str]]:
    """Names of policies, where those on servers are, and what their servers are said to have.

    Written ``pi05=ws://host:8000`` and ``pi05@CHECKPOINT=ws://host:8000``. An address that is not
    given may be in the environment: ``SAFEMANIP_GROOT_PT`` for ``groot-pt``.

    Returns:
        Names; addresses by name; checkpoints by name.

    Raises:
        ConfigError: if an address is given for what is not on a server, or two for one policy, or
            the environment has a token for what is none.
    """
    check_variables(PRESETS, environment)
    servers = {
        name: environment[variable]
        for name in PRESETS
        if environment.get(variable := f"SAFEMANIP_{name.upper().replace('-', '_')}")
    }
    given: dict[str, str] = {}
    checkpoints: dict[str, str] = {}
    for item in items:
        name, equals, address = item.partition("=")
        preset, at, checkpoint = name.partition("@")
        if at and preset in PRESETS:
            name = preset
            if not checkpoint or checkpoints.setdefault(name, checkpoint) != checkpoint:
                raise ConfigError(
                    f"--safemanip-policy: {item!r}: expected one {name}@CHECKPOINT=ADDRESS"
                )
        if equals and "(" in name:
            fault = name.partition("(")[0]
            raise ConfigError(
                f"--safemanip-policy: {item!r}: a fault's number follows an @, as in "
                f"{fault}@{address.rstrip(')') or 'NUMBER'}"
            )
        if equals and name not in PRESETS:
            raise ConfigError(
                f"--safemanip-policy: {item!r} has an address; policies on a server are "
                f"{', '.join(PRESETS)}"
            )
        if given.setdefault(name, address) != address:
            raise ConfigError(
                f"--safemanip-policy: {name!r} has two addresses; servers of the same checkpoint "
                f"are given together: {name}={given[name]}+{address}"
            )
    servers.update((name, address) for name, address in given.items() if address)
    return tuple(given), servers, checkpoints


def parse_checkpoints(lines: Sequence[str]) -> dict[str, str]:
    """What the servers of policies are said to have, from ``pi05 = my-run/75000``.

    Raises:
        ConfigError: if a line is not of that form, or about no policy on a server.
    """
    return dict(_by_preset("safemanip_checkpoint", "CHECKPOINT", lines))


def parse_inflight(lines: Sequence[str]) -> dict[str, int]:
    """How many requests the servers of policies are sent at a time, from ``pi05 = 4``.

    Raises:
        ConfigError: if a line is not of that form, or about no policy on a server.
    """
    found = {}
    for name, text in _by_preset("safemanip_inflight", "NUMBER", lines):
        if not (text.isascii() and text.isdecimal()) or not 0 < int(text) <= MAX_JOBS:
            raise ConfigError(
                f"safemanip_inflight: {name}: expected a number from 1 to {MAX_JOBS}, "
                f"found {text!r}"
            )
        found[name] = int(text)
    return found


def _by_preset(option: str, value: str, lines: Sequence[str]) -> Iterator[tuple[str, str]]:
    for line in lines:
        name, equals, text = (part.strip() for part in line.partition("="))
        if not equals or not text:
            raise ConfigError(f"{option}: expected NAME = {value}, found {line!r}")
        if name not in PRESETS:
            hint = did_you_mean(name, PRESETS)
            raise ConfigError(f"{option}: {name!r} is no policy on a server; {hint}")
        yield name, text


def parse_jobs(text: str) -> int | None:
    """How many rollouts are run side by side; None for ``auto``.

    Raises:
        ConfigError: if it is neither that nor a number from 1 to :data:`MAX_JOBS`.
    """
    if text == "auto":
        return None
    if not (text.isascii() and text.isdecimal()) or not 0 < int(text) <= MAX_JOBS:
        raise ConfigError(
            f"--safemanip-jobs: expected auto or a number from 1 to {MAX_JOBS}, found {text!r}"
        )
    return int(text)


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
        if found[name] > MAX_DEADLINE:
            raise ConfigError(
                f"safemanip_deadlines: expected at most {MAX_DEADLINE} s, found {line!r}"
            )
    try:
        return Deadlines(**found)
    except ConfigError as error:
        raise ConfigError(f"safemanip_deadlines: {error}") from None


def parse_seeds(text: str, option: str = "--safemanip-seeds") -> tuple[int, ...]:
    """Seeds from ``N``, ``A:B`` or ``A,B,C``.

    Args:
        text: the seeds.
        option: what the text was given for.

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
            f"{option}: expected N (that many), A:B (without B) or A,B,C: one seed or more, "
            f"from 0 up, found {text!r}"
        )
    if len(seeds) > MAX_SEEDS or max(seeds) >= SEEDS:
        raise ConfigError(
            f"{option}: expected at most {MAX_SEEDS} seeds below 2**32, found {text!r}"
        )
    return seeds


def told_seeds(seeds: tuple[int, ...]) -> str:
    """Seeds as the option takes them: the inverse of :func:`parse_seeds`."""
    if seeds == tuple(range(seeds[0], seeds[-1] + 1)):
        return f"{seeds[0]}:{seeds[-1] + 1}"
    return ",".join(map(str, seeds))


def parse_params(items: Sequence[str], option: str = "--safemanip-params") -> dict[str, float]:
    """Parameter values from ``NAME=VALUE``.

    Args:
        items: the values.
        option: what they were given for.

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
                f"{option}: expected NAME=VALUE with a number, found {item!r}"
            ) from None
    return found


def parse_early_stop(text: str, gates: Gates) -> float:
    """The error probability of early stopping, checked against the gates.

    Raises:
        ConfigError: if it is no probability, or a gate cannot be decided early.
    """
    try:
        alpha = float(text)
    except ValueError:
        alpha = float("nan")
    if not 0.0 < alpha <= 0.5:
        raise ConfigError(
            f"--safemanip-early-stop: expected a probability above 0, at most 0.5, found {text!r}"
        )
    if not gates.gates:
        raise ConfigError(
            "--safemanip-early-stop stops where gates are decided; give --safemanip-gate"
        )
    for gate in gates.gates:
        try:
            check_gate(gate)
        except ConfigError as error:
            raise ConfigError(f"--safemanip-early-stop: gate {gate.name!r}: {error}") from None
    return alpha


def parse_resources(lines: Sequence[str]) -> dict[str, float]:
    """What a rollout takes of a Ray cluster, from ``num_cpus=2``; one core without any.

    Raises:
        ConfigError: if a line is not of that form.
    """
    found = {"num_cpus": 1.0}
    for line in lines:
        name, _, value = (part.strip() for part in line.partition("="))
        try:
            found[name] = float(value)
        except ValueError:
            found[name] = -1.0
        if not name or not 0.0 <= found[name] < float("inf"):
            raise ConfigError(
                f"safemanip_ray_resources: expected NAME=AMOUNT, as in num_cpus=2, found {line!r}"
            )
    return found


def parse_pythons(lines: Sequence[str], home: Path) -> dict[str, str]:
    """Interpreters of simulators' processes by backend, from ``libero = venv/bin/python``.

    Args:
        lines: of the ini file.
        home: what relative paths are relative to.

    Raises:
        ConfigError: if a line is not of that form.
    """
    found = {}
    for line in lines:
        name, _, value = (part.strip() for part in line.partition("="))
        if not name or not value:
            raise ConfigError(f"safemanip_python: expected BACKEND = PATH, found {line!r}")
        found[name] = str(_under(home, value))
    return found


def parse_backend_paths(lines: Sequence[str], home: Path) -> dict[str, dict[str, Path]]:
    """Folders by backend and by its name for them, from ``libero.assets = FOLDER``.

    Args:
        lines: of the ini file.
        home: what relative paths are relative to.

    Raises:
        ConfigError: if a line is not of that form.
    """
    found: dict[str, dict[str, Path]] = {}
    for line in lines:
        key, _, value = (part.strip() for part in line.partition("="))
        backend, _, name = key.partition(".")
        if not backend or not name or not value:
            raise ConfigError(
                f"safemanip_backend_paths: expected BACKEND.NAME = FOLDER, found {line!r}"
            )
        found.setdefault(backend, {})[name] = _under(home, value)
    return found


def _under(home: Path, text: str) -> Path:
    return home / Path(text).expanduser()


def parse_assets(text: str) -> Literal["auto", "official", "primitive"]:
    """Which assets are used, from a text that is one of the choices."""
    return "official" if text == "official" else "primitive" if text == "primitive" else "auto"


def parse_stop(text: str) -> Literal["success", "horizon", "violation", "warning"]:
    """When a rollout ends, from a text that is one of the choices."""
    match text:
        case "horizon" | "violation" | "warning":
            return text
    return "success"


def parse_names(text: str) -> tuple[str, ...]:
    """Distinct names from a list with commas."""
    return tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))


def parse_scale(flag: str, text: str) -> float:
    """A factor above 0, at most :data:`MAX_SCALE`.

    Raises:
        ConfigError: if it is none; names the option.
    """
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0.0 < value <= MAX_SCALE:
        raise ConfigError(f"{flag}: expected a number above 0, at most {MAX_SCALE}, found {text!r}")
    return value


def parse_count(flag: str, text: str) -> int | None:
    """A number from 1 to :data:`MAX_EXAMPLES`; None for no text.

    Raises:
        ConfigError: if it is none; names the option.
    """
    if not text:
        return None
    if not (text.isascii() and text.isdecimal()) or not 0 < int(text) <= MAX_EXAMPLES:
        raise ConfigError(f"{flag}: expected a number from 1 to {MAX_EXAMPLES}, found {text!r}")
    return int(text)
