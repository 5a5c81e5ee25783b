"""Finds a policy by its name on the command line."""

from __future__ import annotations

import hashlib
import importlib
import inspect
import sys
import threading
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, get_args

from pytest_safemanip.errors import (
    ConfigError,
    RolloutError,
    did_you_mean,
    raised_as,
)
from pytest_safemanip.policies.adapter import AdaptedPolicy, ask, is_policy, member
from pytest_safemanip.policies.base import PolicyLike
from pytest_safemanip.policies.remote.endpoint import Deadlines
from pytest_safemanip.policies.remote.presets import LIBRARIES, PRESETS, Preset, parse_servers
from pytest_safemanip.provenance import closure_digest, file_of, module_file
from pytest_safemanip.sim.staging import Staging
from pytest_safemanip.trace.episode import POLICY_NAME

Stepping = Literal["fast", "exact"]

BUILT_IN: Mapping[str, PolicyLike] = MappingProxyType(
    {
        "scripted": "pytest_safemanip.faults.policy:Scripted",
        "random": "pytest_safemanip.policies.simple:Random",
        "hold": "pytest_safemanip.policies.simple:Hold",
        "recording": "pytest_safemanip.policies.replay:Replay",
    }
)
"""The shipped policies, as a hook would give them. ``NAME:TEXT`` calls a class with the text."""

NOWHERE: Mapping[str, str] = MappingProxyType({})
ANYHOW: Mapping[str, int] = MappingProxyType({})
USUAL = Deadlines()
UNCHANGED: Mapping[str, Preset] = MappingProxyType({})


@dataclass(frozen=True)
class PolicySpec:
    """A policy that was asked for.

    Attributes:
        name: as the user gave it; part of node ids.
        make: makes a fresh policy.
        fingerprint: digest of what decides its actions: what it says of itself, and its source
            code. None if nobody can tell, and then its recordings are not used again in a later
            run.
        tasks: the tasks it can do; None for all.
        scenes: what it is run in if nothing else is asked for; empty for the backend's first.
        stepping: how it is simulated if nothing else is asked for: ``exact`` for a policy that was
            trained on the simulator's own control loop, or that repeats what was recorded.
        needs: what it reads of an observation of the backend.
        official: whether it was trained on pictures of the benchmark's own assets, and demands
            them.
        server: where it is served, by a task and its sets; None if it runs here.
        by_task: likewise digest of what decides its actions in a task, by the task and its sets;
            None if that is the same in all.
        claim: what its user says is served; empty if it runs here.
        shared: whether one object serves all rollouts, and so one at a time.
        slots: requests that its servers are sent at a time, all of them together.
        ready: called with a task and its sets before an episode of it is set up: what cannot be
            used need not be waited for.
        staging: what it wants otherwise in the episodes of a task.
        reads_permissions: whether it is told what a task lets it touch.
        close: frees what it holds.
    """

    name: str
    make: Callable[[], AdaptedPolicy]
    fingerprint: str | None
    tasks: tuple[str, ...] | None = None
    official: bool = False
    scenes: str = ""
    stepping: Stepping = "fast"
    needs: tuple[str, ...] = ()
    server: Callable[[str, tuple[str, ...]], str] | None = None
    by_task: Callable[[str, tuple[str, ...]], str | None] | None = None
    claim: Mapping[str, Any] = field(default_factory=dict)
    shared: bool = False
    slots: int = 0
    ready: Callable[[str, tuple[str, ...]], object] = lambda task, sets: None
    staging: Callable[[str], Staging] = lambda task: Staging()
    reads_permissions: bool = False
    close: Callable[[], None] = lambda: None

    def fingerprint_in(self, task: str, sets: tuple[str, ...] = ()) -> str | None:
        """Digest of what decides its actions in a task, like ``fingerprint``.

        Raises:
            RolloutError: if the policy fails to say it, or its server has to and is not there.
        """
        return self.by_task(task, sets) if self.by_task else self.fingerprint


