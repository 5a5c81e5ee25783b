"""Failures that are kept."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.search.kinds.catalogue import Kinds
from pytest_safemanip.search.proposing.sampling import SobolSampling
from pytest_safemanip.search.regression import (
    Regression,
    as_dimensions,
    changes_of,
    load_regressions,
)
from pytest_safemanip.sim.staging import SetOpen, Store
from tests.search.pure import dimensions_of

WRITTEN = """
task: Toy
property: release_stability
seed: 3
backend: robocasa
changes:
- {move: obj, along: left, size: -4 cm}
- {push: robot, size: 6 N s, at: 2.5 s, towards: 90 deg}
- {distractor: any, beside: obj, choice: can, forward: 3 cm, left: 5 cm}
- {shut: cab, size: 20 %}
- {obstacle: cab, category: pot, size: 4 cm, left: -6 cm}
"""


def test_what_is_kept_is_the_same_when_it_is_read(tmp_path):
    dimensions = dimensions_of(tmp_path)
    (tmp_path / "kept").mkdir()
    for number, deviation in enumerate(SobolSampling(dimensions, 0).ask(30)):
        path = tmp_path / "kept" / f"{number:02}.yaml"
        changes = changes_of(deviation, dimensions)
        kept = Regression(
            "Toy", "a", number, "robocasa", "compact", changes, "it fails", path, number
        )
        kept.save()
        read = load_regressions(tmp_path / "kept", Kinds())[f"{number:02}"]
        assert read == kept
        assert read.situation == dimensions.situation(deviation)


def test_one_is_written_by_hand(tmp_path):
    (tmp_path / "near.yaml").write_text(WRITTEN)
    kept = load_regressions(tmp_path, Kinds())["near"]
    assert kept.seed == 3
    move, add, shut, store = kept.situation.changes
    assert (move.by, add.by, add.category) == ((0.0, -0.04), (0.03, 0.05), "can")
    assert shut == SetOpen("cab", 0.8)
    assert store == Store("pot", "cab", out=0.04, left=-0.06)
    dimensions, deviation = as_dimensions(kept.changes)
    assert dimensions.say(deviation, lambda role: f"the {role}").endswith(
        "the cab begins 20 % shut and a pot stands 4 cm out of the cab, 6 cm right of its middle"
    )
    (push,) = kept.situation.disturbances
    assert (push.target, push.impulse, push.at) == ("robot", 6.0, 2.5)


def test_without_a_folder_there_are_none(tmp_path):
    assert load_regressions(tmp_path / "nowhere", Kinds()) == {}


def test_another_failure_does_not_take_the_place_of_one_that_is_kept(tmp_path):
    (tmp_path / "near.yaml").write_text(WRITTEN)
    kept = load_regressions(tmp_path, Kinds())["near"]
    other = replace(kept, seed=4)
    assert [own.save_in(tmp_path, "near").name for own in (kept, other, other, kept)] == [
        "near.yaml",
        "near-2.yaml",
        "near-2.yaml",
        "near.yaml",
    ]
    again = replace(other, found="9 of 10", repeat=3)
    assert again.save_in(tmp_path, "near").name == "near-2.yaml"
    assert load_regressions(tmp_path, Kinds())["near-2"].repeat == 3


@pytest.mark.parametrize("name", ["near.yml", ".near.yaml"])
def test_what_would_be_passed_over_is_refused(tmp_path, name):
    (tmp_path / name).write_text(WRITTEN)
    with pytest.raises(ConfigError, match=f"{name}: "):
        load_regressions(tmp_path, Kinds())


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("seed: 3", "seed: -3", "a whole number of at least 0"),
        ("seed: 3", "seed: 3.5", "a whole number of at least 0"),
        ("size: -4 cm", "size: 0 cm", "a size other than 0"),
        ("size: -4 cm", "size: -4 s", "expected a number and a unit"),
        ("size: -4 cm", "", "size"),
        ("towards: 90 deg", "towads: 90 deg", "towads"),
        ("move: obj", "mov: obj", "did you mean 'move'"),
        ("- {move: obj, along: left, size: -4 cm}", "- 4", "expected mappings"),
        ("task: Toy", "task: Toy\nprice: 3", "price"),
    ],
)
def test_what_is_none_is_refused_with_its_place(tmp_path, old, new, message):
    assert old in WRITTEN
    (tmp_path / "near.yaml").write_text(WRITTEN.replace(old, new))
    with pytest.raises(ConfigError, match=rf"near.yaml:\d+: .*{message}"):
        load_regressions(tmp_path, Kinds())
