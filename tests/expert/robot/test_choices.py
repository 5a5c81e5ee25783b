from __future__ import annotations

from itertools import islice

from pytest_safemanip.expert.robot.choices import Alternatives, Choices


def tried(most=50, **options):
    """The decisions that come, where each of these is asked for every time."""
    return [
        {what: choices.choose(what, range(count)) for what, count in options.items()}
        for choices in islice(Alternatives(2), most)
    ]


def test_the_usual_way_comes_first_and_then_one_choice_is_changed_at_a_time():
    found = tried(pace=2, side=3)
    assert found[0] == {"pace": 0, "side": 0}
    assert found[1:4] == [{"pace": 1, "side": 0}, {"pace": 0, "side": 1}, {"pace": 0, "side": 2}]
    assert sorted(tuple(one.values()) for one in found) == [
        (p, s) for p in (0, 1) for s in range(3)
    ]


def test_no_way_comes_twice_and_no_more_than_two_choices_are_unusual():
    found = [tuple(one.values()) for one in tried(500, a=3, b=3, c=2, d=4)]
    assert len(set(found)) == len(found)
    assert max(sum(number > 0 for number in one) for one in found) == 2
    # 1 usual, 2 + 2 + 1 + 3 single ones, and the products of two.
    assert len(found) == 1 + 8 + (4 + 2 + 6 + 2 + 6 + 3)


def test_what_is_asked_for_only_after_another_choice_is_tried_too():
    found = []
    for choices in Alternatives(2):
        way = choices.choose("way", ("over", "round"))
        side = choices.choose("side", ("left", "right")) if way == "round" else ""
        found.append((way, side))
    assert found == [("over", ""), ("round", "left"), ("round", "right")]


def test_what_is_dear_is_tried_after_all_that_is_cheaper():
    found = []
    for choices in islice(Alternatives(2), 7):
        stages = choices.choose("stages", (1, 2, 3), (0, 1, 4))
        found.append((stages, choices.choose("hold", range(6))))
    assert found == [(1, 0), (2, 0), (1, 1), (1, 2), (1, 3), (3, 0), (1, 4)]


def test_what_is_preferred_is_tried_before_what_comes_first_otherwise():
    alternatives, found = Alternatives(2), []
    for choices in islice(alternatives, 6):
        found.append((choices.choose("pace", (1, 2)), choices.choose("grasp", (1, 2, 3))))
        if len(found) == 2:
            alternatives.prefer("grasp")
    assert found == [(1, 1), (2, 1), (1, 2), (1, 3), (2, 2), (2, 3)]


def test_the_same_choice_is_the_same_each_time_within_a_try():
    choices = Choices({"pace": 1})
    assert [choices.choose("pace", (1.0, 0.5)) for _ in range(3)] == [0.5] * 3
    assert choices.asked == {"pace": range(2)}
    assert choices.choose("pace", (1.0,)) == 1.0  # where there are fewer ways, the last of them
    assert str(choices) == "pace 1"
    assert str(Choices()) == "usual"
