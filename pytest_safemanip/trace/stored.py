"""Arrays of a file that are unpacked lazily: verdicts do not depend on them."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from pytest_safemanip.errors import DamagedRecording
from pytest_safemanip.trace.members import Packed
from pytest_safemanip.trace.recording import check_array
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Floats

LATER = ("eef_twists", "base_pose", "object_twist", "qpos", "qvel")
"""Arrays that no proposition and no metric reads: for policies, replay and rendering."""


@dataclass(frozen=True)
class StoredArray:
    """An array of steps that is unpacked and checked by a call.

    Attributes:
        name: of the field of the steps.
        packed: as it lies in the file.
        scene: the static part of the steps.
        length: number of steps.
    """

    name: str
    packed: Packed
    scene: Scene
    length: int

    def __call__(self) -> Floats:
        """The array (T, ...).

        Raises:
            TraceError: if it is damaged or impossible.
        """
        try:
            array = self.packed.array(np.float32)
        except zlib.error as error:
            raise DamagedRecording(
                f"{self.packed.name}: damaged ({error}); {DamagedRecording.remedy}"
            ) from None
        check_array(self.scene, self.name, array, self.length)
        return array
