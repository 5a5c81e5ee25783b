"""What a GR00T server says that its model reads and predicts, and what that means for requests."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pytest_safemanip.errors import printable
from pytest_safemanip.policies.remote.naming import ALIASES, IMAGES, NO_CAMERA, PARTS, Naming
from pytest_safemanip.policies.remote.presets import Preset


@dataclass(frozen=True)
class Modalities:
    """A model's modalities, as far as its server declares them.

    Attributes:
        keys: names by modality.
        horizon: steps of a prediction; None if unknown.
        frames: pictures of each camera that the model reads at a time; None if unknown.
        later: whether the server is N1.6 or later.
    """

    keys: Mapping[str, list[str]]
    horizon: int | None
    frames: int | None
    later: bool


def modalities(answer: Any) -> Modalities:
    """Read a modality config in any of its forms; what is not understood is left out."""
    found: dict[str, Mapping[str, Any]] = {}
    later = False
    for name, config in answer.items() if isinstance(answer, dict) else ():
        inner = config
        if isinstance(inner, dict) and "as_json" in inner:
            later = later or isinstance(inner["as_json"], dict)
            inner = _json(inner["as_json"])
        if isinstance(inner, dict):
            found[str(name)] = inner.get("__dict__", inner)
    keys = {name: _texts(config.get("modality_keys")) for name, config in found.items()}
    return Modalities(keys, _length(found, "action"), _length(found, "video"), later)


def fitted(preset: Preset, config: Modalities) -> Naming:
    """The names that a model has for what RoboCasa's observation has.

    Args:
        preset: how it is served, with the names that are tried first.
        config: what its server declares; what it does not declare is taken to be as usual.

    Raises:
        ValueError: if it is a model of something else; says of what, and the setting that helps.
    """
    if config.horizon is not None and config.horizon < preset.steps:
        raise ValueError(
            f"its model predicts {config.horizon} steps, and {preset.steps} are executed before "
            f"the next call: {preset.name}.open_loop_steps = {config.horizon} in safemanip_presets "
            "executes as many"
        )
    if config.frames is not None and config.frames > 1:
        raise ValueError(
            f"its model looks at {config.frames} pictures of each camera at a time, and it is "
            "shown the newest one only"
        )
    naming, usual = preset.naming, preset.naming.keys
    for modality, prefix, roles in (
        ("video", "video.", tuple(IMAGES)),
        ("state", "state.", tuple(PARTS)),
        ("language", "", ("instruction",)),
    ):
        declared = [key.removeprefix(prefix) for key in config.keys.get(modality, ())]
        if not declared:
            continue
        keys = {role: _known(usual[role], role, prefix, declared) for role in roles}
        read = {role: key for role, key in keys.items() if key is not None}
        others = set(declared) - {key.removeprefix(prefix) for key in read.values()}
        if others:
            raise ValueError(
                f"its model reads {', '.join(sorted(others))}, the presets' models "
                f"{', '.join(usual[role] for role in roles)}: another data config is being served, "
                f"or {preset.name}.key.{roles[0]} = {prefix}{min(others)} in safemanip_presets "
                "says what it is"
            )
        naming = naming.with_keys(read)
        unread = {role: NO_CAMERA for role in roles if role not in read and role in IMAGES}
        naming = replace(naming, cameras={**naming.cameras, **unread})
    return naming


def _known(usual: str, role: str, prefix: str, declared: list[str]) -> str | None:
    """The name of a role among those that are declared; None if it is not read."""
    tried = (usual, *ALIASES.get(role, ()))
    return next((key for key in tried if key.removeprefix(prefix) in declared), None)


def _length(found: Mapping[str, Mapping[str, Any]], modality: str) -> int | None:
    deltas = found.get(modality, {}).get("delta_indices")
    return int(np.size(deltas)) if isinstance(deltas, list | np.ndarray) else None


def _json(value: Any) -> Any:
    try:
        return json.loads(value) if isinstance(value, str) else value
    except (ValueError, RecursionError):
        return None


def _texts(value: Any) -> list[str]:
    return [printable(str(item), 100) for item in value] if isinstance(value, list) else []
