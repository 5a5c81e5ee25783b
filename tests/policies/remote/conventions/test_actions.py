from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.policies.remote.actions import (
    ACTION_SIZE,
    PARTS,
    ActionError,
    chunk_of,
    flat,
    flat_label,
    part_label,
    parted,
)
from pytest_safemanip.policies.remote.embodiment import PANDA_OMRON

LABEL = flat_label("actions")
SWITCHES = tuple(PANDA_OMRON.switches)


def test_the_parts_fill_an_action_without_a_gap():
    columns = [n for where in PARTS.values() for n in range(where.start, where.stop)]
    assert columns == list(range(ACTION_SIZE))
    assert [PARTS["gripper_close"].start, PARTS["control_mode"].start] == list(SWITCHES)


@pytest.mark.parametrize(
    ("given", "executed"), [(0, -1), (0.499, -1), (0.5, 1), (1, 1), (-1, -1), (7, 1), (-7, -1)]
)
def test_gripper_and_mode_are_switched_at_a_half(given, executed):
    rows = np.full((1, 12), 0.25)
    rows[0, list(SWITCHES)] = given
    chunk = chunk_of(rows, 1, LABEL)
    assert chunk.actions[0, list(SWITCHES)].tolist() == [executed, executed]
    assert chunk.clipped == 0


@pytest.mark.parametrize("column", [n for n in range(12) if n not in SWITCHES])
def test_every_other_entry_keeps_its_value_within_its_bounds(column):
    rows = np.zeros((3, 12))
    rows[:, column] = (-0.7, 1.0, 1.001)
    chunk = chunk_of(rows, 3, LABEL)
    assert chunk.actions[:, column].tolist() == [-0.7, 1.0, 1.0]
    assert chunk.clipped == 1


def test_the_answer_itself_is_not_changed():
    rows = np.full((2, 12), 3.0)
    chunk_of(rows, 2, LABEL)
    assert (rows == 3.0).all()


def test_an_entry_is_named_in_the_words_of_the_reply():
    assert LABEL(3, 7) == "actions[3, 7] (base_motion)"
    assert LABEL(0, 11) == "actions[0, 11] (control_mode)"
    assert part_label("action.")(3, 8) == "action.base_motion[3, 1]"
    assert part_label("")(0, 2) == "end_effector_position[0, 2]"


def test_how_many_are_not_finite_is_said():
    rows = np.zeros((4, 12))
    rows[1:3, 4] = np.nan
    with pytest.raises(ActionError, match=r"actions\[1, 4\] \(end_eff.*\) is nan, and 1 more: the"):
        chunk_of(rows, 4, LABEL)


@pytest.mark.parametrize("shape", [(12,), (1, 12), (50, 12)])
def test_one_action_is_a_chunk_of_one(shape):
    assert flat({"actions": np.zeros(shape)}, "actions").shape == (shape[0] if shape[1:] else 1, 12)


@pytest.mark.parametrize("shape", [(), (0,), (11,), (2, 13), (1, 50, 12), (12, 2)])
def test_other_shapes_are_refused(shape):
    with pytest.raises(ActionError, match="expected"):
        flat({"actions": np.zeros(shape)}, "actions")


def parts(**changed):
    sizes = {part: where.stop - where.start for part, where in PARTS.items()}
    return {**{part: np.zeros((1, 4, size)) for part, size in sizes.items()}, **changed}


def test_parts_may_come_without_the_sample_and_switches_without_their_axis():
    assert parted(parts(), "").shape == (4, 12)
    bare = {part: array[0] for part, array in parts().items()}
    assert parted(bare, "").shape == (4, 12)
    bare["gripper_close"] = np.ones(4)
    assert parted(bare, "")[:, 6].tolist() == [1.0] * 4


@pytest.mark.parametrize("value", ["x", None, [[1], [1, 2]], np.array(["a"]), {}, [None]])
def test_what_is_no_array_of_numbers_is_refused(value):
    with pytest.raises(ActionError, match="'base_motion' is not an array of numbers"):
        parted(parts(base_motion=value), "")
