"""What carries an object: the mug is a cube of 10 cm at (0, 0, 0.95), on the counter's top."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.propositions.kernels.support import (
    carried_objects,
    carrying_rows,
    margin_at,
    motion,
)
from tests import toy
from tests.propositions.stage import along, arrays, film, look, moved, touch, turned

MUG, APPLE = 0, 1
COUNTER, DOOR = "counter/body", "cabinet/door"
CORNERS = [(-0.05, -0.05, 0.9), (0.05, -0.05, 0.9), (0.05, 0.05, 0.9), (-0.05, 0.05, 0.9)]


def on_corners(steps, a=COUNTER, corners=CORNERS):
    return [row for at in corners for row in touch(steps, a, "mug/body", 2.0, at=at)]


@pytest.mark.parametrize(
    ("normal", "carries"),
    [
        # A contact carries from 30 degrees above the horizontal on, whose sine is exactly a half.
        ((0.0, 0.8660254, 0.5), True),
        ((0.0, 0.8660255, 0.49999), False),
        ((0.0, 0.0, 1.0), True),
        ((1.0, 0.0, 0.0), False),
    ],
)
def test_a_contact_carries_from_thirty_degrees_upward(normal, carries):
    view = look(film(1, touch([0], COUNTER, "mug/body", 2.0, normal)))
    assert len(carrying_rows(view, 0, 1)[0]) == carries


def test_the_upper_side_of_a_contact_is_carried_by_the_lower_one():
    # The normal points from the first part to the second.
    up, down = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
    view = look(
        film(
            3,
            touch([0], "apple/body", "mug/body", 2.0, up),
            touch([1], "apple/body", "mug/body", 2.0, down),
            touch([2], "mug/body", COUNTER, 2.0, down),
        )
    )
    rows, upper, below = carrying_rows(view, 0, 3)
    assert rows.tolist() == [0, 1, 2]
    assert upper.tolist() == [MUG, APPLE, MUG]
    assert below.tolist() == [toy.index(n) for n in ("apple/body", "mug/body", COUNTER)]


def test_what_carries_no_object_and_what_no_longer_presses_is_left_out():
    # The second one touched between two steps only.
    rows = touch([0], COUNTER, DOOR), touch([1], COUNTER, "mug/body", 0.0, sustained=2.0)
    assert len(carrying_rows(look(film(2, *rows)), 0, 2)[0]) == 0


def test_an_object_does_not_carry_itself():
    handle = dataclasses.replace(toy.PARTS[5], name="handle")
    scene = dataclasses.replace(toy.SCENE, parts=(*toy.PARTS, handle))
    view = look(film(1, touch([0], "mug/handle", "mug/body"), scene=scene))
    assert len(carrying_rows(view, 0, 1)[0]) == 0


def test_only_the_steps_that_are_asked_for_are_looked_at():
    view = look(film(6, on_corners(range(6))))
    found = carried_objects(view, 2, 5)
    assert found.step.tolist() == [2, 3, 4]
    assert found.count.tolist() == [4, 4, 4]
    assert found.first.tolist() == [0, 4, 8]


def test_contact_points_are_those_of_one_object_at_one_step():
    apple = [(0.4, 0.0, 0.9), (0.42, 0.0, 0.9)]
    rows = [row for at in apple for row in touch([0, 1], COUNTER, "apple/body", at=at)]
    found = carried_objects(look(film(2, on_corners([0, 1]), rows)), 0, 2)
    assert found.body.tolist() == [MUG, MUG, APPLE, APPLE]  # by object, then by step
    assert found.step.tolist() == [0, 1, 0, 1]
    assert found.points_of(1) == pytest.approx(np.array(CORNERS))
    assert found.points_of(3) == pytest.approx(np.array(apple))


def test_the_level_is_the_mean_height_of_the_contact_points():
    points = [(0.0, 0.0, 0.9), (0.0, 0.0, 0.93), (0.0, 0.0, 0.99)]  # 2.82 m / 3
    (level,) = carried_objects(look(film(1, on_corners([0], corners=points))), 0, 1).level
    assert level == pytest.approx(0.94)


def test_the_centre_of_mass_turns_with_the_object():
    # 3 cm along the mug's own x; turned by 90 degrees about z, that is 3 cm along y.
    bodies = (dataclasses.replace(toy.SCENE.bodies[MUG], com=(0.03, 0.0, 0.01)), *toy.SCENE.bodies)
    scene = dataclasses.replace(toy.SCENE, bodies=(bodies[0], bodies[2]))
    poses = arrays(1).object_pose.copy()
    poses[:, MUG, 3:] = turned(np.pi / 2, (0, 0, 1))
    found = carried_objects(look(film(1, on_corners([0]), scene=scene, object_pose=poses)), 0, 1)
    assert found.com[0] == pytest.approx((0.0, 0.03, 0.96), abs=1e-6)


@pytest.mark.parametrize(
    ("com", "margin"),
    [
        ((0.0, 0.0), 0.05),  # 10 cm cube: half of it on each side
        ((0.044, 0.0), 0.006),  # 6 mm inside the edge
        ((0.0, -0.044), 0.006),
        ((-0.044, 0.046), 0.004),  # the nearer edge counts
        ((0.053, 0.0), -0.003),
        ((0.053, 0.054), -0.005),  # 3 and 4 mm beyond a corner are 5 mm
    ],
)
def test_the_margin_is_how_far_inside_the_nearest_edge_the_centre_of_mass_is(com, margin):
    body = dataclasses.replace(toy.SCENE.bodies[MUG], com=(*com, 0.0))
    scene = dataclasses.replace(toy.SCENE, bodies=(body, toy.SCENE.bodies[APPLE]))
    view = look(film(1, on_corners([0]), scene=scene))
    found = carried_objects(view, 0, 1)
    assert margin_at(view, found, 0) == pytest.approx(margin, abs=1e-7)


def rates(*rows, mug=(0.0,) * 6, apple=(0.0,) * 6, rate=0.0, scene=toy.SCENE, on=("counter",)):
    """Speed and spin of the mug after a second of steady motion, the door opening at a rate."""
    twist = np.zeros((20, 2, 6), np.float32)
    twist[:] = mug, apple
    joint = along(arrays(20).joint, range(20), (0, 1), rate)
    recording = film(20, *rows, scene=scene, joint=joint, object_twist=twist)
    view = look(recording, supports={"mug": frozenset(on)})
    speed, spin = motion(view, carried_objects(view, 19, 20), np.array([0]))
    return float(speed[0]), float(spin[0])


def test_speed_and_spin_are_lengths():
    # 3 and 4 cm/s are 5 cm/s; 0.2, 0.3 and 0.6 rad/s are 0.7 rad/s.
    found = rates(on_corners([19]), mug=(0.03, 0.04, 0.0, 0.2, 0.3, 0.6))
    assert found == pytest.approx((0.05, 0.7), rel=1e-4)


def test_velocities_that_do_not_move_anything_are_no_motion():
    shaken = np.zeros((20, 2, 6), np.float32)
    shaken[::2], shaken[1::2] = 0.5, -0.5
    recording = dataclasses.replace(film(20, on_corners([19])).steps, object_twist=shaken)
    view = look(dataclasses.replace(film(20), steps=recording))
    speed, spin = motion(view, carried_objects(view, 19, 20), np.array([0]))
    assert (speed[0], spin[0]) == (0.0, 0.0)


def test_what_rocks_back_to_where_it_was_has_moved():
    places = np.tile((0.0, 0.0, 0.95), (20, 1))
    places[17, 0] = 0.01
    view = look(film(20, on_corners([19]), object_pose=moved("mug", places)))
    speed, _ = motion(view, carried_objects(view, 19, 20), np.array([0]))
    assert speed[0] == pytest.approx(0.01 / 0.25, rel=1e-4)


def test_of_what_carries_it_counts_that_relative_to_which_it_moves_most():
    rows = on_corners([19], corners=CORNERS[:3]), touch([19], "apple/body", "mug/body")
    both = {"mug": (0.3, 0.0, 0.0, 0.0, 0.0, 0.0), "apple": (0.1, 0.0, 0.0, 0.0, 0.0, 0.0)}
    assert rates(*rows, **both, on=("counter", "apple"))[0] == pytest.approx(0.3, rel=1e-4)
    assert rates(*rows, **both, on=("apple",))[0] == pytest.approx(0.2, rel=1e-4)


def test_what_turns_with_the_thing_below_it_does_not_move():
    # Around the apple's place, 0.4 m away, and with it.
    angle = np.arange(20) * 0.5 * toy.DT
    poses = np.repeat(arrays(1).object_pose, 20, axis=0)
    poses[:, 0, :2] = np.stack((0.4 - 0.4 * np.cos(angle), -0.4 * np.sin(angle)), axis=1)
    poses[:, :, 3:] = np.array([turned(a, (0.0, 0.0, 1.0)) for a in angle])[:, None]
    recording = film(20, touch([19], "apple/body", "mug/body"), object_pose=poses)
    view = look(recording, supports={"mug": frozenset({"apple"})})
    speed, spin = motion(view, carried_objects(view, 19, 20), np.array([0]))
    assert (speed[0], spin[0]) == pytest.approx((0.0, 0.0), abs=1e-5)


def drawer(**changed):
    """The cabinet's door slides by 40 cm along -y."""
    joint = dataclasses.replace(
        toy.SCENE.joints[0], kind="slide", axis=(0.0, -1.0, 0.0), travel=0.4, **changed
    )
    return dataclasses.replace(toy.SCENE, joints=(joint,))


