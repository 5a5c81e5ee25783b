"""The world of these tests itself: what it records is what happened."""

from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.fuzz.trial import calls
from pytest_safemanip.propositions.online import Online
from pytest_safemanip.trace.steps import ARRAYS
from tests.physics.catalogue import SCENARIOS
from tests.physics.scenario import ATTRIBUTES, CATALOGUE, PERIOD, Rollout


def test_the_counter_carries_the_weight_of_what_stands_on_it(play):
    trace = play("can put on counter").view.trace
    can, counter = (set(trace.scene.parts_of(name)) for name in ("can", "counter"))
    weight = trace.scene.bodies[0].mass * 9.81
    assert trace.pair_table.force(can, counter)[10] == pytest.approx(weight, rel=0.01)


def test_both_fingers_press_on_what_is_held(play):
    rollout = play("can is held")
    trace = rollout.view.trace
    held = rollout.steps("lifted", "end")
    for side in ("finger_left", "finger_right"):
        finger = set(trace.scene.parts_of("robot", (side,)))
        force = trace.pair_table.force(finger, set(trace.scene.parts_of("can")))
        assert force[held] == pytest.approx(20.0, rel=0.05)


def test_twists_are_the_rates_of_poses(play):
    steps = play("can is held").recordings[0.025].steps
    moved = np.diff(steps.object_pose[:, 0, :3], axis=0) / 0.025
    mean = (steps.object_twist[1:, 0, :3] + steps.object_twist[:-1, 0, :3]) / 2
    smooth = np.linalg.norm(np.diff(steps.object_twist[:, 0, :3], axis=0), axis=1) < 0.05
    assert moved[smooth] == pytest.approx(mean[smooth], abs=0.01)
    assert np.abs(moved[smooth]).max() > 0.1


def test_the_script_decides_everything(play):
    name = "arm hits bottle"
    first, again = play(name).recordings[PERIOD].steps, Rollout(SCENARIOS[name]())
    second = again.recordings[PERIOD].steps
    assert all(np.array_equal(getattr(first, n), getattr(second, n)) for n in ARRAYS)
    assert np.array_equal(first.contacts.sustained, second.contacts.sustained)


def test_two_rates_look_at_one_simulation(play):
    slow, fast = (r.steps for r in play("can slips").recordings.values())
    assert all(np.array_equal(getattr(slow, n), getattr(fast, n)[::2]) for n in ARRAYS)


@pytest.mark.parametrize(
    "name", ["can added to empty shelf", "hand washed", "water poured beside pan"]
)
def test_step_by_step_the_propositions_say_the_same(play, name):
    rollout = play(name)
    recording, view = rollout.recordings[PERIOD], rollout.view
    binding = rollout.task.bind(recording.scene, ATTRIBUTES)
    every = [
        (p.name, *own)
        for p in CATALOGUE.values()
        for own in calls(p, binding, view.trace.scene)[:2]
        if not p.lacks(view.trace.scene, *own)
    ]
    told = {name for name, *_ in every}
    assert set(CATALOGUE) - told <= {"transfer", "contained", "spilled"}
    online = Online(recording.scene, binding, view.parameters, CATALOGUE, every)
    steps = recording.steps
    values = np.concatenate([online.push(*step) for step in steps])
    assert np.array_equal(values, np.stack([view(*call) for call in every], axis=1))
