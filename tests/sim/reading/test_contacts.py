"""Contacts of a control period, in a small world of a gripper, a cupboard, a table and a ball."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_safemanip.sim.mujoco.contacts import ContactSampler, normal_forces
from pytest_safemanip.sim.robocasa import parts
from pytest_safemanip.trace.elements import Part
from pytest_safemanip.trace.steps import Contacts

SUBSTEPS = 25
WORLD = """
<mujoco>
  <option timestep="0.002" cone="{cone}" impratio="20"/>
  <worldbody>
    <body name="table"><geom name="table_top" type="box" size="1 1 .1" pos="0 0 -.1"/></body>
    <body name="ball" pos="0 0 {height}">
      <freejoint name="ball_joint"/>
      <geom name="ball_g0" size=".05" mass=".2" solref="-40000 -5"/>
      <geom name="ball_visual" size=".06" contype="0" conaffinity="0" mass="0"/>
    </body>
    <body name="block" pos=".5 0 .0499">
      <freejoint name="block_joint"/>
      <geom name="block_g0" type="box" size=".05 .05 .05" mass=".5"/>
    </body>
    <body name="cupboard" pos="0 .8 .3">
      <geom name="cupboard_back" type="box" size=".3 .01 .3"/>
      <body name="cupboard_hingedoor" pos="-.3 -.2 0">
        <joint name="cupboard_doorhinge" axis="0 0 1" range="0 1.6"/>
        <geom name="cupboard_panel" type="box" size=".15 .01 .3" pos=".15 0 0" mass="1"/>
        <geom name="cupboard_door_handle" type="box" size=".01 .02 .1" pos=".28 -.03 0" mass=".1"/>
      </body>
      <body name="cupboard_inner" pos="0 -.1 -.2">
        <joint name="cupboard_slide" type="slide" axis="0 -1 0" range="0 .3"/>
        <geom name="cupboard_tub" type="box" size=".1 .05 .05" mass=".3"/>
      </body>
    </body>
    <body name="wall_decoration" pos="3 0 1"><geom name="nobody" size=".1"/></body>
    <body name="mobilebase0_base" pos="-3 0 1">
      <geom name="base_g" size=".1"/>
      <body name="robot0_base"><geom name="arm_g" size=".1" pos="0 0 .2"/>
        <body name="robot0_link5"><geom name="link_g" size=".1" pos="0 0 .4"/>
          <body name="gripper0_right_right_gripper"><geom name="hand_g" size=".1" pos="0 0 .6"/>
            <body name="gripper0_right_leftfinger"><geom name="f1" size=".1" pos="0 0 .8"/>
              <body name="gripper0_right_finger_joint1_tip">
                <geom name="t1" size=".1" pos="0 0 1"/></body></body>
            <body name="gripper0_right_rightfinger"><geom name="f2" size=".1" pos="0 0 1.2"/></body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
ENTITIES = {"table": False, "ball": True, "block": True, "cupboard": False}


class World:
    def __init__(self, height: float = 1.0, cone: str = "elliptic") -> None:
        self.model = mujoco.MjModel.from_xml_string(WORLD.format(cone=cone, height=height))
        self.data = mujoco.MjData(self.model)
        roots = {self.model.body(name).id: (name, free) for name, free in ENTITIES.items()}
        self.table = parts.build(self.model, roots)
        self.sampler = ContactSampler(self.model, self.table)

    def step(self, substeps: int = SUBSTEPS, note: Callable[[], None] = lambda: None) -> Contacts:
        """One control period."""
        for _ in range(substeps):
            mujoco.mj_step1(self.model, self.data)
            mujoco.mj_step2(self.model, self.data)
            self.sampler.sample(self.data)
            note()
        return self.sampler.take()

    def part_of(self, geom: str) -> Part | None:
        index = self.table.of_geom[self.model.geom(geom).id]
        return self.table.parts[index] if index >= 0 else None

    def rows(self, contacts: Contacts, *geoms: str) -> NDArray[np.intp]:
        """The rows of a pair of parts, each given by one of its geoms."""
        a, b = sorted(self.table.of_geom[self.model.geom(name).id] for name in geoms)
        return np.flatnonzero((contacts.a == a) & (contacts.b == b))

    def force(self, *geoms: str) -> float:
        """What MuJoCo itself says the pair presses with, N."""
        wanted = {self.model.geom(name).id for name in geoms}
        total, force = 0.0, np.zeros(6)
        for index in range(self.data.ncon):
            if set(self.data.contact[index].geom.tolist()) == wanted:
                mujoco.mj_contactForce(self.model, self.data, index, force)
                total += force[0]
        return total


