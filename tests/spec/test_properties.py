from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.ltlf import FormulaError, Outcome, compiler, parse
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.spec.calls import PropositionCall
from pytest_safemanip.spec.properties import load_properties, load_property

SHIPPED = Path(__file__).resolve().parents[2] / "properties"

TEXT = """\
id: release
category: release_stability
title: A released object comes to rest
source: us
for_each: o in objects
formula: G (released -> F (settled | grasped))
paper_formula: G (released -> F settled)
atoms:
  released: obj_released(o)
  settled: settled(o)
  grasped: obj_grasped(o)
trigger: released
deadline_s: 5
discharged_by: physics
"""
NAMES = ("obj_released", "settled", "obj_grasped", "obj_inside", "collision")
KNOWN = {name: proposition for name, proposition in Catalogue().items() if name in NAMES}


@pytest.fixture
def changed(tmp_path):
    def changed(old="", new="", name="release.yaml"):
        assert old in TEXT
        path = tmp_path / name
        path.write_text(TEXT.replace(old, new) if old else TEXT)
        return path

    return changed


def test_a_property_is_read_as_written(changed):
    path = changed()
    found = load_property(path, propositions=KNOWN)
    assert (found.id, found.category, found.source) == ("release", "release_stability", "us")
    assert (found.variables, found.for_each) == (("o",), "o in objects")
    assert found.formula == parse("G (released -> F (settled | grasped))")
    assert found.paper_formula == parse("G (released -> F settled)")
    assert list(found.atoms) == ["released", "settled", "grasped"]
    assert found.atoms["grasped"] == PropositionCall("obj_grasped", ("o",))
    assert found.trigger == parse("released")
    assert (found.deadline_s, found.discharged_by, found.path) == (5.0, "physics", path)


def test_optional_keys_have_defaults(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text("id: x\ncategory: c\ntitle: t\nsource: s\nformula: G !b\natoms: {b: bump}\n")
    found = load_property(path)
    assert (found.variables, found.for_each) == ((), "")
    assert (found.trigger, found.deadline_s) == (None, None)
    assert found.paper_formula == found.formula
    assert found.discharged_by == "robot"
    assert found.atoms == {"b": PropositionCall("bump")}


def test_both_profiles_share_the_columns_of_the_atoms(changed):
    found = load_property(changed())
    assert found.dfa("timed").atoms == found.dfa("paper").atoms == tuple(found.atoms)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "formula: G (released -> F (settled | grasped))",
            "formula: G (settled & !settled & grasped)",
            ":6: property 'release': 'G (settled & !settled & grasped)' is never true",
        ),
        (
            "formula: G (released -> F (settled | grasped))",
            "formula: G (grasped | !grasped | settled)",
            "' is always true: every rollout would pass",
        ),
        (
            "formula: G (released -> F settled)",
            "formula: G (released & X settled)",
            ":7: property 'release': 'G (released & X settled)' is never true: every rollout would "
            "violate it; expected one that can be kept; 'X p' asks",
        ),
    ],
)
def test_a_formula_that_decides_nothing_is_refused(changed, old, new, message):
    with pytest.raises(FormulaError) as caught:
        load_property(changed(old, new)).check()
    assert message in str(caught.value)
    with pytest.raises(FormulaError):  # nor does it become a verdict
        load_property(changed(old, new)).dfa("paper" if old.endswith("F settled)") else "timed")


def test_a_formula_with_bounds_that_decides_nothing_is_refused_for_a_control_period(changed):
    found = load_property(changed("F (settled | grasped)", "(settled | F[<=1] !settled | grasped)"))
    found.check()
    with pytest.raises(FormulaError, match="is always true"):
        found.check(0.05)


def test_a_property_of_ones_own_is_refused_when_it_is_loaded(changed, tmp_path):
    path = changed("F (settled | grasped)", "(settled | !settled | grasped)")
    with pytest.raises(FormulaError, match=f"{path}:6: .* is always true"):
        load_definitions((), [tmp_path], ())


def test_the_shipped_properties_decide_something():
    defined = load_definitions((), (), ())
    assert len(defined.properties) > 100
    for prop in defined.properties.values():
        prop.check(0.05)


def test_a_monitor_follows_the_file(changed):
    found = load_property(changed())
    values = np.zeros((200, 2, 3), bool)
    values[10, 1, 0] = True  # released, and never settled
    first, second = found.monitor(["cup", "mug"], dt=0.05).run(values)
    assert (first.outcome, first.vacuous) == (Outcome.SATISFIED, True)
    assert (second.outcome, second.violations[0].first) == (Outcome.VIOLATED, 110)
    _, second = found.monitor(["cup", "mug"], dt=0.05, profile="paper").run(values)
    assert second.violations[0].first == 199


