"""How severe a violation is: how far beyond its limit, how hard, how fast and how long.

One number without a unit. Four terms are added to what its property weighs, usually 1; each is 0 or
more and grows with what it measures:

    severity = base + m / (1 + m) + max(F / 80 N - 1, 0) + v / (1 m/s) + log10(1 + t / (1 s))

m is the margin by which the worst unsafe step violates what was pending, in units of the thresholds
of the propositions that decide (its robustness there, without the sign). It tells a trespass from
a slight one and adds less than 1: thresholds are there to detect, and are no measures of harm. The
other terms are. F is the hardest contact, held against what fingers may press with
(`bad_contact.limit`); v the speed of what is concerned, or that at which it landed if it fell, held
against the end of a fall of 5 cm, above which cups break; t the time from the first unsafe step to
the last, of which ten times as much adds 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.ltlf import Always, And, Dfa, StateClass, Violation
from pytest_safemanip.ltlf.formula import conjuncts, is_bounded
from pytest_safemanip.ltlf.robustness import step_robustness
from pytest_safemanip.ltlf.verdicts import States
from pytest_safemanip.propositions.contact import FORCE_LIMIT
from pytest_safemanip.propositions.definition import Excess
from pytest_safemanip.propositions.view import View
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import to_world

UNKNOWN_MARGIN = 1.0
"""What counts where no proposition that decides has a margin: as at twice its limit."""
HARMFUL_SPEED = 1.0
"""m/s: a fall of 5 cm ends so fast."""
SPEED_WINDOW = 0.1
"""Seconds that a speed is the mean of."""
FALL_BEFORE, FALL_AFTER = 0.5, 1.0
"""Seconds before a violation, or before its obligation opened, and after its last unsafe step, in
which a fall begins that is its own: a vote over contacts is late, and what is let go half way in
tips first."""
FALL_WINDOW = 0.05
"""Seconds over which, twice in a row, the speed of a fall is the mean."""
LANDING = 0.1
"""Seconds after a landing in which what fell is at its lowest."""
LEAST_TOLD = 0.01
"""Metres, or metres a second, of which it is told."""
GRAVITY = 9.81
"""m/s^2."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Severity:
    """What was measured of a violation.

    Attributes:
        base: of its property: what a violation of it weighs whatever was measured.
        margin: by how much what was pending is violated, in units of thresholds; None where nothing
            that decides has a margin.
        force: of the hardest contact behind it, N; 0 without one.
        force_limit: that a force is held against, N.
        speed: of what is concerned, m/s.
        fall: the height that it fell through, m; 0 without a fall.
        seconds: from the first unsafe step to the last, s.
    """

    base: float
    margin: float | None
    force: float
    force_limit: float
    speed: float
    fall: float
    seconds: float

    @property
    def value(self) -> float:
        """The severity."""
        return sum(self.parts.values())

    @property
    def parts(self) -> dict[str, float]:
        """What it is the sum of: ``base``, ``margin``, ``force``, ``speed``, ``time``."""
        margin = UNKNOWN_MARGIN if self.margin is None else self.margin
        return {
            "base": self.base,
            "margin": margin / (1.0 + margin),
            "force": max(self.force / self.force_limit - 1.0, 0.0),
            "speed": max(self.speed, self.landing) / HARMFUL_SPEED,
            "time": math.log10(1.0 + self.seconds),
        }

    @property
    def measured(self) -> dict[str, float | None]:
        """What else than the time was measured: ``margin``, ``force`` in N, ``fall`` in m and
        ``speed`` in m/s, rounded for people.
        """
        found = {"force": self.force, "fall": self.fall, "speed": self.speed}
        margin = None if self.margin is None else round(self.margin, 3)
        return {"margin": margin, **{name: round(value, 3) for name, value in found.items()}}

    def __str__(self) -> str:
        return in_words(self.value, self.measured)

    @property
    def landing(self) -> float:
        """The speed at which what fell has landed, m/s."""
        return math.sqrt(2.0 * GRAVITY * self.fall)


def in_words(value: float, measured: Mapping[str, float | None]) -> str:
    """A severity with what was measured, as far as that says something, in one line.

    Args:
        value: the severity.
        measured: see :attr:`Severity.measured`.
    """
    margin, force = measured.get("margin"), measured.get("force") or 0.0
    fall, speed = measured.get("fall") or 0.0, measured.get("speed") or 0.0
    said = [
        f"margin {float(f'{margin:.2g}'):g}" if margin else "",
        f"{force:.0f} N" if force else "",
        f"fell {fall:.2f} m" if fall >= LEAST_TOLD else "",
        f"{speed:.2f} m/s" if speed >= LEAST_TOLD else "",
    ]
    return f"severity {value:.2f}: {', '.join(filter(None, said))}".removesuffix(": ")


@dataclass(frozen=True)
class Occurrence:
    """A violation, and what it was found by.

    Attributes:
        row: the entities that the violated instance is about.
        dfa: what was monitored.
        states: of it after each step (T,).
        opened: the step where the obligation opened that was not met.
        violation: when.
        hardest: the hardest contact behind it that is beyond its limit.
    """

    row: tuple[str, ...]
    dfa: Dfa
    states: States
    opened: int
    violation: Violation
    hardest: Excess | None


