"""Stirring what is in a pot with what is held."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.approaching import draw_back
from pytest_safemanip.expert.motions.attitudes import dipped
from pytest_safemanip.expert.motions.placing import bring
from pytest_safemanip.expert.motions.spots import into_thing
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing

OVER_FLOOR = 0.024
"""From a pot's underside up to the end of what stirs in it, m: lower, what it pushes would tip."""
ROUND, ROUNDS = (0.45, 0.3, 0.6), 1.5
"""Radii of the circles that the end of the stick describes one after the other, as shares of the
pot's radius, and how often it goes round each: contents lie near the middle or near the wall."""
STRIDE = 0.0015
"""By how much the end is moved on in a control step, m: faster, what it pushes hops."""
BACK = 0.2
"""How far the base then draws back at least, m."""


def stir(arm: Arm, pot_role: str, role: str) -> Motion:
    """Lower the end of a held stick into a pot, go round in it, and bring it out again.

    Raises:
        SkillFailed: if there is no way for it.
    """
    pot, tool = Thing(arm, pot_role), Thing(arm, role)
    reach = yield from bring(arm, tool, lambda: into_thing(arm, tool, pot), dipped)
    hand = arm.rotation
    first = arm.choices.choose("how far out first", ROUND)
    radii = [
        share * pot.sides()[0][1] / 2.0 for share in sorted(ROUND, key=lambda share: share != first)
    ]
    # Where the hand is then: what turns the stick in the fingers does not draw the hand after it.
    to_hand = arm.position - end(tool)
    way = end(tool) - pot.middle
    start = math.atan2(way[1], way[0])

    def at(angle: float, radius: float) -> Array:
        out = radius * np.array((math.cos(angle), math.sin(angle)))
        goal = np.append(pot.middle[:2] + out, pot.bottom + OVER_FLOOR)
        return np.asarray(goal + to_hand)

    yield from arm.move(
        at(start, radii[0]), hand, tolerance=0.006, speed=0.2, steps=120, required=False
    )
    for radius in radii:
        for turn in np.arange(0.0, 2.0 * math.pi * ROUNDS, STRIDE / radius).tolist():
            yield from arm.move(
                at(start + turn, radius), hand, tolerance=0.0, steps=1, required=False
            )
    yield from arm.move(
        arm.position + reach.entry, hand, tolerance=0.02, speed=0.4, steps=80, required=False
    )
    yield from draw_back(arm, reach, tool, BACK)


def end(tool: Thing) -> Array:
    """The lower end of a held stick (3,)."""
    axis = tool.longest
    return np.asarray(tool.centre - tool.reach(axis) * math.copysign(1.0, axis[2]) * axis)
