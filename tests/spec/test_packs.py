from __future__ import annotations

from pathlib import Path

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.resources import folder
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.spec.packs import load_packs
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.tasks import load_staged, load_tasks

SHIPPED = folder("properties")
PACKS = load_packs(SHIPPED)
PACK = """\
pack: house-rules
title: What our house asks
source: house rules
about: All of it.
not_expressed:
  Manners: nobody measures them
"""
RULE = """\
id: house_rules_quiet
category: manners
title: Nothing falls
source: house rules, 1
for_each: o in things
pattern: absence(fallen)
atoms:
  fallen: fallen(o)
"""


@pytest.fixture
def packs(tmp_path: Path) -> Path:
    place = tmp_path / "packs" / "house-rules"
    place.mkdir(parents=True)
    (place / "pack.yaml").write_text(PACK)
    (place / "quiet.yaml").write_text(RULE)
    return place


def test_a_pack_is_a_folder_of_rules_and_their_description(packs):
    (pack,) = load_packs(packs.parents[1]).values()
    assert (pack.name, pack.title) == ("house-rules", "What our house asks")
    assert pack.not_expressed == {"Manners": "nobody measures them"}
    assert {id_: rule.pack for id_, rule in pack.rules.items()} == {
        "house_rules_quiet": "house-rules"
    }


def test_the_ids_of_a_pack_begin_with_its_name(packs):
    (packs / "quiet.yaml").write_text(RULE.replace("house_rules_quiet", "quiet"))
    with pytest.raises(ConfigError, match=r"quiet\.yaml: id 'quiet' does not begin with 'house_"):
        load_packs(packs.parents[1])


def test_a_rule_is_in_one_pack(packs):
    other = packs.with_name("house")
    other.mkdir()
    (other / "pack.yaml").write_text(PACK.replace("house-rules", "house"))
    (other / "rules_quiet.yaml").write_text(RULE)
    with pytest.raises(ConfigError, match="pack:house has a rule 'house_rules_quiet', too"):
        load_packs(packs.parents[1])


def test_a_pack_has_the_name_of_its_folder(packs):
    (packs / "pack.yaml").write_text(PACK.replace("house-rules", "home"))
    with pytest.raises(ConfigError, match=r"pack\.yaml:1: .*expected 'house-rules', .*'home'"):
        load_packs(packs.parents[1])


def test_a_pack_is_not_called_what_selects_no_pack(packs):
    other = packs.with_name("default")
    packs.rename(other)
    (other / "pack.yaml").write_text(PACK.replace("house-rules", "default"))
    with pytest.raises(ConfigError, match=r"pack.yaml:1: .*'default' selects the properties of no"):
        load_packs(packs.parents[1])


def test_a_pack_has_rules(packs):
    (packs / "quiet.yaml").unlink()
    with pytest.raises(ConfigError, match=r"pack.yaml:1: .*'house-rules' has no rules; add some"):
        load_packs(packs.parents[1])


def test_packs_of_ones_own_folder_are_not_passed_over(packs):
    place = packs.parents[1]
    with pytest.raises(ConfigError, match=f"{packs}/pack.yaml: packs are read from .* only; name"):
        load_definitions([], [place], [])
    (packs / "pack.yaml").unlink()
    assert "house_rules_quiet" in load_definitions([], [packs], []).properties


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("task: PickPlaceCounterToCabinet\n", r"Own.yaml:1: a task of a pack stages the scene of"),
        (
            "task: OpenDrawer\nbase: PickPlaceCounterToCabinet\nsets: [own]\nsuite: own\n",
            "task 'OpenDrawer' is in .* and .*Own.yaml",
        ),
    ],
)
def test_a_task_of_a_pack_is_staged_and_has_a_name_of_its_own(tmp_path, text, message):
    (tmp_path / "Own.yaml").write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_staged([tmp_path], load_tasks([folder("tasks")]), [tmp_path])


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("house-rules/loud.yml", "loud.yml: only *.yaml is read; rename it to 'loud.yaml'"),
        ("house-rules/.loud.yaml", ".loud.yaml: hidden files are not read; rename it, or take it"),
        ("other/loud.yaml", "other: a pack without pack.yaml; add one, with pack: other"),
        ("other/pack.yml", "pack.yml: only *.yaml is read; rename it to 'pack.yaml'"),
        (".other/pack.yaml", ".other: hidden folders are not read; rename it, or take it away"),
        ("loud.yaml", "loud.yaml: belongs to no pack; put it into the folder of one"),
        (
            "house-rules/task/Own.yaml",
            "task: of the folders in a pack only 'tasks' is read; rename",
        ),
    ],
)
def test_no_file_of_a_pack_is_passed_over(packs, file, message):
    path = packs.parent / file
    path.parent.mkdir(exist_ok=True)
    path.write_text(RULE)
    with pytest.raises(ConfigError) as caught:
        load_packs(packs.parents[1])
    assert message in str(caught.value)


@pytest.mark.parametrize("name", ["loud.yml", "loud.YAML", ".loud.yaml"])
def test_of_properties_and_tasks_no_file_is_passed_over_either(tmp_path, name):
    (tmp_path / name).write_text(RULE)
    message = rf"{name}: (only \*.yaml is|hidden files are not) read"
    for paths in (([tmp_path], []), ([], [tmp_path])):
        with pytest.raises(ConfigError, match=message):
            load_definitions(*paths, [])


def test_rules_of_packs_stand_beside_those_of_the_release():
    release = load_properties([SHIPPED])
    rules = {id_: rule for pack in PACKS.values() for id_, rule in pack.rules.items()}
    assert not release.keys() & rules.keys()
    # Who selects a category of the release gets the release's properties, and no others.
    assert not {p.category for p in release.values()} & {p.category for p in rules.values()}
    found = load_definitions([], [], [])
    assert found.properties.keys() == release.keys() | rules.keys()
    assert found.everywhere.keys() == rules.keys()


@pytest.mark.parametrize("pack", PACKS.values(), ids=list(PACKS))
def test_a_rule_lies_in_a_file_of_its_name(pack):
    assert pack.rules
    prefix = f"{pack.name.replace('-', '_')}_"
    assert {rule.path.stem for rule in pack.rules.values()} == {
        id_.removeprefix(prefix) for id_ in pack.rules
    }
    assert len({rule.title for rule in pack.rules.values()}) == len(pack.rules)
