from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.libero.bddl import MAX_BYTES, load_problem, read_problem

TEXT = """
(define (problem LIBERO_Tabletop_Manipulation)
  (:domain robosuite)  ; as LIBERO says
  (:language Put the Mug in the drawer)
  (:regions
    (mug_region (:target main_table) (:ranges ((0.0 0.0 0.1 0.1))))
    (top_region (:target cabinet_1))
    (left_region (:target drainer_1))
  )
  (:fixtures main_table - table cabinet_1 - wooden_cabinet)
  (:objects mug_1 mug_2 - red_coffee_mug plate_1 - plate)
  (:obj_of_interest mug_1 cabinet_1_top_region)
  (:init (On mug_1 main_table_mug_region) (Open cabinet_1_top_region))
  (:goal (And (In mug_1 cabinet_1_top_region) (Close cabinet_1_top_region)))
)
"""


def test_a_problem_says_what_there_is_where_it_begins_and_what_has_to_hold():
    problem = read_problem(TEXT)
    assert problem.domain == "libero_tabletop_manipulation"
    assert problem.instruction == "put the mug in the drawer"
    assert problem.objects == {
        "mug_1": "red_coffee_mug",
        "mug_2": "red_coffee_mug",
        "plate_1": "plate",
    }
    assert problem.fixtures == {"main_table": "table", "cabinet_1": "wooden_cabinet"}
    assert problem.begins[0] == ("on", "mug_1", "main_table_mug_region")
    assert problem.goal == (
        ("in", "mug_1", "cabinet_1_top_region"),
        ("close", "cabinet_1_top_region"),
    )
    assert problem.owner("cabinet_1_top_region") == "cabinet_1"
    assert problem.owner("plate_1") == "plate_1"


def test_a_region_of_a_fixture_that_is_not_there_is_left_out():
    assert "drainer_1_left_region" not in read_problem(TEXT).regions


def test_all_of_liberos_problems_are_read(shipped):
    suites = [files.suite for files in shipped.values()]
    counts = {suite: suites.count(suite) for suite in suites}
    assert counts == {
        "libero_10": 10,
        "libero_90": 90,
        "libero_goal": 10,
        "libero_object": 10,
        "libero_spatial": 10,
    }
    for files in shipped.values():
        problem = load_problem(files.problem)
        assert problem.instruction
        assert problem.goal


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("(define (problem x)", "a parenthesis is not closed"),
        ("(define (problem x)))", "closed that was not opened"),
        ("(problem x)", r"does not begin with \(define"),
        (TEXT.replace("(:goal", "(:aim"), "the section :goal is missing"),
        (TEXT.replace("(In mug_1", "(In cup_1"), "names cup_1, which is not declared"),
        (TEXT.replace("plate_1 - plate", "plate_1"), "plate_1 has no type"),
        ("(" * 40 + ")" * 40, "nested more than 32 levels deep"),
        (TEXT.replace("(Open cabinet_1_top_region)", "(Open)"), "no predicate"),
    ],
)
def test_what_is_no_problem_is_refused_with_the_file_and_the_reason(tmp_path, text, message):
    path = tmp_path / "task.bddl"
    path.write_text(text)
    with pytest.raises(ConfigError, match=rf"task\.bddl: not a BDDL problem: .*{message}"):
        load_problem(path)


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    path = tmp_path / "task.bddl"
    path.write_bytes(b" " * (MAX_BYTES + 1))
    with pytest.raises(ConfigError, match="larger than"):
        load_problem(path)
