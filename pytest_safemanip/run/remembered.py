"""What a run remembers of its rollouts, so that none is run, read or missed twice."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Generic, TypeVar

from pytest_safemanip.errors import (
    ConfigError,
    PolicyMismatch,
    PolicyUnreachable,
    SafemanipError,
    met_again,
)
from pytest_safemanip.metrics.records import RolloutKey

T = TypeVar("T")
KEPT = 2
"""Rollouts kept in memory: neighbouring cases share one, and work stealing can split it."""


class RecentRollouts(Generic[T]):
    """What the newest rollouts gave, in memory.

    Args:
        kept: how many.
    """

    def __init__(self, kept: int = KEPT) -> None:
        self._kept = kept
        self._rollouts: dict[RolloutKey, T] = {}

    def get(self, key: RolloutKey, make: Callable[[], T]) -> T:
        """That of a rollout, made if it is not there."""
        if key not in self._rollouts:
            self._rollouts[key] = make()
            if len(self._rollouts) > self._kept:
                del self._rollouts[next(iter(self._rollouts))]
        return self._rollouts[key]


class RepeatedFailures:
    """Failures that other cases would meet again, so that nothing is tried twice.

    A :class:`ConfigError` is met by all rollouts, a server that is unreachable or has another model
    by those of its policies, any other error by the cases of one rollout.
    """

    def __init__(self) -> None:
        self._unusable: ConfigError | None = None
        self._unreachable: dict[str, SafemanipError] = {}
        self._rollouts: dict[RolloutKey, SafemanipError] = {}

    def add(self, error: SafemanipError, rollout: RolloutKey, server: str) -> None:
        """Remember a failure.

        Args:
            error: the failure.
            rollout: whose it was.
            server: of its policy; empty if it runs here.
        """
        if isinstance(error, ConfigError):
            self._unusable = error
        elif isinstance(error, PolicyUnreachable | PolicyMismatch):
            self._unreachable[server] = error
        else:
            self._rollouts[rollout] = error

    def check(self, rollout: RolloutKey, server: str) -> None:
        """Raise what a rollout would meet again; its traceback was shown the first time.

        Raises:
            ConfigError: if no rollout can be run.
            RolloutError: if this one cannot.
        """
        if self._unusable is not None:
            raise ConfigError(str(self._unusable))
        if server in self._unreachable:
            failure = self._unreachable[server]
            raise met_again(failure, str(failure).splitlines()[0])
        if rollout in self._rollouts:
            raise met_again(self._rollouts[rollout], str(self._rollouts[rollout]))

    def has(self, rollout: RolloutKey, server: str) -> bool:
        """Whether :meth:`check` raises anything."""
        return bool(self._unusable or server in self._unreachable or rollout in self._rollouts)

    def are_unreachable(self, servers: Collection[str]) -> bool:
        """Whether no policy can be asked, given the servers of all of them."""
        return {*servers} <= set(self._unreachable)
