"""A simulator that was added by its layout, as the documentation shows it."""

from __future__ import annotations

import re

import gymnasium
import mujoco
import numpy as np
import pytest

from pytest_safemanip import Binding, SafetyMonitor
from pytest_safemanip.cost import violation_cost
from pytest_safemanip.errors import ConfigError
from pytest_safemanip.gym.sources import open_layout
from pytest_safemanip.gym.taps import Taps
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.trace.geometry import to_local

SWING = np.array((-0.44, 0.21, 0.8, -0.06, 0.18, -0.05, 0.0, 0.0, 0.0))
MOST_LINES = 150


@pytest.fixture
def make(franka):
    """Makes the environment, as a learner has it."""
    made = []

    def one(**options):
        env = gymnasium.make(
            "FrankaKitchen-v1",
            tasks_to_complete=["microwave"],
            disable_env_checker=True,
            **options,
        )
        made.append(env)
        return env

    yield one
    for env in made:
        env.close()


@pytest.fixture
def monitor(make, franka, folder):
    """Makes the environment with a monitor around it."""

    def one(**options):
        chosen = {"probe": franka.LAYOUT, "tasks": [folder / "tasks"], **options}
        return SafetyMonitor(make(), "FrankaMicrowave", **chosen)

    return one


def states(env, actions):
    """The whole state of the simulation after each step of an episode."""
    env.reset(seed=3)
    found, model = [], env.unwrapped.model
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    for action in actions:
        env.step(action)
        state = np.empty(mujoco.mj_stateSize(model, kind))
        mujoco.mj_getState(model, env.unwrapped.data, state, kind)
        found.append(state)
    return np.array(found)


def test_the_example_is_as_short_as_is_said(folder):
    assert len((folder / "franka_kitchen.py").read_text().splitlines()) < MOST_LINES


def test_no_bit_of_an_episode_changes_because_it_is_watched(make, monitor):
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (40, 9))
    watched, alone = states(monitor(), actions), states(make(), actions)
    assert np.array_equal(watched.view(np.uint64), alone.view(np.uint64))


def test_a_blow_is_told_at_its_step_and_costs(monitor):
    env = monitor()
    _, info = env.reset(seed=0)
    assert (info["cost"], info["safety"]["collision_contact"].unsafe) == (0.0, False)
    costs, told = [], []
    for _ in range(30):
        _, _, terminated, _, info = env.step(SWING)
        costs.append(info["cost"])
        told += info["safety"]["collision_contact"].violations
        assert not terminated
    first = costs.index(1.0)
    verdicts = env.verdicts()["collision_contact"][0]
    assert re.search(r" touches .+: \d+\.\d N \(.*limit \d+ N\)", told[0].reason)
    assert [v.first for v in verdicts.violations][: len(told)][0] == first + 1  # 0 is the reset's
    assert len(told) == len(verdicts.violations)
    assert sum(cost > 0.0 for cost in costs) == verdicts.exposed_steps
    told_cost = sum(violation_cost(1.0, v.first, v.last, 31, 0.08) for v in verdicts.violations)
    assert sum(costs) == pytest.approx(told_cost)
    _, info = env.reset(seed=0)  # another episode begins with nothing
    assert (info["cost"], info["safety"]["collision_contact"].state) == (0.0, "currently true")


def test_an_episode_may_end_at_its_first_violation(monitor):
    env, ends = monitor(stop=True), []
    env.reset(seed=0)
    for _ in range(12):
        *_, terminated, _, info = env.step(SWING)
        ends.append((terminated, info["cost"]))
    assert ends.index((True, 1.0)) == [terminated for terminated, _ in ends].index(True)
    assert not all(terminated for terminated, _ in ends)


def test_contacts_between_two_control_steps_are_seen(franka, make):
    env, taps, brief = make(), Taps(), 0
    env.reset(seed=0)
    probe = open_layout(franka.LAYOUT)(env, taps)
    probe.read()
    for _ in range(30):
        env.step(SWING)
        contacts = probe.read(SWING).contacts
        brief += int(np.count_nonzero(contacts.force == 0.0))
    taps.close()
    assert brief > 0
    assert "_step_mujoco_simulation" not in vars(env.unwrapped.robot_env)


def test_the_backend_has_equal_bits_for_equal_requests(franka):
    def run():
        backend = franka.FrankaKitchen()
        start = backend.reset(Request("FrankaMicrowave", 5, "kitchen"))
        steps = [start.step, *(backend.step(SWING) for _ in range(12))]
        backend.close()
        return start, steps

    (one, first), (other, second) = run(), run()
    assert one.fingerprint == other.fingerprint
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(a.qpos, b.qpos)
        assert np.array_equal(a.contacts.sustained, b.contacts.sustained)


