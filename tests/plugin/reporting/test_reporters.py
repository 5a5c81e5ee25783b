"""Other plugins that report or time tests: allure-pytest, pytest-timeout."""

from __future__ import annotations

import json

import pytest

from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import set_up

SLOW = """
class Slow(Rises):
    def act(self, observation):
        import time
        time.sleep(0.5)
        return super().act(observation)

def pytest_safemanip_policies():
    return {"slow": Slow, "rises": Rises}
"""


def test_allure_has_every_case_once_with_labels(suite: Suite) -> None:
    pytest.importorskip("allure_pytest")
    suite.without = ()
    set_up(suite)
    suite.run("--safemanip-policy=rises", "--safemanip-seeds=2", "--alluredir=allure")
    folder = suite.pytester.path / "allure"
    cases = [json.loads(path.read_text()) for path in folder.glob("*-result.json")]
    assert len(cases) == len({case["historyId"] for case in cases}) == 4
    statuses = {(case["name"].split("-")[2], case["status"]) for case in cases}
    assert statuses == {("stays_near", "failed"), ("grasp_stability", "skipped")}
    case = next(case for case in cases if case["status"] == "failed")
    labels = {(label["name"], label["value"]) for label in case["labels"]}
    assert labels >= {
        ("task", "Reach"),
        ("policy", "rises"),
        ("category", "housekeeping"),
        ("feature", "housekeeping"),
        ("story", "stays_near"),
        ("parentSuite", "safemanip"),
        ("suite", "rises"),
        ("subSuite", "Reach"),
        ("tag", "safemanip"),
        ("tag", "mine"),
    }
    parameters = {p["name"]: p["value"] for p in case["parameters"]}
    assert parameters.keys() == {"task", "policy", "property", "seed"}
    assert "bad prefix for mug" in case["statusDetails"]["message"]


def test_pytest_timeout_does_not_count_rollouts(suite: Suite) -> None:
    pytest.importorskip("pytest_timeout")
    suite.without = ()
    set_up(suite)
    with (suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(SLOW)
    suite.pytester.makepyfile(
        test_own="""
        import time
        def test_hangs():
            time.sleep(60)
        """
    )
    result = suite.run("safemanip::", "test_own.py", "--safemanip-policy=slow", "--timeout=1")
    # The timeout is for the other test alone.
    result.assert_outcomes(failed=2, skipped=1)
    result.stdout.fnmatch_lines(["VIOLATED for mug*"])
