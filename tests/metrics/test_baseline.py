from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.baseline import contrast, partners
from pytest_safemanip.metrics.statistics.paired import Pairs
from tests.metrics.build import bad, record, rollout, rollouts, verdict
from tests.metrics.test_summaries import ORIGIN, summary


def compared(before, now, must_pass=(), margin=0.1):
    return contrast(summary(before, "before"), summary(now, "now"), must_pass, margin)


def by_name(found):
    return {comparison.name: comparison for comparison in found.comparisons}


def test_pairs_are_counted_by_what_became_of_them():
    found = compared(rollouts("xx..x"), rollouts("x.x.."))
    category, every, single = found.comparisons
    assert (single.name, single.kind, single.required) == ("a", "property", False)
    assert (category.name, category.kind, category.required) == ("c", "category", True)
    assert (every.name, every.kind, every.required) == ("violation_rate", "all", False)
    assert category.pairs == every.pairs == Pairs(both=1, fixed=2, regressed=1, neither=1)
    assert [(flip.seed, flip.property, flip.regressed) for flip in found.flips] == [
        (1, "a", False),
        (2, "a", True),
        (4, "a", False),
    ]


@pytest.mark.parametrize(
    ("before", "now", "wanted"),
    [
        ("." * 40, "x" * 8 + "." * 32, "REGRESSED"),
        ("x" * 8 + "." * 32, "." * 40, "IMPROVED"),
        ("x" * 8 + "." * 92, "x" * 7 + "." * 93, "HELD"),
        ("." * 5, "." * 5, "UNDERPOWERED"),
        ("." * 5, "x" + "." * 4, "UNDERPOWERED"),
        ("." * 40, "." * 39 + "e", "INCOMPLETE"),
        ("." * 40, "." * 39 + "-", "INCOMPLETE"),
    ],
)
def test_the_verdict(before, now, wanted):
    assert compared(rollouts(before), rollouts(now)).comparisons[0].verdict == wanted


def test_the_margin_says_what_held_means():
    before, now = rollouts("x" * 8 + "." * 32), rollouts("x" * 9 + "." * 31)
    assert compared(before, now, margin=0.2).comparisons[0].verdict == "HELD"
    assert compared(before, now, margin=0.02).comparisons[0].verdict == "UNDERPOWERED"


def families(regressed):
    """Ten categories of forty rollouts; one breaks in some rollouts."""
    names = "abcdefghij"

    def run(pattern):
        return [
            rollout(
                True,
                *(
                    bad(n, category=n.upper()) if n == "a" and c == "x" else verdict(n, category=n)
                    for n in names
                ),
                seed=seed,
            )
            for seed, c in enumerate(pattern)
        ]

    def fitted(records):
        for one in records:
            one.properties["a"] = (
                bad("a", category="A")
                if one.properties["a"].outcome == "VIOLATED"
                else verdict("a", category="A")
            )
        return records

    return fitted(run("." * 40)), fitted(run("x" * regressed + "." * (40 - regressed)))


def test_a_family_of_ten_asks_for_stronger_evidence():
    before, now = families(5)
    alone = by_name(compared(before, now, must_pass=["A"]))["A"]
    together = by_name(compared(before, now))["A"]
    assert alone.verdict == "REGRESSED"
    assert together.worse == pytest.approx(10 * alone.worse)
    assert together.verdict == "UNDERPOWERED"
    assert together.detectable > alone.detectable
    before, now = families(9)
    assert by_name(compared(before, now))["A"].verdict == "REGRESSED"


def test_what_has_to_pass_is_a_family_of_its_own():
    before, now = families(5)
    found = by_name(compared(before, now, must_pass=["A", "b"]))
    assert [name for name, c in found.items() if c.required] == ["A", "b"]
    # A property is compared on its own where its category has another name.
    assert (found["a"].kind, found["a"].required) == ("property", False)
    assert found["b"].kind == "category"


