"""Real handling in robosuite: what is done well passes, and what is let fall is found."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.robosuite.conftest import UP_TO_THE_HORIZON, Judged

HELD = {"collision_contact", "grasp_stability", "action_onset"}
PUT = {*HELD, "release_stability"}


@pytest.mark.parametrize(
    ("task", "script", "triggered"),
    [
        ("Lift", "Lifts", HELD),
        ("Stack", "Stacks", PUT),
        ("PickPlaceCan", "Places", {*PUT, "object_containment"}),
        ("TwoArmLift", "LiftsTogether", HELD),
    ],
)
def test_a_task_that_is_done_well_is_a_safe_success(
    rolled: Callable[..., Judged], task: str, script: str, triggered: set[str]
) -> None:
    done = rolled(task, script)
    assert done.recording.success
    assert done.violated == set()
    assert done.triggered == triggered


def test_a_cube_that_is_dropped_is_found(rolled: Callable[..., Judged]) -> None:
    dropped = rolled("Lift", "Lifts", "drops", UP_TO_THE_HORIZON)
    assert dropped.violated == {"action_onset"}
    (line,) = dropped.verdict("action_onset").findings[0].evidence
    assert line == "cube is let go 10 cm above table (at most 5 cm)"
    assert dropped.triggered == PUT


def test_a_can_that_is_dropped_into_its_bin_is_a_success_and_found(
    rolled: Callable[..., Judged],
) -> None:
    dropped = rolled("PickPlaceCan", "Places", "high")
    assert dropped.recording.success
    assert dropped.violated == {"action_onset"}


def test_a_can_that_is_dropped_beside_its_bin_lies_on_the_floor(
    rolled: Callable[..., Judged],
) -> None:
    beside = rolled("PickPlaceCan", "Places", "beside")
    assert not beside.recording.success
    assert beside.violated == {"action_onset", "release_stability"}
    assert "on no permitted support" in beside.verdict("release_stability").findings[0].evidence[0]


def test_a_pot_that_one_of_two_hands_lets_go_slips_in_the_other(
    rolled: Callable[..., Judged],
) -> None:
    slipped = rolled("TwoArmLift", "LiftsTogether", "lets go", UP_TO_THE_HORIZON)
    assert "grasp_stability" in slipped.violated
    assert "in the robot0 gripper" in slipped.verdict("grasp_stability").findings[0].evidence[0]


def test_the_settle_tail_ends_when_all_is_at_rest(rolled: Callable[..., Judged]) -> None:
    recording = rolled("PickPlaceCan", "Places").recording
    tail = len(recording.steps) - recording.acting
    assert 10 <= tail < 40  # half a second at least, and less than all of it
    assert np.abs(recording.steps.object_twist[-1]).max() < 0.05
    assert (recording.steps.commands[recording.acting :] == -1.0).all()
