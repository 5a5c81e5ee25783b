"""Robots that models are trained for: what is observed of them, and what their actions mean."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.sim.libero import robot as libero
from pytest_safemanip.sim.robocasa import observation as robocasa

Seen = Mapping[str, Any]
Picture = NDArray[np.uint8]


def unchanged(picture: Picture) -> Picture:
    """The picture as the backend gives it, the top row first."""
    return picture


def mirrored(picture: Picture) -> Picture:
    """A picture with left and right exchanged.

    LIBERO's own are upside down, and its models were trained on them turned by 180 degrees, which
    is the upright picture, mirrored.
    """
    return np.ascontiguousarray(picture[:, ::-1])


def axis_angle(quaternion: NDArray[Any]) -> NDArray[np.float64]:
    """A rotation as its axis times its angle, rad (3,).

    Args:
        quaternion: of unit length, (x, y, z, w). Its sign decides which way round the rotation is,
            from 0 to 2 pi, as in robosuite 1.4's ``quat2axisangle``.
    """
    *vector, real = np.asarray(quaternion, np.float64)
    real = min(max(real, -1.0), 1.0)
    length = np.sqrt(1.0 - real * real)
    if np.isclose(length, 0.0):
        return np.zeros(3)
    turned: NDArray[np.float64] = np.array(vector) * 2.0 * np.arccos(real) / length
    return turned


def _joined(*keys: str) -> Callable[[Seen], NDArray[np.float32]]:
    return lambda seen: np.concatenate([seen[key] for key in keys]).astype(np.float32)


def _libero_state(seen: Seen) -> NDArray[np.float32]:
    """Position (3,), axis times angle (3,) and the finger joints (2,)."""
    turn = axis_angle(seen[libero.EEF_ROTATION])
    return np.concatenate((seen[libero.EEF_POSITION], turn, seen[libero.FINGERS])).astype(
        np.float32
    )


@dataclass(frozen=True)
class Embodiment:
    """What models of one robot see and do.

    Attributes:
        cameras: the images of an observation, by the backend's names.
        image_size: their sides, pixels.
        state: length of its other arrays, by name.
        rotations: those of them that are quaternions, (x, y, z, w).
        instruction: key of the instruction.
        parts: where the parts of an action are in it.
        switches: entries that models give as 0 or 1: the values that the environment wants for
            those below 0.5, and for the others.
        flat_state: the state in one array, as openpi's models want it.
        picture: how a picture is turned for the model.
    """

    cameras: tuple[str, ...]
    image_size: int
    state: Mapping[str, int]
    rotations: tuple[str, ...]
    instruction: str
    parts: Mapping[str, slice]
    flat_state: Callable[[Seen], NDArray[np.float32]]
    switches: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    picture: Callable[[Picture], Picture] = unchanged

    @property
    def action_size(self) -> int:
        """Entries of an action."""
        return max(int(part.stop) for part in self.parts.values())

    @property
    def needs(self) -> tuple[str, ...]:
        """All that is read of an observation."""
        return (*self.cameras, *self.state)


PANDA_OMRON = Embodiment(
    cameras=robocasa.CAMERAS,
    image_size=robocasa.IMAGE_SIZE,
    state=robocasa.STATE,
    rotations=(robocasa.EEF_ROTATION, robocasa.BASE_ROTATION),
    instruction=robocasa.INSTRUCTION,
    parts=MappingProxyType(
        {
            "end_effector_position": slice(0, 3),
            "end_effector_rotation": slice(3, 6),
            "gripper_close": slice(6, 7),
            "base_motion": slice(7, 11),
            "control_mode": slice(11, 12),
        }
    ),
    flat_state=_joined(
        robocasa.EEF_POSITION,
        robocasa.EEF_ROTATION,
        robocasa.BASE_POSITION,
        robocasa.BASE_ROTATION,
        robocasa.GRIPPER,
    ),
    switches={6: (-1.0, 1.0), 11: (-1.0, 1.0)},
)
"""RoboCasa365's robot, its names and its order of an action, which is robosuite's too.

RoboCasa's *datasets* have the base first: a model trained on those columns must be served with its
outputs put into this order, since twelve numbers do not show theirs.
"""
LIBERO_PANDA = Embodiment(
    cameras=libero.CAMERAS,
    image_size=libero.IMAGE_SIZE,
    state=libero.STATE,
    rotations=(libero.EEF_ROTATION,),
    instruction=libero.INSTRUCTION,
    parts=MappingProxyType(
        {
            "end_effector_position": slice(0, 3),
            "end_effector_rotation": slice(3, 6),
            "gripper_close": slice(6, 7),
        }
    ),
    flat_state=_libero_state,
    picture=mirrored,
)
"""LIBERO's robot, as openpi's models were trained for it: 1 closes the gripper, -1 opens it."""
OPENVLA_PANDA = replace(LIBERO_PANDA, switches={6: (1.0, -1.0)})
"""LIBERO's robot, as OpenVLA's models were trained for it: 0 closes the gripper, 1 opens it."""