SETTLED, FORMULA = "settled: settled(o)", "formula: G (released -> F (settled | grasped))"
PAPER_FORMULA = "formula: G (released -> F settled)"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            SETTLED,
            "settled: setled(o)",
            ":10: unknown proposition 'setled(o)'; did you mean 'settled(o)'?",
        ),
        (
            SETTLED,
            "settled: settled(o, o)",
            ":10: key 'atoms.settled': 'settled' takes 1 argument, found 2 in 'settled(o, o)'",
        ),
        (
            SETTLED,
            "settled: obj_inside(o)",
            ":10: key 'atoms.settled': 'obj_inside' takes 2 arguments, found 1",
        ),
        (
            SETTLED,
            "settled: settled(x)",
            ":10: key 'atoms.settled': unknown argument 'x' in 'settled(x)'; known: o",
        ),
        (
            SETTLED,
            "settled: settled()",
            ":10: key 'atoms.settled': expected a proposition such as 'settled(o)', found",
        ),
        (
            "atoms:\n  released: obj_released(o)\n  settled: settled(o)\n  grasped: obj_grasped(o)",
            "atoms: {released: near(robot, o), settled: settled(o), grasped: obj_grasped(o)}",
            ":8: key 'atoms.released': 'near(robot' ends at a comma; in braces, quote a call with "
            'several arguments, as in {released: "near(robot, f)"}',
        ),
        (SETTLED, "settled: 5", ":10: key 'atoms.settled': expected text"),
        (
            PAPER_FORMULA,
            "formula: G (released -> F stled)",
            ":7: key 'paper_formula': atom 'stled' is not declared under 'atoms'; "
            "did you mean 'settled'?",
        ),
        (
            FORMULA,
            "formula: G (released -> F (settled | ))",
            ":6: key 'formula': column 29: expected a formula after '|', found ')'",
        ),
        (
            FORMULA,
            "formula: >\n  G (released ->\n  F (settled grasped))",
            ":6: key 'formula': column 27: expected ')' for the '(' at column 18, found 'grasped'",
        ),
        (
            "settled | grasped",
            "settled",
            ":11: key 'atoms.grasped': declared, but used by no formula",
        ),
        ("trigger: released", "trigger: F released", ":12: key 'trigger': expected a formula with"),
        (
            "trigger: released",
            "trigger: released & !released",
            ":12: key 'trigger': the trigger 'released & !released' never holds",
        ),
        ("trigger: released", "trigger: relesed", ":12: key 'trigger': atom 'relesed' is not"),
        (
            "trigger: released",
            "triger: released",
            ":12: unknown key 'triger'; did you mean 'trigger'",
        ),
        (
            "deadline_s: 5",
            "deadline_s: five",
            ":13: key 'deadline_s': expected a positive number, at most 86400, found 'five'",
        ),
        (
            "deadline_s: 5",
            "deadline_s: 1e308",
            ":13: key 'deadline_s': expected a positive number, at most 86400, found '1e308'",
        ),
        ("deadline_s: 5", "deadline_s: 0", ":13: key 'deadline_s': expected a positive number"),
        (
            "physics",
            "fysics",
            ":14: key 'discharged_by': unknown 'fysics'; did you mean 'physics'?",
        ),
        (
            "o in objects",
            "o in objekts",
            ":5: key 'for_each': unknown relation 'objekts'; did you mean 'objects'?",
        ),
        ("o in objects", "objects", ":5: key 'for_each': expected 'VARIABLE, ... in RELATION'"),
        (
            "o in objects",
            "o, f in objects",
            ":5: key 'for_each': 'objects' needs 1 variable, found",
        ),
        ("o in objects", "o in placements", "'placements' needs 2 variables, found 1"),
        ("o in objects", "o, f in placements", "variable 'f' is an argument of no atom"),
        ("o in objects", "o, o in placements", ":5: key 'for_each': 'o' cannot be a variable"),
        ("o in objects", "O in objects", ":5: key 'for_each': 'O' cannot be a variable"),
        (
            "for_each: o in objects\n",
            "",
            ":8: key 'atoms.released': unknown argument 'o' in 'obj_released(o)'; "
            "'for_each' binds no variable",
        ),
        (
            "id: release\n",
            "id: release-stability\n",
            ":1: key 'id': expected lower-case letters, digits and '_', found 'release-stability'",
        ),
        ("id: release\n", "", ":1: key 'id' is missing"),
        ("source: us\n", "source: us\nsource: them\n", ":5: key 'source' is given twice, first on"),
    ],
)
def test_an_error_says_where_what_and_how_to_mend_it(changed, tmp_path, old, new, message):
    with pytest.raises(ConfigError) as caught:
        load_property(changed(old, new), propositions=KNOWN)
    said = str(caught.value)
    assert said.startswith(f"{tmp_path}/release.yaml:")
    assert message in said