@pytest.mark.parametrize(
    ("rate", "own", "speed"),
    [
        (0.5, (0.0, -0.2, 0.0), 0.0),  # half of 40 cm a second, opening: 0.2 m/s along -y
        (0.5, (0.0, 0.0, 0.0), 0.2),
        (-0.5, (0.0, -0.2, 0.0), 0.4),
        (-0.25, (0.0, 0.1, 0.0), 0.0),
    ],
)
def test_they_are_relative_to_a_drawer_that_moves(rate, own, speed):
    found = rates(
        on_corners([19], DOOR),
        mug=(*own, 0.0, 0.0, 0.0),
        rate=rate,
        scene=drawer(),
        on=("cabinet",),
    )
    assert found[0] == pytest.approx(speed, abs=1e-6)


def test_a_hinged_door_carries_nothing_along():
    found = rates(on_corners([19], DOOR), mug=(0.2, 0, 0, 0, 0, 0), rate=0.5, on=("cabinet",))
    assert found[0] == pytest.approx(0.2, rel=1e-4)


FLOOR = dataclasses.replace(
    toy.SCENE,
    entities=tuple(
        dataclasses.replace(e, kind="room") if e.name == "cabinet" else e
        for e in toy.SCENE.entities
    ),
)
"""The cabinet's door plays the floor."""


