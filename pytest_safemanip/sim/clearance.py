"""What a script asks before it moves: would anything touch on the way?

Privileged knowledge, for scripts: a simulator that :class:`Foresees` answers from a copy of its
state, and no bit of the episode changes.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import ConfigError

Floats = NDArray[np.float64]

MOST_WAYPOINTS = 1000
STAYS = np.nan
"""Number in a waypoint of what it says nothing about."""


FARTHEST, UNIT = 1000.0, 1e-3
"""Largest coordinate of a waypoint, m; largest deviation of a quaternion's norm from 1."""


def _floats(given: Any) -> Floats:
    return np.asarray(given, np.float64)


def _names(given: Any) -> tuple[str, ...]:
    if isinstance(given, str) or not all(isinstance(name, str) for name in given):
        raise TypeError("expected a tuple of strings")
    return tuple(given)


def _pairs(given: Any) -> tuple[tuple[str, str], ...]:
    pairs = [_names(pair) for pair in given]
    if any(len(pair) != 2 for pair in pairs):
        raise TypeError("expected pairs of strings")
    return tuple((own, other) for own, other in pairs)


_ARRAYS = ("hand", "base", "speed", "tolerance")
_CONVERSIONS: Mapping[str, Callable[[Any], Any]] = {
    **dict.fromkeys(_ARRAYS, _floats),
    **dict.fromkeys(("opening", "margin", "turn_tolerance", "raised"), float),
    **dict.fromkeys(("since", "steps", "begins"), operator.index),
    "held": _names,
    "permits": _pairs,
}
"""By attribute of a path, what makes its type of what is given."""


@dataclass(frozen=True)
class Path:
    """A way that hand and base would go, waypoint after waypoint, from where they are now.

    Attributes:
        hand: poses of the grip point, m and ``wxyz`` (N, 7); a row of ``STAYS`` where the hand
            keeps its pose relative to the base.
        base: place on the floor, m, and heading, rad (N, 3); rows of ``STAYS`` where it stands.
        speed: of the hand, shares of its top speed (N,).
        tolerance: distance from each waypoint that counts as there, m (N,).
        opening: of the fingers, share of the full opening; ``STAYS`` as they are.
        held: entities that move with the hand.
        permits: touches that do not count: how the name of a robot's part begins, or an entity of
            ``held``, and an entity, or ``ENTITY/PART`` with how the name of the part begins; empty
            texts for any.
        since: the waypoint on the way to which they begin to be permitted.
        margin: what is nearer than this counts as touching, m. What is so near at the beginning may
            stay as near.
        turn_tolerance: angle that counts as there, rad.
        steps: control steps to a waypoint at most.
        raised: how much farther the torso is raised from the beginning on, m.
        begins: the waypoint on the way to which touches begin to count: whatever is touched before
            it is ignored.

    Raises:
        ValueError: if the shapes are others or the numbers make no sense.
    """

    hand: Floats
    base: Floats
    speed: Floats
    tolerance: Floats
    opening: float = STAYS
    held: tuple[str, ...] = ()
    permits: tuple[tuple[str, str], ...] = ()
    since: int = 0
    margin: float = 0.005
    turn_tolerance: float = 0.12
    steps: int = 100
    raised: float = 0.0
    begins: int = 0

    def __post_init__(self) -> None:
        self._convert()
        count = len(self.hand) if self.hand.ndim else 0
        shapes = {"hand": (count, 7), "base": (count, 3), "speed": (count,), "tolerance": (count,)}
        for name, shape in shapes.items():
            values = getattr(self, name)
            if values.shape != shape:
                raise ValueError(f"path: {name} has shape {values.shape}, expected {shape}")
        if not 0 < count <= MOST_WAYPOINTS:
            raise ValueError(f"path: {count} waypoints, expected 1 to {MOST_WAYPOINTS}")
        for name in ("hand", "base"):
            values = getattr(self, name)
            known = ~np.isnan(values)
            if (known.any(axis=1) != known.all(axis=1)).any():
                raise ValueError(f"path: a row of {name} is known in part")
            if (np.abs(values[known]) > FARTHEST).any():
                raise ValueError(f"path: a row of {name} is farther away than {FARTHEST:g} m")
        turns = self.hand[~np.isnan(self.hand[:, 0]), 3:]
        if (np.abs(np.linalg.norm(turns, axis=1) - 1.0) > UNIT).any():
            raise ValueError("path: an orientation of hand is no unit quaternion (wxyz)")
        if not (math.isnan(self.opening) or 0.0 <= self.opening <= 1.0):
            raise ValueError(f"path: opening is {self.opening}, expected 0 to 1")
        if not ((self.speed > 0.0) & (self.speed <= 1.0)).all():
            raise ValueError("path: a speed is not in (0, 1]")
        if not math.isfinite(self.raised):
            raise ValueError(f"path: raised is {self.raised}")
        limits = self.margin, *self.tolerance.tolist(), self.turn_tolerance, self.steps
        if not (np.isfinite(limits).all() and min(limits) >= 0):
            raise ValueError(f"path: margin, tolerances and steps are {limits}")

    def _convert(self) -> None:
        """Convert the attributes to their types, such as float32 to float64.

        Raises:
            ValueError: if one cannot be converted.
        """
        for name, convert in _CONVERSIONS.items():
            given = getattr(self, name)
            try:
                object.__setattr__(self, name, convert(given))
            except (TypeError, ValueError, OverflowError) as error:
                raise ValueError(f"path: {name} is {given!r:.60}: {error}") from error


