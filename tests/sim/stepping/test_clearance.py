"""What scripts are told of ways: by what a ruler gives, and by what the robot then does."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, RolloutError
from pytest_safemanip.sim import clearance
from pytest_safemanip.sim.backend import Backend, Request
from pytest_safemanip.sim.clearance import STAYS, Clearance, Path, Touch
from tests.sim.stepping.following import Kitchen, drawn, way

TASK = "PickPlaceCounterToCabinet"
FINGERTIP = 0.01
"""How far the fingers reach beyond the grip point, m, in robosuite's model of the hand."""
STATE = mujoco.mjtState.mjSTATE_INTEGRATION


@pytest.fixture(scope="module")
def made(make_kitchen: Callable[..., Any]) -> Kitchen:
    return Kitchen(make_kitchen(TASK))


@pytest.fixture
def cook(made: Kitchen) -> Iterator[Kitchen]:
    """The kitchen as its reset left it."""
    model, data = made.model, made.env.sim.data._data
    kept = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, kept, STATE)
    made.reset()
    yield made
    mujoco.mj_setState(model, data, kept, STATE)
    made.env.sim.forward()


def counter_top(cook: Kitchen, ahead: float, left: float) -> float:
    """Height of what is below a point before the robot, by a ray, m."""
    from_above = cook.pose(ahead, left, 1.1, 0.0, 0.0)[:3]
    geom = np.zeros(1, np.int32)
    distance = mujoco.mj_ray(
        cook.model,
        cook.env.sim.data._data,
        from_above,
        np.array((0.0, 0.0, -1.0)),
        None,
        1,
        -1,
        geom,
    )
    return 1.1 - float(distance)


def drive(cook: Kitchen, ahead: float) -> Path:
    """The base, so far forward."""
    arm = cook.arm
    heading = np.arctan2(arm.forward[1], arm.forward[0])
    base = np.append(arm.base + ahead * arm.forward, heading)[None]
    return Path(np.full((1, 7), STAYS), base, np.ones(1), np.ones(1))


def test_fingers_that_stop_above_a_counter_are_free_and_the_gap_is_known(cook: Kitchen) -> None:
    top = counter_top(cook, 0.5, 0.3)
    above = cook.pose(0.5, 0.3, top + FINGERTIP + 0.025, 0.0, 0.0)
    answer = cook.ask(way(above, tolerance=0.002, turn_tolerance=0.02))
    assert answer.free, answer.reason
    assert answer.room == pytest.approx(0.025, abs=0.004)
    assert np.linalg.norm(answer.hand[:3] - above[:3]) < 0.002


def test_fingers_that_would_go_into_a_counter_meet_it_at_its_top(cook: Kitchen) -> None:
    top = counter_top(cook, 0.5, 0.3)
    poses = [cook.pose(0.5, 0.3, top + z, 0.0, 0.0) for z in (0.12, -0.03)]
    answer = cook.ask(way(*poses, margin=0.0))
    assert not answer.free
    assert answer.waypoint == 1
    assert answer.touch is not None
    assert answer.touch.own.startswith("finger")
    assert answer.touch.depth == pytest.approx(0.03 + FINGERTIP - 0.015, abs=0.01)
    assert abs(answer.touch.place[2] - top) < 0.03
    assert answer.reason.startswith(f"{answer.touch.own} meets body of {answer.touch.other} ")


def test_a_touch_that_a_script_permits_does_not_count(cook: Kitchen) -> None:
    top = counter_top(cook, 0.5, 0.3)
    poses = [cook.pose(0.5, 0.3, top + z, 0.0, 0.0) for z in (0.12, -0.005)]
    touch = cook.ask(way(*poses)).touch
    assert touch is not None
    assert cook.ask(way(*poses, permits=(("finger", touch.other),))).free
    assert not cook.ask(way(*poses, permits=(("palm", touch.other),))).free


