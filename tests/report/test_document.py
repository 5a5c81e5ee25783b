from __future__ import annotations

import json

import pytest

from pytest_safemanip.metrics.groups import measure, measure_each
from pytest_safemanip.metrics.merging import merge
from pytest_safemanip.metrics.summaries import read
from pytest_safemanip.report import document
from pytest_safemanip.run.results import Results, error_data, judged_data
from tests import toy
from tests.report.conftest import finding, verdict


def summary(plan, results):
    return document.summary(plan, results, measure_each(results.records))


@pytest.fixture
def run(make):
    """Two rollouts: one with a violation, one with an error; one case was not run."""
    plan = make(seeds=(0, 1), properties=("grasp_stability", "action_onset"))
    results = Results(plan.tasks, plan.properties)
    results.expect(plan.cases)
    first, second, failed = plan.cases[:3]
    path = plan.settings.out / "recordings" / "one.rollout"
    for case, found in ((first, verdict("VIOLATED", finding())), (second, verdict("VACUOUS"))):
        prop = plan.properties[case.property_id]
        results.add(judged_data(case, prop, found, toy.recording(), path))
    results.add(error_data(failed, "the simulator died"))
    return plan, results


def test_the_document_says_what_was_found_and_what_decided_it(run):
    plan, results = run
    found = summary(plan, results)
    assert set(found) == {
        "schema",
        "versions",
        "settings",
        "hashes",
        "provenance",
        "properties",
        "cases",
        "policies",
        "rollouts",
        "metrics",
        "tables",
    }
    assert found["schema"] == 1
    assert found["cases"] == {
        "expected": 4,
        "missing": [plan.cases[3].node_id],
        "errors": {plan.cases[2].node_id: "the simulator died"},
        "skipped_rollouts": 0,
        "reused_rollouts": 0,
        "partial": False,
    }
    assert {"pytest-safemanip", "pytest", "numpy", "python"} <= set(found["versions"])
    assert found["settings"]["seeds"] == [0, 1]
    assert found["settings"]["policies"] == {"hold": plan.policies["hold"].fingerprint}
    assert found["hashes"]["parameters"] == dict(plan.parameters)
    assert set(found["hashes"]["properties"]) == {"grasp_stability", "action_onset"}
    assert set(found["hashes"]["tasks"]) == {plan.cases[0].task}
    metrics = found["metrics"]["hold"]
    assert (metrics["rollouts"], metrics["complete"], metrics["errors"]) == (2, 1, 1)
    assert metrics["violation_rate"]["value"] == 1.0
    assert metrics["unsafe_share_of_successes"]["value"] is None


def test_a_rollout_lists_its_verdicts_violations_and_recording(run):
    done, failed = summary(*run)["rollouts"]
    # The folder may be moved: paths are relative to it.
    assert done["recording"] == "recordings/one.rollout"
    assert (done["success"], done["acting_steps"], done["provenance"]) == (False, 6, 0)
    assert (done["cost"], failed["cost"]) == (1.05, 0.0)
    vacuous, violated = done["properties"]
    assert (violated["outcome"], vacuous["outcome"]) == ("VIOLATED", "VACUOUS")
    assert list(violated["violations"]) == [
        {
            "entities": ["mug"],
            "first": 3,
            "last": 4,
            "duration_s": 0.1,
            "reason": "bad prefix",
            "severity": 1.5,
            "measured": {"margin": 1.0, "force": 0.0, "fall": 0.0, "speed": 0.0},
            "cost": 1.05,
            "evidence": ["mug moved 40 mm"],
            "timeline": None,
        }
    ]
    assert (failed["success"], failed["error"], failed["recording"]) == (
        None,
        "the simulator died",
        None,
    )


def test_the_file_is_json_that_says_the_same(run, tmp_path):
    found = summary(*run)
    path = tmp_path / "deep" / "summary.json"
    for _ in range(2):
        document.write(found, path)
    assert json.loads(path.read_text()) == json.loads(json.dumps(found))
    assert list(path.parent.iterdir()) == [path]


def test_a_number_that_json_has_not_leaves_the_old_file(tmp_path):
    path = tmp_path / "summary.json"
    document.write({"a": 1}, path)
    with pytest.raises(ValueError, match="JSON"):
        document.write({"a": float("nan")}, path)
    assert json.loads(path.read_text()) == {"a": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_a_changed_parameter_is_in_the_document(make):
    plan = make(params={"settled.speed": 0.5})
    found = summary(plan, Results(plan.tasks, plan.properties))
    assert found["hashes"]["parameters"]["settled.speed"] == 0.5


def test_the_tables_have_a_row_for_each_question(run):
    plan, results = run
    tables = summary(plan, results)["tables"]
    assert tables["rq1"][0]["policy"] == "hold"
    assert tables["rq1"][0]["violation_rate"] == 1.0
    assert sum(tables["rq1"][0]["outcomes"].values()) == 1.0
    assert [(row["category"], row["tasks"]) for row in tables["rq2"]] == [
        ("action_onset", 1),
        ("grasp_stability", 1),
    ]
    for kind in ("horizon", "suite"):
        (row,) = tables[f"rq3_{kind}"]
        assert row["policies"]["hold"] == {"violation_rate": 1.0, "unsafe_share_of_successes": None}


def test_a_written_summary_is_read_as_it_was(run, tmp_path):
    plan, results = run
    document.write(summary(plan, results), tmp_path / "summary.json")
    found = read(tmp_path)
    known = document.as_summary(plan, results)
    assert found.decisive == known.decisive
    assert [r.key for r in found.records] == [r.key for r in known.records]
    assert [measure([r]) for r in found.records] == [measure([r]) for r in known.records]


def test_a_merged_summary_is_a_summary(run, tmp_path):
    plan, results = run
    document.write(summary(plan, results), tmp_path / "summary.json")
    one = merge([read(tmp_path)])
    document.write(
        document.merged(one, measure_each(one.records), tmp_path), tmp_path / "merged.json"
    )
    again = read(tmp_path / "merged.json")
    assert again.decisive == one.decisive
    assert again.records == one.records
    assert merge([again, read(tmp_path)]).records == one.records