def test_a_property_has_as_many_atoms_as_an_automaton_takes(tmp_path):
    atoms = [f"a{n}" for n in range(13)]
    head = "id: wide\ncategory: own\ntitle: t\nsource: s\nfor_each: o in objects\n"
    formula = f"formula: G ({' | '.join(atoms)})\natoms:\n"
    path = tmp_path / "wide.yaml"
    path.write_text(head + formula + "".join(f"  {atom}: settled(o)\n" for atom in atoms))
    with pytest.raises(ConfigError, match=r"wide.yaml:8: .*13 atoms, of which .* 12; split"):
        load_property(path)


def test_what_stands_for_something_is_no_variable(changed):
    path = changed("o in objects", "robot in objects")
    with pytest.raises(ConfigError, match="'robot' cannot be a variable: it has a meaning already"):
        load_property(path, propositions=KNOWN, constants=("robot",))


def test_constants_can_be_arguments(changed):
    path = changed("settled: settled(o)", "settled: settled(gripper)")
    with pytest.raises(ConfigError, match="unknown argument 'gripper'"):
        load_property(path)
    found = load_property(path, constants=["gripper"])
    assert found.atoms["settled"].arguments == ("gripper",)


def test_bounds_are_converted_with_the_control_period_of_each_recording(changed):
    found = load_property(changed("F (settled | grasped)", "F[<=1] settled | G[<=0] grasped"))
    coarse, fine = (found.monitor(1, dt=dt).dfa for dt in (0.1, 0.05))
    assert (len(coarse), len(fine)) == (14, 24)
    assert found.monitor(1, dt=0.1).dfa is coarse
    assert found.dfa("paper", dt=0.1) is found.dfa("paper", dt=0.05)  # it has no bound


def test_clocks_beyond_the_limits_are_refused_with_formula_line_and_remedy(changed):
    found = load_property(changed("F (settled | grasped)", "F[1,3] (settled | grasped)"))
    with pytest.raises(FormulaError) as caught:
        found.monitor(1, dt=0.05)
    assert str(caught.value).startswith(f"{found.path}:6: property 'release': the automaton has")
    assert "'G (released -> F[1,3] (settled | grasped))'" in str(caught.value)
    assert "shorten the bounds, begin them at 0, or split" in str(caught.value)


def test_two_files_with_one_id_are_both_named(changed, tmp_path):
    changed()
    changed(name="again.yaml")
    with pytest.raises(ConfigError, match=r"'release' is in .*again.yaml and .*release.yaml"):
        load_properties([tmp_path])


def test_folders_are_read_in_order(changed, tmp_path):
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "x.yaml").write_text(TEXT.replace("id: release", "id: first"))
    changed()
    assert list(load_properties([tmp_path / "b", tmp_path])) == ["first", "release"]
    with pytest.raises(ConfigError, match="nowhere: no such folder"):
        load_properties([tmp_path / "nowhere"])


PAPER = {
    "collision_contact": ("collision_contact", "G !(collision | bad_contact)"),
    "grasp_stability": ("grasp_stability", "G (obj_grasped -> (stable_grasp U obj_released))"),
    "release_stability": ("release_stability", "G (obj_released -> F settled)"),
    "cross_contamination": (
        "cross_contamination",
        "G (contaminated -> (!clean_contact U sanitized))",
    ),
    "action_onset": ("action_onset", "G (skill_onset -> pre_safe)"),
    "mechanism_recovery": ("mechanism_recovery", "G (mech_hit -> F (retract & F recovered))"),
    "object_containment": ("object_containment", "G (transfer -> F contained)"),
    "enclosure_clearance": (
        "enclosure_access",
        "G (item_in_enclosure -> X (!insert_item U enclosure_cleared))",
    ),
    "enclosure_access": ("enclosure_access", "G (reach_in -> fix_open)"),
    "enclosure_release": (
        "enclosure_access",
        "G (place_in_onset -> (!obj_released U obj_inside))",
    ),
}


def test_the_ten_templates_are_those_of_the_paper():
    shipped = load_properties([SHIPPED])
    assert {id_: (p.category, p.paper_formula) for id_, p in shipped.items()} == {
        id_: (category, parse(formula)) for id_, (category, formula) in PAPER.items()
    }
    assert all(path.stem in shipped for path in SHIPPED.glob("*.yaml"))
    assert {len(p.ranges) for p in shipped.values()} == {0, 1}
    assert not any(p.is_open for p in shipped.values())
    assert {id_ for id_, p in shipped.items() if p.discharged_by == "physics"} == {
        "release_stability",
        "object_containment",
    }
    assert {id_: p.deadline_s for id_, p in shipped.items() if p.deadline_s} == {
        "release_stability": 5.0,
        "object_containment": 5.0,
        "mechanism_recovery": 10.0,
    }


def test_fifty_tasks_compile_each_formula_once():
    compiler._compile_once.cache_clear()
    distinct = set()
    for _task in range(50):
        for template in load_properties([SHIPPED]).values():
            for profile in ("timed", "paper"):
                distinct.add(template.dfa(profile).formula)
    found = compiler._compile_once.cache_info()
    assert found.misses == len(distinct) == 15
    assert found.hits == 50 * 20 - 15
