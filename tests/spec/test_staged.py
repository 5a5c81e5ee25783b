"""Tasks that stage the scene of another."""

from __future__ import annotations

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.run.scenes import changes_of, groups_of
from pytest_safemanip.sim.staging import MOST, Fill, Push, Put, SetOpen
from pytest_safemanip.spec.staged import MOST_LIQUIDS, MOST_STAGED
from pytest_safemanip.spec.tasks import load_staged, load_tasks

BASE = """\
task: PutAway
sets: [quick]
suite: storing
horizon: short
objects: [obj]
hot: [obj]
properties: [release_stability]
compact:
  object_groups:
    obj: [mug]
    other: [apple]
"""
STAGED = """\
task: RollingAppleWhilePuttingAway
base: PutAway
sets: [risks]
suite: risky
hot: [other]
liquids: {water: obj}
staging:
  other: {drawn: [orange], beside: obj, forward: 0.1, left: -0.2, turn: 90, speed_left: -1.5}
  cab: {open: 0.5, joint: left}
  pan: {drawn: [pan]}
  drawer: {open: 1}
"""


@pytest.fixture
def written(tmp_path):
    def written(old="", new="", text=STAGED):
        assert old in text
        (tmp_path / "base.yaml").write_text(BASE)
        path = tmp_path / "staged.yaml"
        path.write_text(text.replace(old, new) if old else text)
        return path

    return written


def staged(path):
    bases = load_tasks([path.parent])
    return load_staged([path.parent], bases)


def test_its_keys_stand_for_those_of_its_base(written):
    (task,) = staged(written()).values()
    assert (task.name, task.base, task.simulated) == (
        "RollingAppleWhilePuttingAway",
        "PutAway",
        "PutAway",
    )
    assert (task.sets, task.suite, task.horizon) == (("risks",), "risky", "short")
    assert (task.hot, task.objects, task.properties) == (
        ("other",),
        ("obj",),
        ("release_stability",),
    )
    (base,) = load_tasks([task.path.parent]).values()
    assert (base.simulated, base.staging, base.base) == ("PutAway", (), "")


def test_its_staging_is_what_a_simulator_is_asked_for_and_what_moves_does_last(written):
    (task,) = staged(written()).values()
    assert changes_of(task) == (
        Put("other", "beside", "obj", (0.1, -0.2, 0.0), (0.0, 90.0)),
        SetOpen("cab", 0.5, "left"),
        SetOpen("drawer", 1.0),
        Push("other", (0.0, -1.5)),
        Fill("water", "obj"),
    )


def test_what_it_draws_is_drawn_in_all_scenes(written):
    (task,) = staged(written()).values()
    assert groups_of(task, compact=False) == {"other": ("orange",), "pan": ("pan",)}
    assert groups_of(task, compact=True) == {
        "obj": ("mug",),
        "other": ("orange",),
        "pan": ("pan",),
    }


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("base: PutAway", "base: PutAwy", 2, "unknown task 'PutAwy'; did you mean 'PutAway'?"),
        ("sets: [risks]\n", "", 1, "key 'sets' is missing"),
        ("suite: risky\n", "", 1, "key 'suite' is missing"),
        ("beside: obj", "besides: obj", 8, "'staging.other.besides'; did you mean 'beside'?"),
        (
            "beside: obj",
            "beside: obj, on: pan",
            8,
            "'staging.other': expected one of in, on, beside",
        ),
        ("beside: obj, ", "", 8, "'staging.other': expected one of in, on, beside"),
        (
            "left: -0.2",
            "left: -1e300",
            8,
            "'staging.other.left': expected a number from -10 to 10, found '-1e300'",
        ),
        (
            "beside: obj",
            "beside: obj, from_edge: true",
            8,
            "'staging.other.from_edge': only the floor of an interior has an edge",
        ),
        ("beside: obj", "beside: other", 8, "'staging.other.beside': 'other' cannot be put beside"),
        ("open: 0.5", "open: 5", 9, "'staging.cab.open': expected a number from 0 to 1, found '5'"),
        (
            "left: -0.2",
            "left: far",
            8,
            "'staging.other.left': expected a number from -10 to 10, found 'far'",
        ),
        ("open: 0.5, joint", "open: 0.5, joints", 9, "'staging.cab.joints'; did you mean 'joint'?"),
        ("drawn: [pan]", "drawn: pan", 10, "'staging.pan.drawn': expected a list"),
        (
            "pan: {drawn: [pan]}",
            "obj: {beside: other}",
            8,
            "'staging.other.beside': nothing can stand in a circle: 'other', 'obj', 'other'",
        ),
        (
            "pan: {drawn: [pan]}",
            "obj: {in: cab}",
            8,
            "'staging.other.beside': 'obj' is put elsewhere on line 10; put it first",
        ),
        (
            "base: PutAway",
            "base: RollingAppleWhilePuttingAway",
            2,
            "key 'base': 'RollingAppleWhilePuttingAway' has a 'base' itself",
        ),
    ],
)
def test_a_mistake_is_named_with_file_line_and_remedy(written, old, new, line, message):
    path = written(old, new)
    with pytest.raises(ConfigError) as caught:
        staged(path)
    assert str(caught.value).startswith(f"{path}:{line}: ")
    assert message in str(caught.value)


