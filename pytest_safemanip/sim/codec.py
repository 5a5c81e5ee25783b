"""Requests, starts, steps and observations as messages."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.backend import Request, Start
from pytest_safemanip.sim.staging import from_plain, to_plain
from pytest_safemanip.sim.wire import Message
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import ARRAYS, Contacts, Step

_CONTACTS = tuple(f.name for f in dataclasses.fields(Contacts))


def encode_request(request: Request) -> dict[str, Any]:
    """A request as plain values."""
    groups = {role: list(names) for role, names in request.object_groups.items()}
    changes = to_plain(request.changes)
    return {**dataclasses.asdict(request), "object_groups": groups, "changes": changes}


def decode_request(values: Mapping[str, Any]) -> Request:
    """The inverse of :func:`encode_request`, of values that anybody may have written.

    Raises:
        ConfigError: if they are no request.
    """
    try:
        request = Request(**{**values, "changes": from_plain(values.get("changes", ()))})
    except TypeError as error:
        raise ConfigError(f"what was asked of the simulator: {error}") from error
    texts = (request.task, request.scenes, request.kitchen, request.stepping, request.style)
    groups = request.object_groups
    if not all(isinstance(text, str) for text in texts) or type(request.seed) is not int:
        raise ConfigError(f"what was asked of the simulator: {values!r}")
    if not isinstance(groups, Mapping) or not all(map(_names, groups.values())):
        raise ConfigError(f"what was asked of the simulator: objects drawn from {groups!r}")
    return request


def _names(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(name, str) for name in value)


def encode_step(step: Step) -> Message:
    """A step's arrays and contacts as a message."""
    arrays = {name: getattr(step, name) for name in ARRAYS}
    arrays |= {f"contacts.{name}": getattr(step.contacts, name) for name in _CONTACTS}
    return Message({"success": bool(step.success)}, arrays)


def decode_step(message: Message) -> Step:
    """The inverse of :func:`encode_step`."""
    contacts = Contacts(**{name: message.arrays[f"contacts.{name}"] for name in _CONTACTS})
    arrays = {name: message.arrays[name] for name in ARRAYS}
    return Step(**arrays, success=bool(message.values["success"]), contacts=contacts)


def encode_start(start: Start) -> Message:
    """A start: its step's message with the static part beside it."""
    step = encode_step(start.step)
    values = {
        **step.values,
        "scene": start.scene.to_json(),
        "instruction": start.instruction,
        "horizon": start.horizon,
        "fingerprint": start.fingerprint,
        "patches": list(start.patches),
    }
    return Message(values, step.arrays)


def decode_start(message: Message) -> Start:
    """The inverse of :func:`encode_start`."""
    values = message.values
    return Start(
        scene=Scene.from_json(values["scene"]),
        step=decode_step(message),
        instruction=str(values["instruction"]),
        horizon=int(values["horizon"]),
        fingerprint=str(values["fingerprint"]),
        patches=tuple(map(str, values["patches"])),
    )


def encode_observation(observation: Mapping[str, NDArray[Any]]) -> Message:
    """An observation's arrays as a message."""
    return Message({}, observation)


def decode_observation(message: Message) -> dict[str, NDArray[Any]]:
    """The inverse of :func:`encode_observation`.

    The arrays may be written to: what policies hand them to complains about others.
    """
    return {name: array.copy() for name, array in message.arrays.items()}
