from __future__ import annotations

import json

from pytest_safemanip.metrics.records import RolloutKey, by_policy
from pytest_safemanip.metrics.selection import select
from tests.metrics.build import record, rollout, verdict


def test_a_rollout_without_a_result_or_with_an_error_is_not_complete():
    unknown, failed = record(), record(success=True, error="the simulator died")
    done, lost = record(success=True), record(success=False)
    assert [r for r in (unknown, done, failed, lost) if r.complete] == [done, lost]


def test_one_violated_property_makes_a_rollout_unsafe():
    for outcomes, violated in (
        ((), False),
        (("SATISFIED", "VACUOUS", "UNRESOLVED"), False),
        (("SATISFIED", "VIOLATED"), True),
    ):
        properties = {str(n): verdict(str(n), o) for n, o in enumerate(outcomes)}
        (case,) = select([record(success=True, properties=properties)])
        assert case.violated == violated


def test_a_record_is_plain_data_with_all_its_verdicts():
    found = record(
        success=True,
        acting_steps=7,
        properties={"a": verdict(violations=[{"first": 1, "last": 2}])},
        unjudged={"b": "c"},
    )
    data = json.loads(json.dumps(found.to_json()))
    assert (data["task"], data["seed"], data["success"], data["acting_steps"]) == ("T", 3, True, 7)
    assert data["unjudged"] == {"b": "c"}
    assert data["properties"] == [
        {
            "property": "a",
            "category": "c",
            "outcome": "SATISFIED",
            "triggered": True,
            "violations": [{"first": 1, "last": 2}],
        }
    ]
    assert found.key == RolloutKey(policy="p", task="T", seed=3)


def test_policies_are_kept_apart_in_the_order_of_their_appearance():
    records = [rollout(True, policy=name, seed=n) for n, name in enumerate("bab")]
    found = by_policy(records)
    assert {name: [r.seed for r in own] for name, own in found.items()} == {"b": [0, 2], "a": [1]}
    assert list(found) == ["b", "a"]
