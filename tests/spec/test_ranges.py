from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.propositions.binding import Binding, Zone
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.ranges import RELATIONS, Range, read_for_each, rows_of

CATEGORIES = dict.fromkeys(("mug", "knife"), "object")
CATEGORIES |= dict.fromkeys(("Stove", "Microwave", "Oven"), "fixture")
BINDING = Binding(
    objects=("mug", "knife"),
    placements=(("mug", "oven"),),
    things=("mug", "knife", "vase"),
    obstacles=("vase",),
    fixtures=("stove", "oven"),
    kinds={"mug": "mug", "knife": "knife", "vase": "mug", "stove": "Stove", "oven": "Oven"},
    attributes={
        "mug": frozenset({"fragile", "container"}),
        "knife": frozenset({"sharp", "metal"}),
        "vase": frozenset({"fragile"}),
        "stove": frozenset({"hot_source"}),
        "oven": frozenset({"hot_source", "electrical"}),
    },
    zones={"hob": Zone("stove", 0.1), "sink": Zone("oven")},
    filled=("mug",),
)


@pytest.fixture
def section(tmp_path):
    def section(text):
        path = tmp_path / "x.yaml"
        path.write_text(text + "\n")
        return yamlfile.load(path)

    return section


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("o in objects", Range(("o",), "objects")),
        ("o, f in placements", Range(("o", "f"), "placements")),
        ("  k ,x   in   skills ", Range(("k", "x"), "skills")),
        ("in_ in objects", Range(("in_",), "objects")),
        ("o in objects with fragile", Range(("o",), "objects", having=("fragile",))),
        (
            "o in things of mug or knife with sharp and metal without liquid",
            Range(("o",), "things", ("mug", "knife"), ("sharp", "metal"), ("liquid",)),
        ),
        ("f in fixtures of Stove", Range(("f",), "fixtures", ("Stove",))),
        ("z in zones", Range(("z",), "zones")),
        ("z in zones of hob", Range(("z",), "zones", ("hob",))),
    ],
)
def test_variables_range_over_a_relation(section, text, found):
    assert read_for_each(section(f"for_each: '{text}'"), CATEGORIES) == (found,)
    assert read_for_each(section(f"for_each: '{found}'"), CATEGORIES) == (found,)


def test_several_clauses_are_a_mapping(section):
    file = section("for_each:\n  o: things with liquid\n  p, f: placements")
    assert read_for_each(file) == (
        Range(("o",), "things", having=("liquid",)),
        Range(("p", "f"), "placements"),
    )


def test_without_the_key_there_is_one_instance(section):
    assert read_for_each(section("other: x")) == ()
    assert rows_of((), BINDING) == ((),)


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
        ("o in objects wth sharp", "'wth' is not understood; expected RELATION, and after it"),
        ("o in things of Microwave", "'Microwave' is a category of fixtures, and 'things' ranges"),
        ("o in fixtures of mug", "ranges over fixtures; expected 'things of mug'"),
        ("o in objects with", "expected 'with NAME and NAME', found 'with'"),
        ("o in objects with sharp or metal", "found 'with sharp or metal'"),
        ("o in objects with sharp with metal", "'with' is not understood"),
        ("o in objects with shrap", "unknown attribute 'shrap'; did you mean 'sharp'?"),
        ("o in objects without hot", "unknown attribute 'hot'; did you mean 'hot_source'?"),
        ("f in fixtures of Stoove", "unknown category 'Stoove'; did you mean 'Stove'?"),
        ("o in things with sharp without sharp", "nothing is with 'sharp' and without it"),
        ("z in zones with sharp", "zones have names, as in 'zones of NAME', and no attributes"),
        ("o, f in placements with sharp", "'placements' has pairs: 'with' has no meaning there"),
    ],
)
def test_what_binds_no_variables_is_refused_with_file_and_line(section, text, message):
    file = section(f"a: x\nfor_each: '{text}'")
    with pytest.raises(ConfigError) as caught:
        read_for_each(file, CATEGORIES)
    assert str(caught.value).startswith(f"{file.path}:2: key 'for_each': ")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("lines", "line", "message"),
    [
        ("  o: things with shrap", 2, "key 'for_each.o': unknown attribute 'shrap'"),
        ("  o: things\n  p: [x]", 3, "key 'for_each.p': expected text, found a list"),
        ("  o: things\n  p, o: skills", 2, "'o' cannot be a variable here"),
        ("  {}", 2, "expected at least one variable"),
    ],
)
def test_a_mistake_in_one_of_several_clauses_is_named_with_its_line(section, lines, line, message):
    file = section(f"for_each:\n{lines}")
    with pytest.raises(ConfigError) as caught:
        read_for_each(file)
    assert str(caught.value).startswith(f"{file.path}:{line}: ")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("o in objects with fragile", [("mug",)]),
        ("o in things with fragile", [("mug",), ("vase",)]),
        ("o in things of mug without container", [("vase",)]),
        ("o in things with fragile and sharp", []),
        ("o in obstacles", [("vase",)]),
        ("f in fixtures with hot_source", [("stove",), ("oven",)]),
        ("f in fixtures of Stove or Microwave", [("stove",)]),
        ("z in zones", [("hob",), ("sink",)]),
        ("z in zones of hob or floor", [("hob",)]),
        ("z in zones of floor", []),
        ("o in filled", [("mug",)]),
        ("o, f in placements", [("mug", "oven")]),
    ],
)
def test_attributes_and_kinds_choose_among_the_members(section, text, rows):
    assert list(rows_of(read_for_each(section(f"for_each: {text}")), BINDING)) == rows


def test_several_clauses_give_every_combination_of_different_entities(section):
    file = section("for_each:\n  o: things with fragile\n  p: things of mug or knife")
    assert rows_of(read_for_each(file), BINDING) == (
        ("mug", "knife"),
        ("mug", "vase"),
        ("vase", "mug"),
        ("vase", "knife"),
    )


def test_a_fixture_of_an_unknown_kind_has_no_attributes_that_could_be_asked_for(section):
    odd = Binding(fixtures=("robot_mower",), kinds={"robot_mower": "Mower"})
    assert rows_of(read_for_each(section("for_each: f in fixtures")), odd) == (("robot_mower",),)
    with pytest.raises(TraceError, match=r"kind of fixture 'Mower' has no row in objects\.yaml"):
        rows_of(read_for_each(section("for_each: f in fixtures with sharp")), odd)


def test_every_relation_has_one_or_two_variables():
    assert set(RELATIONS.values()) == {1, 2}