@dataclass(frozen=True)
class Touch:
    """The first touch on a path.

    Attributes:
        own: part of the robot, or held entity.
        other: the entity that it meets.
        part: which of its parts.
        place: where (3,), m.
        depth: how deep, until the waypoint would be reached or it is 2 cm, m; below 0 inside the
            margin.
    """

    own: str
    other: str
    part: str
    place: tuple[float, float, float]
    depth: float

    def __str__(self) -> str:
        x, y, z = self.place
        how = f"{1e3 * self.depth:.0f} mm deep" if self.depth > 0.0 else "too near"
        return f"{self.own} meets {self.part} of {self.other} {how} at {x:.2f} {y:.2f} {z:.2f}"


@dataclass(frozen=True)
class Clearance:
    """The answer for a path.

    Attributes:
        waypoint: the last one that the hand went for: the path's last, or where it ends before.
        touch: the first touch; None if there is none.
        short: how far from that waypoint the hand came to rest, m; 0 where it got there.
        askew: likewise, rad.
        room: least distance of what moves from what does not, but for what was permitted, m; no
            more than ``ROOM`` is looked at.
        hand: pose that the hand reaches (7,).
        joints: positions of the arm's joints there (J,).
    """

    waypoint: int
    touch: Touch | None
    short: float
    askew: float
    room: float
    hand: Floats
    joints: Floats

    @property
    def free(self) -> bool:
        """Whether the path's end is reached without a touch."""
        return self.touch is None and not self.short and not self.askew

    @property
    def reason(self) -> str:
        """Why it is not free; empty if it is."""
        if self.touch is not None:
            return str(self.touch)
        if self.short or self.askew:
            turn = np.degrees(self.askew)
            return f"out of reach, {100 * self.short:.0f} cm and {turn:.0f} degrees short"
        return ""


ROOM = 0.04
"""Distance beyond which nobody asks how far something is, m."""


@runtime_checkable
class Foresees(Protocol):
    """A backend that says what would happen on a path."""

    def clearance(self, paths: Sequence[Path]) -> list[Clearance]:
        """What would touch on each of some paths from the present state; changes nothing.

        Raises:
            ConfigError: if the simulator has no such service.
            RolloutError: if a path names what is not there, or the simulator fails.
        """


BLIND = "this simulator does not say what would be touched on a way"


def blind(paths: Sequence[Path]) -> list[Clearance]:
    """What there is instead where nobody foresees.

    Raises:
        ConfigError: always.
    """
    raise ConfigError(BLIND)


Plain = list[dict[str, Any]]
Arrays = Mapping[str, Floats]

_PLAIN = tuple(name for name in _CONVERSIONS if name not in _ARRAYS)


def encode_paths(paths: Sequence[Path]) -> tuple[Plain, Arrays]:
    """Paths as plain values and named arrays."""
    plain = [
        {name: getattr(path, name) for name in _PLAIN}
        | {"opening": None if np.isnan(path.opening) else path.opening}
        for path in paths
    ]
    arrays = {f"{n}.{name}": getattr(p, name) for n, p in enumerate(paths) for name in _ARRAYS}
    return plain, arrays


def decode_paths(plain: Plain, arrays: Arrays) -> list[Path]:
    """The inverse of :func:`encode_paths`.

    Raises:
        ValueError: if they are none.
    """
    found = []
    for n, values in enumerate(plain):
        known: dict[str, Any] = {name: np.array(arrays[f"{n}.{name}"]) for name in _ARRAYS}
        opening = STAYS if values["opening"] is None else values["opening"]
        found.append(Path(**known | values | {"opening": opening}))
    return found


def encode_clearances(answers: Sequence[Clearance]) -> tuple[Plain, Arrays]:
    """Answers as plain values and named arrays."""
    plain = [
        {name: getattr(a, name) for name in ("waypoint", "short", "askew", "room")}
        | {"touch": a.touch and dict(vars(a.touch))}
        for a in answers
    ]
    arrays = {
        f"{n}.{name}": getattr(a, name)
        for n, a in enumerate(answers)
        for name in ("hand", "joints")
    }
    return plain, arrays


def decode_clearances(plain: Plain, arrays: Arrays) -> list[Clearance]:
    """The inverse of :func:`encode_clearances`."""
    return [
        Clearance(
            **values | {"touch": _touch(values["touch"])},
            hand=arrays[f"{n}.hand"],
            joints=arrays[f"{n}.joints"],
        )
        for n, values in enumerate(plain)
    ]


def _touch(values: dict[str, Any] | None) -> Touch | None:
    return Touch(**values | {"place": tuple(values["place"])}) if values else None
