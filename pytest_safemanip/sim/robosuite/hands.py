"""robosuite's grippers: which of their bodies are fingers, and how far their joints close.

Names are those of the gripper's own model; in an environment they have a prefix. robosuite's
``important_geoms`` tell two sides only, where a hand may have three fingers, and say nothing of how
far it opens.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class HandModel:
    """A gripper of robosuite.

    Attributes:
        palm: the body that all of it hangs on.
        fingers: by finger, the bodies that it consists of; none for a tool that holds nothing.
        joints: joint to its positions when the hand is closed and when it is open, rad or m.
        qpos: number of its joints, which robosuite observes.
    """

    palm: str
    fingers: Mapping[str, tuple[str, ...]]
    joints: Mapping[str, tuple[float, float]]
    qpos: int


def _robotiq(palm: str, left: float, right: float) -> HandModel:
    def finger(side: str) -> tuple[str, ...]:
        return f"{side}_outer_knuckle", f"{side}_inner_knuckle"

    joints = {"finger_joint": (left, 0.0), "right_outer_knuckle_joint": (right, 0.0)}
    return HandModel(palm, {"left": finger("left"), "right": finger("right")}, joints, 6)


HANDS: Mapping[str, HandModel] = MappingProxyType(
    {
        "PandaGripper": HandModel(
            "right_gripper",
            {"left": ("leftfinger",), "right": ("rightfinger",)},
            {"finger_joint1": (0.0, 0.04), "finger_joint2": (0.0, -0.04)},
            2,
        ),
        "RethinkGripper": HandModel(
            "gripper_base",
            {"left": ("l_finger",), "right": ("r_finger",)},
            {"l_finger_joint": (-0.0115, 0.020833), "r_finger_joint": (0.0115, -0.020833)},
            2,
        ),
        "Robotiq85Gripper": _robotiq("robotiq_85_adapter_link", 0.8, 0.8),
        "Robotiq140Gripper": _robotiq("right_gripper", 0.7, -0.7),
        "JacoThreeFingerGripper": HandModel(
            "right_gripper",
            {name: (f"{name}_proximal",) for name in ("thumb", "index", "pinky")},
            {f"joint_{name}": (0.0, 1.51) for name in ("thumb", "index", "pinky")},
            6,
        ),
        "XArm7Gripper": HandModel(
            "xarm_gripper_base_link",
            {
                side: (f"{side}_outer_knuckle", f"{side}_inner_knuckle")
                for side in ("left", "right")
            },
            {f"{side}_driver_joint": (0.85, 0.0) for side in ("left", "right")},
            6,
        ),
        "WipingGripper": HandModel("wiping_gripper", {}, {}, 0),
    }
)
