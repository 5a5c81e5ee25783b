"""How an episode may differ from the one that a task and a seed give: what stands elsewhere or is
there beside it, what is open, how the arm begins, what cameras see, which objects are drawn.
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
SHOULDER = 1.25
"""About the height, m, at which an arm on a mobile base reaches into a shelf best."""


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
        interior: which interior of the fixture, by name; empty for the lowest. Of those that a
            pattern such as ``fridge_shelf*`` matches, it is the one whose floor is nearest to 1.25
            m: kitchens differ in how many shelves a fridge has.
        across: whether it is first turned about the vertical until its longer side lies across the
            base's forward direction: a seed's own heading lets a pot's handles point anywhere.
        from_edge: whether its offset forward counts from the edge of the interior's floor on the
            robot's side: kitchens differ in how deep their shelves are.
    """

    role: str
    relation: Relation
    target: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float] = (0.0, 0.0)
    interior: str = ""
    across: bool = False
    from_edge: bool = False


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


@dataclass(frozen=True)
class Move:
    """Moves an object from where its seed put it, on the same level.

    Attributes:
        role: the object.
        by: along the base's forward and left directions (2,), m.
        turn: about the vertical, degrees.
    """

    role: str
    by: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0


@dataclass(frozen=True)
class Add:
    """Puts one thing more beside an object; its role is ``added_1``, ``added_2``, ... in the order
    of these changes and :class:`Store`.

    Attributes:
        category: what it is drawn from.
        beside: role of the object.
        by: from the middle of that, along the base's forward and left directions (2,), m.
    """

    category: str
    beside: str
    by: tuple[float, float]


@dataclass(frozen=True)
class Store:
    """Puts one thing more into a fixture, on that of its floors that an arm reaches best; its role
    is counted with those of :class:`Add`.

    Attributes:
        category: what it is drawn from.
        fixture: role of the fixture.
        out: how far it stands out over the floor's edge on the robot's side, m; less than 0 if it
            stands behind the edge.
        left: of the floor's middle along the base's left direction, m.
    """

    category: str
    fixture: str
    out: float = 0.0
    left: float = 0.0


@dataclass(frozen=True)
class Posture:
    """Begins with the arm's joints turned away from where they would be.

    Attributes:
        size: root mean square over the joints, rad; the seed draws the direction.
    """

    size: float


@dataclass(frozen=True)
class Cameras:
    """Moves and turns the cameras that are not on a hand.

    Attributes:
        by: along the base's forward, left and up directions (3,), m.
        turn: about the vertical, degrees.
    """

    by: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: float = 0.0


@dataclass(frozen=True)
class Light:
    """Makes all lights brighter or darker.

    Attributes:
        factor: of their brightness.
    """

    factor: float


Change = Put | SetOpen | Fill | Push | Move | Add | Store | Posture | Cameras | Light


@dataclass(frozen=True)
class Staging:
    """All changes to an episode.

    Attributes:
        changes: in the order in which they are made.
        objects: role to the categories or groups that the object is drawn from.
    """

    changes: tuple[Change, ...] = ()
    objects: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


KINDS: Mapping[str, type[Change]] = {
    "put": Put,
    "open": SetOpen,
    "fill": Fill,
    "push": Push,
    "move": Move,
    "add": Add,
    "store": Store,
    "posture": Posture,
    "cameras": Cameras,
    "light": Light,
}
"""Changes by name; a backend declares those that it can make."""


def kind_of(change: Change) -> str:
    """The name of a change's kind."""
    return next(name for name, kind in KINDS.items() if isinstance(change, kind))


def to_plain(changes: Iterable[Change]) -> list[dict[str, Any]]:
    """Plain values, as in a message or a key."""
    return [{"kind": kind_of(c), **dataclasses.asdict(c)} for c in changes]


def from_plain(values: object) -> tuple[Change, ...]:
    """The inverse of :func:`to_plain`, of values that anybody may have written.

    Raises:
        ConfigError: if they are no changes.
    """
    if not isinstance(values, list | tuple) or len(values) > MOST:
        raise ConfigError(f"changes of an episode: expected a list of at most {MOST}")
    return tuple(map(_change, values))


def _change(value: object) -> Change:
    if not isinstance(value, Mapping) or value.get("kind") not in tuple(KINDS):
        known = ", ".join(KINDS)
        raise ConfigError(f"changes of an episode: expected one of {known}, found {value!r}")
    kind = KINDS[value["kind"]]
    fields = {name: _plain(x) for name, x in value.items() if name != "kind"}
    try:
        change = kind(**fields)
    except TypeError as error:
        raise ConfigError(f"changes of an episode: {value!r}: {error}") from error
    for part in dataclasses.fields(kind):
        if not _fits(getattr(change, part.name), str(part.type), part.name):
            raise ConfigError(f"changes of an episode: {part.name} of {value!r}")
    return change


def _plain(value: object) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _fits(value: object, declared: str, name: str) -> bool:
    """Whether a field may have a value, by the type that it is declared with, and by its name."""
    if name == "count":
        return type(value) is int and 1 <= value <= MOST_PARTICLES
    if name == "radius":
        return isinstance(value, int | float) and 1e-3 <= value <= 0.05
    if name == "liquid":
        return isinstance(value, str) and LIQUID_NAME.fullmatch(value) is not None
    if declared == "Relation":
        return value in get_args(Relation)
    if declared == "float":
        return _number(value)
    if declared.startswith("tuple"):
        count = declared.count("float")
        return isinstance(value, tuple) and len(value) == count and all(map(_number, value))
    return isinstance(value, {"str": str, "bool": bool}[declared])


def _number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value)
