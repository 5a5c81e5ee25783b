from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.world.knocks import HAND, LIMB, LOAD, STRAY, Watch
from pytest_safemanip.policies.base import Permissions
from tests import toy

HELD = tuple((0, f"robot/finger_{side}", "mug/body", 5.0, (1, 0, 0)) for side in ("left", "right"))
ALLOWED = Permissions({"obj": ("body",)}, {"obj": ("counter",)})


def step(*rows, **changed):
    return dataclasses.replace(toy.at_rest(**changed), contacts=toy.contacts(*rows))


def watch(allowed=ALLOWED, before=(), roles=("obj",)):
    arm = Arm(toy.SCENE, step(*before))
    arm.permissions = allowed
    return Watch(arm, roles)


def touch(one, other, force):
    return (0, one, other, force, (1, 0, 0))


@pytest.mark.parametrize(
    ("row", "wrong"),
    [
        (touch("robot/link5", "counter/body", LIMB), "link5 presses on counter's body with 3 N"),
        (touch("counter/body", "robot/link5", LIMB), "link5 presses on counter's body"),
        (touch("robot/link5", "counter/body", 0.9 * LIMB), ""),
        (touch("robot/finger_left", "mug/body", HAND), "finger_left presses on mug's body"),
        (touch("robot/finger_left", "mug/body", 0.9 * HAND), ""),
        (touch("robot/finger_left", "apple/body", STRAY), "finger_left presses on apple's body"),
        (touch("robot/finger_left", "apple/body", 0.9 * STRAY), ""),
        (touch("mug/body", "cabinet/door", 50.0), ""),  # nobody holds it
    ],
)
def test_a_limb_may_touch_nothing_and_the_hand_what_it_has_a_reason_to(row, wrong):
    assert watch().wrong(step(row)).startswith(wrong)
    assert bool(watch().wrong(step(row))) == bool(wrong)


def test_what_is_held_may_press_on_what_it_may_rest_on():
    on_counter = touch("mug/body", "counter/body", 10.0 * LOAD)
    on_door = touch("cabinet/door", "mug/body", LOAD)
    assert not watch().wrong(step(*HELD, on_counter))
    assert watch().wrong(step(*HELD, on_door)) == "mug presses on cabinet's door with 4 N"
    assert not watch(before=(on_door,)).wrong(step(*HELD, on_door))


def test_what_touched_before_the_skill_is_no_knock():
    lying = touch("robot/link5", "counter/body", 20.0)
    assert not watch(before=(lying,)).wrong(step(lying))


def test_a_limb_that_lay_against_something_may_press_no_harder():
    lying, pressed = (touch("robot/link5", "counter/body", force) for force in (20.0, 25.0))
    assert watch(before=(lying,)).wrong(step(pressed)).startswith("link5 presses on counter")
    held = [touch("robot/finger_left", "apple/body", force) for force in (20.0, 25.0)]
    assert not watch(before=held[:1]).wrong(step(held[1]))


def test_without_permissions_a_skill_may_touch_all_of_what_it_is_about():
    fingers = touch("robot/finger_left", "cabinet/door", 10.0)
    assert not watch(None, roles=("cab",)).wrong(step(fingers))
    assert watch(None, roles=("obj",)).wrong(step(fingers))


def test_what_the_skill_is_not_about_stays_where_it_is():
    moved = ((0.0, 0.3, 0.95, *toy.UPRIGHT), (0.4, 0.04, 0.94, *toy.UPRIGHT))
    assert watch().left(step(object_pose=moved)) == "apple was moved by 4 cm"
    assert not watch(roles=("obj", "apple")).left(step(object_pose=moved))
    # What may rest on what is carried came along.
    assert not watch(Permissions({}, {"apple": ("obj",)})).left(step(object_pose=moved))


def test_what_lay_in_it_before_comes_along():
    moved = ((0.0, 0.3, 0.95, *toy.UPRIGHT), (0.4, 0.04, 0.94, *toy.UPRIGHT))
    lies_in = touch("apple/body", "mug/body", 0.3)
    assert not watch(before=(lies_in,)).left(step(lies_in, object_pose=moved))


def test_what_lay_on_it_before_does_not_fall_off():
    moved = ((0.0, 0.3, 0.95, *toy.UPRIGHT), (0.4, 0.04, 0.94, *toy.UPRIGHT))
    lies_on = touch("apple/body", "mug/body", 0.3)
    looking = watch(before=(lies_on,))
    assert not looking.left(step(lies_on, object_pose=moved))
    on_counter = touch("apple/body", "counter/body", 0.3)
    assert looking.left(step(on_counter, object_pose=moved)) == "apple fell off what it lay on"


def test_what_something_is_put_on_is_not_pushed_away():
    def put(far, before=HELD):
        moved = ((0.0, 0.3, 0.95, *toy.UPRIGHT), (0.4 + far, 0.0, 0.94, *toy.UPRIGHT))
        return watch(before=before, roles=("obj", "apple")).left(step(object_pose=moved))

    assert put(0.12) == "apple was pushed away by 12 cm"
    assert not put(0.08)
    # It came out with the drawer in which what is to be taken lies.
    assert not put(0.12, before=())


def test_what_moves_in_closed_fingers_slips_and_what_open_ones_let_go_does_not():
    def lowered(commands):
        looking = watch()
        places = ((0.0, 0.3, 0.95 - 0.01 * number, *toy.UPRIGHT) for number in range(4))
        apple = toy.at_rest().object_pose[1].tolist()
        steps = [step(*HELD, object_pose=(place, apple), commands=commands) for place in places]
        return [looking.wrong(one) for one in steps], looking.slipped

    wrong, slipped = lowered((1.0,))
    assert wrong == ["", "", "", "mug slipped by 3 cm and 0 degrees in the fingers"]
    assert slipped
    assert lowered((-1.0,)) == ([""] * 4, False)