def bouncing_ball() -> World:
    """It comes down, touches the table for some milliseconds and leaves within one period."""
    world = World(height=0.1)
    world.data.qvel[2] = -2.0
    return world


def largest_mean(forces: list[float], count: int = 10) -> float:
    """Of so many substeps in a row: 20 ms of 2 ms each."""
    return max(sum(forces[k : k + count]) for k in range(len(forces) - count + 1)) / count


def test_a_touch_between_two_control_steps_is_seen_with_its_impulse() -> None:
    world, forces = bouncing_ball(), list[float]()
    contacts = world.step(note=lambda: forces.append(world.force("ball_g0", "table_top")))
    assert forces[-1] == 0.0
    assert max(forces) > 20.0
    (row,) = world.rows(contacts, "ball_g0", "table_top")
    assert contacts.force[row] == 0.0
    assert contacts.sustained[row] == pytest.approx(largest_mean(forces), rel=1e-6)
    assert contacts.sustained[row] < 0.6 * max(forces)
    assert contacts.position[row] == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


def test_a_touch_is_told_in_its_own_control_period_only() -> None:
    world = bouncing_ball()
    world.step()
    assert len(world.rows(world.step(), "ball_g0", "table_top")) == 0


@pytest.mark.parametrize("split", range(1, SUBSTEPS, 3))
def test_a_blow_that_two_control_periods_share_is_as_hard_as_in_one(split: int) -> None:
    world, shared = bouncing_ball(), bouncing_ball()
    whole = world.step()
    (row,) = world.rows(whole, "ball_g0", "table_top")
    parts = [shared.step(count) for count in (split, SUBSTEPS - split)]
    found = [p.sustained[shared.rows(p, "ball_g0", "table_top")] for p in parts]
    assert np.concatenate(found).max() == pytest.approx(whole.sustained[row], rel=1e-6)


def test_control_periods_that_are_shorter_than_the_mean_add_up() -> None:
    world, shared = bouncing_ball(), bouncing_ball()
    whole = world.step()
    (row,) = world.rows(whole, "ball_g0", "table_top")
    parts = [shared.step(1) for _ in range(SUBSTEPS)]
    found = [p.sustained[shared.rows(p, "ball_g0", "table_top")] for p in parts]
    assert np.concatenate(found).max() == pytest.approx(whole.sustained[row], rel=1e-6)


def test_what_rests_presses_with_its_weight_on_all_its_points() -> None:
    world = World()
    for _ in range(20):
        contacts = world.step()
    rows = world.rows(contacts, "block_g0", "table_top")
    assert len(rows) == 4
    assert contacts.force[rows].sum() == pytest.approx(0.5 * 9.81, rel=0.01)
    across = sorted(contacts.position[rows, 0].tolist())
    assert across == pytest.approx([0.45, 0.45, 0.55, 0.55], abs=1e-3)


@pytest.mark.parametrize("push", [0.0, 5.0])
def test_forces_are_those_of_mujoco(push: float) -> None:
    world, forces = World(height=0.2), list[float]()
    world.data.xfrc_applied[world.model.body("block").id, 0] = push
    for _ in range(6):
        contacts = world.step(note=lambda: forces.append(world.force("block_g0", "table_top")))
        rows = world.rows(contacts, "block_g0", "table_top")
        assert contacts.force[rows].sum() == pytest.approx(forces[-1], rel=1e-5)
        known = [forces[0]] * 9 + forces  # what presses at first has done so before
        wanted = np.full(len(rows), largest_mean(known[-SUBSTEPS - 9 :]))
        assert contacts.sustained[rows] == pytest.approx(wanted, rel=1e-5)


@pytest.mark.parametrize("geom", ["block_g0", "ball_g0"])
def test_the_normal_points_from_the_first_part_to_the_second(geom: str) -> None:
    """MuJoCo puts a sphere before a box and boxes in their own order."""
    world = bouncing_ball()
    contacts = world.step()
    rows = world.rows(contacts, geom, "table_top")
    first = world.table.parts[contacts.a[rows[0]]].entity
    up = np.array((0.0, 0.0, 1.0 if first == "table" else -1.0))
    assert contacts.normal[rows] == pytest.approx(np.tile(up, (len(rows), 1)), abs=1e-6)


