"""A remote policy with one server or several, for any number of rollouts at a time."""

from __future__ import annotations

import contextlib
import itertools
import threading
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import (
    PolicyConnectionLost,
    PolicyMismatch,
    PolicyServerError,
    PolicyUnreachable,
    RolloutError,
)
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.policies.remote.claims import (
    Servers,
    addresses,
    announced,
    checkpoint_of,
    digest_of,
    name_of,
)
from pytest_safemanip.policies.remote.client import Beginning
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.openpi import OWN
from pytest_safemanip.policies.remote.policy import RemotePolicy
from pytest_safemanip.policies.remote.presets import Preset
from pytest_safemanip.policies.remote.tokens import NO_TOKEN, Token
from pytest_safemanip.policies.slots import PERIOD, Slots

LEFT_ALONE = 60.0
"""Seconds for which a server that could not be reached is passed over, if there are others."""


def server_of(servers: Servers, task: str, sets: tuple[str, ...]) -> tuple[str, Sequence[Endpoint]]:
    """The servers that have the checkpoint for a task, and its task set.

    Args:
        servers: by task set; ``""`` serves all.
        task: its name.
        sets: that it belongs to.

    Raises:
        RolloutError: if none has.
    """
    for name in ("", *sets):
        if name in servers:
            return name, servers[name]
    raise RolloutError(
        f"no server is given for {task}, which is in {', '.join(sets) or 'no task set'}; "
        f"there are servers for {', '.join(servers)}"
    )


@dataclass
class _Site:
    """One server: its connections that no rollout uses, and what is shared with other processes.

    Attributes:
        calls: a slot for each request that it is sent at a time.
        episodes: a slot for each rollout that it serves; the number of them is its load.
        most: rollouts that it can serve at a time; None for any number.
        gone: when it could not be reached, by the monotonic clock.
    """

    calls: Slots
    episodes: Slots
    idle: list[RemotePolicy]
    said: Mapping[str, str]
    most: int | None = None
    gone: float = -LEFT_ALONE


@dataclass(frozen=True)
class Visit:
    """One rollout at one server.

    Attributes:
        endpoint: the server.
        slot: its place among the rollouts there.
        policy: the connection, nobody else's.
        used: whether it was made for an earlier rollout.
    """

    endpoint: Endpoint
    slot: int
    policy: RemotePolicy
    used: bool


