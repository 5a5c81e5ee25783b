from __future__ import annotations

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Proposition
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.calls import PropositionCall, read_call

PARAMETERS = {"settled.speed", "settled.window", "obj_inside.depth"}
NAMES = ("settled", "obj_inside", "collision", "skill_onset")
KNOWN = {name: proposition for name, proposition in Catalogue().items() if name in NAMES}

RELATIONS = [name for name, known in Catalogue().items() if len(known.arguments) == 2]


@pytest.fixture
def section(tmp_path):
    def section(text):
        path = tmp_path / "x.yaml"
        path.write_text(text + "\n")
        return yamlfile.load(path)

    return section


@pytest.mark.parametrize("name", RELATIONS)
def test_nothing_is_related_to_itself(section, name):
    file = section(f"near: {name}(o, o)")
    with pytest.raises(ConfigError) as caught:
        read_call(file, "near", ("o", "p"), Catalogue())
    assert str(caught.value) == (
        f"{file.path}:1: key 'near': '{name}(o, o)' is about 'o' and itself, and always the same; "
        "name two"
    )
    assert read_call(section(f"near: {name}(o, p)"), "near", ("o", "p"), Catalogue())


def test_a_users_relation_may_be_of_a_thing_and_itself(section):
    own = Proposition("like", ("object", "object"), lambda _: 0.0, (), lambda *_: np.zeros(1, bool))
    assert read_call(section("a: like(o, o)"), "a", ("o",), {"like": own}).arguments == ("o", "o")


@pytest.mark.parametrize(
    ("text", "name", "arguments"),
    [
        ("collision", "collision", ()),
        ("settled(o)", "settled", ("o",)),
        (" obj_inside( o ,f ) ", "obj_inside", ("o", "f")),
        ("skill_onset(pick, o)", "skill_onset", ("pick", "o")),
    ],
)
def test_a_proposition_has_variables_and_constants_as_arguments(section, text, name, arguments):
    found = read_call(section(f"a: '{text}'"), "a", ("o", "f", "pick"), KNOWN)
    assert found == PropositionCall(name, arguments)
    written = read_call(section(f"a: '{found}'"), "a", ("o", "f", "pick"), KNOWN)
    assert written == found


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("setled(o)", "unknown proposition 'setled(o)'; did you mean 'settled(o)'?"),
        ("settled", "'settled' takes 1 argument, found 0 in 'settled'"),
        ("obj_inside(o)", "'obj_inside' takes 2 arguments, found 1"),
        ("collision(o)", "'collision' takes 0 arguments, found 1"),
        ("settled(p)", "unknown argument 'p' in 'settled(p)'"),
        ("settled()", "expected a proposition such as 'settled(o)', found 'settled()'"),
        ("settled(o", "expected a proposition such as"),
        ("!settled(o)", "expected a proposition such as"),
        ("settled(o) & collision", "expected a proposition such as"),
    ],
)
def test_what_is_no_proposition_is_refused_with_file_and_line(section, text, message):
    file = section(f"b: x\na: '{text}'")
    with pytest.raises(ConfigError) as caught:
        read_call(file, "a", ("o", "f"), KNOWN)
    assert str(caught.value).startswith(f"{file.path}:2: ")
    assert message in str(caught.value)


def test_without_variables_an_argument_has_nothing_to_mean(section):
    with pytest.raises(ConfigError, match="'for_each' binds no variable"):
        read_call(section("a: settled(o)"), "a", (), KNOWN)


def test_names_can_be_left_unchecked_for_properties_of_another_catalogue(section):
    found = read_call(section("a: polished(o)"), "a", ("o",), None)
    assert found == PropositionCall("polished", ("o",))


def test_a_call_sets_parameters_of_its_proposition(section):
    text = "settled(o, speed = 0.05, window=1)"
    found = read_call(section(f"a: '{text}'"), "a", ("o",), KNOWN, PARAMETERS)
    assert found == PropositionCall("settled", ("o",), ("speed=0.05", "window=1"))
    assert str(found) == "settled(o, speed=0.05, window=1)"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("settled(o, sped=1)", "unknown parameter 'sped' of 'settled'; did you mean 'speed'?"),
        ("collision(force=1)", "unknown parameter 'force' of 'collision'; it has none of its own"),
        ("settled(o, speed=fast)", "'speed' of 'settled': expected a number above 0, found 'fast'"),
        ("settled(o, speed=0)", "parameter settled.speed: expected a number above 0"),
        ("settled(o, speed=1e12)", "parameter settled.speed: expected a number above 0, at most"),
        ("settled(o, speed=1, speed=2)", "parameter 'speed' of 'settled' is given twice"),
        ("settled(speed=1, o)", "argument 'o' comes after a parameter that is set"),
    ],
)
def test_what_sets_no_parameter_is_refused_with_file_and_line(section, text, message):
    file = section(f"b: x\na: '{text}'")
    with pytest.raises(ConfigError) as caught:
        read_call(file, "a", ("o",), KNOWN, PARAMETERS)
    assert str(caught.value).startswith(f"{file.path}:2: ")
    assert message in str(caught.value)


def test_an_attribute_is_no_proposition_and_said_to_be_one(section):
    with pytest.raises(ConfigError) as caught:
        read_call(section("a: hot_source(o)"), "a", ("o",), Catalogue())
    assert str(caught.value).endswith(
        ":1: unknown proposition 'hot_source(o)'; did you mean 'hot(o)'? 'hot_source' is an "
        "attribute, as in 'o in things with hot_source'"
    )