def test_near_is_not_touching() -> None:
    """MuJoCo also lists what is within a geom's gap, where no force acts."""
    for margin in (0.0, 0.05):  # older versions count the gap as a part of the margin
        world = World(height=0.07)
        ball = world.model.geom("ball_g0").id
        world.model.geom_margin[ball], world.model.geom_gap[ball] = margin, 0.05
        contacts = world.step()
        listed = [c.efc_address for c in world.data.contact if ball in c.geom]
        if listed:
            break
    assert listed == [-1]
    assert len(world.rows(contacts, "ball_g0", "table_top")) == 0


def test_contacts_within_a_thing_and_between_things_that_never_move_are_left_out() -> None:
    world = World()
    contacts = world.step()
    pairs = {
        frozenset(world.table.parts[i].entity for i in pair)
        for pair in zip(contacts.a, contacts.b, strict=True)
    }
    assert pairs == {frozenset(("block", "table"))}


def test_sampling_changes_nothing() -> None:
    plain, sampled = bouncing_ball(), bouncing_ball()
    for _ in range(5):
        for _ in range(SUBSTEPS):
            mujoco.mj_step(plain.model, plain.data)
        sampled.step()
    assert np.array_equal(plain.data.qpos, sampled.data.qpos)
    assert np.array_equal(plain.data.qacc_warmstart, sampled.data.qacc_warmstart)


def test_no_contact_at_all_is_an_empty_list() -> None:
    world = World()
    world.data.qpos[7 + 2] = 1.0  # the block in the air, as the ball
    assert len(world.step()) == 0


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
def test_forces_are_those_that_mujoco_gives_whatever_the_friction_cones(cone: str) -> None:
    world = World(height=0.0, cone=cone)
    for _ in range(200):
        world.step()
    data, force = world.data, np.zeros(6)
    expected = []
    for contact in range(data.ncon):
        mujoco.mj_contactForce(world.model, data, contact, force)
        expected.append(force[0])
    pyramids = cone == "pyramidal"
    listed, found = data.contact, np.zeros(data.ncon)
    pressing = listed.efc_address >= 0
    found[pressing] = normal_forces(
        listed.efc_address[pressing], listed.dim[pressing], data.efc_force, pyramids
    )
    assert data.ncon > 2
    assert max(expected) > 0.1
    assert found == pytest.approx(expected)


@pytest.mark.parametrize(
    ("geom", "entity", "name", "joint"),
    [
        ("f1", "robot", "finger_left", ""),
        ("t1", "robot", "finger_left", ""),
        ("f2", "robot", "finger_right", ""),
        ("hand_g", "robot", "palm", ""),
        ("link_g", "robot", "link5", ""),
        ("arm_g", "robot", "arm", ""),
        ("base_g", "robot", "base", ""),
        ("table_top", "table", "body", ""),
        ("ball_g0", "ball", "body", ""),
        ("cupboard_back", "cupboard", "body", ""),
        ("cupboard_panel", "cupboard", "door", "cupboard/doorhinge"),
        ("cupboard_door_handle", "cupboard", "handle", "cupboard/doorhinge"),
        ("cupboard_tub", "cupboard", "drawer", "cupboard/slide"),
    ],
)
def test_a_geom_belongs_to_a_part(geom: str, entity: str, name: str, joint: str) -> None:
    assert World().part_of(geom) == Part(entity, name, joint)


@pytest.mark.parametrize("geom", ["ball_visual", "nobody"])
def test_what_cannot_touch_and_what_is_nobodys_is_no_part(geom: str) -> None:
    assert World().part_of(geom) is None


def test_parts_of_a_kitchen_are_told_apart(kitchen: Callable[..., Any]) -> None:
    scene = kitchen("OpenCabinet").scene
    cabinet = scene.roles["fxtr"]
    found = {(p.name, p.joint) for p in scene.parts if p.entity == cabinet}
    doors = [scene.joints[i].key for i in scene.joints_of(cabinet)]
    expected = {(part, joint) for part in ("door", "handle") for joint in doors}
    assert found == {("body", ""), *expected}
    robot = {p.name for p in scene.parts if p.entity == "robot"}
    assert {"finger_left", "finger_right", "palm", "base", "link7"} <= robot
