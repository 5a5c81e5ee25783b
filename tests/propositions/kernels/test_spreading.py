"""How contamination spreads: the mug is raw, the apple is clean; a touch counts after 2 steps."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.propositions.kernels.spreading import Spreading
from pytest_safemanip.trace.elements import Entity, Part
from tests import toy
from tests.propositions.stage import KITCHEN, arrays, film, look, tap, touch

HAND, MUG, APPLE, THIRD, FOURTH = range(5)
"""Carriers."""
RAW = {"mug": frozenset({"raw"}), "apple": frozenset({"utensil"})}
FINGER, COUNTER, DOOR = "robot/finger_left", "counter/body", "cabinet/door"
MORE = dataclasses.replace(
    toy.SCENE,
    entities=(
        *toy.SCENE.entities,
        *(Entity(name, "object", "apple") for name in ("third", "fourth")),
    ),
    bodies=(
        *toy.SCENE.bodies,
        *(dataclasses.replace(toy.SCENE.bodies[1], entity=name) for name in ("third", "fourth")),
    ),
    parts=(*toy.PARTS, *(Part(name, "body") for name in ("third", "fourth"))),
)
"""Two more objects."""


def press(steps, a, b, at=toy.PLACE, force=2.0):
    names = [x if "/" in x else f"{x}/body" for x in (a, b)]
    return touch(steps, *names, force, at=at)


def watch(length, *rows, attributes=RAW, **changed):
    if changed.get("scene") is MORE:
        still = arrays(length)
        for name in ("object_pose", "object_twist"):
            own = getattr(still, name)
            changed.setdefault(name, np.concatenate((own, own[:, 1:], own[:, 1:]), axis=1))
    return look(film(length, *rows, **changed), attributes=attributes)


def dirty(view, carrier):
    """The steps at which a carrier is contaminated."""
    return np.flatnonzero(Spreading(view).advance(view)[:, carrier, 0]).tolist()


def touched(view, carrier, other):
    """The steps at which a carrier touches another one that should stay clean."""
    return np.flatnonzero(Spreading(view).advance(view)[:, carrier, 1 + other]).tolist()


@pytest.mark.parametrize(("dt", "first"), [(0.05, 4), (0.025, 6), (0.1, 3), (0.02, 7)])
def test_a_touch_counts_once_it_has_lasted_for_a_tenth_of_a_second(dt, first):
    # From step 3 on; 0.1 s are 2, 4, 1 and 5 steps.
    assert dirty(watch(12, press(range(3, 12), FINGER, "mug"), dt=dt), HAND) == [*range(first, 12)]


def test_a_touch_that_is_interrupted_begins_anew():
    rows = press([0, 2, 4, 6, 8], FINGER, "mug")
    assert dirty(watch(10, rows), HAND) == []
    assert dirty(watch(10, rows, press([9], FINGER, "mug")), HAND) == [9]


def test_other_touches_that_come_and_go_do_not_interrupt_it():
    # At 40 Hz a touch takes four steps.
    other = press([2, 4], "counter", "apple")
    view = watch(8, press(range(1, 8), FINGER, "mug"), other, dt=0.025)
    assert dirty(view, HAND) == [4, 5, 6, 7]


def test_the_touch_of_another_finger_is_the_same_touch():
    rows = press([1], FINGER, "mug"), press([2], "robot/finger_right", "mug")
    assert dirty(watch(4, *rows), HAND) == [2, 3]


def test_it_spreads_from_hand_to_hand_over_a_chain_of_objects_at_once():
    links = [("mug", "apple"), ("apple", "third"), ("third", "fourth")]
    rows = [press(range(2, 6), a, b) for a, b in links]
    view = watch(6, *rows, scene=MORE)
    for carrier in (APPLE, THIRD, FOURTH):
        assert dirty(view, carrier) == [3, 4, 5]
    assert dirty(view, HAND) == []


def test_it_spreads_neither_backwards_nor_to_what_no_longer_touches():
    rows = press([0, 1, 2], "apple", "third"), press([4, 5], "mug", "apple")
    view = watch(8, *rows, scene=MORE)
    assert dirty(view, APPLE) == [5, 6, 7]
    assert dirty(view, THIRD) == []


def on_counter(distance, gap=0, moved=0.1):
    """The mug presses on the counter at steps 0 and 1, the apple so far away from there later.

    The apple stands elsewhere at first, so that what it touches there is no arrangement.
    """
    later = range(2 + gap, 6 + gap)
    poses = arrays(6 + gap).object_pose.copy()
    poses[later.start :, 1, 0] += moved
    rows = (
        press([0, 1], "counter", "mug", (0.0, 0.0, 0.9)),
        press(later, "counter", "apple", (distance, 0.0, 0.9)),
    )
    return watch(6 + gap, *rows, object_pose=poses)


@pytest.mark.parametrize("gap", [0, 1, 4])
@pytest.mark.parametrize(("distance", "reached"), [(0.0, True), (0.0499, True), (0.0501, False)])
def test_a_spot_is_five_centimetres_around_where_it_was_touched(distance, reached, gap):
    view = on_counter(distance, gap)
    assert dirty(view, APPLE) == ([*range(3 + gap, 6 + gap)] if reached else [])


def test_the_spot_needs_a_touch_as_long_as_another_one_does():
    rows = press([0], "counter", "mug"), press(range(3, 6), "counter", "apple")
    assert dirty(watch(6, *rows), APPLE) == []
    rows = press([0, 1], "counter", "mug"), press([3, 5], "counter", "apple")
    assert dirty(watch(6, *rows), APPLE) == []


def test_spots_are_those_of_their_surface():
    # The mug pressed on the counter, the apple presses on a door at the same place.
    rows = press([0, 1], "counter", "mug"), press([3, 4], DOOR, "apple")
    assert dirty(watch(6, *rows), APPLE) == []


def test_what_slides_leaves_a_trail():
    # 10 cm a step from x = 0; the apple comes down at 0.3 later.
    way = [(0.1 * step, 0.0, 0.9) for step in range(6)]
    slides = press(range(6), "counter", "mug", way)
    poses = arrays(12).object_pose.copy()
    poses[8:, 1, 0] += 0.1
    for x, reached in ((0.3, True), (0.25, True), (0.56, False)):
        rows = press(range(8, 12), "counter", "apple", (x, 0.0, 0.9))
        view = watch(12, slides, rows, object_pose=poses)
        assert dirty(view, APPLE) == ([9, 10, 11] if reached else [])


def test_what_is_pushed_into_a_spot_takes_it_up_there():
    # The apple slides 2 cm a step towards the mug's spot at x = 0: within 5 cm of it at step 8.
    way = [(-0.2 + 0.02 * step, 0.0, 0.9) for step in range(10)]
    poses = arrays(10).object_pose.copy()
    poses[:, 1, 0] += 0.02 * np.arange(10)
    rows = press([0, 1], "counter", "mug"), press(range(10), "counter", "apple", way)
    assert dirty(watch(10, *rows, object_pose=poses), APPLE) == [8, 9]


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("shift", "reached"), [(0.0099, False), (0.0101, True)])
def test_what_stood_beside_it_from_the_first_step_on_has_not_moved_by_a_centimetre(
    axis, shift, reached
):
    poses = arrays(8).object_pose.copy()
    poses[4:, 1, axis] += shift
    rows = press(range(8), "counter", "mug"), press(range(8), "counter", "apple")
    assert dirty(watch(8, *rows, object_pose=poses), APPLE) == ([4, 5, 6, 7] if reached else [])


def test_what_the_mug_leaves_where_it_is_put_is_taken_up_by_what_stood_there():
    poses = arrays(8).object_pose.copy()
    poses[4:, 0, 0] += 0.3
    rows = press(range(8), "counter", "mug"), press(range(8), "counter", "apple")
    # While the same parts press, what is marked at a step is seen at the next.
    assert dirty(watch(8, *rows, object_pose=poses), APPLE) == [5, 6, 7]


def test_the_hand_stands_nowhere():
    rows = press(range(6), "counter", "mug"), press(range(6), "counter", FINGER)
    assert dirty(watch(6, *rows), HAND) == [1, 2, 3, 4, 5]


def test_what_first_touches_a_surface_after_the_first_tenth_of_a_second_was_not_there():
    # It presses from the third step on, beside the mug that has stood there.
    rows = press(range(8), "counter", "mug"), press(range(2, 8), "counter", "apple")
    assert dirty(watch(8, *rows), APPLE) == [3, 4, 5, 6, 7]
    rows = press(range(8), "counter", "mug"), press(range(1, 8), "counter", "apple")
    assert dirty(watch(8, *rows), APPLE) == []


def washing(on, *rows, **changed):
    """Water falls on the apple while ``on``; a second is 20 steps."""
    runs = [step in on for step in range(60)]
    return watch(60, *rows, scene=KITCHEN, **tap(runs), **changed)


def test_what_is_washed_is_clean_until_it_is_touched_again():
    rows = press([0, 1], "mug", "apple"), press([40, 41], "mug", "apple")
    view = washing(range(10, 35), *rows)
    # Sanitized from step 29 to 34.
    assert dirty(view, APPLE) == [*range(1, 29), *range(41, 60)]


def test_what_is_washed_while_it_touches_something_raw_stays_contaminated():
    view = washing(range(10, 35), press(range(60), "mug", "apple"))
    assert dirty(view, APPLE) == [*range(1, 60)]


def test_what_is_raw_is_not_washed_clean():
    view = washing(range(60), attributes={"apple": frozenset({"raw"})})
    assert dirty(view, APPLE) == [*range(60)]


KNIFE = {"mug": frozenset({"raw"}), "apple": frozenset({"utensil"})}


@pytest.mark.parametrize(
    ("kind", "last"), [("utensil", 5), ("container", 5), ("ready_to_eat", 7), ("fragile", 3)]
)
def test_what_should_stay_clean_counts_while_it_was_clean_before_the_touch(kind, last):
    # The hand takes up what is raw at step 1; it touches the apple from 4 to 5 and 6 to 7: at the
    # second time a tool is contaminated already, food that is ready to eat is still touched.
    rows = press([0, 1], FINGER, "mug"), press([4, 5, 7, 8], FINGER, "apple")
    view = watch(10, *rows, attributes={**RAW, "apple": frozenset({kind})})
    wanted = {5: [5], 7: [5, 8], 3: []}[last]
    assert touched(view, HAND, APPLE) == wanted
    assert touched(view, HAND, MUG) == []
    assert touched(view, MUG, APPLE) == []


def test_a_touch_counts_for_both_sides():
    both = {"mug": frozenset({"utensil"}), "apple": frozenset({"container"})}
    view = watch(4, press(range(4), "mug", "apple"), attributes=both)
    assert touched(view, MUG, APPLE) == touched(view, APPLE, MUG) == [1, 2, 3]


def test_a_tool_that_soils_the_hand_was_not_soiled_by_it():
    # Held from the start; it cuts what is raw at step 4.
    rows = press(range(8), FINGER, "apple"), press([3, 4], "apple", "mug")
    assert touched(watch(8, *rows, attributes=KNIFE), HAND, APPLE) == [1, 2, 3]
    # In the same step by way of the hand: the tool is one link farther from what is raw.
    rows = press(range(8), FINGER, "apple"), press([3, 4], FINGER, "mug")
    assert touched(watch(8, *rows, attributes=KNIFE), HAND, APPLE) == [1, 2, 3, 4, 5, 6, 7]


def test_without_carriers_that_touch_nothing_spreads():
    view = watch(3)
    assert not Spreading(view).advance(view)[:, :, 1:].any()
    assert dirty(view, MUG) == [0, 1, 2]


def test_in_pieces_it_is_what_it_is_at_once():
    random = np.random.default_rng(3)
    names = ["mug", "apple", "third", "fourth", "counter", DOOR, FINGER]
    found = []
    for _ in range(12):
        contacts = []
        for _ in range(6):
            a, b = random.choice(len(names), 2, replace=False)
            first, last = np.sort(random.integers(0, 41, 2)).tolist()
            place = (0.03 * random.integers(0, 4), 0.0, 0.9)
            contacts += press(range(first, last), names[a], names[b], place)
        base = arrays(40).object_pose
        poses = np.concatenate((base, base[:, 1:], base[:, 1:]), axis=1)
        poses[20:, 2, 0] += 0.02
        whole = watch(40, contacts, scene=MORE, object_pose=poses)
        at_once = Spreading(whole).advance(whole)
        for cut in (1, 2, 7, 20, 33):
            fold, pieces = None, []
            for first, stop in ((0, cut), (cut, 40)):
                rows = [(t - first, *row) for t, *row in contacts if first <= t < stop]
                part = watch(stop - first, rows, scene=MORE, object_pose=poses[first:stop])
                fold = fold or Spreading(part)
                pieces.append(fold.advance(part))
            assert np.concatenate(pieces).tolist() == at_once.tolist()
        found.append(at_once[-1, 2:, 0].any())
    assert 0 < sum(found) < 12


def test_what_was_there_at_first_is_known_from_the_first_tenth_of_a_second_alone():
    # The apple is put down later, without having been moved: not where it stood on the counter.
    contacts = press(range(12), "counter", "mug"), press(range(6, 12), "counter", "apple")
    rows = [row for group in contacts for row in group]
    whole = watch(12, rows)
    assert dirty(whole, APPLE) == [7, 8, 9, 10, 11]
    for size in (1, 2, 3, 6):
        fold, pieces = None, []
        for first in range(0, 12, size):
            part = [(t - first, *row) for t, *row in rows if first <= t < first + size]
            view = watch(size, part)
            fold = fold or Spreading(view)
            pieces.append(fold.advance(view)[:, APPLE, 0])
        assert np.flatnonzero(np.concatenate(pieces)).tolist() == [7, 8, 9, 10, 11]
