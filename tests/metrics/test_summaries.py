from __future__ import annotations

import dataclasses
import itertools
import json
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.merging import merge
from pytest_safemanip.metrics.selection import select
from pytest_safemanip.metrics.summaries import SCHEMA, Summary, differences, read
from pytest_safemanip.run.invocation import reproduce
from tests.metrics.build import bad, rollout, rollouts, severe, verdict

ORIGIN = {"backend": "toy", "versions": {"mujoco": "3.9.0"}, "hashes": {"assets": "1"}}
DECISIVE = {"semantics": "timed", "parameters.settled.speed": 0.02, "properties.a": "123"}


def summary(records, place="one", origins=(ORIGIN,), **decisive):
    return Summary((place,), tuple(records), {**DECISIVE, **decisive}, tuple(origins))


def document(records):
    return {
        "schema": SCHEMA,
        "settings": {"semantics": "timed", "stop": "success", "horizon_scale": 1.0},
        "hashes": {"parameters": {"settled.speed": 0.02}, "properties": {"a": "123"}},
        "provenance": [ORIGIN],
        "cases": {
            "expected": len(records),
            "missing": ["safemanip::test_safety[T-p-a-seed0]"],
            "errors": {"safemanip::test_safety[T-p-a-seed2]": "the server is gone"},
            "skipped_rollouts": 0,
            "reused_rollouts": 0,
            "partial": False,
        },
        "rollouts": [record.to_json() for record in records],
    }


def written(tmp_path, found, name="summary.json"):
    path = tmp_path / name
    path.write_text(json.dumps(found))
    return path


STRANGE = "\x1b[2J\u202e"
SERVED = {"protocol": "openpi", "calls": "1", "actions": "8", "clipped": "0", "seeded": "yes"}
MEASURED = dataclasses.replace(
    severe(1.5), violations=({**severe(1.5).violations[0], "measured": {"margin": 1.0}},)
)
RECORDS = [
    rollout(True, MEASURED, verdict("b"), provenance=0, recording="r", seed=0),
    rollout(
        False,
        verdict("a"),
        unjudged={"b": "d"},
        deselected={"c": "d"},
        served=SERVED,
        seed=1,
        packs={"b": "house", "c": "house"},
        warned="b for mug in 0.10 s",
        failure="grasp obj: the object was not lifted",
    ),
    *rollouts("e-", first=2),
]


def test_what_was_written_is_read(tmp_path):
    path = written(tmp_path, document(RECORDS))
    for place in (tmp_path, path):
        found = read(place)
        kept = [
            dataclasses.replace(r, recording=str(Path(tmp_path, "r")))
            for r in RECORDS
            if r.recording
        ]
        assert [record for record in found.records if record.recording] == kept
        assert [record for record in found.records if not record.recording] == [
            record for record in RECORDS if not record.recording
        ]
        assert found.origins == (ORIGIN,)
        assert found.place == str(path)
        assert found.decisive["parameters.settled.speed"] == 0.02
        assert found.decisive["semantics"] == "timed"


def test_of_an_earlier_version_no_property_is_of_a_pack_and_no_rollout_says_how_it_ended(tmp_path):
    found = document(RECORDS)
    for own in found["rollouts"]:
        del own["packs"], own["warned"], own["failure"]
    for known in read(written(tmp_path, found)).records:
        assert (known.packs, known.warned, known.failure) == ({}, "", "")
        assert known.pack_of("b") == "default"


def test_a_case_is_run_again_with_the_options_of_its_run(tmp_path):
    given = ["--safemanip-fresh", "--safemanip-params=settled.speed=0.01; rm -rf ."]
    found = read(written(tmp_path, {**document(RECORDS), "run": {"options": given}}))
    assert reproduce(found.options, "safemanip::test_safety[a-b]") == (
        "pytest --safemanip-fresh '--safemanip-params=settled.speed=0.01; rm -rf .' "
        "'safemanip::test_safety[a-b]'"
    )


def test_an_error_may_have_no_message(tmp_path):
    found = document(RECORDS)
    found["cases"]["errors"]["safemanip::test_safety[T-p-a-seed3]"] = ""
    assert len(read(written(tmp_path, found)).records) == len(RECORDS)


