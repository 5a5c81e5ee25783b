"""Ring buffers against a list that forgets nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.propositions.memory import Ring, StepMemory
from tests import toy
from tests.propositions.stage import film, rest, touch

sizes = st.lists(st.integers(0, 70), min_size=1, max_size=12)


@given(st.integers(0, 100), sizes, st.integers(0, 120))
def test_a_ring_gives_back_the_newest_rows_that_it_keeps(kept, counts, asked):
    ring, all_rows = Ring(kept), np.zeros((0, 2))
    for count in counts:
        rows = len(all_rows) + np.arange(2.0 * count).reshape(count, 2)
        ring.extend(rows)
        all_rows = np.concatenate((all_rows, rows))
        wanted = min(asked, max(kept, count), len(all_rows))
        assert ring.last(wanted).tolist() == all_rows[len(all_rows) - wanted :].tolist()


@given(st.lists(st.integers(0, 70), min_size=2, max_size=12), st.data())
def test_what_a_ring_keeps_may_change_from_time_to_time(counts, data):
    ring, all_rows, there = Ring(0), np.zeros(0), 0
    for count in counts:
        ring.kept = data.draw(st.integers(0, there))
        rows = 1000.0 * count + np.arange(count)
        ring.extend(rows)
        all_rows, there = np.concatenate((all_rows, rows)), ring.kept + count
        assert ring.last(there).tolist() == all_rows[len(all_rows) - there :].tolist()


def test_a_ring_without_rows_has_none_and_what_it_gives_is_not_written_to():
    ring = Ring(4)
    with pytest.raises(ValueError, match="nothing was added yet"):
        ring.last(1)
    ring.extend(np.arange(3))
    with pytest.raises(ValueError, match="read-only"):
        ring.last(2)[0] = 7


@pytest.mark.parametrize("every", [1, 3, 7])
@pytest.mark.parametrize("kept", [5, 40])
def test_the_newest_steps_have_their_contacts(every, kept):
    # Two contacts at even steps, none at odd ones, and one more at every fifth.
    steps = film(
        120,
        rest(range(0, 120, 2)),
        touch(range(0, 120, 2), "counter/body", "apple/body"),
        touch(range(0, 120, 5), "robot/link5", "mug/body"),
    ).steps
    memory = StepMemory(toy.SCENE, max(kept, every))
    for first in range(0, 120, every):
        memory.extend(steps.window(first, min(first + every, 120)))
        stop = memory.count
        assert stop == min(first + every, 120)
        assert memory.held == min(stop, max(kept, every))
        for count in (1, memory.held, memory.held + 5):
            begin = stop - min(count, memory.held)
            found, wanted = memory.last(count), steps.window(begin, stop)
            assert found.contacts.step.tolist() == wanted.contacts.step.tolist()
            assert found.contacts.a.tolist() == wanted.contacts.a.tolist()
            assert found.object_pose.tolist() == wanted.object_pose.tolist()
            assert found.tail.tolist() == wanted.tail.tolist()