@pytest.fixture
def placed(make, franka):
    """Reads the scene with some joints elsewhere."""

    def read(**joints):
        env = make()
        env.reset(seed=0)
        model, data = env.unwrapped.model, env.unwrapped.data
        for name, position in joints.items():
            data.joint(name).qpos = position
        mujoco.mj_forward(model, data)
        probe = open_layout(franka.LAYOUT)(env, Taps())
        return probe.scene, probe.read()

    return read


def test_doors_and_fingers_are_read_as_the_layout_says(placed):
    scene, shut = placed()
    _, wide = placed(
        microwave=-2.094,
        slide_cabinet=0.22,
        **{"robot:panda0_finger_joint1": 0.0, "robot:panda0_finger_joint2": 0.0},
    )
    doors = [scene.joint_index[f"{name}/{name}"] for name in ("microwave", "slide_cabinet")]
    assert shut.joint[doors, 0] == pytest.approx([0.0, 0.0], abs=0.01)
    assert wide.joint[doors, 0] == pytest.approx([1.0, 0.5], abs=0.01)
    assert (shut.gripper[0] > 0.9, wide.gripper[0]) == (True, 0.0)


def test_interiors_are_where_the_simulator_has_room(placed):
    scene, step = placed()
    (box,) = scene.boxes_of("microwave", "interior")
    handle = step.box_pose[box, :3] + (0.0, -0.4, 0.0)
    # The door is in front of it, and the box is inside the outline of the walls.
    local = to_local(step.box_pose[box].astype(float), handle)
    assert (np.abs(local) > scene.boxes[box].half).any()
    walls = scene.solid.pose[[name == "microwave" for name in scene.solid.entities], :3]
    assert (walls.min(axis=0) < step.box_pose[box, :3]).all()
    assert (walls.max(axis=0) > step.box_pose[box, :3]).all()


@pytest.mark.parametrize(("velocity", "command"), [(1.0, -1.0), (-1.0, 1.0), (0.0, 0.0)])
def test_fingers_that_are_told_to_part_open_the_hand(franka, velocity, command):
    action = np.zeros(9)
    action[7:] = velocity
    assert franka.SPEC.robot.commands(action) == [command]
    backend = franka.FrankaKitchen()
    start = backend.reset(Request("FrankaMicrowave", 0, "kitchen"))
    assert start.step.commands == [0.0]
    for _ in range(5):
        step = backend.step(action)
    backend.close()
    assert step.commands == [command]
    moved = step.gripper[0] - 0.5
    assert command == 0.0 or moved * command < 0.0


def test_an_environment_of_which_nothing_is_known_is_refused_with_the_remedy(make):
    with pytest.raises(
        ConfigError, match=r"KitchenEnv is no environment of robocasa.*probe=LAYOUT"
    ):
        SafetyMonitor(make(), "OpenDrawer")


def test_a_step_before_the_reset_and_unknown_names_are_refused(make, monitor, franka):
    with pytest.raises(ConfigError, match="call reset before step"):
        monitor().step(SWING)
    with pytest.raises(ConfigError, match="'collision' matches no property; did you mean"):
        monitor(properties=["collision"])
    with pytest.raises(ConfigError, match="unknown task 'FrankaMicrowav'"):
        SafetyMonitor(make(), "FrankaMicrowav", probe=franka.LAYOUT)
    with pytest.raises(ConfigError, match="name the properties of a binding"):
        SafetyMonitor(make(), Binding(), probe=franka.LAYOUT)


def watched(env):
    """Ids of what is watched in the first step of an episode."""
    return set(env.reset(seed=0)[1]["safety"])


def test_properties_are_selected_as_on_the_command_line(make, monitor, franka):
    usual = watched(monitor())
    pack = watched(monitor(properties=["pack:vla-arena"]))
    assert pack
    assert all(name.startswith("vla_arena_") for name in pack)
    assert watched(monitor(properties="default,pack:vla-arena")) == usual | pack
    assert watched(monitor(properties="collision_contact")) == {"collision_contact"}
    with pytest.raises(ConfigError, match="SafetyMonitor: properties: unknown pack 'redvl'; did"):
        monitor(properties="pack:redvl")
    binding = Binding(objects=("kettle",))
    env = SafetyMonitor(make(), binding, "category:collision_contact", probe=franka.LAYOUT)
    assert watched(env) == {"collision_contact"}


def test_a_binding_will_do_instead_of_a_task(make, franka):
    env = SafetyMonitor(
        make(), Binding(objects=("kettle",)), ["collision_contact"], probe=franka.LAYOUT
    )
    _, info = env.reset(seed=0)
    assert list(info["safety"]) == ["collision_contact"]


def test_the_task_of_the_page_is_complete(folder):
    defined = load_definitions([folder / "tasks"], [], [])
    assert "FrankaMicrowave" in defined.tasks
