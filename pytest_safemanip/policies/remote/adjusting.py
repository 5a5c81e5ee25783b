"""Presets as the user's ini file changes them: models differ in more than their weights."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import get_args

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.policies.remote.naming import NO_CAMERA
from pytest_safemanip.policies.remote.presets import PRESETS, Layout, Preset

INI = "safemanip_presets"
MAX_STEPS = 1000
"""Sanity bound on the actions between two calls: 50 s."""
MIN_SIZE, MAX_SIZE = 16, 2048
"""Sanity bounds on the side of an image, in pixels."""

Change = Callable[[Preset, str], Preset]
"""A preset with a setting changed; raises ValueError, saying what was expected."""


def adjusted_presets(lines: Sequence[str]) -> dict[str, Preset]:
    """The presets that are changed, by name.

    Args:
        lines: ``pi05.open_loop_steps = 8`` each; see :func:`changes_of` for what there is.

    Raises:
        ConfigError: if there is no such preset or setting, or its value cannot be.
    """
    found: dict[str, Preset] = {}
    given: set[str] = set()
    for line in lines:
        where, equals, value = (part.strip() for part in line.partition("="))
        name, dot, setting = where.partition(".")
        if not (equals and dot and value):
            raise ConfigError(f"{INI}: expected PRESET.SETTING = VALUE, found {line!r}")
        if name not in PRESETS:
            hint = did_you_mean(name, PRESETS)
            raise ConfigError(f"{INI}: unknown preset {name!r}; {hint}")
        preset = found.get(name, PRESETS[name])
        known = changes_of(preset)
        if setting not in known:
            hint = did_you_mean(setting, known)
            raise ConfigError(f"{INI}: {name} has no setting {setting!r}; {hint}")
        if where in given:
            raise ConfigError(f"{INI}: {where} is given twice")
        given.add(where)
        try:
            found[name] = known[setting](preset, value)
        except ValueError as error:
            raise ConfigError(f"{INI}: {where}: expected {error}, found {value!r}") from None
    return found


def changes_of(preset: Preset) -> Mapping[str, Change]:
    """What can be set of a preset, by name."""
    known: dict[str, Change] = {"open_loop_steps": _steps, "image_size": _size}
    known.update({f"camera.{image}": _camera(image) for image in preset.naming.cameras})
    known.update({f"key.{role}": _key(role) for role in preset.naming.keys})
    if preset.transport == "groot":
        known["layout"] = _layout
    return known


def _steps(preset: Preset, value: str) -> Preset:
    return replace(preset, steps=_number(value, 1, MAX_STEPS))


def _size(preset: Preset, value: str) -> Preset:
    size = _number(value, MIN_SIZE, MAX_SIZE)
    return replace(preset, naming=replace(preset.naming, image_size=size))


def _layout(preset: Preset, value: str) -> Preset:
    for layout in get_args(Layout):
        if value == layout:
            return replace(preset, layout=layout)
    raise ValueError(f"one of {', '.join(get_args(Layout))}")


def _camera(image: str) -> Change:
    def change(preset: Preset, value: str) -> Preset:
        names = {camera.partition(".")[2]: camera for camera in preset.robot.cameras}
        names |= {camera: camera for camera in (*preset.robot.cameras, NO_CAMERA)}
        name = names.get(value)
        if name is None:
            known = (*(camera.partition(".")[2] for camera in preset.robot.cameras), NO_CAMERA)
            raise ValueError(f"a camera; {did_you_mean(value, known)}")
        cameras = {**preset.naming.cameras, image: name}
        return replace(preset, naming=replace(preset.naming, cameras=cameras))

    return change


def _key(role: str) -> Change:
    def change(preset: Preset, value: str) -> Preset:
        taken = [other for other, key in preset.naming.keys.items() if key == value]
        if taken and taken != [role]:
            raise ValueError(f"a key of its own (that of {taken[0]!r} is the same)")
        return replace(preset, naming=preset.naming.with_keys({role: value}))

    return change


def _number(text: str, least: int, most: int) -> int:
    if not text.isdecimal() or not least <= int(text) <= most:
        raise ValueError(f"a number from {least} to {most}")
    return int(text)
