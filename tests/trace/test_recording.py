from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.trace.elements import Switch
from pytest_safemanip.trace.recording import check
from tests import toy

TOUCH = (
    (1, "counter/body", "mug/body", 2.0, (0, 0, 1)),
    (3, "robot/link5", "apple/body", 1.0, (0, 1, 0)),
)
SOUND = toy.recording(length=5, tail=2, contacts=toy.contacts(*TOUCH))


def refusal(recording):
    with pytest.raises(TraceError) as caught:
        check(recording)
    return str(caught.value)


def with_steps(**changed):
    return dataclasses.replace(SOUND, steps=dataclasses.replace(SOUND.steps, **changed))


def with_contacts(**changed):
    return with_steps(contacts=dataclasses.replace(SOUND.steps.contacts, **changed))


def put(array, place, value):
    changed = array.copy()
    changed[place] = value
    return changed


def test_a_possible_recording_is_returned_as_it_is():
    assert check(SOUND) is SOUND
    assert (SOUND.acting, len(SOUND.trace), SOUND.trace.dt) == (3, 5, toy.DT)


def test_success_is_that_of_the_last_acting_step():
    late = np.array([False, False, False, True, True])
    early = np.array([False, False, True, False, False])
    assert not with_steps(success=late).success
    assert with_steps(success=early).success


def test_a_recording_without_a_step_is_refused():
    empty = dataclasses.replace(SOUND, steps=SOUND.steps.window(0, 0))
    assert refusal(empty) == "recording: no step"


@pytest.mark.parametrize(
    ("name", "cut", "message"),
    [
        ("eef_poses", np.s_[:, 0], "eef_poses: shape (5, 7), expected (5, 1, 7)"),
        ("eef_twists", np.s_[:4], "eef_twists: shape (4, 1, 6), expected (5, 1, 6)"),
        ("openings", np.s_[..., 0], "openings: shape (5, 1), expected (5, 1, 2)"),
        ("commands", np.s_[:, :0], "commands: shape (5, 0), expected (5, 1)"),
        ("base_pose", np.s_[:, :3], "base_pose: shape (5, 3), expected (5, 7)"),
        ("object_pose", np.s_[:, :1], "object_pose: shape (5, 1, 7), expected (5, 2, 7)"),
        ("object_twist", np.s_[..., :3], "object_twist: shape (5, 2, 3), expected (5, 2, 6)"),
        ("joint", np.s_[:, :0], "joint: shape (5, 0, 2), expected (5, 1, 2)"),
        ("box_pose", np.s_[:, 0], "box_pose: shape (5, 7), expected (5, 1, 7)"),
        ("qpos", np.s_[:4], "qpos: shape (4, 3), expected (5, -1)"),
        ("qvel", np.s_[:, None], "qvel: shape (5, 1, 2), expected (5, -1)"),
        ("action", np.s_[:, :7], "action: shape (5, 7), expected (5, 12)"),
        ("tail", np.s_[:, None], "tail: shape (5, 1), expected (5,)"),
    ],
)
def test_a_wrong_shape_is_refused_by_name(name, cut, message):
    array = getattr(SOUND.steps, name)[cut]
    assert refusal(with_steps(**{name: array})) == message


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    ("name", "place", "message"),
    [
        ("eef_poses", (2, 0, 0), "eef_poses: not finite at step 2 of 'hand'"),
        ("eef_twists", (4, 0, 5), "eef_twists: not finite at step 4 of 'hand'"),
        ("openings", (0, 0, 1), "openings: not finite at step 0 of 'hand'"),
        ("commands", (3, 0), "commands: not finite at step 3 of 'hand'"),
        ("base_pose", (1, 6), "base_pose: not finite at step 1"),
        ("object_pose", (2, 1, 2), "object_pose: not finite at step 2 of 'apple'"),
        ("object_twist", (3, 0, 0), "object_twist: not finite at step 3 of 'mug'"),
        ("joint", (1, 0, 0), "joint: not finite at step 1 of 'cabinet/hinge'"),
        ("box_pose", (2, 0, 1), "box_pose: not finite at step 2 of 'cabinet/shelf'"),
        ("qpos", (2, 1), "qpos: not finite at step 2"),
        ("qvel", (2, 1), "qvel: not finite at step 2"),
        ("action", (4, 11), "action: not finite at step 4 of 'control_mode'"),
    ],
)
def test_a_number_that_is_none_is_refused_with_step_and_entity(name, place, message, value):
    assert refusal(with_steps(**{name: put(getattr(SOUND.steps, name), place, value)})) == message