def resolve(
    name: str,
    added: Mapping[str, PolicyLike],
    servers: Mapping[str, str] = NOWHERE,
    out: Path = Path(),
    deadlines: Deadlines = USUAL,
    sources: Sequence[Path | None] = (),
    adjusted: Mapping[str, Preset] = UNCHANGED,
    checkpoints: Mapping[str, str] = NOWHERE,
    inflight: Mapping[str, int] = ANYHOW,
) -> PolicySpec:
    """Find a policy.

    Args:
        name: a preset (``pi05``), one that is built in or that a hook provides (``random``),
            alone or with a text (``scripted:FAULT``, ``recording:DIR``), or ``module:attribute``.
        added: policies from the hook ``pytest_safemanip_policies``.
        servers: where presets are served, by name.
        out: folder for what a server answered that cannot be executed, and for locks.
        deadlines: how long to wait for servers.
        sources: the files in which the hook is implemented; None for one that there is not.
        adjusted: presets that the user has changed, by name.
        checkpoints: what the user says that presets' servers have, by name.
        inflight: requests that a preset's servers are sent at a time, each, by name.

    Raises:
        ConfigError: if there is no such policy, it cannot be imported or made, what it says of
            itself cannot be used, or a library is missing.
    """
    if not POLICY_NAME.fullmatch(name):
        raise ConfigError(
            f"policy {name!r}: a name has letters, digits and any of _ . : / @ = + -, at most 200"
        )
    known = {**BUILT_IN, **added}
    if name in added:
        target, files = _found(name, added[name])
        return _local(name, target, (*files, *sources))
    if name in PRESETS:
        preset, claimed = adjusted.get(name, PRESETS[name]), checkpoints.get(name, "")
        at_a_time = inflight.get(name, preset.inflight)
        return _served(preset, servers.get(name, ""), out, deadlines, at_a_time, claimed)
    head, _, text = name.partition(":")
    if head in known and (text or name == head):
        target, files = _found(name, known[head])
        arguments = (text,) if text else ()
        if _takes(target, arguments):
            return _local(name, target, (*files, *(sources if head in added else ())), arguments)
    if text:
        return _local(name, *_found(name, name))
    hint = did_you_mean(name, {*known, "recording:DIR", *PRESETS} - {"recording"})
    raise ConfigError(f"unknown policy {name!r}; {hint} (your own: MODULE:ATTRIBUTE)")


def _served(
    preset: Preset, text: str, out: Path, deadlines: Deadlines, inflight: int, claimed: str
) -> PolicySpec:
    from pytest_safemanip.policies.remote.claims import addresses, described
    from pytest_safemanip.policies.remote.library import need
    from pytest_safemanip.policies.remote.served import RemotePolicyPool, RemoteRollout, server_of
    from pytest_safemanip.policies.remote.tokens import Token

    for library in LIBRARIES[preset.transport]:
        need(library)
    servers = parse_servers(preset, text)
    claim, token = described(preset, servers, claimed), Token.of(preset.name)
    pool = RemotePolicyPool(preset, servers, out, deadlines, inflight, claimed, token)
    return PolicySpec(
        preset.name,
        lambda: AdaptedPolicy(RemoteRollout(pool)),
        None,
        scenes=preset.split,
        stepping="exact",
        needs=preset.robot.needs,
        official=True,
        server=lambda task, sets: addresses(server_of(servers, task, sets)[1]),
        by_task=pool.identity,
        claim=claim,
        slots=inflight * len({endpoint for found in servers.values() for endpoint in found}),
        ready=pool.meet,
        close=pool.close,
    )


def _found(name: str, given: PolicyLike) -> tuple[Any, tuple[Path | None, ...]]:
    """The object that ``MODULE:ATTRIBUTE`` names, with the module's file."""
    if not isinstance(given, str):
        return given, ()
    module, _, attribute = given.partition(":")
    with raised_as(ConfigError, f"policy {name!r}: cannot import {module!r}"):
        target: Any = importlib.import_module(module)
    try:
        for part in attribute.split("."):
            target = getattr(target, part)
    except AttributeError:
        raise ConfigError(f"policy {name!r}: {module!r} has no {attribute!r}") from None
    return target, (module_file(sys.modules[module]),)


def _takes(target: Any, arguments: tuple[str, ...]) -> bool:
    """Whether a policy's class accepts these arguments."""
    if not inspect.isclass(target):
        return not arguments
    try:
        inspect.signature(target).bind(*arguments)
    except (TypeError, ValueError):
        return False
    return True


def _local(
    name: str, target: Any, files: Iterable[Path | None], arguments: tuple[str, ...] = ()
) -> PolicySpec:
    """A policy that runs in this process.

    Args:
        name: as the user gave it.
        target: an object with ``act``, a class, a factory, or a function that is ``act``.
        files: that name it, beside the one that defines it; None for one that there is not.
        arguments: of the class.
    """
    supply = _Supply(name, target, arguments)
    policy = supply.first

    def say(attribute: str) -> Any:
        return _read(name, attribute, lambda: ask(policy.policy, attribute, None))

    own = None if _inherits_fingerprint(policy.policy) else say("fingerprint")
    source = {*files, file_of(target), file_of(policy.policy)}
    in_task = _read(name, "fingerprint_in", lambda: member(policy.policy, "fingerprint_in"))
    _read(name, "staging", lambda: member(policy.policy, "staging"))

    def by_task(task: str, sets: tuple[str, ...]) -> str | None:
        with raised_as(RolloutError, f"the policy failed to say its fingerprint in {task}"):
            return _fingerprint(name, in_task(task), source)

    return PolicySpec(
        name,
        supply.take,
        _fingerprint(name, own, source),
        by_task=by_task if in_task and own is not None else None,
        tasks=_tasks(name, say("tasks")),
        scenes=_scenes(name, say("scenes")),
        stepping=_one_of(name, "stepping", say("stepping"), get_args(Stepping)),
        staging=policy.staging,
        reads_permissions=_flag(name, "reads_permissions", say("reads_permissions")),
        shared=supply.shared,
        close=supply.close,
    )


