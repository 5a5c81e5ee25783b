"""Two things beside each other in one bowl, each let go where it does not press on the other."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.policies.scripted.arm import Arm, Motion, raised
from pytest_safemanip.policies.scripted.facing import BACK, UP
from pytest_safemanip.policies.scripted.grasping import FINGERTIP, fold
from pytest_safemanip.policies.scripted.putting import BRAKE, carry_over, held_over
from pytest_safemanip.policies.scripted.rims import WALL
from pytest_safemanip.policies.scripted.rotations import Array, about_z
from pytest_safemanip.policies.scripted.things import Thing
from pytest_safemanip.policies.scripted.touching import touched

ROOM = 0.012
"""From what is let into a bowl to its wall, m: it hangs askew by some millimetres."""
OVER_RIM = 0.005
"""From a bowl's rim up to the fingertips that open over it, m: in it, they would jam."""
FALL = 0.045
"""Above a bowl's underside, m: nothing is let go higher."""
NEAR = 0.003
"""That height is met so well, m."""
SLOWLY = 0.1
"""Share of the hand's top speed at which it is lowered."""
STEPS = 120


def fill_beside(arm: Arm, role: str, other_role: str, vessel_role: str) -> Motion:
    """Let something into a bowl, on one side of its middle: another thing has room on the other
    side, or lies there. The first is turned to lie as the other one is going to.

    Raises:
        SkillFailed: if the hand or the base does not get there.
    """
    thing, other, vessel = Thing(arm, role), Thing(arm, other_role), Thing(arm, vessel_role)
    away = (other.centre - vessel.middle)[:2]
    radius = vessel.sides()[0][1] / 2.0 - WALL
    inside = bool(np.linalg.norm(away) < radius)
    (narrow, width), (_, length) = thing.sides()
    side = narrow
    if not inside:
        side = other.sides()[0][0]
        turn = fold(heading(side) - heading(narrow), 90.0)
        turned = about_z(turn) @ arm.rotation
        up = raised(arm.position, UP)
        yield from arm.move(up, turned, tolerance=0.05, speed=0.6, steps=60, required=False)
    side = side * (1.0, 1.0, 0.0)
    # The second one comes to lie on the side away from the first, the first on the far side.
    from_there = -away @ side[:2] if inside else float(arm.ahead(side))
    # A long one lies between the walls no farther from the middle.
    between = math.sqrt(max(0.0, radius**2 - length**2 / 4.0))
    most = max(0.0, min(radius - ROOM, between) - width / 2.0)
    off = math.copysign(most, from_there)
    spot = vessel.middle + off * side
    yield from carry_over(arm, role, spot, vessel.highest + BRAKE)
    hanging = float(arm.position[2]) - thing.bottom
    tips = vessel.highest + FINGERTIP + OVER_RIM - hanging
    bottom = min(tips, vessel.bottom + FALL)
    yield from arm.move(
        held_over(arm, thing, spot, bottom),
        speed=SLOWLY,
        steps=STEPS,
        until=lambda: touched(arm, thing) or thing.bottom < bottom + NEAR,
        required=False,
    )
    yield from arm.grip(False)
    yield from arm.move(raised(arm.position, UP), tolerance=0.03, speed=0.5, steps=60)
    yield from arm.drive(arm.base - BACK * arm.forward)


def heading(way: Array) -> float:
    """Of a direction (3,), degrees about the vertical."""
    return math.degrees(math.atan2(way[1], way[0]))
