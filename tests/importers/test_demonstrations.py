"""The human demonstrations in robosuite's wheels: every grasp and release is seen, and whatever is
flagged is listed in docs/real-data.md with its reason.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.importers.base import ImportOptions
from pytest_safemanip.importers.robosuite.importer import RobosuiteImporter
from pytest_safemanip.importers.source import Source
from pytest_safemanip.judge import Judge
from pytest_safemanip.run.definitions import Definitions, load_definitions
from pytest_safemanip.trace.recording import Recording
from tests.importers.wheels import SHA256, NoWheel, wheel

PAGE = Path(__file__).parents[2] / "docs" / "real-data.md"
GRASPS: Mapping[str, Mapping[str, int]] = {
    "0.1.0": {"Lift": 2, "Stack": 2, "NutAssembly": 4, "PickPlace": 8},
    "1.0.0": {"Lift": 1, "Stack": 1, "NutAssembly": 2, "PickPlace": 4},
    "1.4.0": {"Lift": 3, "TwoArmHandover": 7},
}
"""Objects that people grasped, by eye, in the demonstrations of each task."""
LETS_GO = ("Stack", "NutAssembly", "PickPlace")
"""Tasks in which what was grasped is let go."""
EPISODES = {"0.1.0": 12, "1.0.0": 6, "1.4.0": 11}


@dataclass(frozen=True)
class Demonstration:
    """A demonstration, imported and ready to be judged."""

    name: str
    recording: Recording
    judge: Judge
    properties: tuple[str, ...]

    def violated(self, defined: Definitions) -> Iterator[str]:
        for name in self.properties:
            if self.judge.judge(defined.properties[name]).findings:
                yield name


Demonstrations = Callable[[str], list[Demonstration]]


@pytest.fixture(scope="module")
def defined() -> Definitions:
    return load_definitions([], [], [])


@pytest.fixture(scope="module")
def demonstrations(defined: Definitions) -> Demonstrations:
    """Gives those of a wheel; each is imported once."""
    known: dict[str, list[Demonstration]] = {}

    def get(version: str) -> list[Demonstration]:
        if version not in known:
            known[version] = list(_imported(version, defined))
        return known[version]

    return get


def _imported(version: str, defined: Definitions) -> Iterator[Demonstration]:
    try:
        source = Source(wheel(version))
    except (NoWheel, ConfigError) as error:
        pytest.skip(f"robosuite {version} cannot be had: {error}")
    for episode in RobosuiteImporter().episodes(source, ImportOptions()):
        recording = episode.record(lambda done, total: None)
        task, parameters = defined.tasks[episode.task], defined.catalogue.parameters({})
        judge = Judge(recording, task, defined.attributes, defined.catalogue, parameters, "timed")
        name = f"{version} {episode.task} {episode.seed}"
        yield Demonstration(name, recording, judge, task.properties)


def _listed() -> dict[str, set[str]]:
    """The flags that the page has a reason for: properties by demonstration."""
    found: dict[str, set[str]] = {}
    for name, prop in re.findall(r"^\| (\d\S+ \w+ \d+) \| `(\w+)` \|", PAGE.read_text(), re.M):
        found.setdefault(name, set()).add(prop)
    return found


@pytest.mark.parametrize("version", SHA256)
def test_every_grasp_and_release_of_people_is_seen(
    version: str, demonstrations: Demonstrations
) -> None:
    found, expected = demonstrations(version), GRASPS[version]
    assert len(found) == EPISODES[version]
    grasps: dict[str, int] = {}
    releases: dict[str, int] = {}
    for one in found:
        task = one.recording.episode.task
        for thing in (body.entity for body in one.recording.scene.bodies * (task in expected)):
            if one.judge.view("obj_grasped", thing).any():
                grasps[task] = grasps.get(task, 0) + 1
            if one.judge.view("obj_released", thing).any():
                releases[task] = releases.get(task, 0) + 1
    assert {task: grasps.get(task, 0) for task in expected} == expected
    assert {task: releases.get(task, 0) for task in expected if task in LETS_GO} == {
        task: count for task, count in expected.items() if task in LETS_GO
    }


@pytest.mark.parametrize("version", SHA256)
def test_what_people_let_go_settles(version: str, demonstrations: Demonstrations) -> None:
    for one in demonstrations(version):
        if one.recording.episode.task in LETS_GO:
            for thing in (body.entity for body in one.recording.scene.bodies):
                assert one.judge.view("settled", thing)[-1], f"{one.name}: {thing}"


@pytest.mark.parametrize("version", SHA256)
def test_every_flag_has_its_reason_on_the_page(
    version: str, demonstrations: Demonstrations, defined: Definitions
) -> None:
    found = {one.name: set(one.violated(defined)) for one in demonstrations(version)}
    listed = {name: flags for name, flags in _listed().items() if name.startswith(f"{version} ")}
    assert {name: flags for name, flags in found.items() if flags} == listed


@pytest.mark.parametrize("version", SHA256)
def test_physics_stays_near_what_was_recorded(version: str, demonstrations: Demonstrations) -> None:
    for one in demonstrations(version):
        origin = one.recording.episode.origin
        assert float(origin["drift"].split()[0]) < 71.0, one.name
        assert float(origin["drift_median"].split()[0]) < 1.0, one.name
        assert float(origin["drift_hands"].split()[0]) < 4.0, one.name
        assert np.isfinite(one.recording.steps.contacts.force).all()
