"""The tables of the paper's questions, of rollouts that can be counted by hand."""

from __future__ import annotations

from pytest_safemanip.metrics.groups import measure_each
from pytest_safemanip.metrics.tables import tables
from tests.metrics.build import bad, rollout, verdict


def judged(policy, task, success, *verdicts, **changed):
    return rollout(success, *verdicts, policy=policy, task=task, **changed)


FOUND = tables(
    measure_each(
        [
            # Five of ten steps are unsafe in the first; the second is safe, and fails.
            judged("p", "A", True, bad("a", (0, 4), category="c"), verdict("b", category="d")),
            judged("p", "B", False, verdict("a", category="c"), suite="other", horizon="long"),
            judged("q", "A", True, verdict("a", category="c")),
        ]
    )
)


def test_success_against_violation():
    p, q = FOUND["rq1"]
    assert (p["policy"], p["success_rate"], p["violation_rate"]) == ("p", 0.5, 0.5)
    assert {name for name, share in p["outcomes"].items() if share == 0.5} == {
        "success_but_unsafe",
        "fail_but_safe",
    }
    assert (q["policy"], q["success_rate"], q["violation_rate"]) == ("q", 1.0, 0.0)


def test_a_row_for_each_category_with_the_policies_that_it_applied_to():
    assert FOUND["rq2"] == [
        {
            "category": "c",
            "tasks": 2,
            "policies": {
                "p": {"violation_rate": 0.5, "exposure": 0.25},
                "q": {"violation_rate": 0.0, "exposure": 0.0},
            },
        },
        {"category": "d", "tasks": 1, "policies": {"p": {"violation_rate": 0.0, "exposure": 0.0}}},
    ]


def test_a_category_that_was_never_triggered_has_no_rate():
    untested = verdict("a", "VACUOUS", category="c", triggered=False)
    records = [
        judged("p", "A", True, verdict("a", category="c")),
        judged("q", "A", True, untested),
    ]
    (row,) = tables(measure_each(records))["rq2"]
    assert row["policies"] == {
        "p": {"violation_rate": 0.0, "exposure": 0.0},
        "q": {"violation_rate": None, "exposure": None},
    }


def test_a_row_for_each_horizon_and_suite():
    short = {
        "p": {"violation_rate": 1.0, "unsafe_share_of_successes": 1.0},
        "q": {"violation_rate": 0.0, "unsafe_share_of_successes": 0.0},
    }
    # Without a success, no share of successes is unsafe.
    long = {"p": {"violation_rate": 0.0, "unsafe_share_of_successes": None}}
    by_horizon = {row["horizon"]: row["policies"] for row in FOUND["rq3_horizon"]}
    assert by_horizon == {"atomic": short, "long": long}
    assert {row["suite"]: row["policies"] for row in FOUND["rq3_suite"]} == {
        "s": short,
        "other": long,
    }
