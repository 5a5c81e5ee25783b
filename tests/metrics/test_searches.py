"""Searches of several runs put together, and gates on what a policy tolerates."""

from __future__ import annotations

import json
from itertools import permutations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.gates import parse_gate
from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.metrics.merging import merge
from pytest_safemanip.metrics.searches.records import SearchRecord, ToleranceRecord
from pytest_safemanip.metrics.searches.tolerance import decide_tolerance
from pytest_safemanip.metrics.summaries import read
from pytest_safemanip.report import document as documents
from tests.metrics.test_summaries import RECORDS, document, written

FAILURE = {"sentence": "fails a when the mug is gone", "recording": "searches/recordings/x.rollout"}
LEFT = {"dimension": "left", "unit": "cm", "survived": 3.5, "failed": 4.0}


def search(**otherwise):
    found = {
        "policy": "p",
        "task": "T",
        "property": "a",
        "over": True,
        "reused": 0,
        "violated_plain": 0,
    }
    return {**found, "failure": FAILURE, "tolerances": [LEFT], "margins": [0.5, -1.0], **otherwise}


def run(folder, *searches):
    folder.mkdir()
    return read(written(folder, {**document(RECORDS), "searches": list(searches)}))


def merged(folder, *summaries):
    """What is read of their merged summary."""
    found = merge(summaries)
    whole = documents.merged(found, measure_each(found.records), folder)
    folder.mkdir(exist_ok=True)
    return read(written(folder, json.loads(json.dumps(whole)))).searches


def test_a_merged_run_tells_all_that_its_searches_found(tmp_path):
    one = run(tmp_path / "one", search())
    other = run(tmp_path / "other", search(property="b", failure=None))
    first, second = merged(tmp_path / "both", one, other)
    assert first.told["margins"] == [0.5, -1.0]
    assert (first.fails, second.fails) == (FAILURE["sentence"], "")
    assert first.recording == str(tmp_path / "one" / FAILURE["recording"])
    assert first.tolerances == (ToleranceRecord("left", "cm", 3.5, 4.0),)


def test_a_search_counts_once_and_one_that_ended_for_those_that_did_not(tmp_path):
    interrupted = run(tmp_path / "1", search(over=False, failure=None, tolerances=[]))
    ended = run(tmp_path / "2", search())
    again = run(tmp_path / "3", search(reused=30))
    elsewhere = run(tmp_path / "4", search(failure=None, tolerances=[]))
    found = {
        tuple((own.fails, own.over) for own in merged(tmp_path / "all", *order))
        for order in permutations((interrupted, ended, again, elsewhere))
    }
    assert found == {(("", True), (FAILURE["sentence"], True))}


def decided(bound, *rows, over=True):
    own = tuple(ToleranceRecord(*row) for row in rows)
    searches = [SearchRecord("p", "T", "a", over, "", own)]
    return decide_tolerance(parse_gate(f"tolerance[a] >= {bound}"), "p", searches)


def test_what_fails_without_any_change_tolerates_none():
    row = ToleranceRecord("left", "cm", 3.5, 4.0)
    own = SearchRecord("p", "T", "a", True, "fails a when the mug is gone", (row,), 2)
    found = decide_tolerance(parse_gate("tolerance[a] >= 1 cm"), "p", [own])
    assert (found.verdict, found.value) == ("FAIL", 0.0)
    assert found.why == "fails a in T as it is, without any change"


@pytest.mark.parametrize(
    ("bound", "verdict"),
    [("3 cm", "PASS"), ("35 mm", "PASS"), ("3.8 cm", "INCONCLUSIVE"), ("5 cm", "FAIL")],
)
def test_a_size_between_what_is_survived_and_what_fails_decides_nothing(bound, verdict):
    assert decided(bound, ("left", "cm", 3.5, 4.0)).verdict == verdict


def test_the_smallest_failure_of_all_decides():
    rows = ("left", "cm", 3.5, 4.0), ("hand", "mm", 10.0, 12.0), ("turn", "deg", 0.0, 1.0)
    found = decided("2 cm", *rows)
    assert (found.verdict, found.value) == ("FAIL", 1.0)
    assert "hand" in found.why


def test_without_a_failure_the_largest_size_that_was_tried_is_what_is_known():
    assert decided("9 cm", ("left", "cm", 9.5, None)).verdict == "PASS"
    assert decided("10 cm", ("left", "cm", 9.5, None)).verdict == "INCONCLUSIVE"
    assert decided("1 N s", ("left", "cm", 9.5, None)).verdict == "INCONCLUSIVE"


def test_a_search_that_was_interrupted_decides_nothing():
    assert decided("3 cm", ("left", "cm", 3.5, 4.0), over=False).verdict == "INCOMPLETE"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("tolerance[x] <= 3 cm", r"expected tolerance\[PROPERTY\] >= SIZE"),
        ("tolerance[x] >= 3 ells", "expected a size of at least 0 with a unit"),
        ("tolerance[x] >= -3 cm", "expected a size of at least 0 with a unit"),
        ("tolerance[x] >= cm", "expected"),
    ],
)
def test_what_is_no_size_is_no_gate(text, message):
    with pytest.raises(ConfigError, match=message):
        parse_gate(text)
