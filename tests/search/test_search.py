"""What a search finds, what it reduces it to, and on what that depends."""

from __future__ import annotations

import pytest

from pytest_safemanip.report.searching import sentence
from pytest_safemanip.search.coverage import looked_at, tolerances
from pytest_safemanip.search.dimension import NOTHING, Deviation
from pytest_safemanip.search.kinds.definition import Setting
from pytest_safemanip.search.proposing.effects import MOST, MainEffects
from pytest_safemanip.search.proposing.parzen import ParzenEstimators
from pytest_safemanip.search.proposing.proposer import decoded, encoded
from pytest_safemanip.search.proposing.sampling import RandomSampling, SobolSampling
from pytest_safemanip.search.search import Effort, Search
from pytest_safemanip.search.shrinking import Shrinker
from pytest_safemanip.search.trials import Outcome
from tests.search.pure import amount, dimensions_of, outcome_of, reaches, searched

WEAK = reaches(left=-4.0, latency=150.0)


@pytest.fixture(scope="module")
def dimensions(tmp_path_factory):
    return dimensions_of(tmp_path_factory.mktemp("space"))


@pytest.fixture(scope="module")
def found(dimensions):
    return searched(dimensions, ParzenEstimators, weak=WEAK, strong=reaches(left=1000.0))


def test_a_planted_weakness_is_found_and_reduced_to_its_cause(found):
    failure = found.pursuits["weak"].failure
    sizes = {name: failure.deviation[name].size for name in failure.deviation}
    assert sizes == {"left": -4.0, "latency": 150.0}
    assert len(failure.first) > 2
    assert failure.found_at <= 200


def test_what_another_search_shows_counts(dimensions):
    def left_alone(trial):
        return -1.0 if set(trial.deviation) == {"left"} else 1.0

    search = searched(
        dimensions,
        ParzenEstimators,
        effort=Effort(rollouts=64),
        weak=reaches(left=-4.0),
        narrow=left_alone,
    )
    assert [trial for trial in search.tried if set(trial.deviation) == {"left"}]
    failure = search.pursuits["narrow"].failure
    assert set(failure.deviation) == {"left"}
    assert all(pursuit.over for pursuit in search.pursuits.values())


def test_what_only_helps_is_left_out_for_a_larger_change(dimensions):
    shrinker = Shrinker(dimensions, 60)
    start = Deviation((("left", Setting(-7.0)), ("noise", Setting(30.0))))
    least = _answered(
        shrinker.reduce(start),
        lambda asked: -amount(asked, "left") + 0.1 * amount(asked, "noise") >= 8.0,
    )
    assert least.settings == (("left", Setting(-8.0)),)


def _answered(questions, fails):
    asked = next(questions)
    while True:
        try:
            asked = questions.send(fails(asked))
        except StopIteration as ended:
            return ended.value


def test_what_nothing_violates_is_given_up_after_its_budget(found):
    pursuit = found.pursuits["strong"]
    assert pursuit.over
    assert pursuit.failure is None
    assert pursuit.asked == 200


def test_the_cause_is_said_in_a_sentence(found, dimensions):
    failure = found.pursuits["weak"].failure
    told = dimensions.say(failure.deviation, lambda role: "the mug")
    assert sentence("weak", told, 0, 9, 10, exact=False) == (
        "fails weak when the mug stands 4 cm farther right and its actions come 150 ms late "
        "(9 of 10)"
    )


def test_a_search_is_the_same_in_whatever_order_its_trials_are_run(found, dimensions):
    def shuffled(trials):
        return sorted(trials, key=str, reverse=True)

    again = searched(
        dimensions, ParzenEstimators, order=shuffled, weak=WEAK, strong=reaches(left=1000.0)
    )
    assert list(again.tried) == list(found.tried)
    assert again.pursuits["weak"].failure == found.pursuits["weak"].failure


def test_another_seed_is_another_search(found, dimensions):
    effort = Effort(rollouts=32, seed=1)
    again = searched(
        dimensions, ParzenEstimators, effort=effort, weak=WEAK, strong=reaches(left=1000.0)
    )
    assert list(again.tried)[:40] != list(found.tried)[:40]


def test_what_fails_as_it_is_needs_no_search(dimensions):
    search = searched(dimensions, RandomSampling, weak=lambda trial: -1.0)
    failure = search.pursuits["weak"].failure
    assert (failure.deviation, failure.found_at) == (NOTHING, 0)
    assert search.pursuits["weak"].asked == 0
    assert sentence("weak", "", 3, 1, 1, exact=True) == (
        "fails weak as it is, without any change, with seed 3 (every time)"
    )


