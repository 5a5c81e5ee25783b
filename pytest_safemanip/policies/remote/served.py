"""A policy behind one server, or one for each task set, as the rollout loop sees it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.policies.remote.client import Beginning
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.policy import RemotePolicy
from pytest_safemanip.policies.remote.presets import Preset


def server_of(servers: Mapping[str, Endpoint], task: str, sets: tuple[str, ...]) -> Endpoint:
    """Which server has the checkpoint for a task.

    Args:
        servers: by task set; ``""`` serves all.
        task: its name.
        sets: that it belongs to.

    Raises:
        RolloutError: if none has.
    """
    for name in ("", *sets):
        if name in servers:
            return servers[name]
    raise RolloutError(
        f"no server is given for {task}, which is in {', '.join(sets) or 'no task set'}; "
        f"there are servers for {', '.join(servers)}"
    )


class Served:
    """Keeps its connections from one rollout to the next: a model is warmed up once.

    Args:
        preset: which policy it is.
        servers: where it is served, by task set; ``""`` serves all tasks.
        dumps: folder for requests and replies that cannot be executed.
        deadlines: how long to wait for what.
    """

    def __init__(
        self,
        preset: Preset,
        servers: Mapping[str, Endpoint],
        dumps: Path,
        deadlines: Deadlines | None = None,
    ) -> None:
        self._preset, self._servers, self._dumps = preset, dict(servers), dumps
        self._deadlines = deadlines
        self._connected: dict[Endpoint, RemotePolicy] = {}
        self._now: RemotePolicy | None = None

    def connect(self, task: str, sets: tuple[str, ...]) -> RemotePolicy:
        """The connection to a task's server; made now, if there was none.

        Raises:
            PolicyUnreachable: if there is no server of this policy.
        """
        endpoint = server_of(self._servers, task, sets)
        if endpoint not in self._connected:
            policy = RemotePolicy(self._preset, endpoint, self._dumps, self._deadlines)
            policy.open()
            self._connected[endpoint] = policy
        return self._connected[endpoint]

    def reset(self, episode: EpisodeInfo) -> None:
        """Announce the episode to its task's server; connects again if the connection broke.

        Raises:
            PolicyServerError: if the server cannot be reached, or refuses.
        """
        self._now = self.connect(episode.task, episode.sets)
        self._now.reset(Beginning(episode.task, episode.seed, episode.instruction))

    def act(self, observation: Observation) -> NDArray[np.float64]:
        """The actions up to the next call.

        Raises:
            PolicyServerError: if there is no answer, or it cannot be executed.
        """
        if self._now is None:
            raise RolloutError("the policy is asked before its first episode")
        return self._now.act(observation.gym(), observation.index)

    def facts(self) -> dict[str, str]:
        """What is known about the episode's server, and what was exchanged with it."""
        if self._now is None:
            return {}
        counts = self._now.counts
        return {
            "endpoint": str(self._now.endpoint),
            "protocol": self._now.protocol,
            "seeded": "yes" if self._now.seeded else "no",
            "calls": str(counts.calls),
            "actions": str(counts.actions),
            "clipped": str(counts.clipped),
        }

    def close(self) -> None:
        """End the connections."""
        for policy in self._connected.values():
            policy.close()


def claim(preset: Preset, servers: Mapping[str, Endpoint]) -> dict[str, Any]:
    """What a user says is served; nobody can check which checkpoint it is."""
    return {
        "transport": preset.transport,
        "servers": {name or "all": str(endpoint) for name, endpoint in servers.items()},
        "claimed_checkpoints": {
            name or "all": preset.checkpoints.get(name, "") or "any" for name in servers
        },
        "open_loop_steps": preset.steps,
        "official_split": preset.split,
        "instruction_key": preset.instruction_key,
    }
