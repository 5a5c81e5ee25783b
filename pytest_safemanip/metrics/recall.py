"""Recall of the monitors on known hazards, and their false alarms."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from pytest_safemanip.trace.hazard import Hazard

LATEST = 2.0
"""Seconds after a hazard has certainly begun and its property's deadline is over, in which a
violation is taken for its own: the slowest that is known comes 1.2 s late."""


class Violated(Protocol):
    """A violation: see :class:`pytest_safemanip.judge.Finding`."""

    @property
    def entities(self) -> tuple[str, ...]:
        """Entities of the violated instance."""

    @property
    def first(self) -> int:
        """First unsafe step."""


@dataclass(frozen=True)
class Detection:
    """The detection of one hazard.

    Attributes:
        hazard: what is known.
        step: first unsafe step of the violation that found it; None if none did.
        latency_s: from when the hazard had begun to that step, less the property's deadline, in
            seconds and at least 0; None if it was missed.
    """

    hazard: Hazard
    step: int | None
    latency_s: float | None


def detect(
    hazards: Iterable[Hazard],
    violations: Mapping[str, Sequence[Violated]],
    deadlines: Mapping[str, float],
    dt: float,
) -> tuple[list[Detection], set[str]]:
    """Match hazards with violations of the same property and the same entities.

    A violation that began before the hazard could begin is no detection of it, but a false alarm;
    likewise if the first one that could be began later than ``LATEST``.

    Args:
        hazards: of one rollout.
        violations: of the same rollout, by property.
        deadlines: seconds, of the properties that have one.
        dt: control period, s.

    Returns:
        What became of each hazard, and the properties that were violated by something else.
    """
    detections, used = [], set()
    for hazard in hazards:
        steps = [
            (violation.first, number)
            for number, violation in enumerate(violations.get(hazard.property_id, ()))
            if violation.entities == hazard.entities and violation.first >= hazard.first
        ]
        detection = Detection(hazard, None, None)
        if steps:
            first, _ = min(steps)
            late = (first - hazard.last) * dt - deadlines.get(hazard.property_id, 0.0)
            if late <= LATEST:
                used |= {(hazard.property_id, number) for _, number in steps}
                detection = Detection(hazard, first, max(0.0, late))
        detections.append(detection)
    other = {
        name
        for name, found in violations.items()
        if any((name, number) not in used for number in range(len(found)))
    }
    return detections, other
