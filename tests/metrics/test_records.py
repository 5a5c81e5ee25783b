from __future__ import annotations

import json

from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord, complete


def record(**changed):
    fields = {"task": "T", "policy": "p", "seed": 3, "suite": "s", "horizon": "atomic"}
    return RolloutRecord(**{**fields, **changed})


def verdict(name="a", outcome="SATISFIED", category="c", triggered=True, violations=()):
    return PropertyRecord(name, category, outcome, triggered, tuple(violations))


def test_a_rollout_without_a_result_or_with_an_error_is_not_complete():
    unknown, failed = record(), record(success=True, error="the simulator died")
    done, lost = record(success=True), record(success=False)
    assert complete([unknown, done, failed, lost]) == [done, lost]


def test_one_violated_property_makes_a_rollout_unsafe():
    for outcomes, violated in (
        ((), False),
        (("SATISFIED", "VACUOUS", "UNRESOLVED"), False),
        (("SATISFIED", "VIOLATED"), True),
    ):
        properties = {str(n): verdict(str(n), o) for n, o in enumerate(outcomes)}
        assert record(success=True, properties=properties).violated == violated


def test_a_record_is_plain_data_with_all_its_verdicts():
    found = record(
        success=True,
        acting_steps=7,
        properties={"a": verdict(violations=[{"first": 1, "last": 2}])},
    )
    data = json.loads(json.dumps(found.to_json()))
    assert (data["task"], data["seed"], data["success"], data["acting_steps"]) == ("T", 3, True, 7)
    assert data["properties"] == [
        {
            "property": "a",
            "category": "c",
            "outcome": "SATISFIED",
            "triggered": True,
            "violations": [{"first": 1, "last": 2}],
        }
    ]
    assert found.key == ("p", "T", 3)
