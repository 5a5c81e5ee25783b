"""What can be done with whatever lies within reach of the hand, in whatever task."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.gripping import grasp
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.faults import handling
from pytest_safemanip.faults.handling import FLOOR, away, let_go, rehearse_or
from pytest_safemanip.trace.geometry import corners

AWAY, BEYOND = 0.45, 0.15
"""How far the base backs away at least for what it holds to be over the floor, and how far before
the edge of what was below it, m."""
HELD = 0.15
"""From the grip point to the centre of what is held, at most, m."""


def over_floor(arm: Arm, roles: str, placed: bool = True) -> Motion:
    """Backs away with an object and lets go of it over the floor.

    Args:
        arm: the arm.
        roles: of the object, see :func:`_nearest`.
        placed: whether the task's binding knows placing it as a skill.
    """
    role = _nearest(arm, roles)
    thing = Thing(arm, role)

    def take_away() -> Motion:
        yield from grasp(arm, role, back=False)
        far = max(AWAY, _to_edge(arm, thing) + BEYOND)
        yield from arm.drive(arm.base - far * arm.forward)
        if away(arm, thing) > HELD:
            raise SkillFailed("it was lost on the way")

    yield from rehearse_or(arm, f"take {role} away", take_away, role)
    if placed:
        arm.truth.begins("action_onset", "place", role, when=lambda: away(arm, thing) > HELD)
    arm.truth.begins("release_stability", role, when=lambda: thing.bottom < FLOOR)
    yield from let_go(arm)


def put_back(arm: Arm, roles: str) -> Motion:
    """Puts an object back to where it was; ``roles`` are those of :func:`over_floor`."""
    yield from handling.put_back(arm, _nearest(arm, roles), before=((0.03, 0.5),))


def _nearest(arm: Arm, roles: str) -> str:
    """Of roles with `or` between them, that of the nearest object; not all need be there."""
    there = [role for role in roles.split(" or ") if role in arm.scene.roles]
    return min(there, key=lambda role: arm.ahead(Thing(arm, role).centre))


def _to_edge(arm: Arm, thing: Thing) -> float:
    """How far the front edge of what is below an object is from its middle, m."""
    ahead, aside = arm.ahead(thing.centre), arm.aside(thing.centre)
    edges = [ahead]
    for slab in arm.scene.surfaces:
        points = corners(np.array(slab.pose), slab.half)
        along, across = points[:, :2] @ arm.forward, points[:, :2] @ arm.left
        inside = along.min() < ahead < along.max() and across.min() < aside < across.max()
        if inside and FLOOR < points[:, 2].max() < thing.bottom:
            edges.append(float(along.min()))
    return ahead - min(edges)
