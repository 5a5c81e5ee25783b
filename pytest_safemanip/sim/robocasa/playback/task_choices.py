"""What a task of RoboCasa's has drawn for itself; its description of an episode lacks some of it.

A task keeps it in attributes (``self.choice``, ``self.rack_level``); its own check decides by them.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.typed import shown

KEY = "safemanip_task"
"""Key in an episode's description."""
_ASSIGNED = re.compile(r"\bself\.(\w+)\s*=[^=]")


def choices(env: Any) -> dict[str, bool | int | float | str]:
    """The plain values that a task's own classes have assigned.

    Args:
        env: after its reset.
    """
    found = {}
    for name in _own_attributes(env):
        value = vars(env).get(name)
        value = value.item() if isinstance(value, np.generic) else value
        if isinstance(value, bool | int | float | str):
            found[name] = value
    return found


def restore(env: Any, stored: object) -> None:
    """Give a task its choices back.

    Args:
        env: after its reset.
        stored: as it was read.

    Raises:
        TraceError: if they are none of this task's.
    """
    if not isinstance(stored, Mapping):
        raise TraceError(f"ep_meta: {KEY} must be a mapping, found {shown(stored)}")
    known = _own_attributes(env) if stored else []
    for name, value in stored.items():
        if name not in known or not isinstance(value, bool | int | float | str):
            raise TraceError(
                f"ep_meta: {KEY}: {shown(name)}: {shown(value)} is no choice of a task"
            )
        setattr(env, name, value)


def _own_attributes(env: Any) -> list[str]:
    """Names that the classes of a task assign, but not those of all kitchens."""
    from robocasa.environments.kitchen.kitchen import Kitchen

    found: dict[str, None] = {}
    for kind in type(env).__mro__:
        if kind is Kitchen:
            break
        found |= dict.fromkeys(_ASSIGNED.findall(inspect.getsource(kind)))
    common = set(_ASSIGNED.findall(inspect.getsource(Kitchen)))
    return [name for name in found if name not in common]
