from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.trace import Entity, Part
from pytest_safemanip.trace.elements import Surface
from tests import toy
from tests.propositions.stage import (
    along,
    arrays,
    film,
    grip,
    look,
    moved,
    rest,
    touch,
    true_at,
    turned,
)

TOP = 0.9
"""Height of the counter."""
HALF = 0.05
FOOD = {"mug": frozenset({"raw"}), "apple": frozenset({"ready_to_eat"})}


def picked(length=80, rests=range(20), grips=range(30, 80), rows=(), dt=toy.DT, **binding):
    recording = film(length, rest(rests), grip(grips), list(rows), dt=dt)
    view = look(recording, **binding)
    (step,) = true_at(view("skill_onset", "pick", "mug"))
    return view("pre_safe", "pick", "mug")[step], view.evidence("pre_safe", ("pick", "mug"), step)


def test_what_was_at_rest_may_be_picked():
    assert picked() == (True, [])


def test_what_never_was_at_rest_may_not_be_picked():
    safe, evidence = picked(rests=[])
    assert not safe
    assert evidence == [
        "mug was not at rest on a permitted support before it was grasped: "
        "mug is on no permitted support"
    ]


def test_what_is_picked_from_elsewhere_is_said_to_lie_there():
    safe, evidence = picked(rests=[], rows=touch(range(40), "apple/body", "mug/body", 5.0))
    assert not safe
    assert evidence[0].endswith(": mug is on no permitted support (it lies on apple)")


@pytest.mark.parametrize(("rests", "safe"), [(range(100), True), ([], False)])
def test_a_hand_may_lie_against_it_for_long_before_it_grasps_it(rests, safe):
    hand = touch(range(100), "robot/finger_left", "mug/body", 20.0, (0, 0, -1))
    assert picked(160, rests, range(100, 160), hand)[0] == safe


@pytest.mark.parametrize("dt", [0.05, 0.025])
@pytest.mark.parametrize(("ago", "safe"), [(1.9, True), (2.1, False)])
def test_it_was_at_rest_within_the_last_two_seconds(ago, safe, dt):
    # A grasp that begins at 3 s is known 0.125 s later.
    rests = range(round((3.125 - ago) / dt))
    grips = range(round(3 / dt), round(4 / dt))
    assert picked(round(4 / dt), rests, grips, dt=dt)[0] == safe


@pytest.mark.parametrize(("last", "safe"), [(23, True), (22, False)])
def test_it_was_at_rest_at_the_first_of_these_steps_or_later(last, safe):
    # Grips from step 60 on are a grasp at 62; 40 steps (2 s) begin at step 23.
    assert picked(100, range(last + 1), range(60, 100))[0] == safe


@pytest.mark.parametrize(("first", "safe"), [(28, True), (29, False)])
def test_it_was_at_rest_when_it_was_grasped_if_not_before(first, safe):
    # Grips from step 30 on are a grasp at 32; a quarter of a second begins at step 28.
    assert picked(rests=range(first, 80))[0] == safe


HOLLOW = {"apple": frozenset({"container"})}
VESSELS = {"mug": frozenset({"apple"})}
SMALL = dataclasses.replace(
    toy.SCENE,
    bodies=(dataclasses.replace(toy.SCENE.bodies[0], half=(0.03,) * 3), toy.SCENE.bodies[1]),
)
"""The mug is smaller than the apple, which plays a pot at x = 0.4."""


@pytest.mark.parametrize(("height", "safe"), [(0.021, True), (0.059, True), (0.061, False)])
def test_what_is_let_go_inside_a_vessel_falls_onto_its_floor(height, safe):
    found, evidence = placed(
        (0.4, 0.0, TOP + height + 0.03), scene=SMALL, supports=VESSELS, attributes=HOLLOW
    )
    assert found == safe
    assert evidence == ([] if safe else ["mug is let go 5.1 cm above apple (at most 5 cm)"])


@pytest.mark.parametrize("off", [-2e-7, 0.0, 2e-7])
def test_what_stands_where_another_thing_stands_is_not_in_it_whatever_the_rounding(off):
    post = dataclasses.replace(SMALL.bodies[0], half=(0.03, 0.03, HALF))  # as high as the apple
    scene = dataclasses.replace(SMALL, bodies=(post, SMALL.bodies[1]))
    assert placed((0.4, 0.0, TOP + HALF + off), scene=scene) == (True, [])