def test_what_is_touched_before_a_way_begins_does_not_count(cook: Kitchen) -> None:
    top = counter_top(cook, 0.5, 0.3)
    poses = [cook.pose(0.5, 0.3, top + z, 0.0, 0.0) for z in (-0.03, 0.2, 0.25)]
    touch = cook.ask(way(*poses, begins=0)).touch
    assert touch is not None
    assert cook.ask(way(*poses, begins=2)).free
    again = cook.ask(way(*poses, poses[0], begins=2))
    assert again.waypoint == 3
    assert again.touch is not None
    assert again.touch.other == touch.other


def test_a_torso_that_is_raised_takes_the_hand_along_as_far_as_it_goes(cook: Kitchen) -> None:
    here = cook.ask(drive(cook, 0.0)).hand
    for by, risen in ((0.1, 0.1), (1.0, 0.34)):
        raised = cook.ask(dataclasses.replace(drive(cook, 0.0), raised=by)).hand
        assert raised[:3] - here[:3] == pytest.approx((0.0, 0.0, risen), abs=2e-3)
    with pytest.raises(ValueError, match="raised is nan"):
        dataclasses.replace(drive(cook, 0.0), raised=np.nan)


def test_a_hand_that_cannot_arrive_is_an_answer(cook: Kitchen) -> None:
    far = cook.pose(0.2, -1.4, 1.3, 0.0, 0.0)
    answer = cook.ask(way(far, permits=(("", ""),)))
    assert not answer.free
    assert answer.touch is None
    # 1.4 m to the side of a base whose arm reaches 0.85 m from its shoulder.
    assert 0.4 < answer.short < 1.0
    assert answer.short == pytest.approx(np.linalg.norm(answer.hand[:3] - far[:3]))
    assert answer.reason.startswith("out of reach, ")


def test_a_base_that_drives_forward_meets_furniture_and_back_is_free(cook: Kitchen) -> None:
    free = cook.ask(drive(cook, -0.2))
    assert free.free, free.reason
    answer = cook.ask(drive(cook, 1.0))
    assert answer.touch is not None
    assert answer.touch.depth > 0.0
    # Nearer than the metre that it would drive, and before it.
    reached = np.array(answer.touch.place[:2]) - cook.arm.base
    assert 0.0 < reached @ cook.arm.forward < 1.0


def test_what_is_held_moves_with_the_hand(cook: Kitchen) -> None:
    top = counter_top(cook, 0.5, 0.3)
    low = cook.pose(0.5, 0.3, top + 0.06, 0.0, 0.0)
    alone = cook.ask(way(low))
    held = cook.ask(way(low, held=("obj",)))
    assert alone.free
    # Where the thing is when the episode begins, it is carried 20 cm below the hand, say.
    assert held.touch is not None
    assert held.touch.own == "obj"
    with pytest.raises(RolloutError, match="spoon"):
        cook.ask(way(low, held=("spoon",)))


def test_postures_are_those_that_the_robot_takes_and_free_ways_are_free(cook: Kitchen) -> None:
    model, data = cook.model, cook.env.sim.data._data
    kept = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, kept, STATE)
    joints, elbows = [], []
    for path in drawn(cook, 6, seed=3):
        mujoco.mj_setState(model, data, kept, STATE)
        cook.env.sim.forward()
        cook.reset()
        answer = cook.ask(dataclasses.replace(path, margin=0.005))
        if not answer.free:
            continue
        reached = cook.follow(path)
        assert reached.force < 5.0
        joints.append(np.abs(answer.joints - reached.joints).max())
        elbows.append(np.linalg.norm(cook.elbow(answer.joints) - reached.elbow))
    assert len(joints) >= 3
    # Near singular postures the wrist goes other ways to the same hand.
    assert np.median(joints) < 0.1
    assert np.median(elbows) < 0.015
    assert max(elbows) < 0.2


