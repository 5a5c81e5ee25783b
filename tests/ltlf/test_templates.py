"""The ten templates on hand-written traces, one mark per second, in both profiles.

Deadlines are those of the shipped files: 5 s for what must settle or be contained, 10 s for a
mechanism, so an obligation that opens at step s is overdue from step s + 5 or s + 10 on.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from pytest_safemanip.ltlf import Outcome, worst
from pytest_safemanip.spec.properties import load_properties

PROPERTIES = load_properties([Path(__file__).resolve().parents[2] / "properties"])

SATISFIED, UNRESOLVED, VIOLATED = Outcome.SATISFIED, Outcome.UNRESOLVED, Outcome.VIOLATED
BAD, OVERDUE = "bad prefix", "overdue"


class Case(NamedTuple):
    id: str
    what: str
    trace: dict[str, str]
    timed: list[tuple[int, int, str]] | Outcome
    paper: tuple[int, int, str] | Outcome
    vacuous: bool = False


def collision(what, c, b, timed, paper):
    return Case("collision_contact", what, {"collision": c, "bad_contact": b}, timed, paper)


def grasp(what, g, s, r, timed, paper, vacuous=False):
    trace = {"obj_grasped": g, "stable_grasp": s, "obj_released": r}
    return Case("grasp_stability", what, trace, timed, paper, vacuous)


def release(what, r, s, g, timed, paper, vacuous=False):
    trace = {"obj_released": r, "settled": s, "obj_grasped": g}
    return Case("release_stability", what, trace, timed, paper, vacuous)


def contamination(what, d, c, s, timed, paper, vacuous=False):
    trace = {"contaminated": d, "clean_contact": c, "sanitized": s}
    return Case("cross_contamination", what, trace, timed, paper, vacuous)


def onset(what, o, p, timed, paper, vacuous=False):
    return Case("action_onset", what, {"skill_onset": o, "pre_safe": p}, timed, paper, vacuous)


def mechanism(what, h, r, s, timed, paper, vacuous=False):
    trace = {"mech_hit": h, "retract": r, "recovered": s}
    return Case("mechanism_recovery", what, trace, timed, paper, vacuous)


def containment(what, t, c, timed, paper, vacuous=False):
    trace = {"transfer": t, "contained": c}
    return Case("object_containment", what, trace, timed, paper, vacuous)


def clearance(what, i, p, c, timed, paper, vacuous=False):
    trace = {"item_in_enclosure": i, "insert_item": p, "enclosure_cleared": c}
    return Case("enclosure_clearance", what, trace, timed, paper, vacuous)


def access(what, r, o, timed, paper, vacuous=False):
    return Case("enclosure_access", what, {"reach_in": r, "fix_open": o}, timed, paper, vacuous)


def placement(what, p, r, i, o, timed, paper, vacuous=False):
    trace = {"place_in_onset": p, "obj_released": r, "obj_inside": i, "obj_outside": o}
    return Case("enclosure_release", what, trace, timed, paper, vacuous)


CASES = [
    # phi 1: always put to the test; nothing can stay open.
    collision("satisfied", "....", "....", SATISFIED, SATISFIED),
    collision("violated", "...1", "....", [(3, 3, BAD)], (3, 3, BAD)),
    collision("violated twice", ".1....", "....1.", [(1, 1, BAD), (4, 4, BAD)], (1, 5, BAD)),
    collision("violated then recovered", ".1....", "..1...", [(1, 2, BAD)], (1, 5, BAD)),
    # phi 2: with `W` a rollout may end with the object held, with the paper's `U` it may not.
    grasp("satisfied", ".111..", ".111..", "....1.", SATISFIED, SATISFIED),
    grasp("held to the end", ".111", ".111", "....", SATISFIED, (3, 3, OVERDUE)),
    grasp("violated", ".111..", ".1.1..", "....1.", [(2, 2, BAD)], (2, 5, BAD)),
    grasp("violated by a drop", ".11..", ".11..", ".....", [(3, 3, BAD)], (3, 4, BAD)),
    grasp(
        "violated twice", ".11.11.", ".1..1..", "...1..1", [(2, 2, BAD), (5, 5, BAD)], (2, 6, BAD)
    ),
    grasp("violated then recovered", ".11111.", ".1..11.", "......1", [(2, 3, BAD)], (2, 6, BAD)),
    grasp("vacuous", "....", "1...", "..1.", SATISFIED, SATISFIED, vacuous=True),
    # phi 3: physics has to settle it; where the trace has no settle tail, it may still do so.
    release("satisfied", ".1....", "...1..", "......", SATISFIED, SATISFIED),
    release("satisfied in time", ".1......", "......1.", "........", SATISFIED, SATISFIED),
    release("grasped again", ".1....", "......", "...11.", SATISFIED, (5, 5, OVERDUE)),
    release("violated", ".1........", "." * 10, "." * 10, [(6, 9, OVERDUE)], (9, 9, OVERDUE)),
    release("open at the end", ".1..", "....", "....", UNRESOLVED, (3, 3, OVERDUE)),
    release(
        "violated twice",
        ".1.......1........",
        "........1.......1.",
        "." * 18,
        [(6, 7, OVERDUE), (14, 15, OVERDUE)],
        SATISFIED,
    ),
    release(
        "violated then recovered",
        ".1........",
        "........1.",
        "." * 10,
        [(6, 7, OVERDUE)],
        SATISFIED,
    ),
    release("vacuous", "....", ".1..", "1...", SATISFIED, SATISFIED, vacuous=True),
    # phi 4: a rollout may end contaminated.
    contamination("satisfied", ".11..", "1...1", "...1.", SATISFIED, SATISFIED),
    contamination("contaminated to the end", ".111", "....", "....", SATISFIED, (3, 3, OVERDUE)),
    contamination("violated", ".111", "..1.", "....", [(2, 2, BAD)], (2, 3, BAD)),
    contamination(
        "violated twice", ".1111.", "..1.1.", ".....1", [(2, 2, BAD), (4, 4, BAD)], (2, 5, BAD)
    ),
    contamination(
        "violated then recovered", ".111..", "..1..1", "....1.", [(2, 2, BAD)], (2, 5, BAD)
    ),
    contamination("vacuous", "....", ".11.", "...1", SATISFIED, SATISFIED, vacuous=True),
    # phi 5
    onset("satisfied", "..1.", "..1.", SATISFIED, SATISFIED),
    onset("violated", "..1.", "1..1", [(2, 2, BAD)], (2, 3, BAD)),
    onset("violated twice", ".1.1.", ".....", [(1, 1, BAD), (3, 3, BAD)], (1, 4, BAD)),
    onset("violated then recovered", ".1.1.", "...1.", [(1, 1, BAD)], (1, 4, BAD)),
    onset("vacuous", "....", "1..1", SATISFIED, SATISFIED, vacuous=True),
    # phi 6: the robot has to do it, so what is open and not overdue stays unresolved.
    mechanism("satisfied", ".1.....", "..1....", "....1..", SATISFIED, SATISFIED),
    mechanism("unresolved", "..1..", ".....", ".....", UNRESOLVED, (4, 4, OVERDUE)),
    mechanism("recovered too early", ".1....", "...1..", "..1...", UNRESOLVED, (5, 5, OVERDUE)),
    mechanism(
        "violated", ".1" + "." * 12, "." * 14, "." * 14, [(11, 13, OVERDUE)], (13, 13, OVERDUE)
    ),
    mechanism(
        "violated twice",
        ".1............1.............",
        "............1...............",
        ".............1..............",
        [(11, 12, OVERDUE), (24, 27, OVERDUE)],
        (27, 27, OVERDUE),
    ),
    mechanism(
        "violated then recovered",
        ".1.............",
        "............1..",
        ".............1.",
        [(11, 12, OVERDUE)],
        SATISFIED,
    ),
    mechanism("vacuous", "....", ".1..", "..1.", SATISFIED, SATISFIED, vacuous=True),
    # phi 7: as phi 3.
    containment("satisfied", ".1....", "....1.", SATISFIED, SATISFIED),
    containment("satisfied in time", ".1......", "......1.", SATISFIED, SATISFIED),
    containment("violated", ".1........", "." * 10, [(6, 9, OVERDUE)], (9, 9, OVERDUE)),
    containment("open at the end", ".1..", "....", UNRESOLVED, (3, 3, OVERDUE)),
    containment(
        "violated twice",
        ".1.......1........",
        "........1.......1.",
        [(6, 7, OVERDUE), (14, 15, OVERDUE)],
        SATISFIED,
    ),
    containment(
        "violated then recovered", ".1........", "........1.", [(6, 7, OVERDUE)], SATISFIED
    ),
    containment("vacuous", "....", ".1..", SATISFIED, SATISFIED, vacuous=True),
    # phi 8: a rollout may end with the item inside.
    clearance("satisfied", ".11...", "....1.", "...1..", SATISFIED, SATISFIED),
    clearance("left inside", "..11", ".1..", "....", SATISFIED, (3, 3, OVERDUE)),
    clearance("inside at the last step only", "...1", "....", "....", SATISFIED, (3, 3, OVERDUE)),
    clearance("violated", ".11..", "..1..", ".....", [(2, 2, BAD)], (2, 4, BAD)),
    clearance("violated twice", ".1111", "..1.1", ".....", [(2, 2, BAD), (4, 4, BAD)], (2, 4, BAD)),
    clearance("violated then recovered", ".111..", "..1...", "....1.", [(2, 2, BAD)], (2, 5, BAD)),
    clearance("vacuous", "....", ".1..", "1...", SATISFIED, SATISFIED, vacuous=True),
    # phi 9
    access("satisfied", "..1.", ".11.", SATISFIED, SATISFIED),
    access("violated", "..1.", "...1", [(2, 2, BAD)], (2, 3, BAD)),
    access("violated twice", ".1.1.", "..1..", [(1, 1, BAD), (3, 3, BAD)], (1, 4, BAD)),
    access("violated then recovered", ".1.1.", "..11.", [(1, 1, BAD)], (1, 4, BAD)),
    access("vacuous", "....", "1111", SATISFIED, SATISFIED, vacuous=True),
    # phi 10: a rollout may end before the release, and an object may be taken out again.
    placement("satisfied", ".1....", "....1.", "...11.", "......", SATISFIED, SATISFIED),
    placement("never released", ".1..", "....", "....", "....", SATISFIED, (3, 3, OVERDUE)),
    placement("taken out", ".1.....", ".....1.", ".......", "...1...", SATISFIED, (5, 6, BAD)),
    placement("violated", ".1....", "...1..", "......", "......", [(3, 3, BAD)], (3, 5, BAD)),
    placement(
        "violated twice",
        ".1..1..",
        "..1..1.",
        ".......",
        ".......",
        [(2, 2, BAD), (5, 5, BAD)],
        (2, 6, BAD),
    ),
    placement(
        "violated then recovered",
        ".1..1...",
        "..1...1.",
        ".....11.",
        "........",
        [(2, 2, BAD)],
        (2, 7, BAD),
    ),
    placement("vacuous", "....", "..1.", "....", "1111", SATISFIED, SATISFIED, vacuous=True),
]


def judged(case, profile, acting=None):
    template = PROPERTIES[case.id]
    columns = [[mark == "1" for mark in case.trace[atom]] for atom in template.atoms]
    values = np.array(columns).T[:, None, :]
    (verdict,) = template.monitor(1, dt=1.0, profile=profile).run(values, acting)
    return verdict


@pytest.mark.parametrize("profile", ["timed", "paper"])
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.id}-{case.what}")
def test_template(case, profile):
    expected = case.timed if profile == "timed" else case.paper
    verdict = judged(case, profile)
    if isinstance(expected, tuple):
        expected = [expected]
    if isinstance(expected, list):
        assert [(v.first, v.last, v.reason) for v in verdict.violations] == expected
        assert [v.duration_s for v in verdict.violations] == [b - a + 1.0 for a, b, _ in expected]
        expected = VIOLATED
    assert verdict.outcome is expected
    assert bool(verdict.violations) == (expected is VIOLATED)
    assert verdict.vacuous == case.vacuous
    label = "VACUOUS" if case.vacuous else expected.name
    assert worst([verdict]).label == label


@pytest.mark.parametrize(
    ("template", "outcome"),
    [
        ("release_stability", VIOLATED),
        ("object_containment", VIOLATED),
        ("mechanism_recovery", UNRESOLVED),
    ],
)
def test_what_is_open_when_the_robot_stops(template, outcome):
    case = next(case for case in CASES if case.id == template and case.what == "violated")
    steps = len(next(iter(case.trace.values())))
    verdict = judged(case, "timed", np.arange(steps) < 3)
    assert verdict.outcome is outcome
    assert verdict.exposed_steps == 0


def test_every_template_has_its_cases():
    wanted = {"satisfied", "violated", "violated twice", "violated then recovered", "vacuous"}
    for template in PROPERTIES:
        found = {case.what for case in CASES if case.id == template}
        missing = wanted - found - ({"vacuous"} if template == "collision_contact" else set())
        assert not missing, template
    assert any(case.timed is UNRESOLVED for case in CASES)


@pytest.mark.parametrize("profile", ["timed", "paper"])
@pytest.mark.parametrize("template", PROPERTIES)
def test_templates_stay_small(template, profile):
    assert len(PROPERTIES[template].dfa(profile)) <= 3
