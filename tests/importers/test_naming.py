"""What is what in models of robosuite's own robots, by their names."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.importers.mjcf import Assets, compile_model
from pytest_safemanip.importers.robosuite.naming import Convention, action_entries, derive_layout
from pytest_safemanip.importers.source import Source
from pytest_safemanip.sim.mujoco.layout import Layout
from pytest_safemanip.sim.robocasa.patches import importing

HANDS = {
    "Panda": (("finger_left", "finger_right"), {"finger_joint1": (0.0, 0.04)}),
    "Sawyer": (("finger_left", "finger_right"), {"l_finger_joint": (-0.0115, 0.020833)}),
    "UR5e": (("finger_left", "finger_right"), {"finger_joint": (0.8, 0.0)}),
    "Jaco": (("finger_thumb", "finger_index", "finger_pinky"), {"joint_thumb": (0.0, 1.51)}),
}
"""Fingers of each robot's hand, and where a joint of it is when the hand is closed and open."""


def layout(task: str, robot: str, folder: Path) -> Layout:
    """Of a model that robosuite makes."""
    with importing.quiet(), importing.robosuite_settings(), importing.stand_ins():
        robosuite = pytest.importorskip("robosuite")
    env = robosuite.make(
        task,
        robots=robot,
        has_renderer=False,
        has_offscreen_renderer=False,
        use_camera_obs=False,
        renderer="mujoco",
    )
    (folder / "model.xml").write_text("")
    model = compile_model(env.model.get_xml(), Assets(Source(folder)), "").compiled
    # Without its pictures it weighs and moves as it does with them.
    own = env.sim.model._model
    assert (model.body_mass == own.body_mass).all()
    assert (model.body_inertia == own.body_inertia).all()
    return derive_layout(model, 0.05, Convention(robot))


@pytest.mark.parametrize("robot", HANDS)
def test_the_fingers_of_a_robot_are_found(robot: str, tmp_path: Path) -> None:
    fingers, joints = HANDS[robot]
    (hand,) = layout("Lift", robot, tmp_path).robot.hands
    assert tuple(name for group in hand.spec.fingers for name in group) == fingers
    assert hand.frame == "gripper0_right_grip_site"
    found = {joint.name: (joint.closed, joint.opened) for joint in hand.joints}
    for name, ends in joints.items():
        assert found[f"gripper0_right_{name}"] == pytest.approx(ends)


def test_two_arms_of_a_robot_are_told_apart(tmp_path: Path) -> None:
    found = layout("TwoArmLift", "Baxter", tmp_path)
    assert [hand.spec.name for hand in found.robot.hands] == ["right", "left"]
    assert [entry.name for entry in found.actions] == ["right_gripper_close", "left_gripper_close"]
    assert {name: thing.category for name, thing in found.objects.items()} == {"pot": "pot"}
    assert list(found.fixtures) == ["table"]


def test_a_hand_whose_joints_have_no_ends_must_be_told(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match="no joint says how far it opens; see --bindings"):
        layout("Lift", "XArm7", tmp_path)


@pytest.mark.parametrize(
    ("limits", "last", "names"),
    [
        (7, False, ["arm_1", "arm_2", "arm_3", "arm_4", "arm_5", "arm_6", "gripper_close"]),
        (5, False, ["arm_1", "arm_2", "arm_3", "arm_4", "gripper_close"]),
    ],
)
def test_the_last_entry_of_an_action_is_the_gripper(
    limits: int, last: bool, names: list[str]
) -> None:
    convention = Convention("Panda", (1.0,) * limits, grippers_last=last)
    assert [entry.name for entry in action_entries(convention, [""], 1)] == names


def test_of_two_arms_grippers_come_last_from_robosuite_1_5_on() -> None:
    for last, names in {
        False: ["right_arm_1", "right_gripper_close", "left_arm_1", "left_gripper_close"],
        True: ["right_arm_1", "left_arm_1", "right_gripper_close", "left_gripper_close"],
    }.items():
        convention = Convention("Baxter", (1.0,) * 4, grippers_last=last)
        found = action_entries(convention, ["right_", "left_"], 1)
        assert [entry.name for entry in found] == names
