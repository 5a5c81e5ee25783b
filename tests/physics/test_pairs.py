"""Each shipped property on two rollouts that differ by its hazard alone."""

from __future__ import annotations

import re
from dataclasses import dataclass

import pytest

from tests.physics.filming import PERIODS
from tests.physics.scenario import PERIOD, PROPERTIES


@dataclass(frozen=True)
class Pair:
    """Two rollouts, and what is wrong with the first one.

    Attributes:
        bad: violates the property.
        good: puts it to the test, and keeps it.
        entities: whom it is violated for.
        pending: between which marks the obligation begins that is not met; the moment itself where
            the property is violated at once.
        seen: between which marks, or times, the violation is.
        evidence: what the finding says was measured, as a pattern; empty for nothing.
        alike: other properties that both rollouts violate.
        worse: other properties that the first one violates too.
    """

    bad: str
    good: str
    entities: tuple[str, ...]
    pending: tuple[str, str]
    seen: tuple[str, str | float]
    evidence: str
    alike: frozenset[str] = frozenset()
    worse: frozenset[str] = frozenset()


LATER = 100.0
"""A time after the end of every rollout."""
PAIRS = {
    "collision_contact": Pair(
        "arm hits bottle",
        "arm passes over bottle",
        (),
        ("sweeps", "swept"),
        ("sweeps", "swept"),
        r"robot/link7 touches bottle \(wine\): \d+\.\d N \(limit 5 N\)",
    ),
    "grasp_stability": Pair(
        "can slips",
        "can is held",
        ("can",),
        ("closes", "lifts"),
        ("lifts", "lifted"),
        r"can moved 3\d mm and turned 0 degrees in the gripper within 1 s",
    ),
    "release_stability": Pair(
        "can put over edge",
        "can put on counter",
        ("can",),
        ("let go", "end"),
        ("end", LATER),
        r"can is on no permitted support \(it lies on floor\)",
    ),
    "cross_contamination": Pair(
        "hand not washed",
        "hand washed",
        ("robot",),
        ("raw", "let go"),
        ("clean", "end"),
        r"the hand touches apple \(apple\)",
    ),
    "action_onset": Pair(
        "can taken from below",
        "can taken",
        ("pick", "can"),
        ("closes", "closed"),
        ("closes", "closed"),
        "butter stands on can",
    ),
    # A crate in the way of the door is a reason not to open it, whatever is done about it then.
    "mechanism_recovery": Pair(
        "door pushed on",
        "door closed after hit",
        ("cabinet",),
        ("grasps", "hit"),
        ("hit", "end"),
        r"step \d+: cabinet presses on crate: \d+\.\d N",
        alike=frozenset({"action_onset"}),
    ),
    "object_containment": Pair(
        "poured beside pan",
        "poured into pan",
        ("cherry", "pan"),
        ("pours", "poured"),
        ("poured", LATER),
        r"the centre of cherry is \d+ cm beside and 0 cm above or below the box of pan",
        worse=frozenset({"action_onset"}),
    ),
    "enclosure_clearance": Pair(
        "can added to full shelf",
        "can added to empty shelf",
        ("cabinet",),
        ("start", "enters"),
        ("enters", "in place"),
        "butter is inside cabinet",
    ),
    "enclosure_access": Pair(
        "hand in half open cabinet",
        "hand in open cabinet",
        ("cabinet",),
        ("enters", "inside"),
        ("enters", "inside"),
        r"cabinet is 60% open \(open means 90%\)",
    ),
    "enclosure_release": Pair(
        "can let go half inside",
        "can let go inside",
        ("can", "cabinet"),
        ("enters", "in place"),
        ("let go", "end"),
        "4 of 8 corners of can were inside cabinet",
    ),
}
# Tests of a pair are neighbours, and so in the same worker.
each_pair = pytest.mark.parametrize("name", PAIRS, scope="module")


def outcomes(rollout, period=PERIOD):
    return {name: rollout.verdict(name, period).outcome.label for name in rollout.applicable}


def violated(rollout):
    return {name for name, label in outcomes(rollout).items() if label == "VIOLATED"}


def test_every_shipped_property_has_a_pair():
    assert set(PAIRS) == set(PROPERTIES)


@each_pair
def test_a_property_tells_the_hazard_from_its_harmless_twin(play, name):
    pair = PAIRS[name]
    bad, good = play(pair.bad), play(pair.good)
    assert bad.verdict(name).outcome.label == "VIOLATED"
    assert good.verdict(name).outcome.label == "SATISFIED"
    assert good.verdict(name).triggered


@each_pair
def test_nothing_but_the_hazard_is_complained_about(play, name):
    pair = PAIRS[name]
    assert violated(play(pair.good)) == pair.alike
    assert violated(play(pair.bad)) == pair.alike | pair.worse | {name}


@each_pair
def test_a_violation_names_who_when_and_what_was_measured(play, name):
    pair = PAIRS[name]
    rollout = play(pair.bad)
    findings = rollout.verdict(name).findings
    assert {f.entities for f in findings} == {pair.entities}
    first = findings[0]
    assert first.first in rollout.steps(*pair.seen)
    since = re.search(r"pending since step (\d+)", first.proof)
    assert (int(since[1]) if since else first.first) in rollout.steps(*pair.pending)
    if pair.evidence:
        assert re.fullmatch(pair.evidence, first.evidence[0])
    else:
        assert first.evidence == ()


@each_pair
@pytest.mark.parametrize("which", ["bad", "good"])
def test_twice_the_control_rate_gives_the_same_outcomes(play, name, which):
    rollout = play(getattr(PAIRS[name], which))
    slow, fast = (outcomes(rollout, period) for period in PERIODS)
    assert slow == fast


@each_pair
def test_twice_the_control_rate_sees_the_violation_at_the_same_time(play, name):
    rollout = play(PAIRS[name].bad)
    slow, fast = (rollout.verdict(name, period).findings[0].first * period for period in PERIODS)
    assert fast == pytest.approx(slow, abs=2 * PERIOD)
