"""Steps in which not everything was observed: logs of robots, without a simulator."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping
from typing import Any

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.steps import Steps

KINDS: Mapping[str, tuple[str, ...]] = {
    "objects": ("object_pose", "object_twist", "particles"),
    "fixtures": ("joint", "box_pose", "switch"),
    "contacts": ("contacts",),
    "hand": ("eef_poses", "eef_twists"),
    "gripper": ("openings",),
    "base": ("base_pose",),
    "actions": ("action", "commands"),
    "success": ("success",),
}
"""What may not have been observed, and the arrays of steps that it is in; there they are empty or
zero."""
_KIND_OF = {name: kind for kind, names in KINDS.items() for name in names}


class ObservedSteps(Steps):
    """Steps that refuse to give what was not observed."""

    _unobserved: frozenset[str] = frozenset()

    @classmethod
    def of(cls, steps: Steps, unobserved: Collection[str]) -> ObservedSteps:
        """These steps.

        Args:
            steps: of the recording.
            unobserved: of :data:`KINDS`.
        """
        arrays = {f.name: getattr(steps, f.name) for f in dataclasses.fields(steps)}
        guarded = cls(**arrays)
        object.__setattr__(guarded, "_unobserved", frozenset(unobserved))
        return guarded

    def __getattribute__(self, name: str) -> Any:
        kind = _KIND_OF.get(name)
        if kind is not None and kind in object.__getattribute__(self, "_unobserved"):
            raise TraceError(f"it needs {name}, and the recording has no {kind}")
        return super().__getattribute__(name)
