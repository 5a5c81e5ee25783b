"""Our control period against robosuite's own ``env.step``: not one bit may differ."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.robocasa.description import open_reader
from pytest_safemanip.sim.robocasa.stepping.exact import Stepper
from pytest_safemanip.trace.steps import Contacts

FIELDS = ("time", "qpos", "qvel", "act", "ctrl", "qacc_warmstart", "qfrc_applied", "xfrc_applied")

Make = Callable[..., Any]


def state(env: Any) -> dict[str, Any]:
    """All that decides how the simulation goes on, and what RoboCasa says about it."""
    data = env.sim.data._data
    fields = {name: np.array(getattr(data, name)) for name in FIELDS}
    counters = {"timestep": env.timestep, "cur_time": env.cur_time}
    return {**fields, **counters, "success": env._check_success()}


def assert_identical(ours: Any, stock: Any, when: str) -> None:
    left, right = state(ours), state(stock)
    for name in left:
        assert np.array_equal(left[name], right[name]), f"{name} differs {when}"


class Recorder:
    """Steps an environment our way and reads everything at every step."""

    def __init__(self, env: Any) -> None:
        self.reader = open_reader(env)
        self.sampler = ContactSampler(env.sim.model._model, self.reader.description.table)
        self.stepper = Stepper(env, self.sampler.sample)
        self.contacts: list[Contacts] = []

    def step(self, action: NDArray[Any]) -> None:
        self.stepper.step(action)
        self.contacts.append(self.sampler.take())
        self.reader.read(False, self.contacts[-1])

    def touched(self) -> set[str]:
        """The entities that the robot touched."""
        parts = self.reader.description.scene.parts
        touching = {pair for c in self.contacts for pair in zip(c.a, c.b, strict=True)}
        pairs = [{parts[a].entity, parts[b].entity} for a, b in touching]
        return {name for pair in pairs if "robot" in pair for name in pair} - {"robot"}


def run_both(make: Make, actions: Iterable[NDArray[Any]], task: str, scenes: str) -> Recorder:
    ours, stock = make(task, scenes), make(task, scenes)
    recorder = Recorder(ours)
    assert_identical(ours, stock, "after reset")
    for index, action in enumerate(actions):
        recorder.step(action.copy())
        stock.step(action.copy())
        assert_identical(ours, stock, f"after step {index}")
    return recorder


def random_actions(count: int, seed: int = 0) -> NDArray[np.float64]:
    """Arm and base mode in turn, gripper opening and closing, some entries out of range."""
    random = np.random.default_rng(seed)
    actions = random.uniform(-1.2, 1.2, (count, 12))
    actions[:, 11] = np.where(np.arange(count) % 12 < 8, -1.0, 1.0)
    return actions


def test_driving_into_the_counter_is_bit_identical(make_kitchen: Make) -> None:
    forward = np.zeros((30, 12))
    forward[:, 7], forward[:, 11] = 1.0, 1.0
    recorder = run_both(make_kitchen, forward, "OpenDrawer", "compact")
    assert recorder.touched() - {"floor", "robot"}


def test_holding_an_object_is_bit_identical(make_kitchen: Make) -> None:
    def with_object_in_hand(task: str, scenes: str) -> Any:
        env = make_kitchen(task, scenes)
        joint = env.objects["obj"].joints[0]
        hand = env.sim.data.get_site_xpos("gripper0_right_grip_site")
        env.sim.data.set_joint_qpos(joint, np.array((*hand, 1.0, 0.0, 0.0, 0.0)))
        env.sim.forward()
        return env

    actions = 0.3 * random_actions(20)
    actions[:, 6], actions[:, 11] = 1.0, -1.0
    task = "PickPlaceCounterToCabinet"
    assert "obj" in run_both(with_object_in_hand, actions, task, "compact").touched()


@pytest.mark.parametrize(
    ("task", "scenes", "count"),
    [("PickPlaceCounterToCabinet", "compact", 24), ("OpenCabinet", "target", 11)],
)
def test_random_actions_in_both_modes_are_bit_identical(
    make_kitchen: Make, task: str, scenes: str, count: int
) -> None:
    run_both(make_kitchen, random_actions(count), task, scenes)


def test_a_singular_pose_is_bit_identical(make_kitchen: Make) -> None:
    """Stretched out, some singular values are as good as zero."""

    def stretched_out(task: str, scenes: str) -> Any:
        env = make_kitchen(task, scenes)
        env.sim.data.qpos[env.robots[0]._ref_arm_joint_pos_indexes] = 0.0
        env.sim.forward()
        return env

    run_both(stretched_out, random_actions(12, seed=1), "OpenDrawer", "compact")


def test_the_action_is_left_as_it_was(make_kitchen: Make) -> None:
    action = random_actions(9)[8]  # in base mode, where the command is turned
    before = action.copy()
    Recorder(make_kitchen("OpenDrawer")).step(action)
    assert np.array_equal(action, before)


def test_reading_changes_nothing_in_the_simulation(make_kitchen: Make) -> None:
    env = make_kitchen("PickPlaceCounterToCabinet")
    recorder = Recorder(env)
    recorder.step(random_actions(1)[0])
    model, data = env.sim.model._model, env.sim.data._data
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION)
    before, after = np.empty(size), np.empty(size)
    mujoco.mj_getState(model, data, before, mujoco.mjtState.mjSTATE_INTEGRATION)
    poses, forces = data.xpos.copy(), data.efc_force.copy()
    for _ in range(3):
        recorder.sampler.sample(data)
        recorder.reader.read(False, recorder.sampler.take())
    mujoco.mj_getState(model, data, after, mujoco.mjtState.mjSTATE_INTEGRATION)
    assert np.array_equal(before, after)
    assert np.array_equal(poses, data.xpos)
    assert np.array_equal(forces, data.efc_force)