@pytest.mark.parametrize(
    ("supports", "carried"),
    [
        ({"mug": {"apple"}, "apple": {"counter"}}, []),
        ({"mug": {"apple"}, "apple": {"counter", "cabinet"}}, [APPLE, MUG]),
        ({"mug": {"counter"}, "apple": {"cabinet"}}, [APPLE]),
    ],
)
def test_what_lies_on_something_on_the_floor_is_not_carried(supports, carried):
    rows = touch([0], DOOR, "apple/body"), touch([0], "apple/body", "mug/body")
    chosen = {name: frozenset(on) for name, on in supports.items()}
    found = carried_objects(look(film(1, *rows, scene=FLOOR), supports=chosen), 0, 1)
    assert sorted(found.body.tolist(), reverse=True) == carried


def test_what_stands_on_the_counter_is_carried_whatever_lies_on_the_floor():
    rows = touch([0], DOOR, "apple/body"), on_corners([0])
    on = {"mug": frozenset({"counter"}), "apple": frozenset({"counter"})}
    found = carried_objects(look(film(1, *rows, scene=FLOOR), supports=on), 0, 1)
    assert found.body.tolist() == [MUG]


def test_on_the_floor_means_at_that_step():
    on = {"supports": {"mug": frozenset({"apple"}), "apple": frozenset({"counter"})}}
    rows = touch([1], DOOR, "apple/body"), touch([0, 1, 2], "apple/body", "mug/body")
    found = carried_objects(look(film(3, *rows, scene=FLOOR), **on), 0, 3)
    assert found.step[found.body == MUG].tolist() == [0, 2]


def test_a_stack_of_three_on_the_floor_carries_none_of_them():
    third = dataclasses.replace(toy.SCENE.bodies[APPLE], entity="plate")
    scene = dataclasses.replace(
        FLOOR,
        entities=(*FLOOR.entities, dataclasses.replace(toy.SCENE.entities[4], name="plate")),
        bodies=(*FLOOR.bodies, third),
        parts=(*FLOOR.parts, dataclasses.replace(toy.PARTS[6], entity="plate")),
    )
    places = np.concatenate((arrays(1).object_pose, arrays(1).object_pose[:, 1:]), axis=1)
    still = np.zeros((1, 3, 6), np.float32)
    on = {"mug": {"apple"}, "apple": {"plate"}, "plate": {"counter"}}
    rows = [
        touch([0], below, above)
        for below, above in (
            (DOOR, "plate/body"),
            ("plate/body", "apple/body"),
            ("apple/body", "mug/body"),
        )
    ]
    recording = film(1, *rows, scene=scene, object_pose=places, object_twist=still)
    view = look(recording, supports={name: frozenset(below) for name, below in on.items()})
    assert carried_objects(view, 0, 1).body.tolist() == []
