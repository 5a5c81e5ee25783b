"""robosuite's own environments in its own wrapper, watched while they are stepped."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pytest_safemanip import SafetyMonitor
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.robosuite import environment

STEPS = 25
pytestmark = pytest.mark.filterwarnings("ignore:.*precision lowered by casting:UserWarning")


@pytest.fixture(scope="module")
def make():
    """Makes Lift, as a learner has it."""
    environment.load()
    import robosuite
    from robosuite.wrappers import GymWrapper

    def one(**options):
        env = robosuite.make(
            "Lift",
            robots="Panda",
            has_renderer=False,
            has_offscreen_renderer=False,
            use_camera_obs=False,
            seed=0,
            **options,
        )
        return GymWrapper(env)

    return one


def pushed(env):
    """The hand is pushed onto the table: costs, and the state in the end."""
    env.reset(seed=0)
    action = np.array((0.0, 0.1, -1.0, 0.0, 0.0, 0.0, 1.0))
    told = [env.step(action)[-1] for _ in range(STEPS)]
    sim = env.unwrapped.sim
    return told, np.array(sim.get_state().flatten())


def test_a_hand_that_is_pushed_onto_the_table_costs_and_no_bit_changes(make):
    told, watched = pushed(SafetyMonitor(make(), "Lift", horizon=0.25))
    _, alone = pushed(make())
    assert np.array_equal(watched.view(np.uint64), alone.view(np.uint64))
    assert told[0]["cost"] == 0.0
    assert told[-1]["safety"]["collision_contact"].unsafe
    first = next(step for step, info in enumerate(told) if info["cost"])
    assert any(info["warnings"] for info in told[:first])
    assert told[first - 1]["safety"]["collision_contact"].time_to_violation < 0.2
    assert told[first]["safety"]["collision_contact"].time_to_violation == 0.0


def test_nothing_is_predicted_without_a_horizon(make):
    env = SafetyMonitor(make(), "Lift")
    _, info = env.reset(seed=0)
    assert info["warnings"] == []
    assert {state.time_to_violation for state in info["safety"].values()} == {None}
    with pytest.raises(ConfigError, match="give it a horizon in seconds"):
        env.warnings(np.zeros(7))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"horizon": np.nan}, "horizon: expected a number from 0 up, found nan"),
        ({"horizon": -1}, "horizon: expected a number from 0 up, found -1"),
        ({"horizon": "0.25"}, "horizon: expected a number from 0 up, found '0.25'"),
        ({"stop": "warning"}, "stop: expected True or False, found 'warning'; who stops at warnin"),
    ],
)
def test_options_that_would_silently_warn_of_nothing_are_refused(make, options, message):
    with pytest.raises(ConfigError, match=f"SafetyMonitor: {re.escape(message)}"):
        SafetyMonitor(make(), "Lift", **options)


def test_an_action_or_a_pace_that_is_none_is_no_reason_to_be_calm(make):
    env = SafetyMonitor(make(), "Lift", horizon=0.25)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=r"an action has 7 entries \(.*\); found one of 3"):
        env.warnings(np.zeros(3))
    with pytest.raises(ConfigError, match=r"commands: expected finite numbers, found \[nan\]"):
        env.warnings(np.full(7, np.nan))
    with pytest.raises(ConfigError, match="pace: expected a number from 0 up, found -1"):
        env.warnings(np.zeros(7), pace=-1)


def test_other_controllers_are_refused(make):
    from robosuite.controllers import load_composite_controller_config

    joints = load_composite_controller_config(controller="BASIC", robot="Panda")
    joints["body_parts"]["right"] = {**joints["body_parts"]["right"], "type": "JOINT_TORQUE"}
    env = SafetyMonitor(make(controller_configs=joints), "Lift")
    with pytest.raises(ConfigError, match="Lift: actions of 8 entries, expected 7"):
        env.reset(seed=0)
