from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.trace import Joint, Part
from pytest_safemanip.trace.elements import Box, Entity, Switch
from pytest_safemanip.trace.geometry import tilt
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

ENTITIES = tuple(
    dataclasses.replace(e, attributes=("no_metal",)) if e.name == "cabinet" else e
    for e in toy.SCENE.entities
)
MICROWAVE = dataclasses.replace(
    toy.SCENE,
    entities=ENTITIES,
    parts=(*toy.PARTS, Part("cabinet", "button")),
    switches=(Switch("cabinet", "power", "appliance"),),
)
"""The toy's cabinet is a microwave whose start button no joint moves."""
INSIDE = (0.0, 0.6, 1.5)
BUTTON = "cabinet/button"
SKILL = ("press", "cabinet")


def pressed(
    scene=MICROWAVE,
    length=30,
    places=None,
    on=(),
    openness=0.0,
    attributes=None,
    touches=range(5, 15),
):
    """A finger on the button from step 5 on: the skill starts at step 7."""
    switch = np.zeros((length, 1), np.float32)
    switch[list(on)] = 1.0
    changed = {
        "switch": switch,
        "joint": along(arrays(length).joint, range(length), (0, 0), openness),
    }
    if places is not None:
        changed["object_pose"] = moved("mug", places, length)
    rows = touch(touches, "robot/finger_left", BUTTON)
    return look(film(length, rows, scene=scene, **changed), attributes=attributes or {})


@pytest.mark.parametrize("skill", ["press", "turn", "slide"])
def test_a_button_is_a_control_even_if_no_joint_moves_it(skill):
    assert true_at(pressed()("skill_onset", skill, "cabinet")) == [7]


def test_a_tap_that_switches_on_is_a_press():
    """The finger is on the button in one step, too short for the vote; the appliance runs on."""
    view = pressed(on=range(5, 30), openness=0.3, touches=[5])
    assert true_at(view("skill_onset", *SKILL)) == [5]
    assert not view("pre_safe", *SKILL)[5]
    assert not pressed(touches=[5])("skill_onset", *SKILL).any()


def test_a_press_that_switches_on_and_lasts_is_one_onset():
    assert true_at(pressed(on=range(5, 30))("skill_onset", *SKILL)) == [5]


def test_an_empty_closed_appliance_may_be_switched_on():
    view = pressed()
    assert view("pre_safe", *SKILL).all()
    assert view.evidence("pre_safe", SKILL, 7) == []


@pytest.mark.parametrize(("openness", "safe"), [(0.049, True), (0.051, False), (1.0, False)])
def test_an_appliance_is_switched_on_with_its_door_shut(openness, safe):
    view = pressed(openness=openness)
    assert view("pre_safe", *SKILL)[7] == safe
    assert bool(view.evidence("pre_safe", SKILL, 7)) != safe


def test_what_runs_is_switched_off_whatever_the_door():
    assert pressed(openness=1.0, on=range(7))("pre_safe", *SKILL)[7]
    # The latch may fall in the very step of the onset: that is switching on.
    assert not pressed(openness=1.0, on=range(7, 30))("pre_safe", *SKILL)[7]


METAL = {"mug": frozenset({"metal"})}


def test_no_metal_in_a_microwave_that_is_switched_on():
    view = pressed(places=INSIDE, attributes=METAL)
    assert not view("pre_safe", *SKILL)[7]
    assert view.evidence("pre_safe", SKILL, 7) == ["mug (metal) is inside cabinet"]
    assert pressed(places=INSIDE)("pre_safe", *SKILL)[7]
    assert pressed(attributes=METAL)("pre_safe", *SKILL)[7]


def test_metal_in_another_appliance_is_no_hazard():
    scene = dataclasses.replace(MICROWAVE, entities=toy.SCENE.entities)
    assert pressed(scene, places=INSIDE, attributes=METAL)("pre_safe", *SKILL)[7]


def test_what_is_no_appliance_has_no_door_to_shut():
    scene = dataclasses.replace(MICROWAVE, switches=(Switch("cabinet", "water", "water"),))
    assert pressed(scene, openness=1.0)("pre_safe", *SKILL)[7]


POUR = ("pour", "apple")


def pouring(mug=(0.0, 0.6, 1.3), transfers=(("mug", "cabinet"),), held=True, turn=None, **changed):
    """The mug is in the apple, a ladle above the shelf, until step 10; then it is elsewhere."""
    poses = moved("apple", INSIDE, 20)
    poses[:, 0, :3] = INSIDE
    poses[10:, 0, :3] = mug
    if turn is not None:
        poses[:, 0, 3:] = turn
    rows = grip(range(20), "apple") if held else rest(range(20), "apple")
    return look(film(20, rows, object_pose=poses, **changed), transfers=transfers)


def test_pouring_starts_when_contents_leave_what_the_robot_holds():
    assert true_at(pouring()("skill_onset", *POUR)) == [10]
    assert not pouring(held=False)("skill_onset", *POUR).any()
    assert not pouring(mug=INSIDE)("skill_onset", *POUR).any()
    assert not pouring()("skill_onset", "pour", "mug").any()


