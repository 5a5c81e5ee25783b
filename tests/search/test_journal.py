"""What is known of a search on disk."""

from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.run.searching.journal import Journal
from pytest_safemanip.search.trials import Finding, Outcome

OUTCOME = Outcome({"a": Finding(True, -2.5, 3.0)}, digest="d", recording="a.rollout")


def test_outcomes_are_known_again_and_whose_they_are(tmp_path):
    path = tmp_path / "a.jsonl"
    Journal(path, "monday").add("one", OUTCOME)
    again = Journal(path, "tuesday")
    again.add("two", Outcome(refused="the can falls"))
    found = Journal(path, "tuesday")
    assert (found.get("one"), found.get("none")) == (OUTCOME, None)
    assert found.get("two").refused == "the can falls"
    assert [found.is_earlier(key) for key in ("one", "two", "none")] == [True, False, False]


def test_a_line_that_was_cut_off_is_none(tmp_path):
    path = tmp_path / "a.jsonl"
    journal = Journal(path, "monday")
    journal.add("one", OUTCOME)
    journal.add("two", OUTCOME)
    path.write_text(path.read_text()[:-20])
    found = Journal(path, "tuesday")
    assert (found.get("one"), found.get("two")) == (OUTCOME, None)
    found.add("three", OUTCOME)
    assert Journal(path, "tuesday").get("three") == OUTCOME


@pytest.mark.parametrize(
    "line",
    [
        "no JSON",
        "[]",
        '{"key": "a", "run": "b"}',
        '{"key": "a", "run": "b", "outcome": {"findings": {}, "refused": 1, "digest": ""}}',
        '{"key": "a", "run": "b", "outcome": {"findings": {"p": {"violated": 1, "margin": 2.0}}, '
        '"refused": "", "digest": "", "recording": ""}}',
        '{"key": "a", "run": "b", "outcome": {"findings": {"p": {"violated": true, "margin": NaN}}'
        ', "refused": "", "digest": "", "recording": ""}}',
        '{"key": "a", "run": "b", "outcome": {"findings": {}, "refused": "", "digest": "", '
        '"recording": "../../a.rollout"}}',
    ],
)
def test_what_else_is_there_is_refused_with_its_place(tmp_path, line):
    path = tmp_path / "a.jsonl"
    path.write_text(f'{{"format": 1}}\n{line}\n')
    with pytest.raises(ConfigError, match=r"a\.jsonl:2: no outcome of a trial; delete the file"):
        Journal(path, "monday")


@pytest.mark.parametrize("first", ['{"key": "a", "run": "b"}', '{"format": 2}', "[]", "\x00", "1"])
def test_that_of_another_version_is_refused_with_the_remedy(tmp_path, first):
    path = tmp_path / "a.jsonl"
    path.write_text(f"{first}\n")
    with pytest.raises(
        ConfigError, match=r"a\.jsonl: not of this version .*; delete the file, and"
    ):
        Journal(path, "monday")
