"""What lies still sleeps, and nobody who reads contacts can tell."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco import sleeping
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.mujoco.sleeping import Asleep
from pytest_safemanip.sim.robocasa import parts
from pytest_safemanip.sim.robocasa.description import open_reader
from pytest_safemanip.sim.robocasa.stepping.fast import FastStepper
from pytest_safemanip.trace.steps import Contacts
from tests.sim.reading.test_contacts import ENTITIES, SUBSTEPS, WORLD, World
from tests.sim.stepping.test_stepping import random_actions

Make = Callable[..., Any]

pytestmark = pytest.mark.skipif(not sleeping._FLAG, reason="this MuJoCo has no sleeping islands")


BALL = 'size=".05" mass=".2" solref="-40000 -5"'
BOX = 'type="box" size=".05 .05 .05" mass=".2"'


class SleepyWorld(World):
    """The world of the contacts' tests with a second block, on the other or on the floor."""

    def __init__(self, stacked: bool = False, allowed: bool = True) -> None:
        text = WORLD.format(cone="elliptic", height=0.0499).replace(BALL, BOX)
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        roots = {self.model.body(name).id: (name, free) for name, free in ENTITIES.items()}
        self.table = parts.build(self.model, roots)
        self.asleep = Asleep(self.model)
        if not allowed:
            self.asleep.allowed = contextlib.nullcontext
        self.sampler = ContactSampler(self.model, self.table, self.asleep)
        self.upper = self.data.joint("ball_joint")
        if stacked:
            self.upper.qpos[:3] = 0.5, 0.0, 0.1498
        # What cannot move is where it was when nobody was allowed to sleep.
        mujoco.mj_forward(self.model, self.data)

    def step(self, note: Callable[[], None] = lambda: None) -> Contacts:
        with self.asleep.allowed():
            for _ in range(SUBSTEPS):
                mujoco.mj_step1(self.model, self.data)
                mujoco.mj_step2(self.model, self.data)
                self.asleep.note(self.data)
                self.sampler.sample(self.data)
                note()
        return self.sampler.take()

    def settled(self) -> Contacts:
        """Let it come to rest."""
        for _ in range(40):
            contacts = self.step()
        return contacts

    def sleeps(self, body: str) -> bool:
        tree = self.model.body_treeid[self.model.body(body).id]
        return not self.data.tree_awake[tree]


def test_what_rests_keeps_its_support_while_it_sleeps() -> None:
    world = SleepyWorld()
    contacts = world.settled()
    assert world.sleeps("block")
    assert world.data.ncon == 0
    rows = world.rows(contacts, "block_g0", "table_top")
    assert len(rows) == 4
    assert contacts.force[rows].sum() == pytest.approx(0.5 * 9.81, rel=0.01)
    assert contacts.sustained[rows] == pytest.approx(contacts.force[rows].sum(), rel=1e-6)


def test_a_stack_sleeps_and_keeps_the_contacts_between_its_things() -> None:
    world = SleepyWorld(stacked=True)
    contacts = world.settled()
    assert world.sleeps("ball")
    assert world.sleeps("block")
    assert contacts.force[world.rows(contacts, "ball_g0", "block_g0")].sum() == pytest.approx(
        0.2 * 9.81, rel=0.01
    )
    assert contacts.force[world.rows(contacts, "block_g0", "table_top")].sum() == pytest.approx(
        0.7 * 9.81, rel=0.01
    )


@pytest.mark.parametrize("how", ["force", "speed", "place", "joint force"])
def test_whoever_writes_to_it_wakes_it(how: str) -> None:
    world = SleepyWorld()
    world.settled()
    block, joint = world.data.body("block"), world.data.joint("block_joint")
    if how == "force":
        block.xfrc_applied[0] = 20.0
    elif how == "speed":
        joint.qvel[0] = 0.5
    elif how == "joint force":
        joint.qfrc_applied[0] = 20.0
    else:
        joint.qpos[2] += 0.2
    before = joint.qpos.copy()
    contacts = world.step()
    assert not world.sleeps("block")
    assert np.abs(joint.qpos[:3] - before[:3]).max() > 1e-3
    if how == "place":
        assert len(world.rows(contacts, "block_g0", "table_top")) == 0


def test_what_is_hit_wakes_with_all_that_it_carries() -> None:
    world = SleepyWorld(stacked=True)
    world.settled()
    door = world.data.joint("cupboard_slide")  # something else that sleeps stays asleep
    assert world.sleeps("cupboard_inner")
    world.data.joint("block_joint").qvel[0] = 1.0
    contacts = world.step()
    assert not world.sleeps("ball")
    assert world.sleeps("cupboard_inner")
    assert door.qvel[0] == 0.0
    plain = SleepyWorld(stacked=True, allowed=False)
    plain.settled()
    plain.data.joint("block_joint").qvel[0] = 1.0
    expected = plain.step()
    assert set(zip(contacts.a, contacts.b, strict=True)) == set(
        zip(expected.a, expected.b, strict=True)
    )


def test_a_support_taken_away_is_not_carried_on() -> None:
    world = SleepyWorld(stacked=True)
    world.settled()
    world.data.joint("block_joint").qpos[0] += 0.3
    contacts = world.step()
    assert len(world.rows(contacts, "ball_g0", "block_g0")) == 0
    assert world.upper.qvel[2] < -0.3


PUSHES = st.one_of(
    st.tuples(st.sampled_from([0, 1]), st.floats(-1.5, 1.5)),  # too weak to move anything
    st.tuples(st.just(2), st.floats(-15.0, 3.0)),  # onto the support, or off it for a moment
)


