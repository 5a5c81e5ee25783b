"""What a video shows beside the scene, as plain data that can be given to another process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from pytest_safemanip.errors import printable
from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.report.lanes import Lane, Span, telling_lanes
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.trace.recording import Recording

MOST_LANES = 9
LONGEST_LABEL = 44
"""Characters."""


@dataclass(frozen=True)
class Storyboard:
    """The captions and lanes of one recording.

    Attributes:
        title: what was run.
        period: control period, s.
        length: number of steps.
        acting: number of steps before the settle tail.
        lanes: propositions over time.
        violations: what is violated, and its unsafe steps, by first step.
    """

    title: str
    period: float
    length: int
    acting: int
    lanes: tuple[Lane, ...]
    violations: tuple[tuple[str, Span], ...]

    def unsafe(self, first: int, last: int) -> list[str]:
        """What is violated at some of these steps."""
        found = (name for name, (a, b) in self.violations if a <= last and first <= b)
        return list(dict.fromkeys(found))

    def to_json(self) -> dict[str, Any]:
        """Plain builtins."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Storyboard:
        """What :meth:`to_json` gave."""
        lanes = tuple(
            Lane(lane["label"], tuple((a, b) for a, b in lane["spans"])) for lane in data["lanes"]
        )
        violations = tuple((name, (a, b)) for name, (a, b) in data["violations"])
        return cls(**{**data, "lanes": lanes, "violations": violations})


def storyboard(
    recording: Recording,
    judge: Judge,
    properties: Mapping[str, Property],
    verdicts: Mapping[str, Verdict],
) -> Storyboard:
    """The storyboard of a recording that was judged.

    Args:
        recording: what happened.
        judge: of the recording.
        properties: those that were judged, by id.
        verdicts: by id.
    """
    episode = recording.episode
    found = [(id_, (f.first, f.last)) for id_, v in verdicts.items() for f in v.findings]
    lanes = telling_lanes(judge, properties, verdicts, MOST_LANES)
    return Storyboard(
        title=printable(f"{episode.task}, {episode.policy}, seed {episode.seed}", 100),
        period=recording.scene.control_period,
        length=len(recording.steps),
        acting=recording.acting,
        lanes=tuple(Lane(printable(lane.label, LONGEST_LABEL), lane.spans) for lane in lanes),
        violations=tuple(sorted(found, key=lambda one: one[1])),
    )