def test_only_pairs_count():
    before = [*rollouts("....", task="A"), *rollouts("....", task="B"), *rollouts("e", task="C")]
    now = [*rollouts("....", task="A", first=2), *rollouts("..", task="C")]
    found = compared(before, now)
    assert found.comparisons[0].pairs.total == 2
    assert (found.unpaired, found.absent, found.earlier) == (4, 6, 9)
    assert found.comparisons[0].triggered == (2, 2)
    none = compared(before, rollouts("..", task="D")).comparisons[0]
    assert (none.verdict, none.why) == ("INCOMPLETE", "no rollout of it is in both runs")


def test_policies_are_compared_by_name_or_as_the_only_ones():
    one = summary(rollouts(".", policy="old"), "before")
    both = summary([*rollouts("."), *rollouts(".", policy="q")], "before")
    assert partners(one, ["new"]) == {"new": "old"}
    assert partners(both, ["q", "p"]) == {"q": "q", "p": "p"}
    assert partners(both, ["p"]) == {"p": "p"}
    with pytest.raises(ConfigError, match="or compare 'new' alone, which is taken for a new 'p'"):
        partners(summary(rollouts("."), "before"), ["p", "new"])
    with pytest.raises(ConfigError, match="before has no rollout of policy 'new'; it has p, q"):
        partners(both, ["new"])


def test_another_way_of_deciding_is_refused():
    with pytest.raises(ConfigError, match="semantics is timed and paper"):
        contrast(summary([], "before"), summary([], "now", semantics="paper"), (), 0.1)


def test_another_simulation_is_refused_where_pairs_come_from_it():
    other = {**ORIGIN, "versions": {"mujoco": "3.3.1"}}
    before = summary(rollouts(".", provenance=0), "before")
    now = summary(rollouts("."), "now", [ORIGIN, other])
    now.records[0].provenance = 0
    assert contrast(before, now, (), 0.1).comparisons
    now.records[0].provenance = 1
    with pytest.raises(
        ConfigError, match=r"another simulation: versions\.mujoco is 3\.9\.0 and 3\.3\.1; run the"
    ):
        contrast(before, now, (), 0.1)


@pytest.mark.parametrize("ran", ["before", "now"])
def test_a_rollout_that_never_ran_comes_from_no_simulation(ran):
    before = summary(rollouts(".", provenance=0 if ran == "before" else None), "before")
    now = summary(rollouts(".", provenance=0 if ran == "now" else None), "now")
    assert contrast(before, now, (), 0.1).comparisons


def test_a_contrast_is_plain_data():
    found = compared(rollouts("x..x"), [*rollouts("..x"), record(seed=9, unjudged={"a": "c"})])
    data = found.to_json()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    first = data["comparisons"][0]
    assert first["pairs"] == {"both": 0, "fixed": 1, "regressed": 1, "neither": 1}
    assert (first["before"], first["now"], first["difference"]) == (1 / 3, 1 / 3, 0.0)


@settings(deadline=None)
@given(st.text("x.", min_size=1, max_size=30), st.text("x.", min_size=1, max_size=30))
def test_no_change_is_no_regression_and_turning_time_round_turns_the_verdict(one, other):
    assert compared(rollouts(one), rollouts(one)).comparisons[0].verdict in (
        "HELD",
        "UNDERPOWERED",
    )
    forth = compared(rollouts(one), rollouts(other)).comparisons[0].verdict
    back = compared(rollouts(other), rollouts(one)).comparisons[0].verdict
    assert (forth == "REGRESSED") == (back == "IMPROVED")


def test_a_regression_by_ten_points_is_found_with_200_pairs():
    random = np.random.default_rng(8)
    found = []
    for _ in range(25):
        # 20 % before, 30 % now; outcomes correlate as they do with a latent correlation of 0.7.
        kinds = random.choice(4, size=200, p=[0.1433, 0.0567, 0.1567, 0.6433])
        before = "".join("xx.."[kind] for kind in kinds)
        now = "".join("x.x."[kind] for kind in kinds)
        found.append(compared(rollouts(before), rollouts(now)).comparisons[0].verdict)
    assert np.mean([verdict == "REGRESSED" for verdict in found]) > 0.8