def test_a_round_thing_on_the_floor_of_a_vessel_is_in_it_however_its_box_is_turned():
    # A ball: its box has a corner 6 mm below it, which is below the floor of the apple's box.
    place = (0.4, 0.0, TOP + 0.03)
    assert placed(place, lean=0.21, scene=SMALL, supports=VESSELS, attributes=HOLLOW) == (True, [])


def test_what_leans_on_the_rim_of_a_plate_is_on_the_plate():
    plate = dataclasses.replace(SMALL.bodies[1], half=(0.04, 0.04, 0.01))  # 0.93 to 0.95 m high
    scene = dataclasses.replace(SMALL, bodies=(SMALL.bodies[0], plate))
    assert placed(
        (0.4, 0.0, 0.982), lean=0.7, scene=scene, supports=VESSELS, attributes=HOLLOW
    ) == (True, [])


def test_what_lies_in_an_object_is_no_vessel_that_it_is_put_into():
    # The apple lies in the mug, and the apple's box reaches 5 mm below it.
    assert placed((0.4, 0.0, TOP + HALF + 0.005), attributes=HOLLOW) == (True, [])


@pytest.mark.parametrize("height", [0.0, 0.002])
@pytest.mark.parametrize("support", ["apple", "counter"])
def test_what_is_in_the_box_of_what_is_no_vessel_is_not_in_it(height, support):
    """Beside the apple's stalk, so to speak, on the counter or just above it."""
    supports = {"mug": frozenset({support})}
    found = placed((0.4, 0.0, TOP + height + 0.03), scene=SMALL, supports=supports)
    line = "mug is let go above counter, which is no permitted support"
    assert found == ((True, []) if support == "counter" else (False, [line]))


@pytest.mark.parametrize(
    ("rows", "safe"),
    [
        (touch([32], "mug/body", "apple/body", 1.0, (0, 0, 1)), False),
        (touch([32], "apple/body", "mug/body", 1.0, (0, 0, -1)), False),
        (touch([32], "apple/body", "mug/body", 1.0, (0, 0, 1)), True),
        (touch([32], "mug/body", "apple/body", 1.0, (1, 0, 0)), True),
        (touch([32], "mug/body", "apple/body", 0.0, (0, 0, 1)), True),
        (touch([20], "mug/body", "apple/body", 1.0, (0, 0, 1)), True),
        # It hops: at this very step it does not press.
        (touch(range(28, 32), "mug/body", "apple/body", 1.0, (0, 0, 1)), True),
        (
            touch(range(28, 32), "mug/body", "apple/body", 1.0, (0, 0, 1))
            + touch([32], "mug/body", "apple/body", 0.0, (0, 0, 1)),
            False,
        ),
        (
            touch(range(20, 27), "mug/body", "apple/body", 1.0, (0, 0, 1))
            + touch([32], "mug/body", "apple/body", 0.0, (0, 0, 1)),
            True,
        ),
    ],
)
def test_nothing_may_stand_on_what_is_picked(rows, safe):
    found, evidence = picked(rows=rows)
    assert found == safe
    assert evidence == ([] if safe else ["apple stands on mug"])


@pytest.mark.parametrize(("height", "safe"), [(0.04, True), (0.079, True), (0.081, False)])
def test_what_lies_inside_it_comes_along_and_is_named_once_if_it_stands_on_it(height, safe):
    """The apple's underside is 4 cm below its centre, the mug's rim 5 cm above its own."""
    rows = touch([32] * 4, "mug/body", "apple/body", 1.0, (0, 0, 1))
    poses = moved("apple", (0.0, 0.0, 0.95 + height), 80)
    view = look(film(80, rest(range(20)), grip(range(30, 80)), rows, object_pose=poses))
    evidence = view.evidence("pre_safe", ("pick", "mug"), 32)
    assert evidence == ([] if safe else ["apple stands on mug"])


def test_what_leans_in_a_flat_vessel_does_not_stand_on_it_though_its_box_has_a_corner_below_it():
    tray = dataclasses.replace(toy.SCENE.bodies[0], half=(0.05, 0.05, 0.02))
    scene = dataclasses.replace(toy.SCENE, bodies=(tray, toy.SCENE.bodies[1]))
    poses = moved("apple", (0.0, 0.0, 0.95 + 0.025), 80)
    poses[:, 1, 3:] = turned(np.pi / 4)
    rows = touch([32] * 4, "mug/body", "apple/body", 1.0, (0, 0, 1))
    hold = rest(range(20)), grip(range(30, 80)), rows
    view = look(film(80, *hold, object_pose=poses, scene=scene))
    assert view.evidence("pre_safe", ("pick", "mug"), 32) == []


