"""Scenarios at the cabinet: its door is led, things are put in and taken out."""

from __future__ import annotations

import numpy as np

from tests.physics.handling import LOW, can
from tests.physics.scenario import Scenario
from tests.physics.script import LIFTED, REACH, Script
from tests.physics.world import BAR_HEIGHT, COUNTER, DOOR_TRAVEL, HINGE, SHELF, Thing, bar_at

BEFORE = (0.35, -0.55, LIFTED)
"""In front of the open cabinet."""
ON_SHELF = SHELF + 0.045
STANDING = (0.45, -0.3)
AJAR, OPEN, BLOCKED = 0.4, 0.55, 0.95
"""Angles of the door: where it stands to be opened or closed, and where something is in its way."""


def opens_door(mass: float, then: str, away: float = 0.075, pushes: float = 10.6) -> Scenario:
    """The door is opened against a crate: a heavy one blocks it, a light one is pushed along.

    Args:
        mass: of the crate, kg.
        away: how far it stands from where the door is then, m.
        pushes: for how long the door is pushed on, s.
        then: ``recovers``: the door is closed again; ``pushes on``; ``pushes through``, until the
            door is open; ``leaves``: it is taken back slowly, and not all the way.
    """
    place = HINGE + 0.25 * _along(BLOCKED) + away * _front(BLOCKED)
    crate = Thing("crate", "boxed_food", "box", (0.06, 0.06, 0.05), (*place, COUNTER + 0.05), mass)
    x, y = bar_at(AJAR)
    script = Script((x, y - REACH, BAR_HEIGHT)).to(0.4, y=y).mark("grasps").close()
    script.swing(1.5, AJAR, BLOCKED + 0.02).mark("hit").wait(0.2)
    if then == "recovers":
        script.mark("retracts").swing(1.5, BLOCKED + 0.02, 0.0).mark("closed").wait(0.8)
        script.mark("end").open().to(0.3, y=bar_at(0.0)[1] - REACH)
    elif then == "pushes on":
        script.wait(pushes).mark("end").open()
    elif then == "pushes through":
        script.swing(1.5, BLOCKED + 0.02, 0.99 * DOOR_TRAVEL).mark("opened").wait(0.8).mark("end")
    else:
        back = BLOCKED - 0.1
        script.mark("creeps").swing(4.0, BLOCKED + 0.02, back).mark("crept")
        script.swing(1.0, back, AJAR).mark("half way").wait(0.8).mark("end").open()
    return Scenario((crate,), script, AJAR / DOOR_TRAVEL)


def closes_door() -> Scenario:
    """The door is closed against a crate that juts out of the cabinet, and opened again."""
    crate = Thing("crate", "boxed_food", "box", (0.06, 0.06, 0.05), (0.35, 0.02, SHELF + 0.05), 8.0)
    x, y = bar_at(OPEN)
    script = Script((x, y - REACH, BAR_HEIGHT)).to(0.4, y=y).mark("grasps").close()
    script.swing(1.5, OPEN, 0.15).mark("hit").wait(0.2)
    script.mark("retracts").swing(2.0, 0.15, 0.99 * DOOR_TRAVEL).mark("opened").wait(0.8)
    return Scenario((crate,), script.mark("end"), OPEN / DOOR_TRAVEL)


def carries_into_door() -> Scenario:
    """A can is carried into the half open door, above which the hand passes."""
    script = Script(BEFORE).pick((0.3, -0.45, LOW)).to(0.5, z=1.24).mark("carries")
    script.to(0.6, y=-0.2).mark("carried").wait(0.3)
    return Scenario((can(0.3, -0.45),), script, 0.5)


def opens_fully() -> Scenario:
    """The door is led all the way by its handle; a can stands out of its way."""
    x, y = bar_at(AJAR)
    script = Script((x, y - REACH, BAR_HEIGHT)).to(0.4, y=y).mark("grasps").close()
    script.swing(2.0, AJAR, 0.98 * DOOR_TRAVEL).wait(0.1).mark("opened").open()
    return Scenario((can(0.35, 0.2, SHELF + 0.04),), script, AJAR / DOOR_TRAVEL)


