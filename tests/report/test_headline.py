"""The line that every report of a run begins with."""

from __future__ import annotations

import pytest

from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.metrics.searches.records import SearchRecord
from pytest_safemanip.metrics.shards import Shard
from pytest_safemanip.metrics.summaries import Summary
from pytest_safemanip.report.headline import headline, notes_on
from tests.metrics.build import rollout, verdict
from tests.report.ci.conftest import gate, violated


def said(release=None, **changed):
    records = (violated(), violated(seed=1))
    found = headline(Summary(("here",), records, {}, (), **changed), release)
    return found.verdict, found.text


def gates(*verdicts, required=True, refused=""):
    rows = [gate(verdict=verdict, required=required) for verdict in verdicts]
    return Fields("release", {"gates": rows, "baseline": None, "refused": refused})


@pytest.mark.parametrize(
    ("verdicts", "verdict", "text"),
    [
        (("PASS", "PASS"), "PASS", "2 gates passed"),
        (("PASS", "INCONCLUSIVE"), "OPEN", "1 of 2 gates inconclusive"),
        (("FAIL", "UNDERPOWERED", "PASS"), "FAIL", "1 of 3 gates failed, 1 underpowered"),
        (
            ("INCONCLUSIVE", *["UNDERPOWERED"] * 2),
            "OPEN",
            "1 of 3 gates inconclusive, 2 underpowered",
        ),
        (("INCOMPLETE",), "FAIL", "1 of 1 gate failed"),
    ],
)
def test_gates_that_are_open_are_told_apart_from_those_that_failed(verdicts, verdict, text):
    assert said(gates(*verdicts)) == (verdict, f"{text}, 2 of 2 rollouts violated")


def test_what_is_not_required_fails_nothing():
    assert said(gates("FAIL", required=False)) == ("PASS", "2 of 2 rollouts violated")


def test_a_refused_comparison_fails_the_run():
    verdict, text = said(gates("PASS", refused="other tasks"))
    assert (verdict, text.split(", ")[:2]) == (
        "FAIL",
        ["1 gate passed", "not compared with the baseline"],
    )


def test_without_gates_a_violation_fails_the_run():
    assert said() == ("FAIL", "2 of 2 rollouts violated")


def test_rates_are_over_complete_rollouts_and_the_others_are_counted():
    records = (violated(), rollout(True, seed=1), rollout(None, seed=2), rollout(None, seed=3))
    found = headline(Summary(("here",), records, {}, ()), None)
    assert found.text == "1 of 2 complete rollouts violated, 2 rollouts incomplete"


def test_an_interrupted_run_says_what_was_not_run():
    begun = rollout(True, verdict("a"), unjudged={"b": "b", "c": "c"})
    found = headline(Summary(("here",), (begun,), {}, ()), gates("PASS"))
    assert found.verdict == "FAIL"
    assert found.text == (
        "1 gate passed, 0 of 0 complete rollouts violated, 1 rollout incomplete, "
        "2 of 3 cases not run"
    )


def test_a_gate_makes_no_incomplete_run_pass():
    failed = rollout(True, verdict("a"), seed=3, error="RuntimeError: no GPU")
    assert headline(Summary(("here",), (failed,), {}, ()), gates("PASS")).verdict == "FAIL"


def test_a_run_of_nothing_passes_nothing():
    found = headline(Summary(("here",), (), {}, ()), None)
    assert (found.verdict, found.text) == ("OPEN", "no rollout was run")


def test_errors_and_missing_shards_are_told_before_any_figure():
    failed = rollout(True, seed=3, error="RuntimeError: no GPU\nmore")
    found = Summary(("here",), (violated(), failed), {}, (), (Shard(1, 2),), partial=True)
    partial, shards, errors = notes_on(found)
    assert partial.startswith("not all of the run: ")
    assert shards == "not all of the run: no shard 2/2"
    assert errors == "1 rollout ended in an error, the first T, p, seed 3: RuntimeError: no GPU"


@pytest.mark.parametrize(
    ("fails", "release", "verdict", "text"),
    [
        ("", None, "PASS", "no search found a violation"),
        ("fails a", None, "FAIL", "1 search found a violation"),
        ("fails a", gates("FAIL"), "FAIL", "1 of 1 gate failed, 1 search found a violation"),
        ("", gates("PASS"), "PASS", "1 gate passed"),
        ("", gates("INCONCLUSIVE"), "OPEN", "1 of 1 gate inconclusive"),
    ],
)
def test_searches_alone_decide_by_their_gates_or_what_they_found(fails, release, verdict, text):
    own = SearchRecord("p", "T", "a", True, fails, ())
    found = headline(Summary(("here",), (), {}, (), searches=(own,)), release)
    assert (found.verdict, found.text) == (verdict, text)


def test_what_a_search_found_is_told():
    found = Summary(
        ("here",),
        (rollout(True),),
        {},
        (),
        searches=(
            SearchRecord("p", "T", "a", True, "fails a when the mug is gone (9 of 10)", ()),
            SearchRecord("p", "T", "b", True, "", ()),
        ),
    )
    told = headline(found, None)
    assert told.verdict == "FAIL"
    assert told.text == "0 of 1 rollout violated, 1 search found a violation"
    assert notes_on(found) == [
        "a search found what p does not stand in T: it fails a when the mug is gone (9 of 10)"
    ]
