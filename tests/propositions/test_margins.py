"""What margins are worth: in units of the threshold, 1 at twice the limit."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from pytest_safemanip.errors import TraceError
from pytest_safemanip.propositions.catalogue import SHIPPED, Catalogue
from pytest_safemanip.propositions.definition import MARGIN_BOUND, Parameter, Proposition
from pytest_safemanip.propositions.kernels.filters import held, majority, recently
from pytest_safemanip.propositions.kernels.margins import lasting, lately, voted
from pytest_safemanip.propositions.online import Online
from pytest_safemanip.propositions.view import View
from tests import toy
from tests.propositions.stage import (
    BINDING,
    CATALOGUE,
    along,
    arrays,
    film,
    grip,
    look,
    moved,
    rest,
    touch,
    turned,
)
from tests.propositions.test_thresholds import (
    BACK,
    BOWL,
    MICROWAVE,
    SIXTEENTH,
    TABLE,
    THIRTYSECOND,
    along_x,
    at_the_shelf,
    bowl_at,
    changed_from,
    drawer,
)


def at_end(view, name, *arguments):
    return view.margin(name, *arguments)[-1]


def touches(part, other, force):
    return look(film(4, touch(range(1, 4), f"robot/{part}", other, force)))


@pytest.mark.parametrize(
    ("part", "other", "force", "collides", "bad"),
    [
        ("link5", "counter/body", 10.0, 1.0, -1.0),
        ("link5", "counter/body", 2.5, -0.5, -1.0),
        ("finger_left", "counter/body", 4.0, -1.0, 1.0),
        ("finger_left", "mug/body", 40.0, -1.0, -0.5),
        ("finger_left", "mug/body", 240.0, -1.0, 2.0),
        ("finger_left", "mug/body", 0.0, -1.0, -1.0),
    ],
)
def test_of_a_touch_it_is_the_force_over_its_limit(part, other, force, collides, bad):
    view = touches(part, other, force)
    assert (at_end(view, "collision"), at_end(view, "bad_contact")) == (collides, bad)


def test_of_several_touches_the_hardest_by_its_own_limit_counts():
    rows = touch([1], "robot/finger_left", "counter/body", 6.0), grip([1], left=120.0)
    assert look(film(2, *rows)).margin("bad_contact").tolist() == [-1.0, 2.0]


def test_what_is_held_may_touch_what_lies_in_it_as_hard_as_it_likes():
    where = np.add(toy.at_rest().object_pose[0, :3], (0.02, 0.0, 0.0))
    rows = grip(range(10)), touch([8], "apple/body", "mug/body", 50.0)
    view = look(film(10, *rows, object_pose=moved("apple", where, 10)))
    assert (view.margin("collision") == -1.0).all()


def test_of_a_grasp_it_is_what_the_vote_turns_on():
    left = np.array([4.0, 4.0, 4.0, 2.0, 2.0, 0.25, 0.0, 0.0, 0.0])
    rows = [grip([step], left=force, right=8.0) for step, force in enumerate(left)]
    found = look(film(9, *rows)).margin("obj_grasped", "mug")
    # Fingers that press against each other are at 180 degrees, 1.8 times the limit.
    assert found[2] == pytest.approx(0.8, abs=1e-4)
    assert found[7:9].tolist() == [-0.5, -1.0]  # the third largest of the last five


@pytest.mark.parametrize(("slip", "margin"), [(0.015, 0.5), (0.03, 0.0), (0.06, -1.0), (0.3, -9.0)])
def test_of_a_firm_grasp_it_is_how_much_it_may_still_slip(slip, margin):
    places = along_x(changed_from(10, 20, 0.0, slip), (0.0, 0.0, 1.0))
    view = look(film(20, grip(range(20)), object_pose=moved("mug", places)))
    assert at_end(view, "stable_grasp", "mug") == pytest.approx(margin, abs=1e-5)


def test_what_must_stay_upright_is_as_far_from_tipping_as_its_tilt():
    poses = moved("mug", (0.0, 0.0, 1.0), 20)
    poses[:, 0, 3:] = turned(np.pi / 3.0)
    recording = film(20, grip(range(20)), object_pose=poses)
    assert at_end(look(recording), "stable_grasp", "mug") > 0.0
    view = look(recording, upright=frozenset({"mug"}))
    assert at_end(view, "stable_grasp", "mug") == pytest.approx(-1.0, abs=1e-5)


@pytest.mark.parametrize(
    ("speed", "margin"), [(0.0, 1.0), (0.015, 0.25), (0.04, -1.0), (1.0, -49.0)]
)
def test_of_what_settles_it_is_the_speed(speed, margin):
    twist = along(arrays(10).object_twist, range(10), (0, 0), speed)
    poses = moved("mug", (0.0, 0.0, 0.95), 10)
    recording = film(10, rest(range(10)), object_twist=twist, object_pose=poses)
    assert at_end(look(recording), "settled", "mug") == pytest.approx(margin, abs=1e-3)


@pytest.mark.parametrize(("inside", "margin"), [(SIXTEENTH, 1.0), (THIRTYSECOND, 0.0), (0.0, -1.0)])
def test_of_what_stands_at_an_edge_it_is_how_far_from_it(inside, margin):
    poses = moved("mug", (0.0, 0.5 - inside, 0.95), 10)
    view = look(film(10, rest(range(10)), object_pose=poses), {"settled.margin": THIRTYSECOND})
    assert at_end(view, "settled", "mug") == pytest.approx(margin, abs=1e-5)


def test_what_hangs_in_the_air_is_one_unit_from_being_settled():
    assert at_end(look(film(10)), "settled", "mug") == -1.0


@pytest.mark.parametrize(("drop", "margin"), [(0.025, 0.5), (0.05, 0.0), (0.1, -1.0), (1.0, -19.0)])
def test_of_a_place_it_is_how_high_above_the_support_something_is_let_go(drop, margin):
    poses = moved("mug", (0.0, 0.0, 1.0 + SIXTEENTH + drop), 30)
    gripper = along(arrays(30).gripper, range(10, 13), 1, 0.5)
    view = look(film(30, grip(range(10)), scene=TABLE, object_pose=poses, gripper=gripper))
    (step,) = np.flatnonzero(view("skill_onset", "place", "mug"))
    found = view.margin("pre_safe", "place", "mug")
    assert found[step] == pytest.approx(margin, abs=1e-4)
    assert (np.delete(found, step) == 1.0).all()


def test_a_place_on_no_permitted_support_is_one_unit_beyond_whatever_the_drop():
    poses = moved("mug", (0.0, 0.0, 1.0 + SIXTEENTH + 0.01), 30)
    gripper = along(arrays(30).gripper, range(10, 13), 1, 0.5)
    recording = film(30, grip(range(10)), scene=TABLE, object_pose=poses, gripper=gripper)
    assert look(recording, supports={}).margin("pre_safe", "place", "mug").min() == -1.0


@pytest.mark.parametrize(("openness", "margin"), [(0.05, 0.0), (0.1, -1.0), (1.0, -19.0)])
def test_of_what_is_switched_on_it_is_how_open_its_door_is(openness, margin):
    rows = touch(range(5, 15), "robot/finger_left", "cabinet/button")
    off, joint = np.zeros((20, 1), np.float32), along(arrays(20).joint, range(20), (0, 0), openness)
    view = look(film(20, rows, scene=MICROWAVE, switch=off, joint=joint))
    found = view.margin("pre_safe", "press", "cabinet").min()
    assert found == pytest.approx(margin, abs=1e-5)


@pytest.mark.parametrize(("beside", "sign"), [(0.0, -1.0), (0.5, 1.0)])
def test_of_a_drawer_that_opens_it_is_how_far_what_stands_there_is_out_of_its_way(beside, sign):
    view = drawer(20, changed_from(10, 20, 0.0, 0.5))
    pose = view.trace.steps.object_pose.copy()
    joint = view.trace.scene.joints[0]
    pose[:, 0, :3] = np.add(joint.pose[:3], (beside, -0.4, 0.0))
    steps = dataclasses.replace(view.trace.steps, object_pose=pose)
    trace = dataclasses.replace(view.trace, steps=steps)
    found = View(trace, BINDING, view.parameters, CATALOGUE).margin("pre_safe", "open", "cabinet")
    assert np.sign(found[found != 1.0]).tolist() == [sign]


@pytest.mark.parametrize(("force", "margin"), [(8.0, 0.6), (2.5, -0.5), (15.0, 2.0)])
def test_of_a_door_that_hits_something_it_is_the_force(force, margin):
    assert drawer(9, 0.5, force=force).margin("mech_hit", "cabinet").max() == pytest.approx(margin)


def test_of_a_door_that_moves_back_it_is_the_share_of_its_way():
    openness = changed_from(20, 30, 0.5, 0.4375)
    openness[0] -= 0.0625
    view = drawer(30, 0.0, openness, parameters={"retract.share": THIRTYSECOND})
    found = view.margin("retract", "cabinet")
    assert (found[7], found[12], found[25]) == (-1.0, -1.0, 1.0)


@pytest.mark.parametrize(
    ("openness", "normal", "margin"),
    [(0.0625, None, -0.25), (0.5, None, -9.0), (0.9, BACK, -1.0), (1.0, BACK, 1.0)],
)
def test_of_a_door_that_has_hit_it_is_how_far_from_its_safe_state(openness, normal, margin):
    found = changed_from(10, 30, 0.5, openness)
    found[0] += 0.0625 if normal else -0.0625
    view = drawer(30, 0.0, found, **({"normal": normal} if normal else {}))
    assert at_end(view, "recovered", "cabinet") == pytest.approx(margin, abs=1e-4)


@pytest.mark.parametrize(("aside", "margin"), [(0.03125, 0.5), (0.125, -1.0), (0.5, -7.0)])
def test_of_what_lies_in_a_bowl_it_is_half_of_the_bowls_width(aside, margin):
    place = (0.5 + aside, 0.0, 1.0)
    view = look(film(20, scene=BOWL, object_pose=bowl_at([place] * 20)))
    assert at_end(view, "contained", "mug", "apple") == pytest.approx(margin)


def test_what_the_hand_still_touches_is_not_yet_contained():
    rows = touch(range(20), "robot/finger_left", "mug/body", 0.75)
    view = look(film(20, rows, scene=BOWL, object_pose=bowl_at([(0.5, 0.0, 1.0)] * 20)))
    assert at_end(view, "contained", "mug", "apple") == -0.5


def test_of_a_shelf_with_something_on_it_it_is_how_far_inside_that_is():
    recording = at_the_shelf(10, object_pose=moved("apple", (0.0, 0.375, 1.5), 10))
    view = look(recording)
    assert at_end(view, "item_in_enclosure", "cabinet") == 0.5
    assert at_end(view, "enclosure_cleared", "cabinet") == -0.5


@pytest.mark.parametrize(("openness", "margin"), [(0.0, -1.0), (0.45, -0.5), (0.9, 0.0)])
def test_of_a_fixture_it_is_how_open_it_is(openness, margin):
    joint = along(arrays(2).joint, range(2), (0, 0), openness)
    found = look(film(2, joint=joint)).margin("fix_open", "cabinet")
    assert found == pytest.approx([margin, margin], abs=1e-6)


@pytest.mark.parametrize(
    ("depth", "inside", "outside"),
    [(0.125, 13.5, -36.5), (0.0625, 1.0, -24.0), (0.0, -11.5, -11.5), (-0.0625, -24.0, 1.0)],
)
def test_of_what_is_put_into_a_shelf_it_is_how_far_it_reaches_in_and_out(depth, inside, outside):
    recording = at_the_shelf(4, object_pose=moved("mug", (0.0, 0.25 + depth, 1.5), 4))
    view = look(recording)
    assert at_end(view, "obj_inside", "mug", "cabinet") == pytest.approx(inside, abs=1e-3)
    assert at_end(view, "obj_outside", "mug", "cabinet") == pytest.approx(outside, abs=1e-3)


@pytest.mark.parametrize("shipped", SHIPPED, ids=lambda p: p.name)
def test_every_shipped_proposition_has_a_margin_or_says_why_not(shipped):
    assert bool(shipped.margin) != bool(shipped.no_margin)


def own(margin=None, **more):
    def evaluate(view):
        return np.arange(len(view.trace)) >= 2

    return Proposition("own", (), lambda _: 0.0, (), evaluate, margin=margin, **more)


def view_with(proposition, length=4, tail=0):
    catalogue = Catalogue([proposition])
    trace = film(length, tail=tail).trace
    return View(trace, BINDING, catalogue.parameters({}), catalogue)


def test_a_users_margin_is_computed_once_and_cut_off_at_the_bound():
    calls = []

    def margin(view):
        calls.append(view)
        return np.array([-np.inf, -0.5, 0.5, 1e9], np.float32)

    view = view_with(own(margin))
    for _ in range(2):
        assert view.margin("own").tolist() == [-MARGIN_BOUND, -0.5, 0.5, MARGIN_BOUND]
    assert len(calls) == 1


def test_judging_asks_for_no_margin():
    view = view_with(own(lambda view: pytest.fail("asked")))
    assert view("own").tolist() == [False, False, True, True]


@pytest.mark.parametrize("sparse", [False, True])
def test_what_has_no_margin_counts_as_far_on_its_side(sparse):
    far = MARGIN_BOUND
    view = view_with(own(sparse=sparse))
    assert view.margin_part("own", first=1, stop=3).tolist() == [-far, far]
    assert view.margin("own").tolist() == [-far, -far, far, far]


def test_an_act_of_the_robot_is_not_near_in_the_settle_tail():
    view = view_with(own(lambda view: np.array([-0.5, -0.5, 0.5, 0.5]), act=True), tail=2)
    assert view.margin("own").tolist() == [-0.5, -0.5, -1.0, -1.0]


@pytest.mark.parametrize(
    ("result", "message"),
    [
        (np.zeros(3), r"own: its margin is float64\(3,\), expected float64\(4,\)"),
        (np.zeros(4, bool), r"own: its margin is bool\(4,\), expected float64"),
        (np.array([0.0, np.nan, 1.0, 1.0]), "own: its margin is NaN at step 1"),
    ],
)
def test_a_margin_of_another_form_is_an_error_that_names_the_proposition(result, message):
    with pytest.raises(TraceError, match=message):
        view_with(own(lambda view: result)).margin("own")


def test_filters_of_margins_decide_as_those_of_truth_values():
    margins = np.random.default_rng(1).normal(size=(40, 2))
    for count in (1, 2, 5, 6):
        for of_margins, of_values in ((voted, majority), (lasting, held), (lately, recently)):
            found, values = of_margins(margins, count), of_values(margins > 0.0, count)
            assert ((found > 0.0) == values).all()
        assert set(voted(margins, count)[count:].ravel()) <= set(margins.ravel())


def test_a_knock_of_what_one_of_two_hands_holds_is_seen_online_too():
    (hand,) = toy.SCENE.grippers
    parts = tuple(dataclasses.replace(p) for p in toy.PARTS)
    second = dataclasses.replace(hand, name="second", fingers=(("thumb",), ("index",)))
    more = (*parts, *(dataclasses.replace(parts[0], name=name) for name in ("thumb", "index")))
    scene = dataclasses.replace(toy.SCENE, parts=more, grippers=(hand, second))
    still = arrays(10)
    recording = film(
        10,
        grip(range(10)),
        touch([8], "apple/body", "mug/body", 20.0),
        scene=scene,
        **{
            name: np.repeat(getattr(still, name), 2, axis=1)
            for name in ("eef_poses", "eef_twists", "openings", "commands")
        },
    )
    view = look(recording)
    online = Online(scene, BINDING, view.parameters, CATALOGUE, [("collision",)])
    values = np.concatenate([online.push(*step) for step in recording.steps])[:, 0]
    assert np.flatnonzero(values).tolist() == np.flatnonzero(view("collision")).tolist() == [8]


def test_a_users_margin_on_the_wrong_side_is_an_error_where_it_first_is():
    margins = np.array([-0.5, -0.1, 0.0, -0.25, -0.75])
    view = view_with(own(lambda view: margins), length=5)
    wrong = (
        "own: True at step 3, but its margin there is -0.25; margins are positive where it is true "
        "and negative where it is false: turn the sign, or leave 'margin' out"
    )
    with pytest.raises(TraceError, match=re.escape(wrong)):
        view.margin("own")
    with pytest.raises(TraceError, match=re.escape("own: False at step 0, but its margin there")):
        view_with(own(lambda view: -margins), length=5).margin("own")


def test_of_a_sparse_one_it_is_held_against_the_values_of_the_steps_that_are_asked_for():
    view = view_with(own(lambda view: np.array([1.0, -1.0, 1.0, -1.0]), sparse=True))
    assert view.margin_part("own", first=1, stop=3).tolist() == [-1.0, 1.0]
    with pytest.raises(TraceError, match="own: True at step 3, but its margin there is -1"):
        view.margin_part("own", first=2, stop=4)


def test_who_is_exempt_from_the_law_of_margins_may_have_them_on_either_side():
    view = view_with(own(lambda view: np.full(4, -1.0), exempt={"margin": "they are of another"}))
    assert (view.margin("own") == -1.0).all()


@pytest.mark.parametrize("settings", [(), ("limit=2",)])
def test_while_a_rollout_runs_it_is_an_error_at_the_step_that_has_it(settings):
    def up(view):
        return np.ones(len(view.trace), bool)

    def margin(view):
        return view.trace.steps.eef_poses[:, 0, 2] - start + 0.1

    limit = Parameter("up.limit", "", 1.0, "for the test")
    catalogue = Catalogue([Proposition("up", (), lambda _: 0.0, (limit,), up, margin=margin)])
    eef_poses = arrays(9).eef_poses
    start = eef_poses[0, 0, 2]
    recording = film(9, eef_poses=along(eef_poses, [5], (0, 2), start - 0.5))
    call = ("up", *settings)
    online = Online(recording.scene, BINDING, catalogue.parameters({}), catalogue, (call,))
    steps = iter(recording.steps)
    for _ in range(5):
        online.push(*next(steps))
        assert online.margin(call) == pytest.approx(0.1)
    online.push(*next(steps))
    for look_up in (online.margin, lambda call: online.margins(call, 9)):
        with pytest.raises(TraceError, match=re.escape("up: True at step 5, but its margin there")):
            look_up(call)