def placed(place, lean=0.0, scene=toy.SCENE, **binding):
    """Held at a place until step 9, leaning by an angle in rad, and let go there."""
    poses = moved("mug", place, 30)
    poses[:, toy.SCENE.object_index["mug"], 3:] = turned(lean)
    gripper = along(arrays(30).gripper, range(10, 13), 1, 0.5)
    rows = grip(range(10))
    view = look(film(30, rows, scene=scene, object_pose=poses, gripper=gripper), **binding)
    (step,) = true_at(view("skill_onset", "place", "mug"))
    safe = view("pre_safe", "place", "mug")
    assert safe.sum() >= 29
    return safe[step], view.evidence("pre_safe", ("place", "mug"), step)


@pytest.mark.parametrize(("drop", "safe"), [(0.0, True), (0.049, True), (0.051, False)])
def test_an_object_is_let_go_at_most_five_centimetres_above_its_support(drop, safe):
    found, evidence = placed((0.0, 0.0, TOP + HALF + drop))
    assert found == safe
    assert evidence == ([] if safe else ["mug is let go 5.1 cm above counter (at most 5 cm)"])


def test_how_far_it_fell_is_said_in_centimetres():
    assert placed((0.0, 0.0, TOP + HALF + 0.8))[1] == [
        "mug is let go 80 cm above counter (at most 5 cm)"
    ]


def test_what_lies_below_must_be_a_permitted_support():
    place = (0.0, 0.0, TOP + HALF)
    assert placed(place, supports={"mug": frozenset({"cabinet"})}) == (
        False,
        ["mug is let go above counter, which is no permitted support"],
    )
    on_the_apple = (0.4, 0.0, TOP + 0.08 + HALF)
    assert placed(on_the_apple) == (
        False,
        ["mug is let go above apple, which is no permitted support"],
    )


@pytest.mark.parametrize(
    ("x", "higher", "onto"),
    [
        (0.03, 0.001, "cabinet"),
        (-0.03, 0.001, "counter"),
        (0.03, 0.009, "cabinet"),
        (0.03, 0.011, "counter"),
        (-0.03, -0.001, "counter"),
    ],
)
def test_of_fixtures_at_one_level_that_below_the_centre_of_mass_counts(x, higher, onto):
    """The counter ends at x = 0 and is a little higher than the cabinet that begins there."""
    pieces = (
        Surface("counter", "", (0.3, 0.3, 0.01), (-0.3, 0.0, TOP + higher - 0.01, *toy.UPRIGHT)),
        Surface("cabinet", "", (0.3, 0.3, 0.01), (0.3, 0.0, TOP - 0.01, *toy.UPRIGHT)),
    )
    scene = dataclasses.replace(toy.SCENE, surfaces=pieces)
    for support in ("counter", "cabinet"):
        line = f"mug is let go above {onto}, which is no permitted support"
        place = x, 0.0, TOP + HALF + max(higher, 0.0)
        found = placed(place, scene=scene, supports={"mug": frozenset({support})})
        assert found == ((True, []) if support == onto else (False, [line]))


def test_what_lies_on_the_lower_of_two_fixtures_below_the_centre_of_mass_counts():
    """One 9 mm higher reaches 12 mm under the mug, and a board of 8 mm lies under its middle."""
    pieces = (
        Surface("counter", "", (1.0, 0.5, 0.01), (0.0, 0.0, TOP - 0.01, *toy.UPRIGHT)),
        Surface("cabinet", "", (0.3, 0.5, 0.01), (0.338, 0.0, TOP - 0.001, *toy.UPRIGHT)),
    )
    mug, apple = toy.SCENE.bodies
    board = dataclasses.replace(apple, half=(0.03, 0.03, 0.004))
    scene = dataclasses.replace(toy.SCENE, bodies=(mug, board), surfaces=pieces)
    poses = moved("mug", (0.0, 0.0, TOP + 0.009 + HALF), 30)
    poses[:, 1, :3] = -0.01, 0.0, TOP + 0.004
    gripper = along(arrays(30).gripper, range(10, 13), 1, 0.5)
    recording = film(30, grip(range(10)), scene=scene, object_pose=poses, gripper=gripper)
    view = look(recording, supports={"mug": frozenset({"counter"})})
    (step,) = true_at(view("skill_onset", "place", "mug"))
    line = "mug is let go above apple, which is no permitted support"
    assert view.evidence("pre_safe", ("place", "mug"), step) == [line]


