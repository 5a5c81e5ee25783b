"""Everything in which an episode differs from the one that its task and seed give."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from pytest_safemanip.rollouts.disturbances.definition import Disturbance
from pytest_safemanip.rollouts.disturbances.definition import to_plain as disturbances_to_plain
from pytest_safemanip.rollouts.disturbances.of_observations import Calibration
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.staging import Cameras, Change, Move, to_plain


@dataclass(frozen=True)
class Situation:
    """What is otherwise in an episode; nothing by default.

    Attributes:
        changes: how it begins.
        objects: role to the categories that the object is drawn from.
        kitchen: see :class:`~pytest_safemanip.sim.backend.Request`; empty for the usual one.
        style: likewise.
        prompt: the prompt template; empty for that of the run.
        disturbances: what goes wrong while it runs.
    """

    changes: tuple[Change, ...] = ()
    objects: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    kitchen: str = ""
    style: str = ""
    prompt: str = ""
    disturbances: tuple[Disturbance, ...] = ()

    def changed(self, change: Change) -> Situation:
        """With one change more; one that moves the same as an earlier one is added to that."""
        for place, own in enumerate(self.changes):
            if (joined := _joined(own, change)) is not None:
                rest = (*self.changes[:place], joined, *self.changes[place + 1 :])
                return replace(self, changes=rest)
        return replace(self, changes=(*self.changes, change))

    def disturbed(self, disturbance: Disturbance) -> Situation:
        """With one disturbance more; wrong calibrations add up."""
        if isinstance(disturbance, Calibration):
            others = tuple(own for own in self.disturbances if not isinstance(own, Calibration))
            offsets = [own.offset for own in self.disturbances if isinstance(own, Calibration)]
            x, y, z = (sum(values) for values in zip(disturbance.offset, *offsets, strict=True))
            return replace(self, disturbances=(*others, Calibration((x, y, z))))
        return replace(self, disturbances=(*self.disturbances, disturbance))

    def request(self, plain: Request) -> Request:
        """The request for an episode that is otherwise in these things."""
        return replace(
            plain,
            changes=(*plain.changes, *self.changes),
            object_groups={**plain.object_groups, **self.objects},
            kitchen=self.kitchen or plain.kitchen,
            style=self.style or plain.style,
        )

    def to_plain(self) -> dict[str, Any]:
        """Plain values, as in a key."""
        return {
            "changes": to_plain(self.changes),
            "objects": {role: list(names) for role, names in self.objects.items()},
            "kitchen": self.kitchen,
            "style": self.style,
            "prompt": self.prompt,
            "disturbances": disturbances_to_plain(self.disturbances),
        }


def _joined(own: Change, more: Change) -> Change | None:
    """Two changes as one; None if they are about different things."""
    if isinstance(own, Move) and isinstance(more, Move) and own.role == more.role:
        by = (own.by[0] + more.by[0], own.by[1] + more.by[1])
        return dataclasses.replace(own, by=by, turn=own.turn + more.turn)
    if isinstance(own, Cameras) and isinstance(more, Cameras):
        x, y, z = (a + b for a, b in zip(own.by, more.by, strict=True))
        return dataclasses.replace(own, by=(x, y, z), turn=own.turn + more.turn)
    return None
