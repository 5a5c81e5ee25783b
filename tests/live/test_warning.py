"""Violations that are near are said before they happen, and others are not."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_safemanip.errors import JudgementError
from pytest_safemanip.live import LiveJudge, LiveMonitor
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.spec.properties import load_properties
from tests import toy
from tests.live.test_judge import PROPERTIES
from tests.live.test_monitor import SHELF, fed
from tests.propositions.stage import BINDING, CATALOGUE, along, arrays, film, grip, moved, rest

OPEN, CLOSE = (-1.0,), (1.0,)
SKILLS = dataclasses.replace(BINDING, skills=(("place", "mug"),))
HELD = np.full((12, 1), 1.0, np.float32)


def judged(recording, *names, binding=SKILLS, chosen=None):
    """A judge that has seen a whole recording."""
    chosen = [PROPERTIES[name] for name in names] if chosen is None else chosen
    parameters = CATALOGUE.parameters({})
    judge = LiveJudge(recording.scene, binding, chosen, CATALOGUE, parameters)
    for step, action, acting in recording.steps:
        judge.step(step, action, acting)
    return judge


def hand(places):
    """End effector poses over time."""
    return np.array([(*place, *toy.UPRIGHT) for place in places], np.float32)


def held_at(place, length=12):
    """The mug in closed fingers for a while."""
    at = np.repeat([(*place, *toy.UPRIGHT)], length, axis=0).astype(np.float32)
    return film(
        length,
        grip(range(length)),
        object_pose=moved("mug", place, length),
        eef_pose=at,
        commands=HELD[:length],
    )


@pytest.mark.parametrize(
    ("place", "near"),
    [
        ((1.5, 0.0, 0.96), True),  # beside the counter
        ((0.99, 0.0, 0.96), False),  # near its edge, but its centre of mass is above it
        ((1.004, 0.0, 0.96), True),
        ((0.0, 0.0, 0.96), False),  # a centimetre above it
        ((0.0, 0.0, 1.2), True),  # too high
    ],
)
def test_a_hand_that_is_told_to_open_is_warned_where_nothing_would_catch_what_it_holds(place, near):
    judge = judged(held_at(place), "release_stability", "action_onset")
    assert judge.warnings(CLOSE) == []
    found = {one.property_id: one for one in judge.warnings(OPEN)}
    assert ("release_stability" in found) == near
    if near:
        drop = found["release_stability"]
        assert drop.entities == ("mug",)
        assert drop.last_chance < 0.25
        assert drop.time_to_violation == pytest.approx(drop.last_chance + 5.0)
        assert set(drop.atoms) == {"obj_released", "obj_grasped"}
        assert (drop.margin, drop.rate) == (None, None) or drop.atoms[-1] == "obj_grasped"


def test_a_hand_that_moves_while_it_lets_go_is_warned_where_the_load_would_slide_off():
    places = [(0.5 + 0.02 * n, 0.0, 0.951) for n in range(24)]
    recording = film(
        24,
        grip(range(24)),
        object_pose=moved("mug", places),
        eef_pose=hand(places),
        commands=np.full((24, 1), 1.0, np.float32),
    )
    assert judged(held_at(places[-1]), "release_stability").warnings(OPEN) == []
    assert judged(recording, "release_stability").warnings(OPEN)


@pytest.mark.parametrize("wrong", [-0.1, math.nan, "0.25", None, True])
def test_a_horizon_or_a_pace_that_is_no_number_from_0_up_is_refused(wrong):
    judge = judged(held_at((0.3, 0.0, 1.0)), "release_stability")
    for option in ("horizon", "pace"):
        with pytest.raises(ValueError, match=f"{option}: expected a number from 0 up, found "):
            judge.warnings(OPEN, **{option: wrong})
    with pytest.raises(ValueError, match=r"commands: expected finite numbers, found \[nan\]"):
        judge.warnings((math.nan,))
    assert len(judge.warnings(OPEN, horizon=1e9)) == len(judge.warnings(OPEN, horizon=math.inf))


def toward_mug(speed, length=9, start=0.5):
    """The hand comes along x at a speed to the mug, which the task has no use for."""
    places = [(start - speed * toy.DT * n, 0.0, 0.96) for n in range(length)]
    binding = dataclasses.replace(BINDING, touch=frozenset({("apple", "body")}))
    far = moved("apple", (0.0, 0.4, 0.94), length)
    recording = film(length, eef_pose=hand(places), object_pose=far)
    gap = places[-1][0] - 0.1  # half of the hand's box, and half of the mug
    return recording, binding, gap


def test_the_hand_is_warned_of_what_it_moves_to_and_may_not_touch():
    recording, binding, gap = toward_mug(0.8)
    judge = judged(recording, "collision_contact", binding=binding)
    (one,) = judge.warnings()
    assert one.atoms == ("bad_contact",)
    assert one.time_to_violation == one.last_chance == pytest.approx(gap / 0.8, abs=0.01)
    assert one.margin == -1.0  # no force yet
    assert judge.time_to_violation() == {"collision_contact": one.time_to_violation}
    assert judge.warnings(horizon=0.05) == []
    assert judge.warnings(pace=0.0) == []  # it is told to stop
    assert judge.time_to_violation(pace=0.5)["collision_contact"] == pytest.approx(
        gap / 0.4, abs=0.01
    )


def test_a_warning_stays_until_what_it_is_of_happens():
    """Boxes meet a step before what is in them."""
    for speed, expected in ((0.4, 0.0), (0.1, math.inf)):  # what creeps may only graze it
        recording, binding, gap = toward_mug(speed, start=0.09 + speed * toy.DT * 8)
        assert gap == pytest.approx(-0.01)
        judge = judged(recording, "collision_contact", binding=binding)
        assert judge.time_to_violation() == {"collision_contact": expected}


def test_nothing_is_near_where_the_hand_may_touch_it_gently_or_moves_away_or_brakes():
    recording, binding, _ = toward_mug(0.1, start=0.16)
    assert judged(recording, "collision_contact", binding=binding).warnings(horizon=0.5)
    assert judged(recording, "collision_contact").warnings(horizon=0.5) == []
    away, _, _ = toward_mug(-0.5, start=0.2)
    assert judged(away, "collision_contact", binding=binding).warnings(horizon=1.0) == []
    braking = np.cumsum([0.0, 0.04, 0.04, 0.04, 0.03, 0.02, 0.01])
    path = [(0.36 - way, 0.0, 0.96) for way in braking]
    slows = film(7, eef_pose=hand(path), object_pose=moved("apple", (0.0, 0.4, 0.94), 7))
    assert judged(slows, "collision_contact", binding=binding).warnings(horizon=0.4) == []


def test_what_is_held_is_warned_of_what_it_is_carried_to():
    places = [(0.0 + 0.04 * n, 0.0, 1.0) for n in range(8)]
    held = np.asarray(moved("mug", places))
    held[:, 1, :3] = (0.42, 0.0, 1.0)
    above = hand([(x, y, 1.2) for x, y, _ in places])
    recording = film(8, grip(range(8)), object_pose=held, eef_pose=above, commands=HELD[:8])
    (one,) = judged(recording, "collision_contact").warnings()
    assert one.atoms == ("collision",)
    rides = dataclasses.replace(BINDING, supports={"mug": frozenset({"apple"})})
    assert judged(recording, "collision_contact", binding=rides).warnings() == []


def test_the_hand_is_warned_before_it_reaches_into_what_is_shut():
    places = [(0.0, 0.04 * n, 1.5) for n in range(8)]
    shut = judged(film(8, eef_pose=hand(places)), "enclosure_access")
    (one,) = shut.warnings(horizon=0.3)
    assert one.atoms == ("reach_in",)
    assert one.time_to_violation == pytest.approx((0.4 - 0.28) / 0.8, abs=1e-3)
    still = arrays(8)
    ajar = along(still.joint, range(8), (slice(None), 0), 1.0)
    open_ = judged(film(8, eef_pose=hand(places), joint=ajar), "enclosure_access")
    assert open_.warnings(horizon=0.3) == []


def test_a_margin_and_its_rate_say_when_a_limit_is_reached(tmp_path):
    (tmp_path / "apart.yaml").write_text(
        "id: apart\ncategory: own\ntitle: They stay apart\nsource: own\nformula: G !near\n"
        "for_each: c, r in transfers\natoms:\n  near: near(c, r)\n"
    )
    chosen = [load_properties([tmp_path])["apart"]]
    binding = dataclasses.replace(BINDING, transfers=(("mug", "apple"),))

    def rolls(speed):
        places = [(0.12 + speed * toy.DT * n, 0.0, 0.95) for n in range(9)]
        recording = film(9, object_pose=moved("mug", places))
        gap = 0.4 - 0.04 - 0.05 - places[-1][0]  # half of the apple's box, and half of the mug's
        return judged(recording, chosen=chosen, binding=binding), gap

    judge, gap = rolls(0.1)
    (one,) = judge.warnings(horizon=1.0)
    margin, rate = (0.1 - gap) / 0.1, 0.1 / 0.1  # of a limit of 10 cm
    assert one.margin == pytest.approx(margin, abs=1e-4)
    assert one.rate == pytest.approx(rate, rel=1e-3)
    assert one.time_to_violation == pytest.approx(-margin / rate, rel=1e-3)
    assert (one.property_id, one.entities) == ("apart", ("mug", "apple"))
    assert rolls(-0.1)[0].time_to_violation() == {"apart": math.inf}


def test_nothing_is_near_in_the_settle_tail_and_a_violation_is_no_time_away():
    falls = film(14, grip(range(3, 12)), commands=np.full((14, 1), 1.0, np.float32), tail=0)
    assert judged(falls, "grasp_stability").time_to_violation() != {}
    recording = held_at((1.5, 0.0, 1.2))
    judge = judged(recording, "release_stability")
    step, action, _ = list(recording.steps)[-1]
    judge.step(step, action, False)
    assert judge.warnings(OPEN) == []


def test_a_command_for_each_gripper_is_asked_for():
    judge = judged(held_at((0.0, 0.0, 1.0)), "release_stability")
    with pytest.raises(ValueError, match=r"commands: expected one for each gripper \(1,\), found"):
        judge.warnings((1.0, 1.0))


def test_a_robot_that_observes_everything_is_warned_of_the_same():
    recording = held_at((1.5, 0.0, 1.2))
    names = ["release_stability", "grasp_stability"]
    monitor = LiveMonitor(toy.SCENE, BINDING, names, boxes=SHELF)
    blind = LiveMonitor(toy.SCENE, BINDING, names, boxes=SHELF)
    for reading, acting in fed(recording):
        monitor.step(**reading, acting=acting)
        blind.step(**{**reading, "contacts": None}, acting=acting)
    expected = judged(recording, *names, binding=BINDING).warnings(OPEN)
    assert expected
    assert monitor.warnings(OPEN) == expected
    assert monitor.time_to_violation(OPEN)["release_stability"] == expected[0].time_to_violation
    assert blind.warnings(OPEN) == []  # it does not know that it holds anything


def test_an_object_at_rest_that_nobody_holds_is_near_nothing():
    judge = judged(film(12, rest(range(12))), "release_stability", "grasp_stability")
    assert set(judge.time_to_violation(OPEN).values()) == {math.inf}


def test_the_pace_is_how_far_an_action_is_from_holding_still_beside_the_last_one():
    robot, index = toy.ROBOT, toy.ROBOT.actions.index

    def action(x, grip=1.0, mode=-1.0):
        told = np.zeros(robot.actions.size)
        told[0], told[index("gripper_close")], told[index("control_mode")] = x, grip, mode
        return told

    assert robot.pace(action(0.5), []) == 1.0
    assert robot.pace(action(0.2), [action(0.0), action(0.8)]) == pytest.approx(0.25)
    assert robot.pace(action(0.9), [action(0.8)]) == 1.0  # it may go faster: that is not counted on
    assert robot.pace(action(0.0, grip=-1.0), [action(0.8)]) == 0.0
    assert robot.pace(action(0.2, mode=1.0), [action(0.8)]) == 1.0  # then it is the base that moves


def test_a_margin_that_raises_is_an_error_that_names_property_and_proposition(tmp_path):
    def margin(view, o):
        raise RuntimeError("boom")

    (tmp_path / "own.yaml").write_text(
        "id: own\ncategory: own\ntitle: Own\nsource: own\nformula: G !mine\n"
        "for_each: o in objects\natoms:\n  mine: mine(o)\n"
    )
    always = CATALOGUE["settled"].evaluate
    own = Proposition("mine", ("object",), lambda _: 1.0, (), always, margin=margin)
    catalogue = Catalogue([own])
    chosen = load_properties([tmp_path], propositions=catalogue)["own"]
    recording = film(9)
    judge = LiveJudge(recording.scene, BINDING, [chosen], catalogue, catalogue.parameters({}))
    for step in recording.steps:
        judge.step(*step)
    line = margin.__code__.co_firstlineno + 1
    message = (
        rf"^own cannot be judged: mine\(mug\): RuntimeError: boom \(\S*test_warning.py:{line}\)$"
    )
    with pytest.raises(JudgementError, match=message):
        judge.warnings()