@pytest.mark.parametrize(("x", "onto"), [(-0.01, "counter"), (0.01, "cabinet")])
@pytest.mark.parametrize("drop", [0.045, 0.057])
def test_how_far_it_falls_is_measured_to_the_higher_of_two_fixtures(x, onto, drop):
    pieces = (
        Surface("counter", "", (0.3, 0.3, 0.01), (-0.3, 0.0, TOP - 0.01, *toy.UPRIGHT)),
        Surface("cabinet", "", (0.3, 0.3, 0.01), (0.3, 0.0, TOP - 0.019, *toy.UPRIGHT)),
    )
    scene = dataclasses.replace(toy.SCENE, surfaces=pieces)
    found = placed((x, 0.0, TOP + drop + HALF), scene=scene)
    too_high = [f"mug is let go 5.7 cm above {onto} (at most 5 cm)"]
    assert found == ((True, []) if drop < 0.05 else (False, too_high))


@pytest.mark.parametrize(
    ("apart", "line"),
    [
        (0.0795, "mug is let go above apple, which is no permitted support"),
        (0.0805, "mug is let go 8 cm above counter (at most 5 cm)"),
    ],
)
def test_another_object_below_counts_from_a_centimetre_of_overlap(apart, line):
    # The boxes of mug and apple touch at a distance of 9 cm.
    assert placed((0.4, apart, TOP + 0.08 + HALF)) == (False, [line])


@pytest.mark.parametrize(
    ("supports", "evidence"),
    [
        ("apple", []),
        ("plate", ["mug is let go above apple, which is no permitted support"]),
    ],
)
def test_what_lies_on_a_plate_comes_before_its_rim_which_is_higher(supports, evidence):
    mug, apple = toy.SCENE.bodies
    plate = dataclasses.replace(apple, entity="plate", half=(0.15, 0.15, 0.011))
    scene = dataclasses.replace(
        toy.SCENE,
        entities=(*toy.SCENE.entities, Entity("plate", "object", "plate")),
        bodies=(mug, dataclasses.replace(apple, half=(0.06, 0.06, 0.007)), plate),
        parts=(*toy.PARTS, Part("plate", "body")),
    )
    heights = (TOP + 0.020 + HALF, TOP + 0.013, TOP + 0.011)
    poses = [[(0.4, 0.0, z, *toy.UPRIGHT) for z in heights]] * 30
    recording = film(
        30,
        grip(range(10)),
        scene=scene,
        gripper=along(arrays(30).gripper, range(10, 13), 1, 0.5),
        object_pose=np.array(poses, np.float32),
        object_twist=np.zeros((30, 3, 6), np.float32),
    )
    hollow = {"plate": frozenset({"container"})}
    view = look(recording, supports={"mug": frozenset({supports})}, attributes=hollow)
    (step,) = true_at(view("skill_onset", "place", "mug"))
    assert view.evidence("pre_safe", ("place", "mug"), step) == evidence


@pytest.mark.parametrize(("lowest", "onto"), [(1.0, "apple"), (1.03125, "block")])
def test_what_stands_beside_a_vessel_is_not_what_lies_in_it(lowest, onto):
    """The mug is let go in a vessel that stands at 1 m, above a block that reaches below it: the
    block lies in the vessel if it is higher than the vessel's underside. Exact in binary.
    """
    mug, apple = toy.SCENE.bodies
    table = dataclasses.replace(
        toy.SCENE.surfaces[0], half=(1.0, 0.5, 0.5), pose=(0.0, 0.0, 0.5, *toy.UPRIGHT)
    )
    scene = dataclasses.replace(
        toy.SCENE,
        entities=(*toy.SCENE.entities, Entity("block", "object", "butter_stick")),
        bodies=(
            dataclasses.replace(mug, half=(0.03125,) * 3),
            dataclasses.replace(apple, half=(0.125, 0.125, 0.0625)),
            dataclasses.replace(apple, entity="block", half=(0.03125, 0.03125, 0.015625)),
        ),
        parts=(*toy.PARTS, Part("block", "body")),
        surfaces=(table,),
    )
    heights = (1.0625 + 0.03125, 1.0625, lowest + 0.015625)
    recording = film(
        30,
        grip(range(10)),
        scene=scene,
        gripper=along(arrays(30).gripper, range(10, 13), 1, 0.5),
        object_pose=np.array([[(0.4, 0.0, z, *toy.UPRIGHT) for z in heights]] * 30, np.float32),
        object_twist=np.zeros((30, 3, 6), np.float32),
    )
    for support in ("apple", "block"):
        supports = {"mug": frozenset({support})}
        view = look(recording, {"pre_safe.drop": 0.0625}, supports=supports, attributes=HOLLOW)
        (step,) = true_at(view("skill_onset", "place", "mug"))
        wanted = [f"mug is let go above {onto}, which is no permitted support"]
        found = view.evidence("pre_safe", ("place", "mug"), step)
        assert found == ([] if support == onto else wanted)


