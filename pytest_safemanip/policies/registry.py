"""From the name of a policy on the command line to the policy."""

from __future__ import annotations

import hashlib
import importlib
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.policies.base import EpisodeInfo, Observation, Policy
from pytest_safemanip.policies.simple import Hold, Random
from pytest_safemanip.sim.provenance import source_digest
from pytest_safemanip.trace.recording import POLICY_NAME

Factory = Callable[[], Policy]

BUILT_IN = ("scripted", "random", "hold")


@dataclass(frozen=True)
class PolicySpec:
    """A policy that was asked for.

    Attributes:
        name: as the user gave it; part of node ids.
        make: makes a fresh policy.
        fingerprint: digest of what decides its actions; None if nobody can tell, and then its
            recordings are not used again in a later run.
        tasks: the tasks it can do; None for all.
    """

    name: str
    make: Factory
    fingerprint: str | None
    tasks: tuple[str, ...] | None = None


def resolve(name: str, added: Mapping[str, Factory]) -> PolicySpec:
    """Find a policy.

    Args:
        name: ``scripted``, ``scripted:FAULT``, ``random``, ``hold``, ``module:attribute``, or one
            that a hook provides.
        added: policies from the hook ``pytest_safemanip_policies``.

    Raises:
        ConfigError: if there is no such policy, or it cannot be imported.
    """
    if not POLICY_NAME.fullmatch(name):
        raise ConfigError(
            f"policy {name!r}: a name has letters, digits and any of _ . : / @ = + -, at most 200"
        )
    if name in added:
        return _own(name, added[name])
    head, _, tail = name.partition(":")
    if head == "scripted":
        return _scripted(name, tail)
    if name == "random":
        return PolicySpec(name, Random, source_digest("policies/simple.py"))
    if name == "hold":
        return PolicySpec(name, Hold, source_digest("policies/simple.py"))
    if tail:
        return _imported(name, head, tail)
    hint = did_you_mean(name, {*BUILT_IN, *added})
    raise ConfigError(f"unknown policy {name!r}; {hint} (your own: MODULE:ATTRIBUTE)")


def _scripted(name: str, fault: str) -> PolicySpec:
    from pytest_safemanip.policies.scripted.policy import Scripted

    tasks = Scripted(fault).tasks
    digest = source_digest("policies/scripted")
    return PolicySpec(name, lambda: Scripted(fault), digest, tasks)


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
