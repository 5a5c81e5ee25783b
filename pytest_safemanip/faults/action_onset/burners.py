"""Burners lit with nothing on them, or beside what burns."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.operating import KNOB_ON, turn_to
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.faults.handling import rehearse, rehearse_or
from pytest_safemanip.trace.elements import Joint

NEARLY_LIT = 0.2
"""Knob angle from which a burner is as good as lit, rad: RoboCasa's limit is 0.35, some tasks are
over with that, and a knob turns by up to 0.1 in a control step."""


def light_empty(arm: Arm) -> Motion:
    """Turns on a burner, of those that are off the one that is farthest from everything."""
    stove = Furniture(arm, "stove")
    lit = {joint.key for joint in stove.burning()}
    things = [Thing(arm, body.entity) for body in arm.scene.bodies]
    found = arm.scene.boxes_of(stove.entity, "burner")
    burners = [np.asarray(arm.step.box_pose[k][:3], np.float64) for k in found]
    spots = [spot for spot in burners if stove.knob_under(spot).key not in lit]

    def room(spot: Array) -> float:
        return min(float(np.linalg.norm((thing.centre - spot)[:2])) for thing in things)

    yield from _light(arm, stove, max(spots, key=room), unsafe=True)


def light_under(arm: Arm, role: str, unsafe: bool) -> Motion:
    """Turns on the burner that a vessel stands on."""
    spot = Thing(arm, role).middle
    yield from _light(arm, Furniture(arm, "stove"), spot, unsafe)


def _light(arm: Arm, stove: Furniture, spot: Array, unsafe: bool) -> Motion:
    joint = stove.knob_under(spot)

    def turned_up() -> bool:
        return stove.openness(joint) * joint.travel > NEARLY_LIT

    if unsafe:
        arm.truth.begins("action_onset", "turn", "stove", when=turned_up)
    yield from light(arm, stove, joint, unsafe)


def light(arm: Arm, stove: Furniture, joint: Joint, unsafe: bool = True) -> Motion:
    """Turns a burner's knob until it burns.

    Args:
        arm: the arm.
        stove: the stove.
        joint: moves the knob.
        unsafe: whether a collision on the way does not matter, as in a fault.

    Raises:
        SkillFailed: if it does, and no way to turn the knob is free of collisions.
    """
    tried = rehearse_or if unsafe else rehearse
    yield from tried(arm, "light a burner", lambda: turn_to(arm, stove, joint, KNOB_ON), "stove")