def test_a_name_that_is_taken_is_refused_with_both_files(written):
    path = written("task: RollingAppleWhilePuttingAway", "task: PutAway")
    with pytest.raises(ConfigError) as caught:
        staged(path)
    assert str(caught.value) == f"task 'PutAway' is in {path.parent / 'base.yaml'} and {path}"


def test_too_many_things_are_refused_with_file_and_limit(written):
    many = "".join(f"  thing{n}: {{open: 1}}\n" for n in range(150))
    path = written("  drawer: {open: 1}\n", many)
    with pytest.raises(ConfigError) as caught:
        staged(path)
    assert str(caught.value) == (
        f"{path}:8: key 'staging': 153 things, of which a task may stage 50; leave some out"
    )
    assert 2 * MOST_STAGED + MOST_LIQUIDS < MOST  # a thing may be put and pushed


def test_a_scene_is_staged_of_a_task_that_has_one_of_its_own(written):
    path = written()
    other = path.with_name("other.yaml")
    other.write_text(
        "task: Again\nbase: RollingAppleWhilePuttingAway\nsets: [risks]\nsuite: risky\n"
    )
    with pytest.raises(ConfigError) as caught:
        staged(path)
    assert str(caught.value) == (
        f"{other}:2: key 'base': 'RollingAppleWhilePuttingAway' has a 'base' itself; name "
        "'PutAway', whose scene that is"
    )


def test_a_staging_without_the_task_that_it_is_of_is_refused(written):
    path = written("base: PutAway\n", "horizon: short\nproperties: []\n")
    with pytest.raises(ConfigError) as caught:
        load_tasks([path.parent])
    assert str(caught.value).startswith(f"{path}:9: key 'staging': there is no 'base'; name the")


def test_a_staged_task_belongs_to_the_backend_of_its_base(tmp_path):
    text = STAGED.replace("base: PutAway", "base: OpenDrawer").replace("water: obj", "")
    (tmp_path / "mine.yaml").write_text(text)
    found = load_definitions([tmp_path], [], [], "robosuite")
    assert "RollingAppleWhilePuttingAway" not in found.runnable
    assert found.elsewhere["RollingAppleWhilePuttingAway"] == "robocasa"


def test_what_staging_draws_may_be_full_and_stays_an_obstacle(written):
    (task,) = staged(written("water: obj", "water: pan")).values()
    assert task.liquids == {"water": "pan"}
    assert "pan" not in task.objects
    assert changes_of(task)[-1] == Fill("water", "pan")
    with pytest.raises(ConfigError, match="'other_pan' is none of the task's objects; put it into"):
        staged(written("water: obj", "water: other_pan"))


def test_users_stage_shipped_tasks_and_those_of_packs_come_with_robocasa_alone(tmp_path):
    text = STAGED.replace("base: PutAway", "base: OpenDrawer").replace("water: obj", "")
    (tmp_path / "mine.yaml").write_text(text)
    runnable = load_definitions([tmp_path], [], []).runnable
    assert runnable["RollingAppleWhilePuttingAway"].mechanisms == ("drawer",)
    assert runnable["KnifeByTarget"].base == "PickPlaceCounterToCabinet"
    assert not any(
        task.base for task in load_definitions([], [], [], "robosuite").runnable.values()
    )