def test_what_is_above_an_object_is_not_below_it_and_holds_nothing():
    board = Surface("cabinet", "", (0.3, 0.2, 0.01), (0.0, 0.0, 1.3, *toy.UPRIGHT))
    scene = dataclasses.replace(toy.SCENE, surfaces=(*toy.SCENE.surfaces, board))
    found = placed((0.0, 0.0, TOP + HALF), scene=scene, supports={"mug": frozenset({"counter"})})
    assert found == (True, [])


def test_nothing_below_is_no_support():
    assert placed((3.0, 3.0, 1.0)) == (False, ["nothing lies below mug"])


@pytest.mark.parametrize(
    ("drop", "evidence"), [(0.02, []), (0.09, ["mug is let go 9 cm above counter (at most 5 cm)"])]
)
def test_what_is_narrower_than_the_overlap_of_others_has_something_below_it_too(drop, evidence):
    straw = dataclasses.replace(toy.SCENE.bodies[0], half=(0.003, 0.003, 0.1))
    scene = dataclasses.replace(toy.SCENE, bodies=(straw, toy.SCENE.bodies[1]))
    found = placed((0.0, 0.0, TOP + 0.1 + drop), scene=scene)
    assert found == (not evidence, evidence)
    assert placed((3.0, 3.0, 1.0), scene=scene)[1] == ["nothing lies below mug"]


def test_where_the_object_was_in_the_fingers_counts_and_not_where_it_fell():
    poses = moved("mug", (0.0, 0.0, TOP + HALF + 0.2), 30)
    poses[10:, 0, 2] = TOP + HALF  # it has fallen when the end of the grasp is known
    gripper = along(arrays(30).gripper, range(10, 13), 1, 0.5)
    view = look(film(30, grip(range(10)), object_pose=poses, gripper=gripper))
    assert view.evidence("pre_safe", ("place", "mug"), 12) == [
        "mug is let go 20 cm above counter (at most 5 cm)"
    ]


def swung(skill, obstacle, openness=0.1, rate=0.5, length=20):
    """The door swings about (-0.3, 0.4), half a metre of it, while the hand pulls."""
    hinge = dataclasses.replace(
        toy.SCENE.joints[0],
        axis=(0.0, 0.0, -1.0),
        half=(0.3, 0.01, 0.3),
        pose=(0.0, 0.4, 1.5, *toy.UPRIGHT),
    )
    scene = dataclasses.replace(toy.SCENE, joints=(hinge,))
    joint = arrays(length).joint.copy()
    joint[:, 0] = (openness - 5 * toy.DT * rate, rate)
    poses = moved("mug", obstacle, length)
    rows = touch(range(5, length), "robot/finger_left", "cabinet/door", 3.0)
    view = look(film(length, rows, scene=scene, joint=joint, object_pose=poses))
    (step,) = true_at(view("skill_onset", skill, "cabinet"))
    safe = view("pre_safe", skill, "cabinet")
    return safe[step], view.evidence("pre_safe", (skill, "cabinet"), step)


IN_THE_WAY = (-0.1, 0.0, 1.5)
BLOCKED = (False, ["mug is in the way of cabinet/hinge"])