def broken(change):
    found = document(RECORDS)
    change(found, found["rollouts"][0], found["rollouts"][0]["properties"][0])
    return found


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d, r, p: d.update(schema=2), "schema 2, this version reads 1"),
        (lambda d, r, p: d.pop("schema"), "schema: expected a number, found None"),
        (lambda d, r, p: d.update(rollouts={}), "rollouts: expected a list, found {}"),
        (lambda d, r, p: d.update(rollouts=[3]), "rollouts[0]: expected a mapping, found 3"),
        (lambda d, r, p: r.update(task=""), "rollouts[0]: task: expected text, found ''"),
        (lambda d, r, p: d.pop("cases"), "cases: expected a mapping, found None"),
        (lambda d, r, p: d["cases"].update(missing=3), "cases: missing: expected a list of texts"),
        (lambda d, r, p: d["cases"].update(errors={"a": 1}), "errors: a: expected text, found 1"),
        (lambda d, r, p: d["cases"].update(expected="9"), "expected: expected a whole number"),
        (lambda d, r, p: r.update(policy="a\x1b[2J"), "policy: expected the name of a policy"),
        (lambda d, r, p: r.update(policy="\ud800"), "found '\\ud800'"),
        (lambda d, r, p: r.update(seed=-1), "rollouts[0]: seed: expected a whole number"),
        (lambda d, r, p: r.update(seed=True), "rollouts[0]: seed: expected a whole number"),
        (lambda d, r, p: r.update(success=1.5), "success: expected true, false or null"),
        (lambda d, r, p: r.update(provenance=1), "provenance: expected an index below 1"),
        (lambda d, r, p: r.update(served=[]), "served: expected a mapping"),
        (lambda d, r, p: r.update(served={**SERVED, "calls": "9" * 5000}), "calls must be a count"),
        (lambda d, r, p: r.update(served={"clipped": "9" * 5000}), "clipped must be a count"),
        (lambda d, r, p: r.update(served={"protocol": "openpi"}), "calls must be a count"),
        (lambda d, r, p: p.update(violations=[]), "violations: expected some if VIOLATED"),
        (lambda d, r, p: p.update(outcome="SATISFIED"), "none if not; it is SATISFIED"),
        (lambda d, r, p: r.update(properties=[]), "a rollout of which no property was asked for"),
        (lambda d, r, p: r["properties"].append(p), "two entries for property 'a'"),
        (lambda d, r, p: r.update(unjudged={"b": "c"}), "two entries for property 'b'"),
        (lambda d, r, p: r.update(deselected={"b": "c"}), "two entries for property 'b'"),
        (
            lambda d, r, p: r["properties"][1].update(triggered=False),
            "triggered: expected true of what is SATISFIED",
        ),
        (
            lambda d, r, p: r["properties"][1].update(outcome="VACUOUS"),
            "triggered: expected false of what is VACUOUS",
        ),
        *(
            (lambda d, r, p, key=key: r.update({key: STRANGE}), f"{key}: expected printable text")
            for key in ("task", "suite", "horizon")
        ),
        *(
            (lambda d, r, p, key=key: p.update({key: STRANGE}), f"{key}: expected printable text")
            for key in ("property", "category")
        ),
        (
            lambda d, r, p: d["cases"].update(errors={STRANGE: 1}),
            r"errors: \x1b[2J\u202e: expected",
        ),
        (lambda d, r, p: p.update(outcome="SAFE"), "outcome: expected one of VIOLATED"),
        (lambda d, r, p: p.update(triggered="yes"), "triggered: expected true or false"),
        (lambda d, r, p: p["violations"][0].update(last=1), "last: expected a step from 2 on"),
        (lambda d, r, p: p["violations"][0].update(duration_s=-1), "expected a number from 0"),
        (lambda d, r, p: p["violations"][0].update(entities=[1]), "expected a list of texts"),
        (
            lambda d, r, p: p["violations"][0].update(severity=-1, measured={}),
            "severity: expected a number from 0 up",
        ),
        (lambda d, r, p: p["violations"][0].pop("measured"), "measured: expected a mapping"),
        (
            lambda d, r, p: p["violations"][0].update(severity=1, measured={"margin": "much"}),
            "measured: margin: expected a number",
        ),
        (lambda d, r, p: d["rollouts"].append(r), "two rollouts with the same policy, task and"),
        (lambda d, r, p: d.update(run={}), "run: options: expected a list of texts"),
        *(
            (
                lambda d, r, p, bad=bad: d.update(run={"options": [bad]}),
                "run: options: expected opt",
            )
            for bad in ("; rm -rf .", "-p no:x", "--safemanip-a\nb", "--safemanip-a=\x1b[2J")
        ),
    ],
)
def test_what_is_broken_is_refused_with_its_place(tmp_path, change, message):
    with pytest.raises(ConfigError) as caught:
        read(written(tmp_path, broken(change)))
    assert str(tmp_path / "summary.json") in str(caught.value)
    assert message in str(caught.value)
    assert str(caught.value).isprintable()


