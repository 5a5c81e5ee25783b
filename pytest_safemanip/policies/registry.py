"""From the name of a policy on the command line to the policy."""

from __future__ import annotations

import hashlib
import importlib
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.policies.base import EpisodeInfo, Observation, Policy
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.presets import LIBRARIES, PRESETS, Preset, parse_servers
from pytest_safemanip.policies.replay import Replay
from pytest_safemanip.policies.simple import Hold, Random
from pytest_safemanip.sim.provenance import source_digest
from pytest_safemanip.sim.staging import Staging
from pytest_safemanip.trace.episode import POLICY_NAME

Factory = Callable[[], Policy]

BUILT_IN = ("scripted", "random", "hold")


NOWHERE: Mapping[str, str] = MappingProxyType({})
USUAL = Deadlines()


@dataclass(frozen=True)
class PolicySpec:
    """A policy that was asked for.

    Attributes:
        name: as the user gave it; part of node ids.
        make: makes a fresh policy.
        fingerprint: digest of what decides its actions; None if nobody can tell, and then its
            recordings are not used again in a later run.
        tasks: the tasks it can do; None for all.
        scenes: what it is run in if nothing else is asked for.
        stepping: how it is simulated if nothing else is asked for: ``exact`` for a policy that was
            trained on the simulator's own control loop, or that repeats what was recorded.
        server: where it is served, by a task and its sets; None if it runs here.
        claim: what its user says is served; empty if it runs here.
        shared: whether its server may be asked by several processes at a time.
        ready: called with a task and its sets before an episode of it is set up: what cannot be
            used need not be waited for.
        staging: what it wants otherwise in the episodes of a task.
        close: frees what it holds.
    """

    name: str
    make: Factory
    fingerprint: str | None
    tasks: tuple[str, ...] | None = None
    scenes: str = "compact"
    stepping: Literal["exact", "fast"] = "fast"
    server: Callable[[str, tuple[str, ...]], Endpoint] | None = None
    claim: Mapping[str, Any] = field(default_factory=dict)
    shared: bool = False
    ready: Callable[[str, tuple[str, ...]], object] = lambda task, sets: None
    staging: Callable[[str], Staging] = lambda task: Staging()
    close: Callable[[], None] = lambda: None


def resolve(
    name: str,
    added: Mapping[str, Factory],
    servers: Mapping[str, str] = NOWHERE,
    out: Path = Path(),
    deadlines: Deadlines = USUAL,
) -> PolicySpec:
    """Find a policy.

    Args:
        name: a preset (``pi05``), ``scripted``, ``scripted:FAULT``, ``random``, ``hold``,
            ``recording:DIR``, ``module:attribute``, or one that a hook provides.
        added: policies from the hook ``pytest_safemanip_policies``.
        servers: where presets are served, by name.
        out: folder for what a server answered that cannot be executed.
        deadlines: how long to wait for servers.

    Raises:
        ConfigError: if there is no such policy, it cannot be imported, or a library is missing.
    """
    if not POLICY_NAME.fullmatch(name):
        raise ConfigError(
            f"policy {name!r}: a name has letters, digits and any of _ . : / @ = + -, at most 200"
        )
    if name in added:
        return _own(name, added[name])
    if name in PRESETS:
        return _served(PRESETS[name], servers.get(name, ""), out / "refused", deadlines)
    head, _, tail = name.partition(":")
    if head == "scripted":
        return _scripted(name, tail)
    if name == "random":
        return PolicySpec(name, Random, source_digest("policies/simple.py"))
    if name == "hold":
        return PolicySpec(name, Hold, source_digest("policies/simple.py"))
    if head == "recording" and tail:
        replay = Replay(Path(tail).expanduser())
        return PolicySpec(name, lambda: replay, None, replay.tasks, stepping=replay.stepping)
    if tail:
        return _imported(name, head, tail)
    hint = did_you_mean(name, {*BUILT_IN, "recording:DIR", *PRESETS, *added})
    raise ConfigError(f"unknown policy {name!r}; {hint} (your own: MODULE:ATTRIBUTE)")


def _served(preset: Preset, text: str, dumps: Path, deadlines: Deadlines) -> PolicySpec:
    from pytest_safemanip.policies.remote.library import need
    from pytest_safemanip.policies.remote.served import Served, claim, server_of

    for library in LIBRARIES[preset.transport]:
        need(library)
    servers = parse_servers(preset, text)
    policy = Served(preset, servers, dumps, deadlines)
    return PolicySpec(
        preset.name,
        lambda: policy,
        None,
        scenes=preset.split or "compact",
        stepping="exact",
        server=lambda task, sets: server_of(servers, task, sets),
        claim=claim(preset, servers),
        shared=preset.batches,
        ready=policy.connect,
        close=policy.close,
    )


def _scripted(name: str, fault: str) -> PolicySpec:
    from pytest_safemanip.policies.scripted.policy import Scripted

    script = Scripted(fault)
    digest = source_digest("policies/scripted")
    return PolicySpec(name, lambda: Scripted(fault), digest, script.tasks, staging=script.staging)


def _imported(name: str, module: str, attribute: str) -> PolicySpec:
    try:
        target: Any = importlib.import_module(module)
    except Exception as error:  # the user's module may raise anything
        what = f"{type(error).__name__}: {error}"
        raise ConfigError(f"policy {name!r}: cannot import {module!r} ({what})") from error
    try:
        for part in attribute.split("."):
            target = getattr(target, part)
    except AttributeError:
        raise ConfigError(f"policy {name!r}: {module!r} has no {attribute!r}") from None
    return _own(name, target)


def _own(name: str, target: Any) -> PolicySpec:
    return PolicySpec(name, lambda: _as_policy(name, target), _own_fingerprint(target))


def _as_policy(name: str, target: Any) -> Policy:
    """A policy from what a user gives: an object, a class, a factory or a function.

    An object has ``act`` (or ``infer``), and may have ``reset``. What is called without arguments
    is a factory; any other function is the policy's ``act`` itself.
    """
    if inspect.isclass(target) or (callable(target) and _takes_nothing(target)):
        target = target()
    act = next((getattr(target, n) for n in ("act", "infer") if hasattr(target, n)), None)
    if act is None and callable(target):
        act = target
    if act is None:
        raise ConfigError(f"policy {name!r}: has no 'act(observation)' and cannot be called")
    return _Adapted(act, getattr(target, "reset", None))


class _Adapted:
    """A user's policy behind the interface; ``reset`` may be missing or take nothing."""

    def __init__(self, act: Callable[[Observation], Any], reset: Callable[..., Any] | None) -> None:
        self._act, self._reset = act, reset

    def reset(self, episode: EpisodeInfo) -> None:
        if self._reset is not None:
            arguments: Sequence[Any] = () if _takes_nothing(self._reset) else (episode,)
            self._reset(*arguments)

    def act(self, observation: Observation) -> Any:
        return self._act(observation)


def _takes_nothing(target: Callable[..., Any]) -> bool:
    """Whether it can be called without arguments and does not expect any."""
    try:
        parameters = inspect.signature(target).parameters.values()
    except (TypeError, ValueError):
        return False
    return all(p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD) or p.default is not p.empty
               for p in parameters)  # fmt: skip


def _own_fingerprint(target: Any) -> str | None:
    """What the policy says of itself: an attribute ``fingerprint``, for example of its weights."""
    value = getattr(target, "fingerprint", None)
    if callable(value):
        return None
    return hashlib.sha256(str(value).encode()).hexdigest()[:16] if value is not None else None