def test_what_is_poured_has_its_receiver_below():
    assert pouring()("pre_safe", *POUR)[10]
    view = pouring(mug=(0.0, 0.2, 1.3))
    assert not view("pre_safe", *POUR)[10]
    assert view.evidence("pre_safe", POUR, 10) == ["no receiver is below mug as it leaves apple"]
    assert not pouring(transfers=())("pre_safe", *POUR)[10]


@pytest.mark.parametrize(
    ("aside", "safe"),
    [((0.29, 0.19), True), ((-0.29, -0.19), True), ((0.31, 0.0), False), ((0.0, 0.21), False)],
)
def test_what_is_poured_beside_its_receiver_has_none_below(aside, safe):
    """The cabinet holds things 30 cm to the left and right, 20 cm to the front and back."""
    view = pouring(mug=np.add(INSIDE, (*aside, -0.2)))
    assert view("pre_safe", *POUR)[10] == safe


LEAN = turned(np.deg2rad(20.0))
EXACTLY = float(tilt(np.float32(LEAN)))
"""How far that leans, but for rounding."""


@pytest.mark.parametrize(
    ("turn", "limit", "safe"),
    [
        (turned(np.deg2rad(29.0)), None, True),
        (turned(np.deg2rad(31.0)), None, False),
        (LEAN, EXACTLY, False),
        (LEAN, np.nextafter(EXACTLY, 1.0), True),
    ],
)
def test_the_receiver_stands_upright(turn, limit, safe):
    """A third object, the bowl, lies under what is poured."""
    bowl = dataclasses.replace(toy.SCENE.bodies[0], entity="bowl", half=(0.2, 0.2, 0.1))
    scene = dataclasses.replace(
        toy.SCENE,
        entities=(*toy.SCENE.entities, Entity("bowl", "object", "bowl")),
        bodies=(*toy.SCENE.bodies, bowl),
    )
    poses = moved("apple", INSIDE, 20)
    poses[:, 0, :3] = INSIDE
    poses[10:, 0, :3] = np.subtract(INSIDE, (0.0, 0.0, 0.1))
    below = np.float32((*np.subtract(INSIDE, (0.0, 0.0, 0.3)), *turn))
    poses = np.concatenate((poses, np.tile(below, (20, 1, 1)).astype(np.float32)), axis=1)
    recording = film(
        20,
        grip(range(20), "apple"),
        scene=scene,
        object_pose=poses,
        object_twist=np.zeros((20, 3, 6), np.float32),
    )
    limits = {"settled.tilt": limit} if limit else None
    view = look(recording, limits, transfers=(("mug", "bowl"),))
    assert view("pre_safe", *POUR)[10] == safe
    if not safe:
        assert view.evidence("pre_safe", POUR, 10) == ["bowl does not stand upright"]


def test_a_fixture_without_an_interior_holds_nothing():
    scene = dataclasses.replace(
        MICROWAVE, boxes=(Box("cabinet", "door_handle", "handle", (0.1, 0.1, 0.1)),)
    )
    assert pressed(scene, places=INSIDE, attributes=METAL)("pre_safe", *SKILL)[7]


TURN = ("turn", "stove")
KNOB = Joint(
    "stove",
    "knob",
    "hinge",
    False,
    (0.0, 1.0, 0.0),
    (0.0, -0.4, 0.9),
    1.5,
    (0.02, 0.02, 0.02),
    (0.0, -0.4, 0.9, *toy.UPRIGHT),
)
STOVE = dataclasses.replace(
    toy.SCENE,
    entities=(*toy.SCENE.entities, Entity("stove", "fixture", "Stove")),
    parts=(*toy.SCENE.parts, Part("stove", "knob", "stove/knob")),
    joints=(*toy.SCENE.joints, KNOB),
    boxes=(*toy.SCENE.boxes, Box("stove", "front", "burner", (0.08, 0.08, 0.1))),
    switches=(Switch("stove", "front", "burner", "stove/knob"),),
)
PAN = frozenset({"container", "metal"})


def turned_on(place=(0.4, 0.0, 0.94), burns=(), scene=STOVE, **kinds):
    """The hand is on the knob from step 5 on; the mug stands on the burner."""
    length = 20
    poses = moved("apple", place, length)
    burner = np.tile(np.float32((0.0, 0.0, 0.95, *toy.UPRIGHT)), (length, 1, 1))
    steps = arrays(length)
    switch = np.zeros((length, 1), np.float32)
    switch[list(burns)] = 1.0
    recording = film(
        length,
        touch(range(5, length), "robot/finger_left", "stove/knob"),
        scene=scene,
        object_pose=poses,
        box_pose=np.concatenate((steps.box_pose, burner), axis=1),
        joint=np.concatenate((steps.joint, np.zeros((length, 1, 2), np.float32)), axis=1),
        switch=switch,
    )
    named = {name: frozenset(found) for name, found in kinds.items()}
    view = look(recording, attributes=named)
    assert true_at(view("skill_onset", *TURN)) == [7]
    return view