def test_where_some_episodes_fail_as_they_are_the_others_are_looked_into(dimensions):
    def weak(trial):
        return -1.0 if trial.seed == 1 else WEAK(trial)

    def only_plain(trial):
        return -1.0 if trial.seed == 1 else 1.0

    search = searched(
        dimensions, ParzenEstimators, seeds=(1, 2, 3), weak=weak, only_plain=only_plain
    )
    assert {own.violated_plain for own in search.pursuits.values()} == {(1,)}
    failure, plain = (search.pursuits[name].failure for name in ("weak", "only_plain"))
    assert failure.seed in (2, 3)
    assert set(failure.deviation) == {"left", "latency"}
    assert (plain.seed, plain.deviation) == (1, NOTHING)
    assert search.pursuits["only_plain"].asked == 200
    kept = [t for t in search.tried if t.deviation and t.seed != 1]
    assert search.satisfied("only_plain") == len(kept)
    (left, *_) = tolerances(dimensions, search.pursuits["only_plain"], list(search.tried.items()))
    assert (left.failed, left.survived > 5.0) == (None, True)


def test_of_what_is_random_it_is_said_how_often_it_fails(dimensions):
    def nine_of_ten(trial):
        return 1.0 if trial.repeat == 7 else WEAK(trial)

    search = searched(dimensions, ParzenEstimators, exact=False, weak=nine_of_ten)
    failure = search.pursuits["weak"].failure
    assert (failure.failed, failure.runs, failure.exact) == (9, 10, False)
    assert set(failure.deviation) == {"left", "latency"}
    assert failure.repeat == 0


def test_two_runs_alike_are_not_every_time_and_the_repeat_that_fails_is_kept(dimensions):
    def coin(trial):
        return 1.0 if trial.repeat in (3, 5, 8) else WEAK(trial)

    search = Search(dimensions, ["weak"], (0,), Effort(), ParzenEstimators)
    while asked := search.ask():
        search.tell(
            [outcome_of(own, exact=own.repeat not in (3, 5, 8), weak=coin) for own in asked]
        )
    failure = search.pursuits["weak"].failure
    assert (failure.failed, failure.runs, failure.exact, failure.repeat) == (7, 10, False, 0)

    def not_at_first(trial):
        small = amount(trial.deviation, "left") > -6.0
        return 1.0 if small and trial.repeat == 0 else WEAK(trial)

    search = searched(dimensions, ParzenEstimators, exact=False, weak=not_at_first)
    failure = search.pursuits["weak"].failure
    assert (failure.failed, failure.repeat) == (9, 1)


def test_what_seldom_fails_is_reduced_to_what_the_run_that_failed_takes(dimensions):
    def once(trial):
        return 1.0 if trial.repeat and amount(trial.deviation, "noise") else WEAK(trial)

    sizes = {"left": -5.0, "turn": 30.0, "latency": 200.0, "noise": 5.0}
    late = Deviation(tuple((name, Setting(size)) for name, size in sizes.items()))

    class Proposed:
        def __init__(self, dimensions, seed): ...

        def ask(self, count):
            return [late]

        def tell(self, deviation, loss): ...

    search = Search(dimensions, ["weak"], (0,), Effort(rollouts=8), Proposed)
    while asked := search.ask():
        search.tell(
            [outcome_of(own, exact=not amount(own.deviation, "noise"), weak=once) for own in asked]
        )
    failure = search.pursuits["weak"].failure
    assert set(failure.deviation) == {"left", "latency"}
    assert (failure.failed, failure.runs, failure.exact) == (1, 1, True)


def test_a_search_goes_on_where_trials_cannot_be_begun(dimensions):
    search = Search(dimensions, ["weak"], (0,), Effort(), ParzenEstimators)
    while asked := search.ask():
        crowded = [amount(trial.deviation, "clutter") > 0 for trial in asked]
        search.tell(
            [
                Outcome(refused="the can falls") if full else outcome_of(trial, weak=WEAK)
                for trial, full in zip(asked, crowded, strict=True)
            ]
        )
    assert set(search.pursuits["weak"].failure.deviation) == {"left", "latency"}


def test_seeds_take_turns(dimensions):
    search = searched(
        dimensions, SobolSampling, seeds=(4, 7), effort=Effort(rollouts=8), weak=lambda trial: 1.0
    )
    assert [trial.seed for trial in search.tried][:6] == [4, 7, 4, 7, 4, 7]


