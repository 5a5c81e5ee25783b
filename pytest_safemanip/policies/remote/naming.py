"""What a model's request calls what RoboCasa's observation has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from pytest_safemanip.policies.remote import observation as seen
from pytest_safemanip.sim.libero import robot as libero

IMAGES = {"left": seen.LEFT, "wrist": seen.WRIST, "right": seen.RIGHT}
"""The pictures that models look at, with the camera that usually takes each."""
PARTS = {
    "eef_position": seen.EEF_POSITION,
    "eef_rotation": seen.EEF_ROTATION,
    "gripper": seen.GRIPPER,
    "base_position": seen.BASE_POSITION,
    "base_rotation": seen.BASE_ROTATION,
}
"""The parts of the robot's state."""
NO_CAMERA = "none"


@dataclass(frozen=True)
class Naming:
    """Names and sizes in the requests of a model.

    Attributes:
        keys: name in the request of each picture, of the state or of its parts, and of the
            instruction.
        cameras: the camera of each picture, by its name in the observation;
            :data:`NO_CAMERA` for a picture that is left out.
        image_size: side of the square that pictures are fitted into, in pixels; 0 for as they are
            drawn.
    """

    keys: Mapping[str, str]
    cameras: Mapping[str, str] = field(default_factory=lambda: dict(IMAGES))
    image_size: int = 0

    @property
    def pictures(self) -> dict[str, str]:
        """Camera by the name in the request."""
        return {
            self.keys[image]: camera
            for image, camera in self.cameras.items()
            if camera != NO_CAMERA
        }

    def with_keys(self, keys: Mapping[str, str]) -> Naming:
        """With some names changed."""
        return replace(self, keys={**self.keys, **keys})


OPENPI = Naming(
    {
        "left": "observation/image",
        "wrist": "observation/wrist_image",
        "right": "observation/right_image",
        "state": "observation/state",
        "instruction": "prompt",
    },
    image_size=224,
)
"""pi0 ignores the right image, pi0.5 insists on it."""
OPENPI_LIBERO = Naming(
    {name: key for name, key in OPENPI.keys.items() if name != "right"},
    {"left": libero.AGENT_VIEW, "wrist": libero.WRIST},
    image_size=224,
)
"""LIBERO has one camera in front of the robot."""
OPENVLA_OFT = Naming(
    {
        "left": "full_image",
        "wrist": "wrist_image",
        "state": "state",
        "instruction": "instruction",
    },
    OPENPI_LIBERO.cameras,
)
"""The names in its own evaluation; it resizes and crops the pictures itself."""
ROBOCASA = Naming(
    {**IMAGES, **PARTS, "instruction": seen.INSTRUCTION},
    {"left": seen.LEFT, "right": seen.RIGHT, "wrist": seen.WRIST},
)
"""The names of RoboCasa's own gym wrapper, which GR00T N1.5's models know."""
VLA_EVAL = ROBOCASA.with_keys({"instruction": "task_description"})

ALIASES: Mapping[str, tuple[str, ...]] = {
    "left": ("video.res256_image_side_0", "video.left_view"),
    "right": ("video.res256_image_side_1", "video.right_view"),
    "wrist": ("video.res256_image_wrist_0", "video.wrist_view"),
    "instruction": (seen.INSTRUCTION, "annotation.human.action.task_description"),
}
"""Other names that GR00T's later models have for the same things."""