def test_what_is_for_people_is_read_with_escapes(tmp_path):
    found = document(RECORDS)
    found["rollouts"][1].update(
        served={**SERVED, "protocol": STRANGE, STRANGE: "1"},
        unjudged={STRANGE: STRANGE},
        recording=STRANGE,
    )
    found["rollouts"][0]["properties"][0]["violations"][0].update(
        reason=STRANGE, entities=[STRANGE]
    )
    found["rollouts"][2]["error"] = f"one\n\ttwo{STRANGE}"
    one, two, three, _ = read(written(tmp_path, found)).records
    assert three.error == "one\n\ttwo\\x1b[2J\\u202e"
    assert str((one, two)).isprintable()
    plain = r"\x1b[2J\u202e"
    assert (two.served["protocol"], two.unjudged) == (plain, {plain: plain})
    assert one.properties["a"].violations[0]["reason"] == plain
    assert differences({"a": 1}, {"a": STRANGE}) == [rf"a is 1 and {plain}"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not a summary"),
        ("[1, 2]", "expected a mapping"),
        ('{"schema": NaN}', "NaN is no JSON"),
        ('{"schema": 1, "a": {"b": 1, "b": 2}}', "'b' stands twice in a mapping"),
        ("[" * 100_000, "not a summary"),
        ("\xff", "not a summary"),
    ],
)
def test_a_file_that_is_no_summary_is_refused(tmp_path, text, message):
    path = tmp_path / "summary.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(ConfigError, match=message):
        read(path)


def test_a_folder_without_a_summary_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"there is no summary\.json; name the folder of a run"):
        read(tmp_path)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)


@given(st.data())
def test_any_value_anywhere_is_read_or_refused(tmp_path_factory, data):
    found = document(RECORDS)
    place = data.draw(st.sampled_from([found, found["rollouts"][0]]))
    place = data.draw(st.sampled_from([place, found["rollouts"][0]["properties"][0]]))
    place[data.draw(st.sampled_from(sorted(place)))] = data.draw(json_values)
    path = written(tmp_path_factory.getbasetemp(), found, "any.json")
    try:
        found = read(path)
    except ConfigError as error:
        found = error
    assert isinstance(found, Summary) or "any.json" in str(found)


def test_rollouts_of_several_runs_count_once():
    one = summary(rollouts("x..", task="A"), "one")
    two = summary([*rollouts("x", task="A"), *rollouts("..", task="B")], "two")
    found = merge([one, two])
    assert len(found.records) == 5
    assert found.places == ("one", "two")
    assert {record.task for record in found.records} == {"A", "B"}


def test_properties_that_were_judged_apart_come_together():
    one = rollout(True, verdict("a"), unjudged={"b": "d"}, packs={"b": "house"})
    two = rollout(True, bad("b", category="d"), unjudged={"a": "c"}, packs={"b": "house"})
    (found,) = merge([summary([one]), summary([two], "two")]).records
    assert set(found.properties) == {"a", "b"}
    assert found.packs == {"b": "house"}
    assert not found.unjudged
    assert select([found])[0].violated


def test_what_was_deselected_in_one_run_and_judged_in_another_is_judged():
    one = rollout(True, verdict("a"), deselected={"b": "d", "c": "d"})
    two = rollout(True, bad("b", category="d"), deselected={"a": "c", "c": "d"})
    (found,) = merge([summary([one]), summary([two], "two")]).records
    assert set(found.properties) == {"a", "b"}
    assert found.deselected == {"c": "d"}


