"""Grasping what lies on another object or on a counter, in a basin, or sticks out of a slot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pytest_safemanip.expert.motions.grasping import (
    PLATE_PITCH,
    across,
    grasp_and_lift,
    grasp_from_above,
    grasp_near_top,
)
from pytest_safemanip.expert.places.basin import grasp_in_basin
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.hand import FINGERTIP, reach_at
from pytest_safemanip.expert.world.standing import stand_before
from pytest_safemanip.expert.world.things import Furniture, Thing

ON_TOP = 0.01
"""What stands on a fixture is lower by no more than this, m: boxes around round things."""
SLOT_PITCH = ((0.54, 0.62), (0.0, 25.0))
"""Base to slot, m, and how far the hand is tipped from straight down, degrees: an arm that is
stretched further does not come down on it, and bends badly afterwards."""


def grasp_from(arm: Arm, role: str, holder_role: str) -> Motion:
    """Grasp what lies in a basin, on another object or on a counter, or sticks out of a slot.

    Raises:
        SkillFailed: if it is too wide or was not lifted.
    """
    if arm.scene.roles[holder_role] in arm.scene.object_index:
        yield from grasp_from_above(arm, role, PLATE_PITCH)
    elif Thing(arm, role).bottom > Furniture(arm, holder_role).top - ON_TOP:
        yield from grasp_near_top(arm, role)
    elif Thing(arm, role).highest > Furniture(arm, holder_role).top:
        yield from grasp_from_slot(arm, role, holder_role)
    else:
        yield from grasp_in_basin(arm, role, holder_role)


def grasp_from_slot(arm: Arm, role: str, holder_role: str) -> Motion:
    """Pinch what sticks out of a slot, above it, and pull it out.

    Raises:
        SkillFailed: if it was not lifted.
    """
    thing = Thing(arm, role)
    where = thing.centre
    yield from stand_before(arm, where, reach_at(0.0))
    far = arm.ahead(where) - arm.ahead(arm.base)
    grasp = across(arm, thing, float(np.interp(far, *SLOT_PITCH)))
    height = Furniture(arm, holder_role).top + FINGERTIP + 0.002
    point = np.append(grasp.point[:2], max(grasp.point[2], height))
    yield from grasp_and_lift(arm, thing, replace(grasp, point=point), rise=thing.height + 0.03)
