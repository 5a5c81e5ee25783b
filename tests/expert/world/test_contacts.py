from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.contacts import borne_at, carriers, contact_force, palm_meets
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Part
from tests import toy

UP, ASIDE = (0.0, 0.0, 1.0), (0.7, -0.7, 0.0)
FINGER = (0, "robot/finger_left", "mug/body", 9.0, ASIDE)
APPLE = (0, "mug/body", "apple/body", 2.0, ASIDE)
TABLE = (0, "counter/body", "mug/body", 0.6, UP)


def _arm(*rows, part="link5", apple=0.94):
    parts = tuple(Part("robot", part) if p.name == "link5" else p for p in toy.PARTS)
    scene = dataclasses.replace(toy.SCENE, parts=parts)
    poses = (0.0, 0.0, 0.95, *toy.UPRIGHT), (0.0, 0.0, apple, *toy.UPRIGHT)
    step = toy.at_rest(object_pose=poses)
    arm = Arm(scene, dataclasses.replace(step, contacts=toy.contacts(*rows)))
    return arm, Thing(arm, "obj")


@pytest.mark.parametrize(
    ("apple", "rows", "stands"),
    [
        (0.95, (), False),
        (0.95, (APPLE,), False),
        (0.95, (APPLE, TABLE), True),
        (0.95, (TABLE,), True),
        (0.95, ((0, "counter/body", "mug/body", 0.4, UP),), False),
        (0.90, ((0, "apple/body", "mug/body", 2.0, UP),), True),
    ],
)
def test_a_vessel_does_not_stand_on_what_lies_in_it(apple, rows, stands):
    arm, mug = _arm(FINGER, *rows, apple=apple)
    assert bool(carriers(arm, mug)) == stands


@pytest.mark.parametrize(
    ("one", "other", "normal", "bears"),
    [
        ("counter", "mug", UP, True),
        ("mug", "counter", (0.0, 0.0, -1.0), True),
        ("mug", "counter", UP, False),
        ("counter", "mug", (0.8, 0.0, 0.6), True),
        ("counter", "mug", (0.9, 0.0, 0.44), False),
        ("counter", "apple", UP, False),
        ("robot", "mug", UP, False),
    ],
)
def test_what_presses_from_below_bears_a_thing_and_what_presses_from_aside_does_not(
    one, other, normal, bears
):
    place = (0.25, 0.0, 0.5)
    below = "robot/link5" if one == "robot" else f"{one}/body"
    arm, mug = _arm((0, below, f"{other}/body", 0.01, normal, place, 0.01))
    assert borne_at(arm, mug).tolist() == ([list(place)] if bears else [])


@pytest.mark.parametrize(
    ("part", "other", "force", "meets"),
    [
        ("palm", "mug", 0.6, False),
        ("palm", "apple", 0.6, True),
        ("palm", "apple", 0.4, False),
        ("palm", "counter", 0.6, True),
        ("link6", "apple", 9.0, False),
    ],
)
def test_the_palm_meets_what_is_not_in_the_fingers(part, other, force, meets):
    arm, mug = _arm(FINGER, (0, f"{other}/body", "robot/link5", force, UP), part=part)
    assert palm_meets(arm, mug) == meets


@pytest.mark.parametrize(
    ("row", "push"),
    [
        ((0, "counter/body", "robot/link5", 30.0, (1.0, 0.0, 0.0)), (30.0, 0.0)),
        ((0, "robot/link5", "counter/body", 30.0, (1.0, 0.0, 0.0)), (-30.0, 0.0)),
        ((0, "robot/link5", "counter/body", 0.4, (1.0, 0.0, 0.0)), (0.0, 0.0)),
        ((0, "counter/body", "robot/link5", 30.0, UP), (0.0, 0.0)),
        ((0, "counter/body", "mug/body", 30.0, (1.0, 0.0, 0.0)), (0.0, 0.0)),
    ],
)
def test_what_the_base_leans_on_pushes_it_away(row, push):
    arm, _ = _arm(row, part="base")
    assert contact_force(arm, "base", 0.5) == pytest.approx(push)
