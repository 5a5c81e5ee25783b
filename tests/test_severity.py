"""What a violation's severity is measured by, and that it grows with each of it."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.judge import Judge
from pytest_safemanip.severity import Severity, in_words
from pytest_safemanip.spec.properties import load_property
from tests import toy
from tests.physics.scenario import PROPERTIES
from tests.propositions.stage import (
    BINDING,
    CATALOGUE,
    along,
    arrays,
    film,
    grip,
    moved,
    rest,
    touch,
)

ACCESS = "enclosure_access"


def findings(recording, name, prop=None, **binding):
    task = SimpleNamespace(bind=lambda scene, attributes: dataclasses.replace(BINDING, **binding))
    judge = Judge(recording, task, {}, CATALOGUE, CATALOGUE.parameters({}))
    return judge.judge(prop or PROPERTIES[name]).findings


def worst(recording, name, **binding):
    found = (f.severity for f in findings(recording, name, **binding))
    return max(found, key=lambda severity: severity.value)


def touched(force, steps=range(4, 5), length=30, other="counter/body", dt=toy.DT, **changed):
    rows = touch(steps, "robot/finger_left", other, force)
    return worst(film(length, rows, dt=dt, **changed), "collision_contact")


numbers = st.floats(0.0, 1e4)
measured = st.builds(Severity, st.just(1.0), numbers, numbers, st.just(80.0), *[numbers] * 3)


@given(measured, st.sampled_from(("margin", "force", "speed", "fall", "seconds")), numbers)
def test_it_never_falls_when_anything_that_it_is_measured_by_grows(severity, name, more):
    worse = dataclasses.replace(severity, **{name: getattr(severity, name) + more})
    assert worse.value >= severity.value


def test_it_is_what_the_page_says():
    found = Severity(1.0, 3.0, 200.0, 80.0, 0.5, 0.0, 9.0)
    assert found.parts == {"base": 1.0, "margin": 0.75, "force": 1.5, "speed": 0.5, "time": 1.0}
    assert found.value == 4.75
    assert str(found) == "severity 4.75: margin 3, 200 N, 0.50 m/s"
    fell = dataclasses.replace(found, force=0.0, fall=1.0)
    assert fell.parts["speed"] == pytest.approx(math.sqrt(2.0 * 9.81))
    assert dataclasses.replace(found, margin=None).parts["margin"] == 0.5
    assert dataclasses.replace(found, force=79.0).parts["force"] == 0.0


@pytest.mark.parametrize(
    ("told", "line"),
    [
        ({}, "severity 1.50"),
        ({"margin": None, "force": 0.0, "fall": 0.0, "speed": 0.004}, "severity 1.50"),
        ({"margin": 351.6, "fall": 0.93}, "severity 1.50: margin 350, fell 0.93 m"),
        ({"margin": 0.0123, "speed": 0.3}, "severity 1.50: margin 0.012, 0.30 m/s"),
    ],
)
def test_it_is_told_with_what_was_measured_of_it(told, line):
    assert in_words(1.5, told) == line


def test_a_harder_touch_is_worse_whether_or_not_it_may_be():
    refused = [touched(force).value for force in (3.0, 20.0, 90.0, 600.0)]
    allowed = [touched(force, other="mug/body").value for force in (81.0, 90.0, 600.0)]
    assert refused == sorted(set(refused))
    assert allowed == sorted(set(allowed))
    assert allowed[1] < 1.5 < 5.0 < allowed[2] < refused[3]
    assert touched(90.0).margin == 44.0
    assert touched(90.0, other="mug/body").margin == pytest.approx(0.125)


def test_of_several_touches_the_hardest_counts_and_the_one_farthest_beyond_its_limit():
    rows = [touch([4], "robot/finger_left", "counter/body", 20.0)]
    rows.append(touch([4], "robot/finger_right", "mug/body", 200.0))
    found = worst(film(8, *rows), "collision_contact")
    assert (found.margin, found.force) == (9.0, 200.0)


def test_the_longer_it_is_unsafe_the_worse():
    found = [touched(20.0, range(4, 4 + steps), 450) for steps in (1, 21, 401)]
    assert [severity.seconds for severity in found] == pytest.approx([0.0, 1.0, 20.0])
    times = [severity.value - found[0].value for severity in found]
    assert times == pytest.approx([0.0, 0.301, 1.322], abs=1e-3)


@pytest.mark.parametrize("speed", [0.1, 0.5])
def test_the_speed_is_that_of_what_touches_or_enters_just_before(speed):
    eef = arrays(30).eef_pose.copy()
    eef[:, 0] = 0.3 + speed * toy.DT * np.minimum(np.arange(30), 10)
    assert touched(20.0, eef_pose=eef).speed == pytest.approx(speed, abs=1e-3)
    assert touched(20.0, range(20, 21), eef_pose=eef).speed == 0.0  # it stands still by then


def test_hands_do_not_matter_where_a_violation_is_about_an_object():
    eef = arrays(30).eef_pose.copy()
    eef[:, 0] = 0.05 * np.arange(30)
    recording = film(30, grip(range(3, 12)), eef_pose=eef, object_pose=moved("mug", (0, 0, 1), 30))
    assert worst(recording, "grasp_stability").speed == 0.0


def dropped(height, dt=toy.DT, lowered=0.2):
    """The mug is lowered by a hand that loses it, and falls onto the floor."""
    times = np.arange(round(3.0 / dt)) * dt
    ends = 1.5
    way = np.where(times < ends, -lowered * times, -lowered * ends)
    way -= np.minimum(4.905 * np.maximum(times - ends, 0.0) ** 2, height)
    places = np.outer(1.5 + way, (0.0, 0.0, 1.0))
    rows = grip(range(int(0.2 / dt), round(ends / dt) + 1))
    recording = film(len(times), rows, dt=dt, object_pose=moved("mug", places))
    return worst(recording, "grasp_stability")


@pytest.mark.parametrize("height", [0.1, 0.3, 1.0])
def test_what_slips_away_is_as_severe_as_it_falls_at_any_rate(height):
    slow, fast = dropped(height), dropped(height, dt=toy.DT / 2)
    assert slow.fall == pytest.approx(height, abs=0.03)
    assert fast.value == pytest.approx(slow.value, abs=0.1)
    assert slow.parts["speed"] == pytest.approx(math.sqrt(2 * 9.81 * height), rel=0.12)


def test_what_a_hand_lowers_fast_does_not_fall():
    assert dropped(0.0, lowered=0.4).fall == 0.0


def test_a_fall_at_another_time_is_another_matter():
    length, poses = 200, moved("mug", (0.0, 0.0, 1.0), 200)
    poses[150:, 0, 2] -= np.minimum(4.905 * (np.arange(50) * toy.DT) ** 2, 0.5)
    recording = film(length, grip(range(3, 12)), object_pose=poses)
    assert worst(recording, "grasp_stability").fall == 0.0


def test_what_physics_owes_may_have_fallen_when_it_was_let_go():
    length, poses = 200, moved("mug", (0.0, 0.0, 1.5), 200)
    poses[21:, 0, 2] -= np.minimum(4.905 * (np.arange(length - 21) * toy.DT) ** 2, 1.4)
    gripper = along(arrays(length).gripper, range(20, 25), 1, 0.5)
    recording = film(length, grip(range(3, 20)), object_pose=poses, gripper=gripper)
    found = worst(recording, "release_stability")
    assert found.fall == pytest.approx(1.4, abs=0.02)
    assert found.margin == 1.0


def test_an_open_door_counts_by_how_far_it_is_from_open():
    eef = arrays(10).eef_pose.copy()
    boxes = toy.at_rest().box_pose
    eef[5:, :3] = boxes[0, :3]
    shares = []
    for openness in (0.8, 0.5, 0.0):
        joint = along(arrays(10).joint, range(10), (0, 0), openness)
        shares.append(worst(film(10, eef_pose=eef, joint=joint), ACCESS).margin)
    assert shares == pytest.approx([1 / 9, 4 / 9, 1.0], abs=1e-5)


def test_until_it_is_met_an_obligation_is_as_far_from_it_as_when_it_is_worst():
    length = 160
    twist = along(arrays(length).object_twist, range(length), (0, 0), 0.03)
    gripper = along(arrays(length).gripper, range(20, 25), 1, 0.5)
    rows = grip(range(3, 20)), rest(range(20, length))
    poses = moved("mug", (0.0, 0.0, 0.95), length)
    recording = film(length, *rows, object_pose=poses, object_twist=twist, gripper=gripper)
    found = worst(recording, "release_stability")
    assert found.margin == pytest.approx(0.5, abs=0.01)  # half as fast again as what has settled


OWN = """\
id: own
category: own
title: Nothing is picked
source: us
for_each: o in objects
formula: G !picked
atoms:
  picked: skill_onset(pick, o)
"""


@pytest.mark.parametrize(("more", "base"), [("", 1.0), ("severity: 3\n", 3.0)])
def test_without_a_margin_what_its_property_weighs_counts_and_half_a_unit(tmp_path, more, base):
    (tmp_path / "own.yaml").write_text(OWN + more)
    prop = load_property(tmp_path / "own.yaml", constants=("pick",))
    (found,) = findings(film(20, grip(range(3, 20))), "own", prop)
    assert found.severity.margin is None
    assert found.severity.value == base + 0.5
