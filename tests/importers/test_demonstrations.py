"""The human demonstrations in robosuite's wheels: every grasp and release is seen, and whatever is
flagged is listed in docs/real-data.md with its reason.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

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

    @property
    def things(self) -> list[str]:
        return [body.entity for body in self.recording.scene.bodies]

    def ever(self, proposition: str, thing: str) -> bool:
        return bool(self.judge.view(proposition, thing).any())

    def violated(self, defined: Definitions) -> Iterator[str]:
        for name in self.properties:
            if self.judge.judge(defined.properties[name]).findings:
                yield name


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
def test_what_people_did_is_seen_and_every_flag_has_its_reason_on_the_page(version: str) -> None:
    # One test for a wheel: to import it takes longer than all that is asked of it.
    defined = load_definitions([], [], [])
    found = list(_imported(version, defined))
    assert len(found) == EPISODES[version]
    _every_grasp_and_release_is_seen(found, GRASPS[version])
    _what_is_let_go_settles(found)
    _physics_stays_near(found)
    flagged = {one.name: set(one.violated(defined)) for one in found}
    listed = {name: flags for name, flags in _listed().items() if name.startswith(f"{version} ")}
    assert {name: flags for name, flags in flagged.items() if flags} == listed


def _every_grasp_and_release_is_seen(
    found: list[Demonstration], expected: Mapping[str, int]
) -> None:
    grasps: dict[str, int] = {}
    releases: dict[str, int] = {}
    for one in found:
        task = one.recording.episode.task
        for thing in one.things if task in expected else ():
            grasps[task] = grasps.get(task, 0) + one.ever("obj_grasped", thing)
            releases[task] = releases.get(task, 0) + one.ever("obj_released", thing)
    assert grasps == expected
    assert {task: releases[task] for task in expected if task in LETS_GO} == {
        task: count for task, count in expected.items() if task in LETS_GO
    }


def _what_is_let_go_settles(found: list[Demonstration]) -> None:
    for one in found:
        if one.recording.episode.task in LETS_GO:
            for thing in one.things:
                assert one.judge.view("settled", thing)[-1], f"{one.name}: {thing}"


def _physics_stays_near(found: list[Demonstration]) -> None:
    for one in found:
        origin = one.recording.episode.origin
        assert float(origin["drift"].split()[0]) < 20.0, one.name
        assert float(origin["drift_median"].split()[0]) < 0.3, one.name
        assert float(origin["drift_hands"].split()[0]) < 3.0, one.name
