from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, JudgementError, TraceError
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.catalogue import SHIPPED, Catalogue
from pytest_safemanip.propositions.definition import Parameter, Proposition
from pytest_safemanip.propositions.grounding import check_call
from pytest_safemanip.propositions.online import Online
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
    with pytest.raises(JudgementError, match=r"own\(mug\): ZeroDivisionError"):
        view.part("own", "mug", first=1, stop=3)
    assert (view.since, view.until) == (0, 4)
    assert view("own", "mug").all()


def test_a_proposition_has_the_name_of_no_other():
    with pytest.raises(ConfigError, match="proposition 'settled' is defined twice"):
        Catalogue([proposition(yes, "settled")])


MINE = Parameter("own.speed", "m/s", 0.25, "a walk")
FORCE = next(p for one in SHIPPED for p in one.parameters if p.name == "mech_hit.force")


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (
            (dataclasses.replace(FORCE, default=1e6),),
            "'mech_hit.force' is 1e.06 N here and .* N in proposition 'mech_hit'; .*'own.force'",
        ),
        ((dataclasses.replace(FORCE, unit="kN"),), "kN here and .* N in proposition 'mech_hit'"),
        ((MINE, MINE), "two parameters 'own.speed'"),
        (
            (dataclasses.replace(MINE, name="settled.sped"),),
            "none of your propositions; .*own.sped",
        ),
        ((dataclasses.replace(MINE, name="speed"),), "none of your propositions; .*'own.speed'"),
        ((dataclasses.replace(MINE, default=np.nan),), "own.speed: expected a number .* found nan"),
        ((dataclasses.replace(MINE, default=np.inf),), "own.speed: expected a number .* found inf"),
        (MINE, "parameters: expected a tuple of them, found Parameter"),
    ],
)
def test_parameters_of_a_users_proposition_change_no_others(parameters, message):
    own = dataclasses.replace(proposition(yes), parameters=parameters)
    with pytest.raises(
        ConfigError, match=rf"test_definition.py:\d+: proposition 'own': .*{message}"
    ):
        Catalogue([own])


def test_propositions_may_share_a_parameter():
    own = dataclasses.replace(proposition(yes), parameters=(MINE, FORCE))
    other = dataclasses.replace(own, name="other")
    values = Catalogue([own, other]).parameters({})
    assert (values["own.speed"], values["mech_hit.force"]) == (0.25, FORCE.default)


@pytest.mark.parametrize(
    ("window", "message"),
    [
        (lambda p: np.nan, "expected a window of 0 s or more, found nan"),
        (lambda p: -1.0, "expected a window of 0 s or more, found -1.0"),
        (lambda p: "long", "window failed .ValueError"),
        (lambda p: p["own.spede"], "window failed .KeyError: 'own.spede'"),
    ],
)
def test_a_window_is_a_number_of_seconds(window, message):
    own = dataclasses.replace(proposition(yes), window=window)
    with pytest.raises(ConfigError, match=rf"test_definition.py:\d+: proposition 'own': {message}"):
        Catalogue([own]).parameters({})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("objct",), "unknown kind of argument 'objct'; did you mean 'object'. known: object, "),
        (("object or fixtur",), "unknown kind of argument 'fixtur'; did you mean 'fixture'"),
        ("object", r"arguments: expected a tuple as \('object',\), found 'object'"),
    ],
)
def test_kinds_of_arguments_are_those_that_exist(arguments, message):
    with pytest.raises(ConfigError, match=rf"test_definition.py:\d+: proposition 'own': {message}"):
        Catalogue([proposition(yes, arguments=arguments)])


def misspelt(view, name):
    return view("obj_relesed", name)


def itself(view, name):
    return view("own", name)


def short(view):
    return yes(view)


@pytest.mark.parametrize(
    ("evaluate", "message"),
    [
        (misspelt, "unknown proposition 'obj_relesed'; did you mean 'obj_released'?"),
        (itself, "it asks for itself"),
        (short, "TypeError: short() takes 1 positional argument but 2 were given"),
    ],
)
@pytest.mark.parametrize("online", [False, True])
def test_mistakes_in_a_users_proposition_name_it_and_its_line(evaluate, message, online):
    catalogue = Catalogue([proposition(evaluate)])
    recording, parameters = film(4), catalogue.parameters({})
    live = Online(toy.SCENE, BINDING, parameters, catalogue, [("own", "mug")])
    view = View(recording.trace, BINDING, parameters, catalogue)
    first = next(iter(recording.steps))
    with pytest.raises(JudgementError) as caught:
        _ = live.push(*first) if online else view("own", "mug")
    said = str(caught.value)
    assert said.startswith(f"own(mug): {message} (")
    line = evaluate.__code__.co_firstlineno + (evaluate is misspelt)
    assert said.endswith(f"test_definition.py:{line})")


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
