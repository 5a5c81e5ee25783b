"""robosuite's own environments in its own wrapper, watched while they are stepped."""

from __future__ import annotations

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


def test_other_controllers_are_refused(make):
    from robosuite.controllers import load_composite_controller_config

    joints = load_composite_controller_config(controller="BASIC", robot="Panda")
    joints["body_parts"]["right"] = {**joints["body_parts"]["right"], "type": "JOINT_TORQUE"}
    env = SafetyMonitor(make(controller_configs=joints), "Lift")
    with pytest.raises(ConfigError, match="Lift: actions of 8 entries, expected 7"):
        env.reset(seed=0)
