from __future__ import annotations

from pathlib import Path

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.libero.kinds import KINDS, WORKSPACES
from pytest_safemanip.sim.robocasa import loading
from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.spec.objects import ATTRIBUTES, load_attributes

FILE = Path(__file__).resolve().parents[2] / "tasks" / "objects.yaml"
SHIPPED = load_attributes(FILE)


def test_every_attribute_is_used_and_known():
    used = {attribute for attributes in SHIPPED.values() for attribute in attributes}
    assert used == set(ATTRIBUTES)


def test_nothing_is_both_raw_and_ready_to_eat():
    assert not [name for name, own in SHIPPED.items() if {"raw", "ready_to_eat"} <= own]


@pytest.mark.parametrize(
    ("category", "attributes"),
    [
        ("chicken_breast", {"raw"}),
        ("apple", {"ready_to_eat"}),
        ("egg", {"raw", "fragile"}),
        ("ham", {"ready_to_eat"}),
        ("salami", {"ready_to_eat"}),
        ("knife", {"utensil", "metal", "sharp"}),
        ("digital_scale", {"electrical"}),
        ("liquor", {"liquid", "fragile", "combustible", "flammable"}),
        ("Stove", {"hot_source"}),
        ("Microwave", {"hot_source", "electrical"}),
        ("flat_stove", {"hot_source"}),
        ("aluminum_foil", {"metal"}),
        ("potato", set()),
    ],
)
def test_a_category_has_the_attributes_that_its_safety_depends_on(category, attributes):
    assert SHIPPED[category] == attributes


def test_what_takes_fire_beside_a_flame_does_so_on_a_burner_too():
    assert not [n for n, own in SHIPPED.items() if "flammable" in own and "combustible" not in own]


@pytest.fixture
def robocasa() -> None:
    """RoboCasa, imported with the assets that other tests of this process need."""
    loading.load(prepare_assets(loading.package_assets(), "primitive").root)


@pytest.mark.usefixtures("robocasa")
def test_every_kind_of_fixture_that_robocasa_and_libero_build_has_a_row():
    scenes = pytest.importorskip("robocasa.models.scenes.scene_builder")
    built = {kind.__name__ for kind in scenes.FIXTURES.values()}
    assert {*built, *KINDS, *WORKSPACES} <= set(SHIPPED)


@pytest.mark.usefixtures("robocasa")
def test_every_category_that_robocasa_can_draw_has_a_row():
    kitchen = pytest.importorskip("robocasa.models.objects.kitchen_objects")
    assert set(kitchen.OBJ_CATEGORIES) <= set(SHIPPED)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("categories:\n  egg: [row]\n", 2, "key 'categories.egg': unknown attribute 'row'"),
        ("categories:\n  egg: [row]\n", 2, "did you mean 'raw'?"),
        ("categories:\n  ham: []\n  egg: raw\n", 3, "'categories.egg': expected a list"),
        ("categories:\n  egg: []\n  egg: []\n", 3, "key 'egg' is given twice"),
        ("fixtures:\n  Stove: [hot]\n", 2, "'fixtures.Stove': unknown attribute 'hot'"),
        (
            "categories:\n  stove: []\nfixtures:\n  stove: []\n",
            4,
            "'fixtures.stove': is a category of objects, and a kind of fixtures",
        ),
        ("category: {}\n", 1, "unknown key 'category'; did you mean 'categories'?"),
        ("categories: []\n", 1, "'categories': expected a mapping"),
    ],
)
def test_a_mistake_is_named_with_file_line_and_remedy(tmp_path, text, line, message):
    path = tmp_path / "objects.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load_attributes(path)
    assert str(caught.value).startswith(f"{path}:{line}: ")
    assert message in str(caught.value)
