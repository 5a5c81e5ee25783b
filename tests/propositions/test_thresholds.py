"""On which side of a threshold is what reaches it exactly: all numbers are exact in binary."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.trace.elements import Part, Switch
from pytest_safemanip.trace.geometry import tilt
from tests import toy
from tests.propositions.stage import along, arrays, film, grip, look, moved, rest, touch, turned

SIXTEENTH, THIRTYSECOND, SHARE = 0.0625, 0.03125, 0.0078125
FINGER, DOOR = "robot/finger_left", "cabinet/door"
SLIDE = dataclasses.replace(
    toy.SCENE,
    joints=(
        dataclasses.replace(toy.SCENE.joints[0], kind="slide", axis=(0.0, -1.0, 0.0), travel=0.5),
    ),
)
BACK, FORTH = (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)


def beside(value, far):
    """Something just below a threshold, at it, and just above; far enough for single precision."""
    return value - far, value, value + far


def changed_from(step, length, before, after):
    return np.where(np.arange(length) < step, before, after)


def along_x(ways, start):
    return np.add(np.outer(ways, (1.0, 0.0, 0.0)), start)


def grasps(force):
    return look(film(10, grip(range(10), left=force, right=8.0)))("obj_grasped", "mug").any()


def stays_in_the_hand(slip):
    places = along_x(changed_from(10, 20, 0.0, slip), (0.0, 0.0, 1.0))
    recording = film(20, grip(range(20)), object_pose=moved("mug", places))
    view = look(recording, {"stable_grasp.distance": THIRTYSECOND})
    return view("stable_grasp", "mug")[-1]


def is_let_go_by_fingers_that_open(rate):
    gripper = along(arrays(20).gripper, range(20), 1, rate)
    view = look(film(20, grip(range(10)), gripper=gripper), {"obj_released.rate": THIRTYSECOND})
    return view("obj_released", "mug").any()


def settles_at(speed, column=0, parameter="settled.speed"):
    twist = along(arrays(10).object_twist, range(10), (0, column), speed)
    recording = film(10, rest(range(10)), dt=SIXTEENTH, object_twist=twist)
    view = look(recording, {parameter: THIRTYSECOND})
    settled = view("settled", "mug")[-1]
    assert settled == (not view.evidence("settled", ("mug",), 9))
    return settled


def settles_turning_at(spin):
    return settles_at(spin, 5, "settled.spin")


def settles_between_three_points(inside):
    """Its centre of mass is so far from the nearest side of the triangle, in the air."""
    triangle = (-SIXTEENTH, -inside, 1.75), (SIXTEENTH, -inside, 1.75), (0.0, SIXTEENTH, 1.75)
    lies = [rest(range(10), at=point) for point in triangle]
    recording = film(10, *lies, object_pose=moved("mug", (0.0, 0.0, 1.8125), 10))
    return look(recording, {"settled.margin": THIRTYSECOND})("settled", "mug")[-1]


def settles_so_far_from_the_edge(inside):
    """One point carries it, on a counter that ends at y = 0.5."""
    poses = moved("mug", (0.0, 0.5 - inside, 0.95), 10)
    view = look(film(10, rest(range(10)), object_pose=poses), {"settled.margin": THIRTYSECOND})
    return view("settled", "mug")[-1]


def drawer(length, rate, openness=0.5, hit=None, force=8.0, normal=FORTH, parameters=None):
    """A drawer that the hand moves, by a sixteenth first; it may hit the mug at step 8. A control
    period is a sixteenth of a second.
    """
    joint = np.zeros((length, 1, 2), np.float32)
    joint[:, 0, 0], joint[:, 0, 1] = openness, rate
    rows = touch(range(length), FINGER, DOOR, 3.0, FORTH)
    bump = touch([8], DOOR, "mug/body", force, normal)
    return look(film(length, rows, bump, scene=SLIDE, dt=SIXTEENTH, joint=joint), parameters)


def hits_with(force):
    return drawer(9, 0.5, force=force)("mech_hit", "cabinet").any()


def hits_while_it_moves_at(rate):
    return drawer(9, rate, parameters={"mech_hit.rate": THIRTYSECOND})("mech_hit", "cabinet").any()


def is_retracted_by(share):
    openness = changed_from(20, 30, 0.5, 0.5 - share)
    openness[0] -= 0.0625
    view = drawer(30, 0.0, openness, parameters={"retract.share": THIRTYSECOND})
    return view("retract", "cabinet").any()


def is_recovered_when_closed_but_for(openness):
    found = changed_from(10, 30, 0.5, openness)
    found[0] -= 0.0625
    return drawer(30, 0.0, found, parameters={"recovered.share": SIXTEENTH})(
        "recovered", "cabinet"
    ).any()


def is_recovered_when_open_but_for(share):
    found = changed_from(10, 30, 0.5, 1.0 - share)
    found[0] += 0.0625
    view = drawer(30, 0.0, found, normal=BACK, parameters={"recovered.share": SIXTEENTH})
    return view("recovered", "cabinet").any()


def starts_to_open_at(rate):
    rates = changed_from(10, 20, 0.0, rate)
    view = drawer(20, rates, parameters={"skill_onset.rate": THIRTYSECOND})
    return view("skill_onset", "open", "cabinet").any()


def starts_to_close_at(rate):
    rates = -changed_from(10, 20, 0.0, rate)
    view = drawer(20, rates, parameters={"skill_onset.rate": THIRTYSECOND})
    return view("skill_onset", "close", "cabinet").any()


KNOB = dataclasses.replace(
    toy.SCENE, joints=(dataclasses.replace(toy.SCENE.joints[0], gives_access=False),)
)


def turns_a_knob_with(force):
    view = look(film(20, touch(range(8, 20), FINGER, DOOR, force), scene=KNOB))
    return view("skill_onset", "turn", "cabinet").any()


TABLE = dataclasses.replace(
    toy.SCENE,
    bodies=(
        dataclasses.replace(toy.SCENE.bodies[0], half=(SIXTEENTH,) * 3),
        toy.SCENE.bodies[1],
    ),
    surfaces=(
        dataclasses.replace(
            toy.SCENE.surfaces[0], half=(1.0, 0.5, 0.5), pose=(0.0, 0.0, 0.5, *toy.UPRIGHT)
        ),
    ),
)
"""A counter whose top is at 1 m, a mug of 12.5 cm."""


def may_be_let_go_above(drop):
    poses = moved("mug", (0.0, 0.0, 1.0 + SIXTEENTH + drop), 30)
    gripper = along(arrays(30).gripper, range(10, 13), 1, 0.5)
    recording = film(30, grip(range(10)), scene=TABLE, object_pose=poses, gripper=gripper)
    view = look(recording, {"pre_safe.drop": SIXTEENTH})
    safe = view("pre_safe", "place", "mug")
    (step,) = np.flatnonzero(view("skill_onset", "place", "mug"))
    assert safe[step] == (not view.evidence("pre_safe", ("place", "mug"), step))
    return safe.all()


MICROWAVE = dataclasses.replace(
    toy.SCENE,
    parts=(*toy.PARTS, Part("cabinet", "button")),
    switches=(Switch("cabinet", "power", "appliance"),),
)


def may_be_switched_on_with_a_door_open_by(openness):
    rows = touch(range(5, 15), FINGER, "cabinet/button")
    off, joint = np.zeros((20, 1), np.float32), along(arrays(20).joint, range(20), (0, 0), openness)
    recording = film(20, rows, scene=MICROWAVE, switch=off, joint=joint)
    return look(recording, {"pre_safe.closed": SIXTEENTH})("pre_safe", "press", "cabinet").all()


BOWL = dataclasses.replace(
    toy.SCENE,
    bodies=(
        toy.SCENE.bodies[0],
        dataclasses.replace(toy.SCENE.bodies[1], half=(SIXTEENTH,) * 3),
    ),
)


def bowl_at(places):
    """The mug at places, the apple a bowl of 12.5 cm at (0.5, 0, 1)."""
    poses = moved("mug", places)
    poses[:, 1, :3] = 0.5, 0.0, 1.0
    return poses


def is_poured_above_the_underside_of_a_shelf(height):
    """The mug leaves the apple, which the hand holds, so far above the middle of the shelf."""
    poses = moved("mug", along_x(changed_from(10, 20, 0.0, 0.125), (0.0, 0.5, 1.5 + height)))
    poses[:, 1, :3] = 0.0, 0.5, 1.5 + height
    boxes = arrays(20).box_pose.copy()
    boxes[:, 0, :3] = 0.0, 0.5, 1.5
    box = dataclasses.replace(toy.SCENE.boxes[0], half=(0.5, 0.5, 0.25))
    scene = dataclasses.replace(toy.SCENE, boxes=(box,))
    recording = film(20, grip(range(20), "apple"), scene=scene, object_pose=poses, box_pose=boxes)
    view = look(recording, transfers=(("mug", "cabinet"),))
    assert view("skill_onset", "pour", "apple")[10]
    return view("pre_safe", "pour", "apple").all()


def is_meant_for_a_bowl_from(height):
    """Let go so far above its middle."""
    place = (0.5, 0.0, 1.0 + height)
    recording = film(20, grip(range(10)), scene=BOWL, object_pose=bowl_at([place] * 20))
    return look(recording)("transfer", "mug", "apple").any()


def is_in_a_bowl(x=0.0, y=0.0, z=0.0):
    """So far beside and above its middle, without touching it."""
    recording = film(20, scene=BOWL, object_pose=bowl_at([(0.5 + x, y, 1.0 + z)] * 20))
    view = look(recording)
    held = view("contained", "mug", "apple")[-1]
    inside = "the centre of mug is inside the box of apple"
    assert (view.evidence("contained", ("mug", "apple"), 19) == [inside]) == held
    return held


def is_in_a_bowl_behind_its_middle(y):
    return is_in_a_bowl(y=y)


def is_in_a_bowl_below_its_rim(z):
    return is_in_a_bowl(z=z)


SHELF = dataclasses.replace(
    toy.SCENE,
    bodies=TABLE.bodies,
    boxes=(dataclasses.replace(toy.SCENE.boxes[0], half=(0.5, 0.25, 0.25)),),
    grippers=(dataclasses.replace(toy.SCENE.grippers[0], half=(SIXTEENTH, 0.125, SIXTEENTH)),),
)
"""A shelf around (0, 0.5, 1.5), open at y = 0.25; a mug and a gripper of 12.5 cm."""


def at_the_shelf(length, **changed):
    boxes = arrays(length).box_pose.copy()
    boxes[:, 0, :3] = 0.0, 0.5, 1.5
    return film(length, grip(range(length)), **{"scene": SHELF, "box_pose": boxes, **changed})


def reaches_in(depth):
    eef = arrays(4).eef_pose.copy()
    eef[2:, :3] = 0.0, 0.25 + depth, 1.5
    return look(at_the_shelf(4, eef_pose=eef))("reach_in", "cabinet").any()


def rests_on_a_shelf(depth):
    recording = at_the_shelf(10, object_pose=moved("apple", (0.0, 0.25 + depth, 1.5), 10))
    return look(recording)("item_in_enclosure", "cabinet")[-1]


def has_the_hand_behind_its_open_door(aside):
    """Two doors meet at x = 0, the left one is open; the hand is so far to the right."""
    doors = [
        dataclasses.replace(
            toy.SCENE.joints[0], name=name, half=(0.25, 0.01, 0.25), pose=(x, 0.25, 1.5, 1, 0, 0, 0)
        )
        for name, x in (("hinge", -0.25), ("right", 0.25))
    ]
    joint = np.zeros((4, 2, 2), np.float32)
    joint[:, 0, 0] = 1.0
    eef = arrays(4).eef_pose.copy()
    eef[:, :3] = aside, 0.5, 1.5
    scene = dataclasses.replace(SHELF, joints=tuple(doors))
    recording = at_the_shelf(4, scene=scene, joint=joint, eef_pose=eef)
    return look(recording)("fix_open", "cabinet").all()


def is_meant_for_a_bowl(distance):
    """Let go so far beside its box, after it was brought from far away."""
    place = (0.5 + SIXTEENTH + distance, 0.0, 1.0)
    recording = film(20, grip(range(10)), scene=BOWL, object_pose=bowl_at([place] * 20))
    view = look(recording, {"transfer.reach": THIRTYSECOND})
    return view("transfer", "mug", "apple").any()


def is_brought(way):
    places = along_x(changed_from(20, 40, way, 0.0), (0.5, 0.0, 1.0))
    recording = film(40, grip(range(10, 30)), scene=BOWL, object_pose=bowl_at(places))
    view = look(recording, {"transfer.displacement": THIRTYSECOND})
    return view("transfer", "mug", "apple").any()


def drifting(drift, start):
    """A place that moves by so much at every fourth step, once in each window of five."""
    return along_x(drift * (np.arange(20) // 4), start)


def rests_in_a_bowl_drifting_by(drift):
    recording = film(20, scene=BOWL, object_pose=bowl_at(drifting(drift, (0.4375, 0.0, 1.0))))
    view = look(recording, {"contained.drift": SHARE})
    return view("contained", "mug", "apple")[4:12].any()


def rests_on_a_shelf_drifting_by(drift):
    recording = film(20, object_pose=moved("mug", drifting(drift, (0.0, 0.5, 1.5))))
    view = look(recording, {"item_in_enclosure.drift": SHARE})
    return view("item_in_enclosure", "cabinet")[4:12].any()


def is_open_at(openness):
    joint = along(arrays(2).joint, range(2), (0, 0), openness)
    return look(film(2, joint=joint), {"fix_open.openness": 0.875})("fix_open", "cabinet").all()


@pytest.mark.parametrize(
    ("happens", "threshold", "far", "sides"),
    [
        # Below the threshold, at it, above it.
        (grasps, 0.5, 0.01, (False, True, True)),
        (stays_in_the_hand, THIRTYSECOND, 1e-4, (True, False, False)),
        (is_let_go_by_fingers_that_open, THIRTYSECOND, 1e-4, (False, False, True)),
        (settles_at, THIRTYSECOND, 1e-4, (True, False, False)),
        (settles_turning_at, THIRTYSECOND, 1e-4, (True, False, False)),
        (settles_between_three_points, THIRTYSECOND, 1e-4, (False, True, True)),
        (settles_so_far_from_the_edge, THIRTYSECOND, 1e-4, (False, True, True)),
        (hits_with, 5.0, 0.1, (False, True, True)),
        (hits_while_it_moves_at, THIRTYSECOND, 1e-4, (False, False, True)),
        (is_retracted_by, THIRTYSECOND, 1e-4, (False, True, True)),
        (is_recovered_when_closed_but_for, SIXTEENTH, 1e-4, (True, True, False)),
        (is_recovered_when_open_but_for, SIXTEENTH, 1e-4, (True, True, False)),
        (starts_to_open_at, THIRTYSECOND, 1e-4, (False, False, True)),
        (starts_to_close_at, THIRTYSECOND, 1e-4, (False, False, True)),
        (turns_a_knob_with, 0.5, 0.01, (False, True, True)),
        (may_be_let_go_above, SIXTEENTH, 1e-4, (True, True, False)),
        (may_be_switched_on_with_a_door_open_by, SIXTEENTH, 1e-4, (True, True, False)),
        (is_poured_above_the_underside_of_a_shelf, -0.25, 1e-4, (False, False, True)),
        (is_meant_for_a_bowl, THIRTYSECOND, 1e-4, (True, False, False)),
        (is_meant_for_a_bowl_from, -SIXTEENTH, 1e-4, (False, False, True)),
        (is_in_a_bowl, SIXTEENTH, 1e-4, (True, True, False)),
        (is_in_a_bowl_behind_its_middle, SIXTEENTH, 1e-4, (True, True, False)),
        (is_in_a_bowl_below_its_rim, SIXTEENTH, 1e-4, (True, True, False)),
        (is_in_a_bowl_below_its_rim, -SIXTEENTH, 1e-4, (False, True, True)),
        (reaches_in, 0.0, 1e-4, (False, True, True)),
        (rests_on_a_shelf, 0.0, 1e-4, (False, True, True)),
        (has_the_hand_behind_its_open_door, SIXTEENTH, 1e-4, (True, True, False)),
        (is_brought, THIRTYSECOND, 1e-4, (False, True, True)),
        (rests_in_a_bowl_drifting_by, SHARE, 1e-4, (True, False, False)),
        (rests_on_a_shelf_drifting_by, SHARE, 1e-4, (True, False, False)),
        (is_open_at, 0.875, 1e-4, (False, True, True)),
    ],
    ids=lambda value: value.__name__ if callable(value) else "",
)
def test_what_reaches_a_threshold_exactly(happens, threshold, far, sides):
    assert tuple(bool(happens(value)) for value in beside(threshold, far)) == sides


LEAN = turned(0.5)
"""What leans by half a radian, but for rounding; the limit is what that is."""
LIMIT = float(tilt(np.float32(LEAN)))


@pytest.mark.parametrize(("limit", "fine"), [(LIMIT, False), (np.nextafter(LIMIT, 1.0), True)])
def test_what_leans_by_exactly_the_limit_leans_too_much(limit, fine):
    poses = moved("mug", (0.0, 0.0, 0.95), 20)
    poses[:, 0, 3:] = LEAN
    upright = {"upright": frozenset({"mug"})}
    limits = {"stable_grasp.tilt": limit, "settled.tilt": limit, "contained.tilt": limit}
    view = look(film(20, grip(range(20)), object_pose=poses), limits, **upright)
    assert view("stable_grasp", "mug")[-1] == fine
    view = look(film(20, rest(range(20)), object_pose=poses), limits, **upright)
    assert view("settled", "mug")[-1] == fine
    poses[:, 1, :3] = poses[:, 0, :3]
    view = look(film(20, object_pose=poses), limits)
    assert view("contained", "apple", "mug")[-1] == fine
