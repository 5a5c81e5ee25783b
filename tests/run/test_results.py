from __future__ import annotations

import dataclasses
import itertools
import json
from pathlib import Path

import pytest

from pytest_safemanip.metrics.selection import select
from pytest_safemanip.run.results import Results, error_data, judged_data, skipped_data
from tests import toy
from tests.report.conftest import finding, verdict

PATH = Path("recordings/one.rollout")


@pytest.fixture
def plan(make):
    return make(seeds=(0, 1))


def data(plan, case, outcome="SATISFIED", *findings, recording=None):
    prop = plan.properties[case.property_id]
    return judged_data(case, prop, verdict(outcome, *findings), recording or toy.recording(), PATH)


def test_the_data_of_a_case_survive_the_way_between_processes(plan):
    case = plan.cases[0]
    for found in (data(plan, case, "VIOLATED", finding()), error_data(case, "lost")):
        assert json.loads(json.dumps(found)) == found


def test_a_rollout_collects_the_verdicts_of_its_cases_in_any_order(plan):
    own = [case for case in plan.cases if case.seed == 0][:3]
    expected = None
    for order in itertools.permutations(own):
        results = Results(plan.tasks, plan.properties)
        results.expect(plan.cases)
        for case in order:
            outcome = ("VIOLATED", finding()) if case == own[0] else ("VACUOUS",)
            results.add(data(plan, case, *outcome))
        record, other = results.records
        assert record.key == ("hold", own[0].task, 0)
        assert select([record])[0].violated
        assert (record.success, record.acting_steps, record.recording) == (False, 6, str(PATH))
        assert not other.complete
        assert set(other.unjudged) == {c.property_id for c in plan.cases if c.seed == 1}
        found = {name: p.outcome for name, p in record.properties.items()}
        assert expected in (None, found)
        expected = found


def test_a_rollout_says_of_which_packs_its_properties_are_judged_or_not(plan):
    own = {case.property_id for case in plan.cases}
    first, *others = sorted(own)
    of_packs = {
        name: dataclasses.replace(plan.properties[name], pack="" if name == first else "house")
        for name in own
    }
    results = Results(plan.tasks, of_packs)
    results.expect(plan.cases)
    results.add(data(plan, plan.cases[0]))
    for record in results.records:
        assert record.packs == dict.fromkeys(others, "house")
        assert [record.pack_of(name) for name in (first, others[0])] == ["default", "house"]


def test_a_case_with_an_error_makes_its_rollout_incomplete_whichever_comes_first(plan):
    good, bad = plan.cases[:2]
    for order in ((good, bad), (bad, good)):
        results = Results(plan.tasks, plan.properties)
        for case in order:
            results.add(error_data(case, "died") if case == bad else data(plan, case))
        assert not results.records[0].complete
        assert results.records[0].error == "died"
        assert results.errors == {bad: "died"}


def test_records_are_in_the_order_of_the_plan_and_unseen_cases_are_missing(plan):
    results = Results(plan.tasks, plan.properties)
    results.expect(plan.cases)
    results.expect(plan.cases)
    last, first = plan.cases[-1], plan.cases[0]
    results.add(data(plan, last))
    results.add(data(plan, first))
    assert [record.seed for record in results.records] == [0, 1]
    assert results.missing == [case for case in plan.cases if case not in (first, last)]
    assert len(results.expected) == len(plan.cases)


def test_what_was_deselected_is_no_verdict_that_a_gate_could_do_without(plan):
    first = [case for case in plan.cases if case.seed == 0]
    results = Results(plan.tasks, plan.properties, plan.cases)
    assert not results.left_out
    results.expect(first[:1])
    results.add(data(plan, first[0]))
    (record,) = results.records
    assert record.complete
    assert not record.unjudged
    assert set(record.deselected) == {case.property_id for case in first[1:]}
    assert record.reason.startswith(f"{len(first) - 1} of {len(first)} cases of this rollout were")
    assert not select([record.as_planned()])[0].decided
    (other,) = results.left_out
    assert other.seed == 1
    assert len(other.deselected) == len(first)


def test_origins_are_kept_once_and_without_what_is_of_one_rollout_only(plan):
    results = Results(plan.tasks, plan.properties)
    episodes = [
        toy.episode(seed=n, hashes={"key": str(n), "start": str(n), "policy": "p", "backend": "b"})
        for n in range(2)
    ]
    other = toy.episode(assets="official", hashes={"backend": "b"})
    for case, about in zip(
        (plan.cases[0], plan.cases[-1], plan.cases[1]), (*episodes, other), strict=True
    ):
        results.add(data(plan, case, recording=toy.recording(about=about)))
    assert [origin["assets"] for origin in results.provenance] == ["primitive", "official"]
    assert results.provenance[0]["hashes"] == {"backend": "b"}


def test_skipped_rollouts_are_neither_missing_nor_incomplete(plan):
    results = Results(plan.tasks, plan.properties)
    results.expect(plan.cases)
    for case in plan.cases:
        results.add(data(plan, case) if case.seed == 0 else skipped_data(case))
    assert [record.seed for record in results.records] == [0]
    assert results.records[0].complete
    assert not results.records[0].unjudged
    assert len(results.skipped) == 1
    assert not results.missing
