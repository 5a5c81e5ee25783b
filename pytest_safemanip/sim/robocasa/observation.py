"""Names of the observation of RoboCasa365's own gym wrapper, which camera policies get."""

from __future__ import annotations

LEFT = "video.robot0_agentview_left"
RIGHT = "video.robot0_agentview_right"
WRIST = "video.robot0_eye_in_hand"
CAMERAS = (LEFT, RIGHT, WRIST)
"""Images (256, 256, 3), uint8, RGB, the top row first: the wrapper has turned MuJoCo's over."""

IMAGE_SIZE = 256

INSTRUCTION = "annotation.human.task_description"
"""The key of the instruction; the episode's, not the simulator's."""

EEF_POSITION = "state.end_effector_position_relative"
EEF_ROTATION = "state.end_effector_rotation_relative"
GRIPPER = "state.gripper_qpos"
BASE_POSITION = "state.base_position"
BASE_ROTATION = "state.base_rotation"
STATE = {EEF_POSITION: 3, EEF_ROTATION: 4, GRIPPER: 2, BASE_POSITION: 3, BASE_ROTATION: 4}
"""Length of each part of the state, float32.

Metres and quaternions (x, y, z, w): the end effector's pose in the base frame, the fingers' joint
positions, the base's pose in the world. As in robosuite, the end effector's position is that of the
gripper's site and its rotation that of the hand's body, a quarter turn apart.
"""