class RemotePolicyPool:
    """A policy on servers. Rollouts are begun at the server that has the fewest.

    Args:
        preset: which policy it is.
        servers: where it is served.
        out: folder for replies that cannot be executed, and for what processes share.
        deadlines: how long to wait for what.
        inflight: requests that a server is sent at a time; the preset's if None.
        claimed: what its user says is served; empty if nothing.
        token: an API key, where the servers want one.
    """

    def __init__(
        self,
        preset: Preset,
        servers: Servers,
        out: Path,
        deadlines: Deadlines | None = None,
        inflight: int | None = None,
        claimed: str = "",
        token: Token = NO_TOKEN,
    ) -> None:
        self._token = token
        self._preset, self._servers, self._claimed = preset, dict(servers), claimed
        self._dumps, self._deadlines = out / "refused", deadlines
        self._inflight = preset.inflight if inflight is None else inflight
        every = {endpoint for found in servers.values() for endpoint in found}
        self._sites = {endpoint: _site(endpoint, out / "locks") for endpoint in every}
        self._met: set[Endpoint] = set()
        self._tried: set[Endpoint] = set()
        self._failure: tuple[int, PolicyServerError | None] = 0, None
        self._connecting, self._changing = threading.Lock(), threading.Lock()

    def meet(self, task: str, sets: tuple[str, ...]) -> None:
        """Connect to a task's servers and try each, the first time; all must be there and serve
        the same.

        Raises:
            PolicyServerError: if that is not so.
        """
        _, endpoints = server_of(self._servers, task, sets)
        with self._first_time(endpoints, self._tried):
            self._greet(endpoints)
            for endpoint in endpoints:
                if endpoint not in self._tried:
                    self._try(endpoint, task)

    def identity(self, task: str, sets: tuple[str, ...]) -> str | None:
        """Digest of what a task's checkpoint is claimed to be, or else of what its server says.

        Returns:
            None if nobody says anything: recordings are of no use to a later run.

        Raises:
            PolicyServerError: if the server has to be asked, and cannot be used.
        """
        task_set, endpoints = server_of(self._servers, task, sets)
        if self._claimed:
            claimed = checkpoint_of(self._preset, self._claimed, task_set)
            return digest_of(self._preset, {"claimed": claimed})
        with self._first_time(endpoints, self._met):
            self._greet(endpoints)
        said = self._sites[endpoints[0]].said
        return digest_of(self._preset, said) if said else None

    def begin(self, task: str, sets: tuple[str, ...]) -> Visit:
        """A connection for one rollout, at the server with the fewest; the others take over from
        one that is gone.

        Raises:
            PolicyUnreachable: if none can be reached.
        """
        _, endpoints = server_of(self._servers, task, sets)
        left = list(endpoints)
        while True:
            now = time.monotonic()
            there = [e for e in left if now - self._sites[e].gone >= LEFT_ALONE] or left
            endpoint, slot = self._least_loaded(there)
            try:
                with self._changing:
                    idle = self._sites[endpoint].idle
                    policy = idle.pop() if idle else None
                if policy is not None and policy.is_open:
                    return Visit(endpoint, slot, policy, True)
                policy = self._connected(endpoint, task if len(left) == 1 else None)
                return Visit(endpoint, slot, policy, False)
            except BaseException as error:
                self._sites[endpoint].episodes.give_back(slot)
                self._sites[endpoint].gone = time.monotonic()
                left.remove(endpoint)
                if not isinstance(error, PolicyUnreachable) or not left:
                    raise

    def end(self, visit: Visit) -> None:
        """Take a rollout's connection back. After one has failed, no other is thought sound: with
        the server they all go.
        """
        site = self._sites[visit.endpoint]
        with self._changing:
            sound = visit.policy.is_open
            stale, site.idle = ([], [*site.idle, visit.policy]) if sound else (site.idle, [])
        for policy in stale:
            policy.close()
        site.episodes.give_back(visit.slot)

    def check(self, endpoint: Endpoint, policy: RemotePolicy) -> None:
        """Refuse a server that has come back with another checkpoint: recordings are kept under the
        name of the first.

        Raises:
            PolicyMismatch: if it announces something else than when the run began.
        """
        first, now = self._sites[endpoint].said, announced(policy.metadata)
        if now != first:
            one, two = (name_of(said) or "nothing" for said in (first, now))
            policy.close()
            raise PolicyMismatch(
                f"policy server {endpoint}: it announced {one} when the run began, and now {two}: "
                "start it with the same checkpoint, or run again"
            )

    def facts(self, visit: Visit, task: str, sets: tuple[str, ...]) -> dict[str, str]:
        """What a recording says of its policy's servers: the same at whichever it was run."""
        task_set, endpoints = server_of(self._servers, task, sets)
        claimed = checkpoint_of(self._preset, self._claimed, task_set)
        named = name_of(self._sites[visit.endpoint].said)
        return {
            "endpoint": addresses(endpoints),
            **({"checkpoint": claimed} if claimed else {}),
            **({"announced": named} if named else {}),
        }

    def close(self) -> None:
        """End the connections that no rollout uses."""
        for site in self._sites.values():
            with self._changing:
                idle, site.idle = site.idle, []
            for policy in idle:
                policy.close()

    @contextlib.contextmanager
    def _first_time(
        self, endpoints: Sequence[Endpoint], done: Collection[Endpoint]
    ) -> Iterator[None]:
        """One thread does what the others wait for; a failure is that of all who waited."""
        failures, _ = self._failure
        with contextlib.ExitStack() as stack:
            if not {*endpoints} <= {*done}:
                stack.enter_context(self._connecting)
                count, failure = self._failure
                if count != failures and failure is not None:
                    raise type(failure)(str(failure))
            try:
                yield
            except PolicyServerError as error:
                self._failure = failures + 1, error
                raise

    def _greet(self, endpoints: Sequence[Endpoint]) -> None:
        """Connect to servers, the first time, and compare what they say."""
        for endpoint in endpoints:
            if endpoint not in self._met:
                self._sites[endpoint].idle.append(self._connected(endpoint))
                self._met.add(endpoint)
        first, *others = endpoints
        for other in others:
            said = [self._sites[endpoint].said for endpoint in (first, other)]
            if said[0] != said[1]:
                one, two = (name_of(each) or "does not say what it serves" for each in said)
                raise PolicyMismatch(
                    f"policy {self._preset.name}: its servers do not have the same checkpoint: "
                    f"{first}: {one}; {other}: {two}"
                )

    def _try(self, endpoint: Endpoint, task: str) -> None:
        """Try a server in an episode of its own, before anything is set up."""
        site = self._sites[endpoint]
        _, slot = self._least_loaded([endpoint])
        try:
            with self._changing:
                policy = site.idle.pop() if site.idle else None
            policy = policy or self._connected(endpoint)
            try:
                policy.probe(task)
            except PolicyConnectionLost:
                policy.probe(task)  # it may have broken while another rollout was waited for
            with self._changing:
                site.idle.append(policy)
            self._tried.add(endpoint)
        finally:
            site.episodes.give_back(slot)

    def _connected(self, endpoint: Endpoint, patient_for: str | None = None) -> RemotePolicy:
        """A new connection; one for a task waits for a server that is away for a while."""
        site = self._sites[endpoint]
        policy = RemotePolicy(
            self._preset,
            endpoint,
            self._dumps,
            self._deadlines,
            self._token,
            lambda: site.calls.one(self._inflight),
            met=endpoint in self._tried,
        )
        if patient_for is None:
            policy.open()
        else:
            policy.prepare(patient_for)
        if endpoint not in self._met:
            site.said = announced(policy.metadata)
        self.check(endpoint, policy)
        site.most = _most_episodes(policy.metadata)
        return policy

    def _least_loaded(self, endpoints: Sequence[Endpoint]) -> tuple[Endpoint, int]:
        """The server whose lowest free slot is the lowest, with that slot; waits for one."""
        most = [self._sites[endpoint].most for endpoint in endpoints]
        bound = None if None in most else max(n for n in most if n is not None)
        while True:
            for slot in itertools.count() if bound is None else range(bound):
                for endpoint, limit in zip(endpoints, most, strict=True):
                    free = limit is None or slot < limit
                    if free and self._sites[endpoint].episodes.take(slot):
                        return endpoint, slot
            time.sleep(10 * PERIOD)