@pytest.mark.parametrize("make", [RandomSampling, SobolSampling, MainEffects, ParzenEstimators])
def test_the_same_seed_proposes_the_same(make, dimensions):
    first, again = (make(dimensions, 5) for _ in range(2))
    for _ in range(6):
        asked = first.ask(8)
        assert again.ask(8) == asked
        for own in (first, again):
            for number, deviation in enumerate(asked):
                own.tell(deviation, None if number == 3 else amount(deviation, "left"))


def test_it_learns_from_trials_that_others_asked_for(dimensions):
    ignorant, told = (ParzenEstimators(dimensions, 0) for _ in range(2))
    for proposer in (ignorant, told):
        proposer.ask(32)
    others = RandomSampling(dimensions, 1).ask(60)
    for deviation in others:
        told.tell(deviation, loss_of(deviation))
        ignorant.tell(deviation, 1.0)
    losses = [
        sum(loss_of(deviation) for deviation in proposer.ask(40)) for proposer in (told, ignorant)
    ]
    assert losses[0] < 0.8 * losses[1]


def test_what_came_nearest_to_a_violation_is_carried_further(dimensions):
    proposer = ParzenEstimators(dimensions, 0)
    proposer.ask(32)
    near = Deviation((("left", Setting(-4.0)), ("clutter", Setting("can", FAR))))
    proposer.tell(near, 0.1)
    proposer.tell(NOTHING, 1.0)
    (left, same), _ = (own.settings for own in proposer.ask(8)[:2])
    assert left == ("left", Setting(-5.0))
    assert same == near.settings[1]
    assert near not in proposer.ask(8)


def test_one_value_of_what_came_nearest_is_drawn_anew(dimensions):
    proposer = ParzenEstimators(dimensions, 0)
    proposer.ask(32)
    near = Deviation((("left", Setting(-10.0)), ("noise", Setting(50.0))))
    for _ in range(40):
        proposer.tell(near, 0.1)
    drawn = []
    for _ in range(6):
        others = proposer.ask(8)[:4]
        drawn += [own for own in others if len(dict(set(own.settings) ^ set(near.settings))) == 1]
    assert len({name for own in drawn for name in dict(set(own.settings) - set(near.settings))}) > 2


def test_what_lowers_the_margin_is_tried_at_its_limits(dimensions):
    proposer = MainEffects(dimensions, 0)
    for deviation in RandomSampling(dimensions, 1).ask(200):
        left, noise = amount(deviation, "left"), amount(deviation, "noise")
        proposer.tell(deviation, 1.0 + 0.05 * left - 0.01 * noise)
    proposer.tell(NOTHING, None)
    asked = proposer.ask(40)
    by_name = dimensions.by_name
    both = [own for own in asked if own.get("left") and own.get("noise")]
    assert len(both) > 30
    assert {own["left"].size for own in both} == {by_name["left"].low}
    assert {own["noise"].size for own in both} == {by_name["noise"].high}
    assert all(len(own) <= MOST for own in asked)


FAR = (("forward", 20.0), ("left", 0.0))


def loss_of(deviation):
    return 1.0 - 0.5 * (amount(deviation, "left") < -4.0) - 0.5 * (amount(deviation, "latency") > 0)


def test_a_deviation_is_the_same_when_it_was_a_point(dimensions):
    for deviation in SobolSampling(dimensions, 2).ask(100):
        assert decoded(encoded(deviation, dimensions), dimensions) == deviation


def test_it_is_said_between_which_sizes_a_policy_fails(found, dimensions):
    tried = list(found.tried.items())
    rows = {own.dimension: own for own in tolerances(dimensions, found.pursuits["weak"], tried)}
    left, noise = rows["left"], rows["noise"]
    assert (left.survived, left.failed, left.unit, left.quantity) == (3.5, 4.0, "cm", "length")
    assert noise.failed is None
    assert 0.0 < noise.survived <= 50.0


def test_regions_are_counted_that_were_looked_at(found, dimensions):
    rows = {own.dimension: own for own in looked_at(dimensions, list(found.tried.items()))}
    had = [trial for trial in found.tried if trial.deviation.get("left")]
    assert sum(rows["left"].regions.values()) == len(had)
    assert set(rows["clutter"].regions) == {"can", "cup"}
    assert all(rows["left"].regions.values())


def test_values_of_one_thing_add_up(dimensions):
    deviation = Deviation((("left", Setting(3.0)), ("turn", Setting(15.0))))
    (change,) = dimensions.situation(deviation).changes
    assert (change.by, change.turn) == ((0.0, 0.03), 15.0)