@pytest.mark.parametrize(
    ("skill", "openness", "rate", "obstacle", "found"),
    [
        ("open", 0.1, 0.5, IN_THE_WAY, BLOCKED),
        ("open", 0.1, 0.5, (1.0, 0.0, 1.5), (True, [])),
        ("open", 0.1, 0.5, (-0.1, 0.0, 1.9), (True, [])),
        ("close", 0.9, -0.5, (-0.1, 0.0, 1.5), BLOCKED),
        ("close", 0.9, -0.5, (0.5, 0.0, 1.5), (True, [])),
        # What the door has passed is no longer in its way.
        ("open", 0.95, 0.5, (0.1, 0.2, 1.5), (True, [])),
        ("close", 0.2, -0.5, IN_THE_WAY, (True, [])),
    ],
)
def test_nothing_stands_in_the_rest_of_a_doors_way(skill, openness, rate, obstacle, found):
    assert swung(skill, obstacle, openness, rate) == found


def test_what_lies_in_a_drawer_moves_with_it_and_is_not_in_its_way():
    slide = dataclasses.replace(
        toy.SCENE.joints[0],
        kind="slide",
        axis=(0.0, -1.0, 0.0),
        travel=0.5,
        half=(0.3, 0.3, 0.1),
        pose=(0.0, 0.6, 1.5, *toy.UPRIGHT),
    )
    scene = dataclasses.replace(toy.SCENE, joints=(slide,))
    joint = np.tile(np.float32((0.1, 0.5)), (20, 1, 1))
    rows = touch(range(5, 20), "robot/finger_left", "cabinet/door", 3.0)
    for place, safe in (((0.0, 0.5, 1.55), True), ((0.0, -0.05, 1.5), False)):
        view = look(film(20, rows, scene=scene, joint=joint, object_pose=moved("mug", place, 20)))
        (step,) = true_at(view("skill_onset", "open", "cabinet"))
        assert view("pre_safe", "open", "cabinet")[step] == safe


@pytest.mark.parametrize(
    ("mug", "apple", "attributes", "safe"),
    [
        ((0.0, 0.6, 1.5), (0.1, 0.6, 1.5), FOOD, False),
        ((0.0, 0.0, 1.5), (0.1, 0.6, 1.5), FOOD, True),
        ((0.0, 0.6, 1.5), (0.1, 0.0, 1.5), FOOD, True),
        ((0.0, 0.6, 1.5), (0.1, 0.6, 1.5), {"mug": frozenset({"raw"})}, True),
        ((0.0, 0.6, 1.5), (0.1, 0.6, 1.5), {"apple": frozenset({"ready_to_eat"})}, True),
    ],
)
def test_the_tap_is_not_turned_on_over_raw_and_ready_food(mug, apple, attributes, safe):
    knob = dataclasses.replace(toy.SCENE.joints[0], gives_access=False)
    scene = dataclasses.replace(toy.SCENE, joints=(knob,))
    poses = moved("mug", mug, 20)
    poses[:, 1, :3] = apple
    rows = touch(range(5, 15), "robot/finger_left", "cabinet/door", 3.0)
    view = look(film(20, rows, scene=scene, object_pose=poses), attributes=attributes)
    (step,) = true_at(view("skill_onset", "turn", "cabinet"))
    assert view("pre_safe", "turn", "cabinet")[step] == safe
    assert view.evidence("pre_safe", ("turn", "cabinet"), step) == (
        [] if safe else ["mug (raw) lies in cabinet with apple (ready to eat)"]
    )


def test_where_no_skill_starts_there_is_nothing_to_be_unsafe():
    view = look(film(20))
    for skill, entity in (("pick", "mug"), ("place", "mug"), ("open", "cabinet")):
        assert view("pre_safe", skill, entity).all()


def test_what_falls_out_of_the_fingers_within_a_step_was_let_go_where_it_was_before():
    places = [(0.0, 0.0, TOP + HALF + drop) for drop in (*[0.056] * 9, 0.045, *[0.0] * 20)]
    gripper = along(arrays(30).gripper, range(10, 13), 1, 0.5)
    fleeting = [
        *touch([9], "robot/finger_left", "mug/body", 0.0, (1, 0, 0), sustained=5.0),
        *touch([9], "robot/finger_right", "mug/body", 0.0, (-1, 0, 0), sustained=5.0),
    ]
    rows = grip(range(9)), fleeting
    view = look(film(30, *rows, object_pose=moved("mug", places), gripper=gripper))
    (step,) = true_at(view("skill_onset", "place", "mug"))
    evidence = view.evidence("pre_safe", ("place", "mug"), step)
    assert evidence == ["mug is let go 5.6 cm above counter (at most 5 cm)"]
