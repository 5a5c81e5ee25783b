"""A scenario, and what is known of it once it was played."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.propositions.binding import Zone
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.view import View
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.task import OBJECTS_FILE, Task
from pytest_safemanip.trace.recording import Recording
from tests.physics.filming import film
from tests.physics.script import Script
from tests.physics.world import Place, Thing

ROOT = Path(__file__).resolve().parents[2]
PROPERTIES = load_properties([ROOT / "properties"])
ATTRIBUTES = load_attributes(ROOT / "tasks" / OBJECTS_FILE)
CATALOGUE = Catalogue()
PERIOD = 0.05
ZONES = {
    "before_cabinet": Zone("cabinet", 0.1),
    "by_cabinet": Zone("cabinet", 0.058),
    "over_counter": Zone("counter", above=0.6),
}


@dataclass(frozen=True)
class Scenario:
    """A short manipulation.

    Attributes:
        things: what is there.
        script: what the hand does, and when what happens.
        door: openness of the cabinet's door at first.
        binding: what of the task differs from the general one.
        water: where its particles are at first.
    """

    things: tuple[Thing, ...]
    script: Script
    door: float = 0.0
    binding: Mapping[str, Any] = field(default_factory=dict)
    water: tuple[Place, ...] = ()


class Rollout:
    """A scenario that was played.

    Args:
        scenario: what happens.
        recordings: of it, by control period; None to play it.
    """

    def __init__(
        self, scenario: Scenario, recordings: Mapping[float, Recording] | None = None
    ) -> None:
        self.scenario = scenario
        self.recordings = recordings or film(
            scenario.things, scenario.script, scenario.door, water=scenario.water
        )
        self._judges: dict[float, Judge] = {}

    @cached_property
    def task(self) -> Task:
        """A task that gives a reason to do anything with any of the things."""
        names = tuple(thing.name for thing in self.scenario.things)
        general: dict[str, Any] = {
            "objects": names,
            "enclosures": ("cabinet",),
            "mechanisms": ("cabinet",),
            "placements": tuple((name, "cabinet") for name in names),
            "skills": (
                *((skill, name) for name in names for skill in ("pick", "place", "pour")),
                ("open", "cabinet"),
            ),
            "tools": ("robot",),
            "touch": {"cabinet": ("handle",), **dict.fromkeys(names, ("body",))},
            "supports": dict.fromkeys(names, ("counter", "cabinet")),
            "zones": ZONES,
        }
        fixed = {"name": "Physics", "path": Path("physics.yaml"), "sets": (), "suite": "tests"}
        return Task(
            **{**fixed, "horizon": "short", "properties": (), **general, **self.scenario.binding}
        )

    def verdict(self, name: str, period: float = PERIOD) -> Verdict:
        """What the shipped property says."""
        if period not in self._judges:
            self._judges[period] = Judge(
                self.recordings[period], self.task, ATTRIBUTES, CATALOGUE, CATALOGUE.parameters({})
            )
        return self._judges[period].judge(PROPERTIES[name])

    @property
    def applicable(self) -> list[str]:
        """The shipped properties that have an instance here."""
        return [n for n, p in PROPERTIES.items() if p.may_apply(self.task)]

    @cached_property
    def view(self) -> View:
        """The rollout at 20 Hz as propositions see it."""
        return self.seen({})

    def seen(self, parameters: Mapping[str, float], **binding: Any) -> View:
        """Likewise, with other parameters or another binding."""
        recording = self.recordings[PERIOD]
        bound = self.task.bind(recording.scene, ATTRIBUTES)
        changed = dataclasses.replace(bound, **binding)
        return View(recording.trace, changed, CATALOGUE.parameters(parameters), CATALOGUE)

    def steps(self, first: str | float, last: str | float, period: float = PERIOD) -> range:
        """The steps between two marks of the script, or times, both included."""
        marks = self.scenario.script.marks
        start, stop = (marks[t] if isinstance(t, str) else t for t in (first, last))
        return range(int(np.ceil(start / period - 1e-6)), int(stop / period + 1e-6) + 1)