def _flag(name: str, attribute: str, said: Any) -> bool:
    if said is None or isinstance(said, bool):
        return bool(said)
    raise ConfigError(f"policy {name!r}: its {attribute!r} is {said!r}, expected True or False")


def _read(name: str, attribute: str, read: Callable[[], Any]) -> Any:
    """What reading an attribute of a policy gives.

    Raises:
        ConfigError: if it raises anything, as a property may.
    """
    with raised_as(ConfigError, f"policy {name!r}: its {attribute!r} failed"):
        return read()


class _Supply:
    """Makes a policy for each rollout.

    The first is made at once: it says what the run has to know of the policy, and serves the first
    rollout.

    Raises:
        ConfigError: if it cannot be made.
    """

    def __init__(self, name: str, target: Any, arguments: tuple[str, ...]) -> None:
        self._name, self._target, self._arguments = name, target, arguments
        self.shared: bool = _read(name, "act", lambda: is_policy(target))
        self._changing = threading.Lock()
        self._in_use: dict[int, Any] = {}
        self.first = self._made()
        self._taken = False

    def take(self) -> AdaptedPolicy:
        """A policy for one rollout."""
        with self._changing:
            first, self._taken = not self._taken, True
        return self.first if first else self._made()

    def close(self) -> None:
        """Close what no rollout closes."""
        if self.shared or not self._taken:
            AdaptedPolicy(self.first.policy).close()

    def _made(self) -> AdaptedPolicy:
        made = self._target
        if not self.shared and callable(made):
            with raised_as(ConfigError, f"policy {self._name!r}: cannot be made"):
                made = made(*self._arguments)
        if not _read(self._name, "act", lambda: is_policy(made)):
            raise ConfigError(
                f"policy {self._name!r}: {type(made).__name__} has no 'act(observation)' and "
                "cannot be called with an observation"
            )
        return AdaptedPolicy(made, self.shared, self._lent(made))

    def _lent(self, made: Any) -> Callable[[], object]:
        """Notes that a rollout uses an object; gives what is called when it no longer does."""
        if self.shared:
            return lambda: None
        with self._changing:
            if id(made) in self._in_use:
                raise ConfigError(
                    f"policy {self._name!r}: what makes it gave the object that another rollout "
                    "is using; make one for each rollout, or name the object itself"
                )
            self._in_use[id(made)] = made
        return lambda: self._in_use.pop(id(made), None)


def _inherits_fingerprint(policy: Any) -> bool:
    """Whether its fingerprint is inherited from a class of this package."""
    if "fingerprint" in getattr(policy, "__dict__", {}) or _is_ours(type(policy)):
        return False
    owners = [cls for cls in type(policy).__mro__ if "fingerprint" in vars(cls)]
    return bool(owners) and _is_ours(owners[0])


def _is_ours(cls: type) -> bool:
    return cls.__module__.startswith("pytest_safemanip.")


def _fingerprint(name: str, value: Any, files: Collection[Path | None]) -> str | None:
    """Digest of what a policy says of itself and of its source; None if one is missing."""
    if value is None:
        return None
    if not isinstance(value, str | int):
        raise ConfigError(
            f"policy {name!r}: its 'fingerprint' is of type {type(value).__name__}, expected text "
            "or a number: a digest of the weights, say"
        )
    found = [path for path in files if path is not None]
    source = closure_digest(found) if len(found) == len(files) else None
    if source is None:
        return None
    return hashlib.sha256(f"{value}\0{source}".encode()).hexdigest()[:16]


def _tasks(name: str, value: Any) -> tuple[str, ...] | None:
    if value is None:
        return None
    tasks = tuple(value) if isinstance(value, Iterable) else (value,)
    if isinstance(value, str) or not all(isinstance(t, str) for t in tasks):
        raise ConfigError(f"policy {name!r}: its 'tasks' are {value!r}, expected a list of names")
    return tasks


def _scenes(name: str, value: Any) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    raise ConfigError(f"policy {name!r}: its 'scenes' are {value!r}, expected text")


def _one_of(name: str, attribute: str, value: Any, known: tuple[str, ...]) -> Any:
    """An attribute's value if it is one of some choices; the first of them if it is None."""
    if value is None:
        return known[0]
    if value not in known:
        hint = did_you_mean(str(value), known)
        raise ConfigError(f"policy {name!r}: unknown {attribute!r} {value!r}; {hint}")
    return value
