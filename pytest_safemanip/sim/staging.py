"""How an episode may differ from the one that a task and a seed give: what is put elsewhere, what
is open, which objects are drawn.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from pytest_safemanip.errors import ConfigError

Relation = Literal["in", "on", "beside"]
MOST = 200
"""Changes of one episode."""
MOST_PARTICLES = 200
"""Of a liquid: each is a body that moves freely."""
LIQUID_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True)
class Put:
    """Moves an object before the episode begins.

    Attributes:
        role: the object.
        relation: ``in`` an interior of a fixture, ``on`` top of an object, ``beside`` one.
        target: role of that fixture or object.
        offset: from the middle of the interior's floor or of the object, along the base's forward,
            left and up directions (3,), m.
        turn: rotation that it gets, from how its task would stand it: degrees about the base's
            left direction, then about the vertical (2,).
        interior: which interior of the fixture, by name; empty for the lowest.
        across: whether it is first turned about the vertical until its longer side lies across the
            base's forward direction: a seed's own heading lets a pot's handles point anywhere.
    """

    role: str
    relation: Relation
    target: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float] = (0.0, 0.0)
    interior: str = ""
    across: bool = False


@dataclass(frozen=True)
class SetOpen:
    """Sets doors, drawers or controls before the episode begins.

    Attributes:
        role: the fixture.
        openness: 0 closed, 1 open.
        joint: name of one joint of it; empty for all of its doors and drawers.
    """

    role: str
    openness: float
    joint: str = ""


@dataclass(frozen=True)
class Fill:
    """Fills an object with a liquid before the episode begins: with small balls.

    Attributes:
        liquid: its name, a role of the episode.
        role: the object.
        count: number of balls, at most :data:`MOST_PARTICLES`.
        radius: of each, m.
    """

    liquid: str
    role: str
    count: int = 24
    radius: float = 0.006


@dataclass(frozen=True)
class Push:
    """Lets an object move when the episode begins.

    Attributes:
        role: the object.
        velocity: along the base's forward and left directions (2,), m/s. A round one rolls.
    """

    role: str
    velocity: tuple[float, float] = (0.0, 0.0)


Change = Put | SetOpen | Fill | Push


@dataclass(frozen=True)
class Staging:
    """All changes to an episode.

    Attributes:
        changes: in the order in which they are made.
        objects: role to the categories or groups that the object is drawn from.
    """

    changes: tuple[Change, ...] = ()
    objects: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


_KINDS: Mapping[str, type[Put] | type[SetOpen] | type[Fill] | type[Push]] = {
    "put": Put,
    "open": SetOpen,
    "fill": Fill,
    "push": Push,
}


def to_plain(changes: Iterable[Change]) -> list[dict[str, Any]]:
    """Plain values, as in a message or a key."""
    names = {kind: name for name, kind in _KINDS.items()}
    return [{"kind": names[type(c)], **dataclasses.asdict(c)} for c in changes]


def from_plain(values: object) -> tuple[Change, ...]:
    """The inverse of :func:`to_plain`, of values that anybody may have written.

    Raises:
        ConfigError: if they are no changes.
    """
    if not isinstance(values, list | tuple) or len(values) > MOST:
        raise ConfigError(f"changes of an episode: expected a list of at most {MOST}")
    return tuple(map(_change, values))


def _change(value: object) -> Change:
    if not isinstance(value, Mapping) or value.get("kind") not in tuple(_KINDS):
        raise ConfigError(f"changes of an episode: expected {' or '.join(_KINDS)}, found {value!r}")
    kind = _KINDS[value["kind"]]
    fields = {name: _plain(x) for name, x in value.items() if name != "kind"}
    try:
        change = kind(**fields)
    except TypeError as error:
        raise ConfigError(f"changes of an episode: {value!r}: {error}") from error
    for part in dataclasses.fields(kind):
        if not _fits(getattr(change, part.name), part.default, part.name):
            raise ConfigError(f"changes of an episode: {part.name} of {value!r}")
    return change


def _plain(value: object) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _fits(value: object, default: object, name: str) -> bool:
    """Whether a field may have a value, by that which it has without one."""
    if name == "relation":
        return value in get_args(Relation)
    if name == "openness":
        return _number(value)
    if name == "count":
        return type(value) is int and 1 <= value <= MOST_PARTICLES
    if name == "radius":
        return isinstance(value, int | float) and 1e-3 <= value <= 0.05
    if name == "liquid":
        return isinstance(value, str) and LIQUID_NAME.fullmatch(value) is not None
    if isinstance(default, tuple):
        return isinstance(value, tuple) and len(value) == len(default) and all(map(_number, value))
    return isinstance(value, type(default) if isinstance(default, bool) else str)


def _number(value: object) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)
