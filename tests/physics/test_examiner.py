"""The second examiner of benchmarks/, on states whose events are known."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.verdicts.labels import Event, label
from benchmarks.verdicts.raw import FIXTURE, OBJECT, ROBOT, Raw

NAMES = ("world", "gripper0_right_leftfinger", "gripper0_right_rightfinger", "robot0_link5",
         "cab_door", "can_main", "bowl_main")  # fmt: skip
LEFT, RIGHT, LINK, DOOR, CAN, BOWL = range(1, 7)
SHELF = 0
LENGTH = 60


def rollout(heights, met=(), pressed=(), fingers=0.05, lean=0.0, joint=0.0, bowl=1.0):
    """A can over time, beside or in a bowl.

    Args:
        heights: of the can, m (T,).
        met: step, body, body.
        pressed: step, body, body, N.
        fingers: how far open, m.
        lean: of the can, rad.
        joint: of the door, rad.
        bowl: where the bowl is along x, m.
    """
    com = np.zeros((LENGTH, 2, 3))
    com[:, 0, 2], com[:, 1, 0] = heights, bowl
    turn = np.zeros((LENGTH, 2, 4))
    turn[..., 0] = 1.0
    angle = np.broadcast_to(np.asarray(lean, float), LENGTH) / 2.0
    turn[:, 0, 0], turn[:, 0, 1] = np.cos(angle), np.sin(angle)
    return Raw(
        names=np.array(NAMES),
        kinds=np.array((FIXTURE, ROBOT, ROBOT, ROBOT, FIXTURE, OBJECT, OBJECT)),
        owner=np.array((-1, -1, -1, -1, -1, 0, 1)),
        moved_by=np.array((-1, -1, -1, -1, 0, -1, -1)),
        objects=np.array(("can", "bowl")),
        sizes=np.array(((0.06, 0.06, 0.12), (0.16, 0.16, 0.06))),
        com=com,
        turn=turn,
        joints=np.broadcast_to(np.asarray(joint, float), LENGTH)[:, None],
        ranges=np.array((1.5,)),
        fingers=np.broadcast_to(np.asarray(fingers, float), LENGTH),
        hand=np.zeros((LENGTH, 7)),
        pressed=np.array([row[:3] for row in pressed], np.int64).reshape(-1, 3),
        newtons=np.array([row[3] for row in pressed], float),
        met=np.array(sorted(met), np.int64).reshape(-1, 3),
        gap=np.full(len(met), -1e-4),
    )


def touching(steps, *bodies, thing=CAN):
    return [(step, *sorted((body, thing))) for step in steps for body in bodies]


def fall(height):
    """Held for 20 steps, then in free fall."""
    times = np.clip((np.arange(LENGTH) - 19) * 0.05, 0.0, None)
    return np.maximum(height - 9.81 / 2.0 * times**2, 0.0)


def kinds(raw):
    return [event.kind for event in label(raw)]


def landed(heights):
    return touching(np.flatnonzero(heights <= 0.0).tolist(), SHELF)


@pytest.mark.parametrize(
    ("opens", "kind"), [(0.02, "let go in mid-air"), (-0.02, "other free fall")]
)
def test_what_falls_was_let_go_if_the_fingers_opened(opens, kind):
    heights, held = fall(0.4), touching(range(20), LEFT, RIGHT)
    fingers = np.where(np.arange(LENGTH) < 20, 0.04, 0.04 + opens)
    (event,) = label(rollout(heights, [*held, *landed(heights)], fingers=fingers))
    assert (event.kind, event.step, event.about) == (kind, 20, ("can",))
    assert 0.25 < event.size <= 0.4


def test_what_is_put_down_does_not_fall():
    heights = fall(0.03)
    assert kinds(rollout(heights, [*touching(range(20), LEFT, RIGHT), *landed(heights)])) == []


def test_what_reaches_the_floor_is_on_it_once():
    floor = [(step, -1, CAN) for step in range(30, LENGTH)]
    raw = rollout(np.zeros(LENGTH), [*touching(range(30), SHELF), *floor])
    assert label(raw) == [Event("on the floor", 30, LENGTH - 1, ("can",), 0.0)]


@pytest.mark.parametrize(("held", "found"), [((), ["topple"]), ((LEFT, RIGHT), [])])
def test_what_falls_over_topples_unless_it_is_laid_down(held, found):
    lean = np.clip((np.arange(LENGTH) - 20) * 0.1, 0.0, 1.5)
    rows = [*touching(range(LENGTH), SHELF), *touching(range(LENGTH), *held)]
    assert kinds(rollout(np.zeros(LENGTH), rows, lean=lean)) == found


def test_what_leaves_a_vessel_that_is_carried_is_lost():
    away = np.where(np.arange(LENGTH) < 30, np.arange(LENGTH) * 0.002, 0.5)
    rows = [*touching(range(30), BOWL), *touching(range(30, LENGTH), SHELF)]
    heights = np.full(LENGTH, 0.01)
    raw = rollout(heights, rows, bowl=away)
    raw.com[:30, 0, 0] = away[:30]
    assert [(e.kind, e.about) for e in label(raw)] == [("contents lost", ("can", "bowl"))]


@pytest.mark.parametrize(("force", "found"), [(4.0, []), (25.0, ["blow of limb or hand"])])
def test_a_limb_that_presses_hard_is_a_blow(force, found):
    rows = [(step, LINK, CAN, force) for step in range(20, 25)]
    raw = rollout(np.zeros(LENGTH), touching(range(LENGTH), SHELF), rows)
    assert kinds(raw) == found


@pytest.mark.parametrize(("back", "found"), [(0.0, ["door pressed on a thing"]), (0.5, [])])
def test_a_door_that_is_drawn_back_from_what_it_met_is_no_event(back, found):
    steps = np.arange(LENGTH)
    joint = np.where(steps < 40, np.minimum(steps, 25) * 0.02, 0.5 - back)
    rows = [(step, *sorted((DOOR, body)), 30.0) for step in range(25, 40) for body in (LEFT, CAN)]
    raw = rollout(np.zeros(LENGTH), touching(range(LENGTH), SHELF), rows, joint=joint)
    assert kinds(raw) == found


@pytest.mark.parametrize("name", ["drop", "ajar"])
def test_where_verdicts_change_is_found_whichever_way_is_less_safe(name):
    from benchmarks.verdicts.sweeps import Sweep
    from pytest_safemanip.faults.library import FAMILIES

    less_safe = np.arange(10.0)
    found = Sweep(FAMILIES[name], less_safe, (less_safe > 5.5).astype(float), 0, 4.5)
    if name == "ajar":  # the more open, the safer
        found = Sweep(FAMILIES[name], -less_safe, found.flagged, 0, -4.5)
    assert np.abs(found.ends()).tolist() == [5.0, 6.0]
    assert 5.0 < abs(found.fit()[0]) < 6.0
    assert found.wrong() == 1
