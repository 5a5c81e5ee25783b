from __future__ import annotations

from pathlib import Path

from pytest_safemanip.errors import RolloutError
from pytest_safemanip.report.failure import MAX_TRACEBACK, error_text, shown


def test_a_failure_prints_its_text_and_is_one_line_in_summaries():
    found = shown("first line\n  second line", "mug slipped", Path("/x/prop.yaml"))
    assert str(found).splitlines()[:2] == ["first line", "  second line"]
    assert found.reprcrash.message == "mug slipped"
    assert found.reprcrash.path == "/x/prop.yaml"


def raised(cause):
    try:
        raise RolloutError("the policy failed at step 3") from cause
    except RolloutError as error:
        return error


def test_an_error_shows_where_the_policys_own_code_broke():
    def network():
        raise ValueError("weights are missing")

    try:
        network()
    except ValueError as cause:
        text = error_text(raised(cause))
    assert text.startswith("the policy failed at step 3\n\n")
    assert "in network" in text
    assert text.rstrip().endswith("ValueError: weights are missing")


def test_a_long_traceback_is_cut_at_its_beginning():
    text = error_text(raised(ValueError("x" * 10_000 + " the end")))
    assert len(text) < MAX_TRACEBACK + 100
    assert text.rstrip().endswith("the end")


def test_an_error_without_a_cause_is_its_message():
    assert error_text(RolloutError("the server is gone")) == "the server is gone"
