"""What is read from RoboCasa's source is what RoboCasa says once it runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_safemanip.sim.backend import Backend, Request
from pytest_safemanip.sim.robocasa import fixture_parts, task_source
from pytest_safemanip.trace.elements import BUTTON

KIND_OF_CLASS = {
    "HingeCabinet": "CABINET_WITH_DOOR",
    "FridgeSideBySide": "FRIDGE",
    "BlenderLid": "BLENDER",
    "Box": "COUNTER",
    "Floor": "COUNTER",
    "Wall": "COUNTER",
}
"""Kinds of fixture whose class has another name; walls and boxes are as plain as counters."""


@pytest.fixture
def source() -> Path:
    folder = task_source.environments()
    assert folder is not None
    return folder


def test_the_names_are_those_that_robocasa_registers(source: Path, assets_root: Path) -> None:
    from robocasa.environments.kitchen.kitchen import REGISTERED_KITCHEN_ENVS

    assert task_source.task_names(source) == set(REGISTERED_KITCHEN_ENVS)


@pytest.mark.parametrize(
    ("task", "role", "kinds"),
    [
        ("TurnOnMicrowave", "microwave", {"MICROWAVE"}),
        ("OpenCabinet", "fxtr", {"CABINET_WITH_DOOR"}),  # from the subclass's constructor
        ("PickPlaceCounterToCabinet", "cab", {"CABINET"}),  # from a parameter's default
        ("OpenDrawer", "drawer", {"TOP_DRAWER"}),  # found by what was found before
        ("CloseBlenderLid", "blender", {"BLENDER"}),
        ("OpenDropDownDoor", "fxtr", None),  # no constructor says
    ],
)
def test_the_kinds_of_a_role_are_followed_to_where_they_are_written(
    source: Path, task: str, role: str, kinds: set[str] | None
) -> None:
    assert task_source.fixture_roles(source, task)[role] == kinds


@pytest.mark.parametrize(
    ("task", "roles"),
    [
        ("GarnishPancake", ("distr_fridge", "pancake", "pancake_container", "strawberry")),
        (
            "RecycleBottlesByType",
            (
                "bottle_glass*",
                "bottle_glass_middle",
                "bottle_plastic*",
                "bottle_plastic_middle",
                "mystery_middle",
            ),
        ),
        ("PlaceLidToBoil", ("saucepan", "saucepan_auxiliary")),
        ("TurnOnElectricKettle", ()),
        ("StirVegetables", None),  # other code makes their names
    ],
)
def test_the_objects_of_a_task_are_those_that_it_describes(
    source: Path, task: str, roles: tuple[str, ...] | None
) -> None:
    assert task_source.object_roles(source, task) == roles


def test_objects_are_drawn_from_what_robocasa_has(assets_root: Path) -> None:
    from robocasa.models.objects.kitchen_objects import OBJ_GROUPS

    table = task_source.categories()
    assert table is not None
    assert task_source.object_kinds(table) == set(OBJ_GROUPS)


def test_every_kind_of_fixture_has_parts(assets_root: Path) -> None:
    from robocasa.models.fixtures import FixtureType

    assert set(fixture_parts.KINDS) == {kind.name for kind in FixtureType}


def test_the_parts_of_all_kinds_are_those_that_scenes_are_read_into() -> None:
    from pytest_safemanip.sim.robocasa.parts import MOVING_PARTS

    assert {"body", BUTTON, "door", "drawer", *MOVING_PARTS} == fixture_parts.ANY


def test_the_parts_of_a_full_kitchen_are_declared(backend: Backend) -> None:
    scene = backend.reset(Request("LoadDishwasher", 0, "compact", kitchen="full")).scene
    for part in scene.parts:
        entity = scene.entity[part.entity]
        if entity.kind not in ("fixture", "room"):
            continue
        words = "".join(f"_{c}" if c.isupper() else c for c in entity.category).strip("_")
        kind = KIND_OF_CLASS.get(entity.category, words.upper())
        assert part.name in fixture_parts.KINDS[kind], entity