def reaches_in(door: float) -> Scenario:
    """The hand stops at the cabinet's front, then goes in."""
    script = Script((0.53, -0.55, BAR_HEIGHT)).mark("peeks").to(0.6, y=0.03).wait(0.3)
    script.mark("enters").to(0.4, y=0.12).mark("inside").wait(0.2).to(0.5, y=-0.4)
    return Scenario((can(0.2, 0.2, SHELF + 0.04),), script, door)


def thrusts_in(door: float, seconds: float) -> Scenario:
    """The hand goes from in front of the cabinet into it, within so many seconds."""
    script = Script((0.53, -0.55, BAR_HEIGHT)).to(0.6, y=-0.1).wait(0.3).to(seconds, y=0.12)
    return Scenario((can(0.2, 0.2, SHELF + 0.04),), script.wait(0.2), door)


def shelves(depth: float) -> Scenario:
    """A can is put on the shelf, so deep."""
    script = _fetch_can().mark("enters")
    _shelve(script, 0.35, depth)
    return Scenario((can(*STANDING),), script.wait(0.6).mark("end"), 1.0)


def shelves_turned() -> Scenario:
    """An apple is turned in passing, and put on the shelf's front."""
    apple = Thing("apple", "apple", "ball", (0.034,) * 3, (*STANDING, COUNTER + 0.034), 0.15)
    low = SHELF + 0.034
    script = Script(BEFORE).pick((*STANDING, COUNTER + 0.034)).to(0.3, y=-0.35)
    script.mark("enters").to(0.6, x=0.35, z=low + 0.02, roll=0.3).to(0.8, y=0.042).to(0.3, z=low)
    return Scenario((apple,), script.mark("in place").let_go().wait(0.6).mark("end"), 1.0)


def adds(clears: bool) -> Scenario:
    """A can is put into a cabinet that takes one thing at a time, and holds butter."""
    butter = Thing("butter", "butter_stick", "box", (0.025, 0.025, 0.04), (0.25, 0.1, SHELF + 0.04))
    script = Script(BEFORE)
    if clears:
        script.pick((0.25, 0.1, ON_SHELF)).mark("takes out").to(0.5, y=-0.35).mark("taken out")
        script.to(0.4, z=LOW).let_go()
    script.pick((*STANDING, LOW)).to(0.3, y=-0.35).mark("enters")
    _shelve(script, 0.45, 0.1)
    task = {"exclusive_enclosures": ("cabinet",)}
    return Scenario((butter, can(*STANDING)), script.wait(0.6).mark("end"), 1.0, task)


def hesitates() -> Scenario:
    """A can is held at the front of the shelf, deeper step by step, and taken away again."""
    script = _fetch_can().to(0.6, x=0.35, y=-0.1, z=ON_SHELF + 0.03).wait(0.2)
    for name, depth in (("touches", -0.022), ("enters", -0.014), ("half", 0.015), ("in", 0.04)):
        script.mark(name).to(0.3, y=depth).wait(0.4)
    script.mark("back").to(0.3, y=0.01).wait(0.3)
    script.mark("dips").to(0.1, y=-0.012).to(0.1, y=0.01).wait(0.3)
    script.mark("leaves").to(0.6, y=-0.3).to(0.4, z=LOW).let_go().wait(0.4)
    return Scenario((can(*STANDING),), script.mark("end"), 1.0)


def _fetch_can() -> Script:
    return Script(BEFORE).pick((*STANDING, LOW)).to(0.3, y=-0.35)


def _shelve(script: Script, x: float, depth: float) -> None:
    script.to(0.5, x=x, z=ON_SHELF + 0.015).to(0.8, y=depth).mark("in place").to(0.2, z=ON_SHELF)
    script.wait(0.1).let_go()


def _along(angle: float) -> np.ndarray:
    return np.array((np.cos(angle), -np.sin(angle)))


def _front(angle: float) -> np.ndarray:
    return np.array((-np.sin(angle), -np.cos(angle)))
