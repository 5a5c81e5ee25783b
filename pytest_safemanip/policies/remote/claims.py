"""Which checkpoint a server is said to have: by its user, or by itself. Neither can be checked."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterable, Mapping
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.remote.endpoint import Endpoint
from pytest_safemanip.policies.remote.openpi import OWN
from pytest_safemanip.policies.remote.presets import Preset
from pytest_safemanip.provenance import source_digest

OFFICIAL = "official"
"""Claims the public checkpoint of a preset."""
ANNOUNCED = ("checkpoint", "fingerprint")
"""Keys of a server's metadata that tell its checkpoint from others; the rest of it describes."""
Servers = Mapping[str, tuple[Endpoint, ...]]
"""Servers by task set; ``""`` serves all."""


def checkpoint_of(preset: Preset, claimed: str, task_set: str) -> str:
    """The checkpoint that a user's claim means.

    Args:
        preset: the policy.
        claimed: the claim; ``official`` is the preset's own, empty claims nothing.
        task_set: whose servers; ``""`` for all.

    Raises:
        ConfigError: if the preset has no official checkpoint.
    """
    if claimed != OFFICIAL:
        return claimed
    if not preset.checkpoints.get(task_set):
        raise ConfigError(
            f"policy {preset.name}@{OFFICIAL}: it has no official checkpoint; name what is served: "
            f"{preset.name}@CHECKPOINT=ADDRESS"
        )
    return preset.checkpoints[task_set]


def announced(metadata: Mapping[str, Any]) -> dict[str, str]:
    """What tells a server's checkpoint from others in its metadata; empty if nothing does.

    ``safemanip serve`` says the policy's fingerprint and a digest of its source, and counts if it
    says both, like a policy that runs here; of any other server :data:`ANNOUNCED` counts.
    """
    own = metadata.get(OWN)
    if isinstance(own, Mapping):
        found = _texts(own, ("policy", "source", "fingerprint"))
        return found if {"source", "fingerprint"} <= found.keys() else {}
    return _texts(metadata, ANNOUNCED)


def name_of(said: Mapping[str, str]) -> str:
    """What a server announced, in few words; empty if nothing."""
    names = (said.get(key, "") for key in ("policy", *ANNOUNCED))
    return " ".join(name for name in names if name)


def digest_of(preset: Preset, said: Mapping[str, str]) -> str:
    """Digest of everything known that decides the actions of a policy on a server.

    Args:
        preset: how it is asked.
        said: of the checkpoint, by its user or its server.
    """
    parts = {
        "said": dict(said),
        "transport": preset.transport,
        "layout": preset.layout,
        "steps": preset.steps,
        "naming": dataclasses.asdict(preset.naming),
        "client": source_digest("policies/remote"),
    }
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]


def addresses(endpoints: Iterable[Endpoint]) -> str:
    """Servers of one checkpoint, as on the command line."""
    return "+".join(map(str, endpoints))


def described(preset: Preset, servers: Servers, claimed: str) -> dict[str, Any]:
    """What its user says of a policy on servers, for header and summary."""
    return {
        "transport": preset.transport,
        "servers": {name or "all": addresses(found) for name, found in servers.items()},
        "claimed_checkpoints": {
            name or "all": checkpoint_of(preset, claimed, name) for name in servers
        },
        "open_loop_steps": preset.steps or "all",
        "official_split": preset.split,
        "keys": dict(preset.naming.keys),
        "cameras": dict(preset.naming.cameras),
        "layout": preset.layout,
        "image_size": preset.naming.image_size or "as drawn",
    }


def _texts(found: Mapping[str, Any], names: Iterable[str]) -> dict[str, str]:
    return {name: str(found[name]) for name in names if found.get(name) not in (None, "")}