@settings(max_examples=15, deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(5, 20), st.sampled_from(["ball", "block"]), PUSHES),
        min_size=1,
        max_size=3,
    ),
    st.booleans(),
)
@example(pushes=[(5, "ball", (2, -8.0)), (5, "ball", (1, 1.0))], stacked=True)
@example(
    pushes=[(15, "block", (1, 0.4)), (18, "block", (1, -1.49609375)), (9, "ball", (2, -2.0))],
    stacked=True,
)
def test_pushed_it_touches_what_it_touches_without_sleep(
    pushes: list[tuple[int, str, tuple[int, float]]], stacked: bool
) -> None:
    sleepy, plain = SleepyWorld(stacked), SleepyWorld(stacked, allowed=False)
    slept = False
    for periods, body, (axis, push) in pushes:
        for _ in range(periods):
            assert_alike(sleepy.step(), plain.step())
        slept = slept or sleepy.sleeps(body)
        for world in (sleepy, plain):
            world.data.body(body).xfrc_applied[axis] = push
        assert_alike(sleepy.step(), plain.step())
        for world in (sleepy, plain):
            world.data.body(body).xfrc_applied[axis] = 0.0
    assert slept
    leans: dict[str, list[NDArray[np.float64]]] = {"ball": [], "block": []}
    for _ in range(20):  # a tower of equal blocks trembles as long as it is awake
        sleepy.step()
        plain.step()
        for body, seen in leans.items():
            seen.append(_lean(plain, body))
    for body, seen in leans.items():
        one, other = sleepy.data.body(body), plain.data.body(body)
        assert np.abs(one.xpos - other.xpos).max() < 5e-3
        # How they lean, and not how they are turned about the vertical: nothing turns a block back
        # that trembled on another, and where it stands and what it touches is the same.
        least, most = np.min(seen, axis=0), np.max(seen, axis=0)
        lean = _lean(sleepy, body)
        assert np.abs(lean - np.clip(lean, least, most)).max() < 1e-2
    for joint in ("cupboard_doorhinge", "cupboard_slide"):
        apart = sleepy.data.joint(joint).qpos - plain.data.joint(joint).qpos
        assert np.abs(apart).max() < 5e-3


def _lean(world: World, body: str) -> NDArray[np.float64]:
    """The vertical in a body's frame (3,)."""
    vertical: NDArray[np.float64] = world.data.body(body).xmat.reshape(3, 3)[2].copy()
    return vertical


def assert_alike(one: Contacts, other: Contacts) -> None:
    """The same pairs that press, as strongly within what a substep can differ by."""
    for left, right in ((one, other), (other, one)):
        pairs = {(a, b): f for a, b, f in zip(left.a, left.b, left.sustained, strict=True)}
        there = set(zip(right.a.tolist(), right.b.tolist(), strict=True))
        assert all(pair in there for pair, force in pairs.items() if force > 0.2)


def listed(contacts: Contacts) -> NDArray[np.float64]:
    """A row for each contact, in an order that does not depend on how they were found (N, 10)."""
    columns = [contacts.a, contacts.b, *contacts.position.T, *contacts.normal.T]
    rows = np.stack([*columns, contacts.force, contacts.sustained], axis=1).astype(float)
    return rows[np.lexsort(rows[:, 4::-1].round(2).T)]


class Rollout:
    """Fast stepping of a kitchen, with sleep or without, and all that is recorded of it."""

    def __init__(self, env: Any, allowed: bool) -> None:
        model = env.sim.model._model
        self.env, self.reader, self.asleep = env, open_reader(env), Asleep(model)
        if not allowed:
            self.asleep.allowed = contextlib.nullcontext
        self.sampler = ContactSampler(model, self.reader.description.table, self.asleep)
        self.stepper = FastStepper(env, self.sampler.sample, self.asleep)
        self.awake: list[int] = []

    def step(self, action: NDArray[np.float64]) -> Any:
        self.stepper.step(action.copy())
        self.awake.append(int(self.env.sim.data._data.ntree_awake))
        return self.reader.read(bool(self.env._check_success()), self.sampler.take())


@pytest.mark.parametrize("scenes", ["compact", "target"])
def test_a_rollout_is_recorded_as_without_sleep(make_kitchen: Make, scenes: str) -> None:
    task = "PickPlaceCounterToCabinet"
    sleepy, plain = (Rollout(make_kitchen(task, scenes), allowed) for allowed in (True, False))
    for action in random_actions(16, seed=3):
        one, other = sleepy.step(action), plain.step(action)
        assert listed(one.contacts) == pytest.approx(listed(other.contacts), abs=1e-3)
        assert one.qpos == pytest.approx(other.qpos, abs=1e-4)
        assert one.qvel == pytest.approx(other.qvel, abs=1e-3)
        assert one.success == other.success
    assert min(sleepy.awake) < 0.2 * max(plain.awake)


def test_robocasa_is_told_of_contacts_that_sleep(make_kitchen: Make) -> None:
    rollout = Rollout(make_kitchen("PickPlaceCounterToCabinet"), allowed=True)
    still = np.zeros(12)
    for _ in range(3):
        rollout.step(still)
    env = rollout.env
    thing = env.objects["distr_counter"]
    assert env.sim.data._data.ncon == 0
    assert env.check_contact(thing, env.counter)
    env.sim.data.set_joint_qpos(thing.joints[0], np.array((0.0, 0.0, 3.0, 1.0, 0.0, 0.0, 0.0)))
    rollout.step(still)
    assert not env.check_contact(thing, env.counter)
