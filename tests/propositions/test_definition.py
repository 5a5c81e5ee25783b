from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.catalogue import SHIPPED, Catalogue
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.propositions.grounding import check_call
from pytest_safemanip.propositions.view import View
from pytest_safemanip.spec.ranges import RELATIONS
from tests import toy
from tests.propositions.stage import BINDING, CATALOGUE, film, rest, true_at


def proposition(evaluate, name="own", arguments=("object",), **more):
    return Proposition(name, arguments, lambda _: 0.0, (), evaluate, **more)


def view_with(evaluate, length=4, tail=0, **more):
    catalogue = Catalogue([proposition(evaluate, **more)])
    recording = film(length, tail=tail)
    return View(recording.trace, BINDING, catalogue.parameters({}), catalogue)


def yes(view, *_):
    """Always."""
    return np.ones(len(view.trace), bool)


def test_a_users_proposition_is_evaluated_once_for_each_arguments():
    calls = []

    def evaluate(view, name):
        calls.append(name)
        return yes(view)

    view = view_with(evaluate)
    for name in ("mug", "apple", "mug"):
        assert view("own", name).tolist() == [True] * 4
    assert calls == ["mug", "apple"]


def test_what_a_sparse_proposition_asks_others_is_their_value_at_all_steps():
    def evaluate(view, name):
        return view("settled", name)

    catalogue = Catalogue([proposition(evaluate, sparse=True)])
    recording = film(40, rest(range(40)))
    views = [View(recording.trace, BINDING, catalogue.parameters({}), catalogue) for _ in range(2)]
    assert views[0].part("own", "mug", first=10, stop=15).all()
    assert true_at(views[0]("settled", "mug")) == true_at(views[1]("settled", "mug"))


def test_a_view_is_whole_again_after_a_proposition_has_failed():
    def evaluate(view, name):
        if view.since:
            raise ZeroDivisionError
        return yes(view)

    view = view_with(evaluate, sparse=True)
    with pytest.raises(ZeroDivisionError):
        view.part("own", "mug", first=1, stop=3)
    assert (view.since, view.until) == (0, 4)
    assert view("own", "mug").all()


def test_a_proposition_has_the_name_of_no_other():
    with pytest.raises(ConfigError, match="proposition 'settled' is defined twice"):
        Catalogue([proposition(yes, "settled")])


@pytest.mark.parametrize(
    ("result", "found"),
    [
        (np.ones(3, bool), r"bool\(3,\)"),
        (np.ones((4, 1), bool), r"bool\(4, 1\)"),
        (np.ones(4), r"float64\(4,\)"),
        (np.ones(4, int), r"int64\(4,\)"),
        (True, r"bool\(\)"),
        (None, r"object\(\)"),
    ],
)
def test_a_result_of_another_form_is_an_error_that_names_the_proposition(result, found):
    with pytest.raises(TraceError, match=rf"own: evaluated to {found}, expected bool\(4,\)"):
        view_with(lambda view, name: result)("own", "mug")


def test_wrong_arguments_are_errors_that_name_them():
    view = view_with(yes)
    with pytest.raises(TraceError, match="own: unknown entity 'cup'"):
        view("own", "cup")
    with pytest.raises(TraceError, match="own: 2 arguments, expected 1"):
        view("own", "mug", "apple")


def test_an_act_of_the_robot_cannot_happen_in_the_settle_tail():
    assert view_with(yes, tail=2, act=True)("own", "mug").tolist() == [True, True, False, False]
    assert view_with(yes, tail=2)("own", "mug").all()


def test_evidence_is_optional():
    assert view_with(yes).evidence("own", ("mug",), 0) == []
    said = view_with(yes, evidence=lambda view, name, step: [f"{name} at {step}"])
    assert said.evidence("own", ("mug",), 3) == ["mug at 3"]


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf"), 1e10])
def test_a_parameter_is_a_finite_number_above_zero(value):
    with pytest.raises(ConfigError, match=r"settled\.speed: expected a number above 0, at most"):
        CATALOGUE.parameters({"settled.speed": value})


def test_an_unknown_parameter_is_refused_with_a_near_miss():
    with pytest.raises(ConfigError, match=r"'settled\.sped'; did you mean 'settled\.speed'\?"):
        CATALOGUE.parameters({"settled.sped": 1.0})


def test_a_changed_parameter_changes_its_value_and_nothing_else():
    plain, changed = (CATALOGUE.parameters(c) for c in ({}, {"settled.speed": 0.03}))
    assert {name for name in plain if plain[name] != changed[name]} == {"settled.speed"}


@pytest.mark.parametrize("shipped", SHIPPED, ids=lambda p: p.name)
def test_every_shipped_proposition_says_what_it_means_and_why_its_numbers(shipped):
    assert shipped.doc
    values = CATALOGUE.parameters({})
    lasts = shipped.name in (
        *("contaminated", "clean_contact", "collision", "bad_contact"),
        *("hot", "displaced", "tilted"),
    )
    assert 0.0 <= shipped.window(values) < 15.0 or lasts
    for parameter in shipped.parameters:
        assert parameter.reason
        assert parameter.unit in ("N", "m", "s", "rad", "m/s", "rad/s", "1/s", "degC", "")
        assert parameter.name.split(".")[0] in {*CATALOGUE, "enclosure"}


def test_no_two_parameters_have_one_name():
    values = {}
    for shipped in SHIPPED:
        for parameter in shipped.parameters:
            assert values.setdefault(parameter.name, parameter) == parameter


@pytest.mark.parametrize("relation", RELATIONS)
def test_every_relation_that_properties_range_over_has_rows_in_a_binding(relation):
    rows = BINDING.relation(relation)
    assert all(len(row) == RELATIONS[relation] for row in rows)
    assert Binding().relation(relation) == ()
    if relation in ("objects", "enclosures", "placements"):
        assert rows


@pytest.mark.parametrize(
    ("call", "changed", "message"),
    [
        (("obj_grasped", "mug"), {"grippers": ()}, r"obj_grasped\(mug\) .* has no gripper"),
        (("bad_contact",), {"grippers": ()}, r"bad_contact\(\) .* the scene has no gripper"),
        (("skill_onset", "pick", "mug"), {"grippers": ()}, "the scene has no gripper"),
        (("skill_onset", "open", "counter"), {}, "'counter' has no door or drawer"),
        (("mech_hit", "counter"), {}, "'counter' has no door or drawer"),
        (("reach_in", "counter"), {}, "'counter' has no interior"),
        (("settled", "counter"), {}, "'counter' is no movable object"),
    ],
)
def test_what_a_scene_lacks_is_an_error_and_not_false(call, changed, message):
    scene = dataclasses.replace(toy.SCENE, **changed)
    name, *arguments = call
    with pytest.raises(TraceError, match=message):
        check_call(CATALOGUE[name], tuple(arguments), scene, ())
