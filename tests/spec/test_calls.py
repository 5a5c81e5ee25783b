from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.calls import RELATIONS, PropositionCall, read_call, read_for_each

KNOWN = {"settled": 1, "obj_inside": 2, "collision": 0, "skill_onset": 2}


@pytest.fixture
def section(tmp_path):
    def section(text):
        path = tmp_path / "x.yaml"
        path.write_text(text + "\n")
        return yamlfile.load(path)

    return section


@pytest.mark.parametrize(
    ("text", "variables", "relation"),
    [
        ("o in objects", ("o",), "objects"),
        ("o, f in placements", ("o", "f"), "placements"),
        ("  k ,x   in   skills ", ("k", "x"), "skills"),
        ("in_ in objects", ("in_",), "objects"),
    ],
)
def test_variables_range_over_a_relation(section, text, variables, relation):
    assert read_for_each(section(f"for_each: '{text}'")) == (variables, relation)


def test_without_the_key_there_is_one_instance(section):
    assert read_for_each(section("other: x")) == ((), None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("objects", "expected 'VARIABLE, ... in RELATION', found 'objects'"),
        ("o of objects", "expected 'VARIABLE, ... in RELATION'"),
        ("o in object", "unknown relation 'object'; did you mean 'objects'?"),
        ("o in placements", "'placements' needs 2 variables, found 1"),
        ("o, f in objects", "'objects' needs 1 variable, found 2"),
        ("o, o in placements", "'o' cannot be a variable here"),
        ("O in objects", "'O' cannot be a variable here"),
        ("o, in placements", "'' cannot be a variable here"),
    ],
)
def test_what_binds_no_variables_is_refused_with_file_and_line(section, text, message):
    file = section(f"a: x\nfor_each: '{text}'")
    with pytest.raises(ConfigError) as caught:
        read_for_each(file)
    assert str(caught.value).startswith(f"{file.path}:2: key 'for_each': ")
    assert message in str(caught.value)


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


def test_every_relation_has_one_or_two_variables():
    assert set(RELATIONS.values()) == {1, 2}