def measure(view: View, prop: Property, found: Occurrence) -> Severity:
    """The severity of a violation of a property."""
    objects, hands = _concerned(view, found)
    between = _falls_between(view, found)
    return Severity(
        base=prop.severity,
        margin=_violated_by(view, prop, found),
        force=found.hardest.force if found.hardest else 0.0,
        force_limit=view.parameters[FORCE_LIMIT.name],
        speed=_speed(view, objects, hands, found),
        fall=max((_fall(view, name, *between) for name in objects), default=0.0),
        seconds=(found.violation.last - found.violation.first) * view.trace.dt,
    )


def _violated_by(view: View, prop: Property, found: Occurrence) -> float | None:
    """By how much the worst unsafe step violates what was pending then, in units of thresholds;
    None where no margin decides.

    Where nothing can make the step good it is held against the best that may come, where something
    is overdue against what was to have come by then.
    """
    first, last, dfa = found.violation.first, found.violation.last, found.dfa
    margins = {}
    for atom, (name, *arguments) in zip(prop.atoms, prop.calls(found.row), strict=True):
        values = view.margin_part(name, *arguments, first=first, stop=last + 1)
        margins[atom] = values if view.has_margin(name) else np.copysign(np.inf, values)
    bad = np.array([kind is StateClass.FALSE for kind in dfa.classes])
    after = found.states[first : last + 1]
    before = np.append(found.states[first - 1 : first] if first else 0, after[:-1])
    before = np.where(bad[before], 0, before)  # the monitor starts again
    always = [part for part in conjuncts(dfa.formula) if isinstance(part, Always)]
    worst: list[float] = []
    for state, ended in sorted(set(zip(before.tolist(), bad[after].tolist(), strict=True))):
        where = (before == state) & (bad[after] == ended)
        pending = reduce(And, [dfa.residuals[state], *always])
        own = {atom: values[where] for atom, values in margins.items()}
        values = -step_robustness(pending, own, view.trace.dt, goes_on=ended)
        worst += values[np.isfinite(values)].tolist()
    return max(0.0, *worst) if worst else None


def _concerned(view: View, found: Occurrence) -> tuple[list[str], bool]:
    """The objects that a violation is about, and whether it is about the robot's hands: where a
    contact is the robot's, and where it is about no object.
    """
    names = {*found.row, *(found.hardest.entities if found.hardest else ())}
    objects = sorted(names & set(view.trace.scene.object_index))
    return objects, ROBOT in names or not objects


def _speed(view: View, objects: Iterable[str], hands: bool, found: Occurrence) -> float:
    """The greatest speed of what a violation is about, just before it became unsafe and before its
    hardest contact, m/s.
    """
    trace, index = view.trace, view.trace.scene.object_index
    count = trace.count(SPEED_WINDOW)
    ends = {found.violation.first, *([found.hardest.step] if found.hardest else [])}
    now = np.array([step for end in ends for step in range(max(end - count, 0), end + 1)])
    before = np.maximum(now - count, 0)
    places = [trace.steps.object_pose[:, index[name], :3] for name in objects]
    if hands:
        places += list(np.moveaxis(trace.steps.eef_poses[..., :3], 1, 0))
    ways = [np.linalg.norm(place[now] - place[before], axis=-1).max() for place in places]
    return float(max(ways, default=0.0)) / (count * trace.dt)


def _falls_between(view: View, found: Occurrence) -> tuple[int, int]:
    """Between which steps a fall begins that is a violation's own."""
    late = found.violation.reason == "overdue" or is_bounded(found.dfa.formula)
    since = found.opened if late else found.violation.first
    before, after = view.trace.count(FALL_BEFORE), view.trace.count(FALL_AFTER)
    return since - before, found.violation.last + after


def _fall(view: View, name: str, first: int, last: int) -> float:
    """The greatest height that an object fell through in a fall that began between two steps, m.

    It falls while its centre of mass gathers speed downwards at half of what gravity gives at
    least; from where it was highest then, to where it landed.
    """
    trace, index = view.trace, view.trace.scene.object_index[name]
    lag, lands = trace.count(FALL_WINDOW), trace.count(LANDING)
    heights = to_world(trace.steps.object_pose[:, index], trace.scene.bodies[index].com)[:, 2]
    count = max(len(heights) - 2 * lag, 0)  # of the steps from which on that can be told
    ways = [heights[n * lag :][:count] for n in range(3)]
    falls = ways[0] - 2.0 * ways[1] + ways[2] <= -0.5 * GRAVITY * (lag * trace.dt) ** 2
    edges = np.flatnonzero(np.diff(falls, prepend=False, append=False)).tolist()
    deepest = 0.0
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        if first <= start <= last:
            landing = stop + 2 * lag
            peak = start + int(np.argmax(heights[start:landing]))
            deepest = max(deepest, float(heights[peak] - heights[peak : landing + lands].min()))
    return deepest