class RemoteRollout:
    """A policy on servers as one rollout sees it: it stays with the server where it begins.

    Args:
        pool: the policy.
    """

    def __init__(self, pool: RemotePolicyPool) -> None:
        self._pool = pool
        self._visit: Visit | None = None
        self._facts: dict[str, str] = {}

    def reset(self, episode: EpisodeInfo) -> None:
        """Find a server, and announce the episode to it.

        Raises:
            PolicyServerError: if no server can be reached, or it refuses.
        """
        self.close()
        self._visit = visit = self._pool.begin(episode.task, episode.sets)
        self._facts = self._pool.facts(visit, episode.task, episode.sets)
        beginning = Beginning(episode.task, episode.seed, episode.instruction)
        try:
            visit.policy.reset(beginning)
        except PolicyConnectionLost:
            if not visit.used:
                raise
            visit.policy.reset(beginning)  # it broke while nobody used it: nothing was begun
        self._pool.check(visit.endpoint, visit.policy)

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """The actions up to the next call.

        Raises:
            PolicyServerError: if there is no answer, or it cannot be executed.
        """
        if self._visit is None:
            raise RolloutError("the policy is asked before its first episode")
        return self._visit.policy.act(observation.gym(), observation.index)

    def served_facts(self) -> dict[str, str]:
        """Facts about the policy's servers, and counts of the exchange with the episode's."""
        if self._visit is None:
            return {}
        policy = self._visit.policy
        return {
            **self._facts,
            "protocol": policy.protocol,
            "seeded": "yes" if policy.seeded else "no",
            "calls": str(policy.counts.calls),
            "actions": str(policy.counts.actions),
            "clipped": str(policy.counts.clipped),
        }

    def close(self) -> None:
        """Leave the server."""
        visit, self._visit = self._visit, None
        if visit is not None:
            self._pool.end(visit)


def _site(endpoint: Endpoint, locks: Path) -> _Site:
    return _Site(Slots(locks, f"calls {endpoint}"), Slots(locks, f"episodes {endpoint}"), [], {})


def _most_episodes(metadata: Mapping[str, Any]) -> int | None:
    """Rollouts that a server keeps apart: this package's own has a policy's state once, unless it
    says that there is more of it. Others keep the state of each connection, or none.
    """
    own = metadata.get(OWN)
    if not isinstance(own, Mapping):
        return None
    most = own.get("episodes", 1 if own.get("reset") else None)
    return most if isinstance(most, int) and most > 0 else None