def test_asking_changes_no_bit_of_an_episode_in_a_process_of_its_own(backend: Backend) -> None:
    assert isinstance(backend, clearance.Foresees)
    ends = []
    for asks in (False, True):
        start = backend.reset(Request(TASK, 0, "compact", stepping="fast"))
        pose = np.array(start.step.eef_pose, np.float64)
        for _ in range(3):
            if asks:
                higher = pose + np.eye(7)[2] * 0.03
                near, far = backend.clearance([way(higher), way(pose)])
                assert near.free
                assert far.free
                assert far.joints.shape == (7,)
            step = backend.step(np.full(12, 0.2))
        ends.append(step)
    assert np.array_equal(ends[0].qpos, ends[1].qpos)
    assert np.array_equal(ends[0].qvel, ends[1].qvel)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"hand": np.zeros((2, 7))}, "base has shape"),
        ({"speed": np.zeros(1)}, "speed is not in"),
        ({"base": np.array([[0.0, STAYS, 0.0]])}, "known in part"),
        (
            {
                "hand": np.zeros((0, 7)),
                "base": np.zeros((0, 3)),
                "speed": np.zeros(0),
                "tolerance": np.zeros(0),
            },
            "waypoints",
        ),
        ({"margin": -0.1}, "margin"),
        ({"hand": "up"}, "path: hand is 'up'"),
        ({"hand": 0.0}, r"hand has shape \(\)"),
        ({"hand": np.zeros((1, 7))}, "no unit quaternion"),
        ({"hand": np.array([[1e7, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])}, "farther away than 1000 m"),
        ({"base": np.full((1, 3), np.inf)}, "farther away than 1000 m"),
        ({"opening": np.inf}, "opening is inf, expected 0 to 1"),
        ({"opening": "half"}, "path: opening is 'half'"),
        ({"held": "obj"}, "path: held is 'obj': expected a tuple of strings"),
        ({"permits": ("ab", "c")}, "path: permits is .* expected"),
        ({"permits": (("a", "b", "c"),)}, "expected pairs of strings"),
        ({"begins": "a"}, "path: begins is 'a'"),
        ({"since": 0.5}, "path: since is 0.5"),
    ],
)
def test_a_path_with_wrong_shapes_is_refused(changed: dict[str, Any], message: str) -> None:
    right = {
        "hand": np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]]),
        "base": np.zeros((1, 3)),
        "speed": np.ones(1),
        "tolerance": np.ones(1),
    }
    Path(**right)
    with pytest.raises(ValueError, match=message):
        Path(**{**right, **changed})


def test_numbers_of_a_path_may_be_of_other_types() -> None:
    path = Path(
        np.array([[0, 0, 1, 1, 0, 0, 0]]),
        np.zeros((1, 3), np.float16),
        np.ones(1, np.float32),
        np.ones(1),
        since=np.int64(1),
    )
    plain, arrays = clearance.encode_paths([path])
    assert json.loads(json.dumps(plain))[0]["since"] == 1
    assert {array.dtype for array in arrays.values()} == {np.dtype(np.float64)}


def test_paths_and_answers_survive_the_wire() -> None:
    permits = (("finger", "pan"),)
    path = way(
        np.array((0.0, 1.0, 2.0, 0.0, 1.0, 0.0, 0.0)),
        held=("pan",),
        permits=permits,
        opening=0.5,
        raised=0.2,
        begins=1,
    )
    plain, arrays = clearance.encode_paths(
        [path, way(np.array((1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 0.5)))]
    )
    first, second = clearance.decode_paths(plain, arrays)
    assert (first.held, first.permits, first.opening) == (path.held, permits, 0.5)
    assert (first.raised, first.begins) == (0.2, 1)
    assert np.array_equal(first.hand, path.hand)
    assert np.isnan(second.opening)
    touch = Touch("palm", "cab", "door", (1.0, 2.0, 3.0), 0.01)
    answers = [
        Clearance(1, touch, 0.0, 0.0, -0.01, np.ones(7), np.ones(7)),
        Clearance(0, None, 0.03, 0.0, 0.04, np.ones(7), np.ones(7)),
    ]
    back = clearance.decode_clearances(*clearance.encode_clearances(answers))
    assert [a.reason for a in back] == [
        "palm meets door of cab 10 mm deep at 1.00 2.00 3.00",
        "out of reach, 3 cm and 0 degrees short",
    ]


def test_where_nobody_foresees_a_script_is_told() -> None:
    with pytest.raises(ConfigError, match="does not say what would be touched"):
        clearance.blind([])
