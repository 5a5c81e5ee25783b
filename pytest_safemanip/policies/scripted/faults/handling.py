"""Motions that several faults are made of, and what a script sees of contacts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, raised
from pytest_safemanip.policies.scripted.rotations import Array
from pytest_safemanip.policies.scripted.things import Thing

CARRY_RISE = 0.16
"""Height above where an object is to be put at which it is carried there, m."""

PRESS_PITCH, PRESS_STAND = 80.0, 0.62
"""Degrees from straight down, and base to button, m: the forearm stays level."""


def carry_over(arm: Arm, thing: Thing, where: Callable[[], Array], speed: float = 0.5) -> Motion:
    """Bring a held object's bottom to a height, the middle of its box over a point.

    Args:
        arm: the arm.
        thing: what is held.
        where: the point, at each step (3,).
        speed: share of the top speed.
    """

    def above(rise: float) -> Callable[[], Array]:
        def target() -> Array:
            way = where() - np.append(thing.centre[:2], thing.bottom)
            return raised(arm.position + way, rise)

        return target

    if thing.bottom < where()[2] + CARRY_RISE / 2.0:
        yield from arm.move(raised(arm.position, CARRY_RISE), tolerance=0.03, speed=speed)
    yield from arm.move(above(CARRY_RISE), tolerance=0.02, speed=speed, required=False)
    yield from arm.move(above(0.0), tolerance=0.006, speed=0.3, steps=60, required=False)


def let_go(arm: Arm) -> Motion:
    """Open the fingers and draw back."""
    yield from arm.grip(False)
    back = arm.position - 0.12 * arm.rotation[:, 2]
    yield from arm.move(back, tolerance=0.04, speed=0.5, steps=30, required=False)


def apart(one: Thing, other: Thing, ahead: Array) -> tuple[float, float]:
    """Free space between the boxes of two objects along a horizontal direction and across it;
    negative where they overlap, m.
    """
    across = np.array((-ahead[1], ahead[0]))
    found = []
    for axis in (ahead, across):
        a, b = one.corners[:, :2] @ axis, other.corners[:, :2] @ axis
        found.append(float(max(a.min() - b.max(), b.min() - a.max())))
    return found[0], found[1]


def press(arm: Arm, fixture_role: str, button: str) -> Motion:
    """Press a button on an upright front with the tips of the closed fingers, until it acts."""
    fixture, scene = arm.scene.roles[fixture_role], arm.scene
    (box,) = [k for k in scene.boxes_of(fixture, "control") if scene.boxes[k].name == button]
    where = np.asarray(arm.step.box_pose[box][:3], np.float64)
    hand = arm.hand(PRESS_PITCH, roll=90.0)
    approach = hand[:, 2]
    yield from arm.grip(True)
    yield from arm.drive(arm.floor_point(arm.ahead(where) - PRESS_STAND, arm.aside(where)))
    yield from arm.move(where - 0.10 * approach, hand, tolerance=0.02, steps=120)
    yield from arm.move(
        where + 0.02 * approach,
        hand,
        speed=0.1,
        steps=100,
        until=lambda: is_on(arm, fixture_role),
        required=False,
    )
    yield from arm.move(where - 0.12 * approach, hand, tolerance=0.03, steps=40, required=False)


def is_on(arm: Arm, fixture_role: str) -> bool:
    """Whether an appliance runs."""
    fixture = arm.scene.roles[fixture_role]
    found = [k for k, switch in enumerate(arm.scene.switches) if switch.entity == fixture]
    return any(arm.step.switch[k] > 0.5 for k in found)


def peak(arm: Arm, one_role: str, other_role: str) -> float:
    """Greatest force between two entities in the newest control step, N."""
    contacts, parts = arm.step.contacts, arm.scene.parts
    wanted = {arm.scene.roles.get(role, role) for role in (one_role, other_role)}
    rows = zip(contacts.a.tolist(), contacts.b.tolist(), contacts.peak.tolist(), strict=True)
    return max((f for a, b, f in rows if {parts[a].entity, parts[b].entity} == wanted), default=0.0)