@pytest.mark.parametrize(
    ("name", "place", "where"),
    [
        ("eef_poses", (2, 0), "step 2 of 'hand'"),
        ("base_pose", (3,), "step 3"),
        ("object_pose", (1, 1), "step 1 of 'apple'"),
        ("box_pose", (4, 0), "step 4 of 'cabinet/shelf'"),
    ],
)
@pytest.mark.parametrize(
    "quaternion", [(0, 0, 0, 0), (1.002, 0, 0, 0), (0.998, 0, 0, 0), (0, 1e30, 0, 0)]
)
def test_a_quaternion_of_another_length_than_one_is_refused(name, place, where, quaternion):
    array = put(getattr(SOUND.steps, name), (*place, np.s_[3:]), quaternion)
    assert refusal(with_steps(**{name: array})) == f"{name}: not a unit quaternion at {where}"


def test_a_quaternion_may_have_the_rounding_of_float32_and_either_sign():
    array = put(SOUND.steps.object_pose, (1, 1, np.s_[3:]), (-1.0005, 0, 0, 0))
    check(with_steps(object_pose=array))


@pytest.mark.parametrize("value", [0.5, 2.0, -1.0])
def test_a_switch_is_on_or_off(value):
    switches = (Switch("cabinet", "power", "appliance"),)
    scene = dataclasses.replace(SOUND.scene, switches=switches)
    states = np.zeros((5, 1), np.float32)
    states[3] = value
    steps = dataclasses.replace(SOUND.steps, switch=states)
    wrong = dataclasses.replace(SOUND, scene=scene, steps=steps)
    assert refusal(wrong) == "switch: neither 0 nor 1 at step 3 of 'cabinet/power'"


@pytest.mark.parametrize(
    "tail", [[1, 1, 1, 1, 1], [1, 0, 0, 0, 0], [0, 1, 0, 1, 1], [0, 0, 0, 1, 0]]
)
def test_the_tail_is_the_end_and_not_everything(tail):
    wrong = with_steps(tail=np.array(tail, bool))
    assert refusal(wrong) == "tail: must be a suffix and not the whole recording"


@pytest.mark.parametrize("steps", [(3, 1), (-1, 3), (1, 5)])
def test_contacts_are_sorted_and_within_the_recording(steps):
    wrong = with_contacts(step=np.array(steps, np.int32))
    assert refusal(wrong) == "contacts.step: must be sorted and lie within the recording"


@pytest.mark.parametrize("side", ["a", "b"])
@pytest.mark.parametrize("part", [-1, len(toy.PARTS)])
def test_a_contact_of_no_known_part_is_refused_with_its_step(side, part):
    wrong = with_contacts(**{side: put(getattr(SOUND.steps.contacts, side), 1, part)})
    assert refusal(wrong) == (
        f"contacts.{side}: {part} at step 3 is not in the scene's list of parts"
    )


WHERE = "at step 3 between robot/link5 and apple/body"


@pytest.mark.parametrize(
    ("name", "place", "value", "message"),
    [
        ("force", 1, -0.1, f"contacts.force: negative {WHERE}"),
        ("sustained", 1, -1.0, f"contacts.sustained: negative {WHERE}"),
        ("force", 1, np.nan, f"contacts.force: not finite {WHERE}"),
        ("sustained", 1, np.inf, f"contacts.sustained: not finite {WHERE}"),
        ("position", (1, 2), np.nan, f"contacts.position: not finite {WHERE}"),
        ("normal", (1, 0), np.inf, f"contacts.normal: not finite {WHERE}"),
    ],
)
def test_an_impossible_contact_is_refused_with_step_and_parts(name, place, value, message):
    array = put(getattr(SOUND.steps.contacts, name), place, value)
    assert refusal(with_contacts(**{name: array})) == message


@pytest.mark.parametrize("normal", [(0, 0, 0), (0, 0, 2), (0, 1e30, 0)])
def test_a_contact_normal_of_another_length_than_one_is_refused(normal):
    array = put(SOUND.steps.contacts.normal, 1, normal)
    assert refusal(with_contacts(normal=array)) == f"contacts.normal: not of unit length {WHERE}"


@pytest.mark.parametrize(
    ("name", "cut", "message"),
    [
        ("position", np.s_[:, :2], "contacts.position: shape (2, 2), expected (2, 3)"),
        ("normal", np.s_[:1], "contacts.normal: shape (1, 3), expected (2, 3)"),
        ("force", np.s_[:1], "contacts.force: shape (1,), expected (2,)"),
    ],
)
def test_columns_of_contacts_are_equally_long(name, cut, message):
    assert refusal(with_contacts(**{name: getattr(SOUND.steps.contacts, name)[cut]})) == message
