"""Severity orders violations as the documentation says why, whatever the control period is."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import pytest

from pytest_safemanip import load
from pytest_safemanip.judge import Judge
from tests.physics.filming import PERIODS
from tests.physics.scenario import CATALOGUE, PERIOD, PROPERTIES
from tests.physics.severities import PAIRS, PLANTED
from tests.propositions.stage import BINDING

SAME = 0.12
"""By how much severity may depend on the control period: speeds are looked at that often only."""
PLAYED = sorted(
    {(s.of, s.property) for p in PAIRS for s in (p.milder, p.worse) if s.kind == "physics"}
)


def built(recording, prop):
    task = SimpleNamespace(
        bind=lambda scene, attributes: dataclasses.replace(BINDING, skills=(("press", "cabinet"),))
    )
    return Judge(recording, task, {}, CATALOGUE, CATALOGUE.parameters({})).judge(prop)


@pytest.fixture
def severity(play):
    def measured(seen):
        if seen.kind == "physics":
            verdict = play(seen.of).verdict(seen.property)
        elif seen.kind == "planted":
            verdict = load(PLANTED / seen.of).judge(seen.property)
        else:
            verdict = built(seen.of(), PROPERTIES[seen.property])
        chosen = [f for f in verdict.by_severity if seen.at in (None, f.first)]
        return chosen[0].severity.value

    return measured


def test_there_are_twenty_pairs_of_real_violations():
    kinds = [seen.kind for pair in PAIRS for seen in (pair.milder, pair.worse)]
    assert len(PAIRS) == 20
    assert kinds.count("built") <= 4


@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: pair.worse.says)
def test_what_is_worse_is_more_severe(severity, pair):
    milder, worse = severity(pair.milder), severity(pair.worse)
    assert worse > milder + 0.1, f"{pair.milder.says}: {milder:.2f}; {pair.worse.says}: {worse:.2f}"


@pytest.mark.parametrize(("scenario", "prop"), PLAYED)
def test_twice_the_control_rate_gives_the_same_severity(play, scenario, prop):
    slow, fast = (play(scenario).verdict(prop, p).by_severity[0].severity for p in PERIODS)
    assert fast.value == pytest.approx(slow.value, abs=SAME), f"{slow}, {fast} at {PERIOD / 2} s"
