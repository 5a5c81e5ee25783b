"""How an episode may differ from the one that a task and a seed give: what is put elsewhere, what
is open, which objects are drawn.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal


@dataclass(frozen=True)
class Put:
    """An object stands elsewhere when the episode begins.

    Attributes:
        role: the object.
        relation: ``in`` an interior of a fixture, ``on`` top of an object, ``beside`` one.
        target: role of that fixture or object.
        offset: from the middle of the interior's floor or of the object, along the base's forward,
            left and up directions (3,), m.
        turn: rotation that it gets, from how its task would stand it: degrees about the base's
            left direction, then about the vertical (2,).
        interior: which interior of the fixture, by name; empty for the lowest.
    """

    role: str
    relation: Literal["in", "on", "beside"]
    target: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float] = (0.0, 0.0)
    interior: str = ""


@dataclass(frozen=True)
class SetOpen:
    """Doors, drawers or controls stand elsewhere when the episode begins.

    Attributes:
        role: the fixture.
        openness: 0 closed, 1 open.
        joint: name of one joint of it; empty for all of its doors and drawers.
    """

    role: str
    openness: float
    joint: str = ""


Change = Put | SetOpen


@dataclass(frozen=True)
class Staging:
    """All changes to an episode.

    Attributes:
        changes: in the order in which they are made.
        objects: role to the categories or groups that the object is drawn from.
    """

    changes: tuple[Change, ...] = ()
    objects: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


_KINDS: Mapping[str, type[Put] | type[SetOpen]] = {"put": Put, "open": SetOpen}


def to_plain(changes: Iterable[Change]) -> list[dict[str, Any]]:
    """Plain values, as in a message or a key."""
    names = {kind: name for name, kind in _KINDS.items()}
    return [{"kind": names[type(c)], **dataclasses.asdict(c)} for c in changes]


def from_plain(values: Iterable[Mapping[str, Any]]) -> tuple[Change, ...]:
    """The inverse of :func:`to_plain`."""
    return tuple(_KINDS[v["kind"]](**{k: _tuple(x) for k, x in v.items() if k != "kind"})
                 for v in values)  # fmt: skip


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
