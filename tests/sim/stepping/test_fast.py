"""The fast control period against the exact one: within a tolerance, and never the same."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_safemanip.sim.robocasa.stepping.exact import Stepper
from pytest_safemanip.sim.robocasa.stepping.fast import FastStepper, LawStepper
from tests.sim.stepping.test_stepping import random_actions

Make = Callable[..., Any]
ROBOT = ("robot0_", "mobilebase0_", "gripper0_")


def robot_joints(env: Any) -> NDArray[np.intp]:
    """Where the joint positions of arm, torso, base and gripper are."""
    model = env.sim.model._model
    joints = [model.joint(n) for n in range(model.njnt)]
    return np.array([j.qposadr[0] for j in joints if j.name.startswith(ROBOT)])


def run(stepper: Any, env: Any, actions: NDArray[Any]) -> NDArray[np.float64]:
    """Positions of the robot's joints after each action (N, J)."""
    joints, positions = robot_joints(env), []
    for action in actions:
        stepper.step(action.copy())
        positions.append(env.sim.data.qpos[joints])
    return np.array(positions)


@pytest.mark.parametrize(
    ("task", "scenes", "seed"),
    [
        ("PickPlaceCounterToCabinet", "compact", 0),
        ("PickPlaceCounterToCabinet", "compact", 1),
        ("OpenCabinet", "target", 2),
    ],
)
def test_joints_stay_near_those_of_exact_stepping(
    make_kitchen: Make, task: str, scenes: str, seed: int
) -> None:
    actions = random_actions(40, seed)
    exact, fast = make_kitchen(task, scenes), make_kitchen(task, scenes)
    expected = run(Stepper(exact, lambda _: None), exact, actions)
    found = run(FastStepper(fast, lambda _: None), fast, actions)
    assert np.ptp(expected, axis=0).max() > 0.5
    assert 0.0 < np.abs(found - expected).max() < 2e-3


def test_the_law_as_one_matrix_is_that_of_exact_stepping_but_for_rounding(
    make_kitchen: Make,
) -> None:
    actions = random_actions(20, seed=1)
    exact, ours = (make_kitchen("PickPlaceCounterToCabinet") for _ in range(2))
    expected = run(Stepper(exact, lambda _: None), exact, actions)
    found = run(LawStepper(ours, lambda _: None), ours, actions)
    assert 0.0 < np.abs(found - expected).max() < 1e-6


def test_a_singular_pose_is_followed_too(make_kitchen: Make) -> None:
    """Stretched out, the matrices change by their own size from substep to substep."""

    def stretched_out() -> Any:
        env = make_kitchen("OpenDrawer", "compact")
        env.sim.data.qpos[env.robots[0]._ref_arm_joint_pos_indexes] = 0.0
        env.sim.forward()
        return env

    actions = random_actions(20, seed=1)
    actions[:, 11] = -1.0
    exact, fast = stretched_out(), stretched_out()
    expected = run(Stepper(exact, lambda _: None), exact, actions)
    found = run(FastStepper(fast, lambda _: None), fast, actions)
    assert np.abs(found - expected).max() < 2e-3


@pytest.mark.parametrize(
    "posture",
    [
        (-0.175, -0.302, 0.733, -0.98, -0.314, 0.406, 0.914),
        (-0.65, -0.812, 1.234, -0.991, -0.181, 0.324, 1.238),
    ],
)
def test_near_a_singular_posture_joints_stay_as_near(
    make_kitchen: Make, posture: tuple[float, ...]
) -> None:
    """Where hundreds of random actions led to; the matrices change slowly, and not evenly."""

    def bent() -> Any:
        env = make_kitchen("OpenDrawer", "compact")
        env.sim.data.qpos[env.robots[0]._ref_arm_joint_pos_indexes] = posture
        env.sim.forward()
        return env

    actions = random_actions(20, seed=13)
    exact, fast = bent(), bent()
    expected = run(Stepper(exact, lambda _: None), exact, actions)
    found = run(FastStepper(fast, lambda _: None), fast, actions)
    assert np.abs(found - expected).max() < 2e-3


def test_the_arms_goals_are_those_that_its_controller_would_set(make_kitchen: Make) -> None:
    env = make_kitchen("OpenDrawer")
    stepper = FastStepper(env, lambda _: None)
    arm = env.robots[0].composite_controller.part_controllers["right"]
    for action in random_actions(24):  # of the arm, then of the base
        before = arm.goal_pos, arm.goal_ori
        stepper.step(action)
        commanded = np.append(action[:3], 2.0 * action[3:6])  # some beyond the limits
        goals = [np.column_stack((before[1], before[0]))]
        for set_goal in (arm.set_goal, type(arm).set_goal.__get__(arm)):
            arm.goal_pos, arm.goal_ori = before
            arm.new_update = False
            stepper._controls.arm.refresh()
            set_goal(commanded)
            goals.append(np.column_stack((arm.goal_ori, arm.goal_pos)))
        assert np.abs(goals[1] - goals[2]).max() < 1e-6
        assert np.abs(goals[1] - goals[0]).max() > 1e-3


def test_every_substep_is_shown_and_the_clocks_go_on(make_kitchen: Make) -> None:
    exact, fast = make_kitchen("OpenDrawer"), make_kitchen("OpenDrawer")
    seen: list[float] = []
    action = random_actions(1)[0]
    Stepper(exact, lambda _: None).step(action.copy())
    FastStepper(fast, lambda data: seen.append(data.time)).step(action)
    assert len(seen) == 25
    assert (fast.timestep, fast.cur_time) == (exact.timestep, exact.cur_time)
    assert np.array_equal(action, random_actions(1)[0])
