"""GitHub's annotations."""

from __future__ import annotations

import re
from pathlib import Path

from pytest_safemanip.report.ci.annotations import MAX_ANNOTATIONS, annotations_of
from tests.metrics.build import record
from tests.report.ci.conftest import found, gate, violated


def commands(run, **changed):
    return [annotation.command() for annotation in annotations_of(run, Path.cwd(), **changed)]


def test_a_violation_is_an_error_at_the_file_of_the_users_property(make_run):
    run = make_run([violated()], a={"file": "../mine/drop.yaml"})
    assert commands(run) == [
        "::error file=mine/drop.yaml,line=1,title=a violated"
        "::T, p, seed 0: the mug fell 40 mm, at step 12 (0.60 s)"
    ]


def test_what_gates_tolerate_is_a_warning_behind_the_gates_that_fail(make_run):
    run = make_run([violated()], [gate(), gate(verdict="PASS"), gate(required=False)])
    first, second = commands(run)
    assert first == "::error title=FAIL%3A violation_rate <= 0.1::p: 1 of 2 = 50.0 %25"
    assert second.startswith("::warning title=a violated::")


def test_an_undecided_gate_is_no_error_where_it_is_skipped(make_run):
    run = make_run([violated()], [gate(verdict="INCONCLUSIVE", why="too few")])
    assert commands(run)[0].startswith("::error title=INCONCLUSIVE")
    assert all("INCONCLUSIVE" not in line for line in commands(run, skip_open=True))


def test_rollouts_without_a_verdict_are_one_annotation(make_run):
    failed = [
        record(seed=n, error="the server is gone\nsays it", unjudged={"a": "c"}) for n in (1, 2)
    ]
    assert commands(make_run(failed)) == [
        "::error title=2 rollouts without a verdict::T, p, seed 1: the server is gone"
    ]


def test_there_are_ten_at_most(make_run):
    run = make_run([violated(seed=n) for n in range(30)], [gate()] * 3)
    assert len(commands(run)) == MAX_ANNOTATIONS == 10


def test_hostile_names_add_no_command_and_no_property(hostile):
    told = commands(hostile)
    assert len(told) == 2
    for line in told:
        assert line.isprintable()  # one line, whatever they are
        level, properties, _ = re.fullmatch("::(error|warning) (.*?)::(.*)", line).groups()
        assert level
        # A colon would end the properties, a comma begin another.
        assert not re.search("[:,]", re.sub("^(file=[^,:]*,line=1,)?title=", "", properties))


def test_a_percent_sign_is_told_as_such(make_run):
    run = make_run([violated("a", found(evidence=["50 % of it, %0A"]))])
    assert commands(run)[0].endswith("mug: 50 %25 of it, %250A, at step 12 (0.60 s)")