def test_what_was_done_elsewhere_is_no_longer_missing():
    for hole in "e-":
        found = merge([summary(rollouts(hole)), summary(rollouts("."), "two")])
        assert [record.complete for record in found.records] == [True]
    found = merge([summary(rollouts("-")), summary(rollouts("e"), "two")])
    assert [record.error for record in found.records] == ["the server is gone"]


def test_two_runs_of_one_rollout_are_not_one():
    one, two = summary(rollouts("x")), summary(rollouts("."), "two")
    with pytest.raises(ConfigError, match="one and two differ on a in the rollout of T, policy p"):
        merge([one, two])
    longer = [dataclasses.replace(record, acting_steps=11) for record in one.records]
    with pytest.raises(ConfigError, match="two runs of it cannot count as one"):
        merge([one, summary(longer, "two")])


def test_runs_that_were_decided_in_different_ways_are_refused_with_the_difference():
    for name, value in (
        ("semantics", "paper"),
        ("parameters.settled.speed", 0.05),
        ("parameters.new", 1.0),
        ("properties.a", "456"),
    ):
        with pytest.raises(ConfigError, match=rf"{name} is .* and {value}.*--safemanip-recordings"):
            merge([summary([]), summary([], "two", **{name: value})])
    # A property that one of them has only decides nothing about the other.
    found = merge([summary([]), summary([], "two", **{"properties.b": "1"})])
    assert found.decisive["properties.b"] == "1"
    with pytest.raises(ConfigError, match=r"properties\.b is 1 and 2"):
        merge(
            [
                summary([]),
                summary([], "2", **{"properties.b": "1"}),
                summary([], "3", **{"properties.b": "2"}),
            ]
        )


def test_few_of_many_differences_are_shown():
    one = {f"p{n}": n for n in range(9)}
    found = differences(one, dict.fromkeys(one, -1))
    assert len(found) == 6
    assert found[-1] == "and 4 more"
    six = dict.fromkeys(list(one)[:6], 0)
    assert differences(six, dict.fromkeys(six, 1))[-1] == "and 1 more"
    five = dict.fromkeys(list(one)[:5], 0)
    assert differences(five, dict.fromkeys(five, 1)) == [f"p{n} is 0 and 1" for n in range(5)]


verdicts = st.dictionaries(st.sampled_from("ab"), st.booleans(), max_size=2)
HIDDEN = {(seed, name): (seed * 7 + ord(name)) % 3 == 0 for seed in range(4) for name in "ab"}
"""What would be found out about each rollout by whoever runs it."""


@st.composite
def shards(draw):
    """A run of some rollouts, some of which fail, of some properties of each."""
    records = []
    for seed in draw(st.sets(st.integers(0, 3))):
        done = draw(st.sets(st.sampled_from("ab")))
        if draw(st.booleans()):
            records += rollouts(draw(st.sampled_from("e-")), first=seed)
            continue
        found = [bad(n) if HIDDEN[seed, n] else verdict(n) for n in sorted(done)]
        left = dict.fromkeys(sorted(set("ab") - done), "c")
        path = draw(st.sampled_from(["here", "there"]))
        record = rollout(True, *found, seed=seed, unjudged=left, provenance=0, recording=path)
        records.append(record)
    origin = {**ORIGIN, "scenes": draw(st.sampled_from(["compact"]))}
    return summary(records, draw(st.sampled_from(["one", "two", "three"])), [origin])


@given(st.lists(shards(), min_size=1, max_size=3))
def test_the_order_of_runs_does_not_matter(found):
    wanted = merge(found)
    for order in itertools.permutations(found):
        assert merge(order) == wanted


@given(st.lists(shards(), min_size=1, max_size=3))
def test_merging_again_changes_nothing(found):
    wanted = merge(found)
    assert merge([*found, *found]) == wanted
    assert merge([wanted]) == wanted
    assert merge([wanted, found[0]]) == wanted
    assert merge([merge(found[:1]), *found[1:]]) == wanted


def test_a_pipe_is_no_summary(tmp_path):
    os.mkfifo(tmp_path / "summary.json")  # read, it waits for somebody who writes
    with pytest.raises(ConfigError, match="cannot be read: not a regular file"):
        read(tmp_path)