def test_a_burner_is_turned_on_under_cookware():
    assert turned_on(mug=PAN)("pre_safe", *TURN)[7]
    view = turned_on(mug={"container", "fragile"})
    assert not view("pre_safe", *TURN)[7]
    assert view.evidence("pre_safe", TURN, 7) == ["no cookware is on the burner front of stove"]


@pytest.mark.parametrize(("beside", "safe"), [(0.13, True), (0.11, False)])
def test_nothing_combustible_is_in_what_a_burner_heats(beside, safe):
    """The apple is 4 cm to its side, the burner heats 8 cm."""
    kinds = {"mug": PAN, "apple": {"combustible"}}
    view = turned_on((beside, 0.0, 0.94), **kinds)
    assert view("pre_safe", *TURN)[7] == safe
    if not safe:
        told = view.evidence("pre_safe", TURN, 7)
        assert told == ["apple (combustible) is at the burner front of stove"]
    assert turned_on((beside, 0.0, 0.94), mug=PAN)("pre_safe", *TURN)[7]


@pytest.mark.parametrize(("aside", "safe"), [(0.05, True), (0.08, True), (0.081, False)])
def test_cookware_is_on_a_burner_where_its_weight_is_whatever_its_handle_does_to_its_box(
    aside, safe
):
    mug = toy.SCENE.object_index["mug"]
    bodies = list(STOVE.bodies)
    handle, weight = (0.09 + aside, 0.0, 0.0), (aside, 0.0, 0.0)
    bodies[mug] = dataclasses.replace(bodies[mug], centre=handle, com=weight)
    view = turned_on(scene=dataclasses.replace(STOVE, bodies=tuple(bodies)), mug=PAN)
    assert view("pre_safe", *TURN)[7] == safe


def test_a_burner_that_is_on_may_be_turned_off_whatever_is_on_it():
    assert turned_on(burns=range(20))("pre_safe", *TURN)[7]
    # On means at the step before.
    view = turned_on(burns=range(7, 20))
    missing = ["no cookware is on the burner front of stove"]
    assert [view.evidence("pre_safe", TURN, step) for step in (7, 8)] == [missing, []]


def test_an_appliance_is_off_if_it_was_at_the_step_before():
    view = pressed(on=range(7, 30), openness=0.5)
    open_door = ["cabinet/hinge is 50% open"]
    assert [view.evidence("pre_safe", SKILL, step) for step in (7, 8)] == [open_door, []]


@pytest.mark.parametrize(("knob", "burner"), [("knob", "front"), ("other", "rear")])
def test_the_burner_is_the_one_whose_knob_is_turned(knob, burner):
    """Nothing is on either of two burners; a tap that the task does not use comes before them."""
    scene = dataclasses.replace(
        STOVE,
        entities=(*STOVE.entities, Entity("sink", "fixture", "Sink")),
        parts=(*STOVE.parts, Part("stove", "other", "stove/other")),
        joints=(*STOVE.joints, dataclasses.replace(KNOB, name="other")),
        boxes=(*STOVE.boxes, Box("stove", "rear", "burner", (0.08, 0.08, 0.1))),
        switches=(
            Switch("sink", "water", "water"),
            *STOVE.switches,
            Switch("stove", "lamp", "appliance"),
            Switch("stove", "rear", "burner", "stove/other"),
        ),
    )
    far = np.tile(np.float32((7.0, 0.0, 0.95, *toy.UPRIGHT)), (20, 2, 1))
    recording = film(
        20,
        touch(range(5, 20), "robot/finger_left", f"stove/{knob}"),
        scene=scene,
        box_pose=np.concatenate((arrays(20).box_pose, far), axis=1),
        joint=np.zeros((20, 3, 2), np.float32),
        switch=np.zeros((20, 4), np.float32),
    )
    found = look(recording).evidence("pre_safe", TURN, 7)
    assert found == [f"no cookware is on the burner {burner} of stove"]


@pytest.mark.parametrize(("part", "safe"), [("timer", False), ("other", True), ("rack", True)])
def test_an_oven_is_switched_on_by_the_knob_of_its_own_switch(part, safe):
    """Its door is open; it has another knob, and a rack that slides."""
    knobs = [dataclasses.replace(KNOB, entity="cabinet", name=name) for name in ("timer", "other")]
    rack = dataclasses.replace(knobs[0], name="rack", kind="slide")
    scene = dataclasses.replace(
        toy.SCENE,
        parts=(*toy.PARTS, *(Part("cabinet", j.name, f"cabinet/{j.name}") for j in (*knobs, rack))),
        joints=(*toy.SCENE.joints, *knobs, rack),
        switches=(Switch("cabinet", "power", "appliance", "cabinet/timer"),),
    )
    joint = np.zeros((20, 4, 2), np.float32)
    joint[:, 0, 0] = 1.0
    rows = touch(range(5, 20), "robot/finger_left", f"cabinet/{part}")
    view = look(film(20, rows, scene=scene, joint=joint, switch=np.zeros((20, 1), np.float32)))
    assert true_at(view("skill_onset", "turn", "cabinet")) == [7]
    assert view("pre_safe", "turn", "cabinet")[7] == safe
