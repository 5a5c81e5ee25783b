from __future__ import annotations

from pathlib import Path

from pytest_safemanip.errors import PolicyUnreachable, RolloutError
from pytest_safemanip.plugin.longrepr import to_longrepr
from pytest_safemanip.report import failure
from pytest_safemanip.report.failure import (
    MAX_CHARACTERS,
    MAX_LINES,
    ErrorTexts,
    user_traceback,
    without_package_frames,
)


def test_a_failure_prints_its_text_and_is_one_line_in_summaries():
    found = to_longrepr("first line\n  second line", "mug slipped", Path("/x/prop.yaml"))
    assert str(found).splitlines()[:2] == ["first line", "  second line"]
    assert found.reprcrash.message == "mug slipped"
    assert found.reprcrash.path == "/x/prop.yaml"


def raised(cause, error_type=RolloutError):
    try:
        raise error_type("the policy failed at step 3") from cause
    except error_type as error:
        return error


def network():
    raise ValueError("weights are missing")


def caught(function, *arguments):
    """What a function raises, through code of this package and of pytest."""
    try:
        function(*arguments)
    except Exception as error:
        return error


def calls(filename, name, function):
    """A function of that name, in a file of that name, that calls another."""
    names = {"function": function}
    exec(compile(f"def {name}():\n    function()", filename, "exec"), names)  # noqa: S102
    return names[name]


OURS = str(Path(failure.__file__))


def test_an_error_shows_where_the_policys_own_code_broke_and_no_other_frame():
    text = ErrorTexts().text(raised(caught(network)))
    assert text.startswith("the policy failed at step 3\n\nTraceback")
    assert "in network" in text
    assert text.endswith("ValueError: weights are missing")


def test_the_users_frames_are_shown_wherever_they_are_between_others():
    theirs = calls("conftest.py", "straying", calls(OURS, "deep_inside", network))
    text = user_traceback(caught(calls("/x/pluggy/_callers.py", "hook", calls(OURS, "us", theirs))))
    assert 'File "conftest.py", line 2, in straying' in text
    assert "in network" in text
    assert not {"deep_inside", "us", "hook"} & set(text.split())


def test_a_failure_of_this_package_shows_its_frames_and_not_those_of_pytest():
    def fails():
        int("x")

    fails.__code__ = fails.__code__.replace(co_filename=OURS)
    error = caught(calls("/x/pluggy/_callers.py", "hook", calls(OURS, "us", fails)))
    error = error.with_traceback(error.__traceback__.tb_next)  # this file's own frame
    assert "in us" in user_traceback(error)
    assert "in hook" not in user_traceback(error)


def test_a_traceback_is_shown_once():
    errors = ErrorTexts()
    first, again = (errors.text(raised(caught(network))) for _ in range(2))
    assert "in network" in first
    assert again == "the policy failed at step 3\n\n(same traceback as before)"


def test_a_long_traceback_is_cut_at_its_beginning():
    for message in ("x" * 10_000 + " the end", "x\n" * 500 + "the end"):
        text = user_traceback(raised(ValueError(message)).__cause__)
        assert len(text) <= MAX_CHARACTERS
        assert len(text.splitlines()) <= MAX_LINES
        assert text.endswith("the end")


def test_an_error_without_a_cause_and_that_of_a_server_are_their_messages():
    assert ErrorTexts().text(RolloutError("the server is gone")) == "the server is gone"
    unreachable = raised(caught(network), PolicyUnreachable)
    assert ErrorTexts().text(unreachable) == "the policy failed at step 3"


def test_a_traceback_begins_with_the_users_first_frame():
    error = caught(network)
    found = without_package_frames(error.__traceback__)
    assert found.tb_frame.f_code.co_name == "caught"
