"""What is told in narrow terminals, and with the options that make pytest say less."""

from __future__ import annotations

import pytest

from tests.plugin.conftest import Suite
from tests.plugin.toyfolder import set_up

FAILING = """
class Fails(Rises):
    fingerprint = "1"
    def act(self, observation):
        raise ValueError("the network exploded")

def pytest_safemanip_policies():
    return {"rises": Rises, "fails": Fails}
"""


@pytest.fixture
def own(suite: Suite, monkeypatch: pytest.MonkeyPatch) -> Suite:
    """A user's folder, seen in 80 columns."""
    set_up(suite)
    with (suite.pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(FAILING)
    monkeypatch.setenv("COLUMNS", "80")
    return suite


@pytest.fixture
def simple(one_suite: Suite, monkeypatch: pytest.MonkeyPatch) -> Suite:
    set_up(one_suite)
    monkeypatch.setenv("COLUMNS", "80")
    return one_suite


def short_summary(result: pytest.RunResult) -> list[str]:
    (start,) = (n for n, line in enumerate(result.outlines) if "short test summary" in line)
    return result.outlines[start + 1 : -1]


def test_reasons_survive_80_columns(own: Suite) -> None:
    result = own.run("--safemanip-policy=rises,fails", "-k", "near")
    lines = sorted(short_summary(result))
    assert [line[:80] for line in lines] == [
        "ERROR the policy failed at step 0: ValueError: the network exploded - safemanip:",
        "VIOLATED stays_near: bad prefix for mug (mug), at step 5 (0.25 s) - safemanip::t",
    ]
    # The whole id is there to be copied.
    assert lines[1].endswith(" - safemanip::test_safety[Reach-rises-stays_near-seed0]")


def test_where_there_is_room_the_line_is_as_pytests_own(
    simple: Suite, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    (line,) = short_summary(simple.run())
    node_id = "safemanip::test_safety[Reach-rises-stays_near-seed0]"
    assert line.startswith(f"VIOLATED {node_id} - stays_near: bad prefix")
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("CI", "true")
    (line,) = short_summary(simple.run())
    assert line.startswith(f"VIOLATED {node_id} - stays_near: bad prefix")


def test_skips_are_folded_by_reason(simple: Suite) -> None:
    result = simple.run("--safemanip-policy=rises", "--safemanip-seeds=3", "-k", "grasp", "-rs")
    assert short_summary(result) == ["SKIPPED [3] safemanip: grasp_stability: never triggered"]


def test_quiet_is_a_line_for_each_policy_and_each_gate(simple: Suite) -> None:
    gate = "--safemanip-gate=violation_rate <= 0.5"
    result = simple.run("--safemanip-policy=rises", "--safemanip-seeds=2", gate, "-q")
    shown = result.stdout.str().split("= safety =")[1].splitlines()[1:]
    assert shown[:2] == [
        "rises: 2 of 2 rollouts complete, 0.0 % successful, 100.0 % violated (34 to 100 %)",
        "FAIL  violation_rate <= 0.5, rises: 2 of 2 = 100.0 %",
    ]
    assert "short test summary" in shown[2]
    assert not any(line.startswith("safemanip:") for line in result.outlines)


@pytest.mark.parametrize("option", ["--no-summary", "-qq"])
def test_nothing_is_summarised_if_nothing_is_to_be(simple: Suite, option: str) -> None:
    text = simple.run(option).stdout.str()
    assert "= safety =" not in text
    assert (simple.out / "summary.json").exists()


def test_the_counterexample_obeys_tb(simple: Suite) -> None:
    def failure(style: str) -> list[str]:
        text = simple.run(f"--tb={style}").stdout.str()
        return text.split("= safety =")[0].split("FAILURES")[-1].splitlines()[1:-1]

    whole, short, line = failure("auto"), failure("short"), failure("line")
    assert any("decided by" in text for text in whole)
    assert short[1:] == [
        "stays_near: The hand stays near (the house rules)",
        "VIOLATED for mug (mug) at step 5 (0.25 s), unsafe for 0.80 s",
        "  severity 1.74",
        "reproduce with  pytest 'safemanip::test_safety[Reach-rises-stays_near-seed0]'",
    ]
    assert line == [
        "mine/properties/own.yaml:1: stays_near: bad prefix for mug (mug), at step 5 (0.25 s)"
    ]
    assert "FAILURES" not in simple.run("--tb=no").stdout.str()


def test_gates_say_how_to_see_the_violations_that_are_expected(simple: Suite) -> None:
    gate, hint = "--safemanip-gate=violation_rate <= 1", "*--xfail-tb prints their counterexamples"
    result = simple.run(gate)
    result.assert_outcomes(xfailed=1, passed=1, skipped=1)
    result.stdout.fnmatch_lines([hint])
    result = simple.run(gate, "--xfail-tb")
    result.stdout.fnmatch_lines(["VIOLATED for mug (mug) at step 5*"])
    result.stdout.no_fnmatch_line(hint)


def test_help_has_single_percent_signs(simple: Suite) -> None:
    text = " ".join(simple.pytester.runpytest("--help").stdout.str().split())
    assert "%%" not in text
    assert text.count("<= 10 % @0.95") == 2  # the option and its ini twin
