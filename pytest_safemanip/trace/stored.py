"""Steps of a file, of which that is unpacked later which verdicts do not depend on."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.members import Packed
from pytest_safemanip.trace.recording import check_array
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Steps

LATER = ("eef_twist", "base_pose", "qpos", "qvel")
"""What no proposition and no metric reads: for policies, replay and rendering."""


class StoredSteps(Steps):
    """Steps whose arrays :data:`LATER` are unpacked and checked when they are asked for.

    Raises:
        TraceError: from the attribute of such an array, if it is damaged or impossible.
    """

    @classmethod
    def of(cls, scene: Scene, ready: Mapping[str, Any], later: Mapping[str, Packed]) -> StoredSteps:
        """Steps of which some arrays are at hand.

        Args:
            scene: their static part.
            ready: fields by name.
            later: the other fields.
        """
        steps = object.__new__(cls)
        vars(steps).update(ready, _scene=scene, _later=dict(later))
        return steps

    def __getattr__(self, name: str) -> Any:
        packed: Packed | None = vars(self).get("_later", {}).get(name)
        if packed is None:
            raise AttributeError(name)
        try:
            array = packed.array(np.float32)
        except zlib.error as error:
            raise TraceError(f"{packed.name}: damaged ({error})") from error
        check_array(vars(self)["_scene"], name, array, len(self))
        vars(self)[name] = array
        return array
