"""Putting a lid on a vessel that is part of the kitchen."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.robot.hand import FINGERTIP
from pytest_safemanip.expert.world.things import Furniture

LID_PITCH = 35.0
LID_STAND = 0.60
LID_YAW = 45.0
"""Degrees by which the hand comes in from the side away from a vessel that is close to the lid."""
PALM_ROOM = 0.12
"""From the knob to the vessel, m, for a hand that comes in from the front: its palm is 10 cm
wide to either side, and it arrives within 2 cm."""
KNOB = 0.012
"""Below the top of a lid's knob where it is pinched, m."""
PLUG = 0.012
"""Depth to which a lid's plug goes into the vessel, m."""
OVER_RIM = 0.035
"""From a rim up to the fingertips that pass over it, m; the hand arrives within 15 mm."""
OFF_LID = 0.20
"""How far the hand draws back, m: RoboCasa wants 15 cm from the grip point to the lid."""


def cover(arm: Arm, role: str, lid_role: str) -> Motion:
    """Pick up a lid by its knob, put it on a vessel's rim, let go and draw back."""
    low, high = Furniture(arm, role).extent()
    rim = np.append((low + high)[:2] / 2.0, high[2])
    bottom, top = Furniture(arm, lid_role).extent()
    knob = np.append((bottom + top)[:2] / 2.0, top[2] - KNOB)
    beside = arm.aside(knob) - arm.aside(rim)
    half_width = float(np.abs(arm.left) @ (high - low)[:2]) / 2.0
    close = abs(beside) - half_width < PALM_ROOM
    hand = arm.hand(LID_PITCH, yaw=-math.copysign(LID_YAW, beside) if close else 0.0)
    yield from _rise_above(arm, high[2])
    yield from arm.drive(arm.floor_point(arm.ahead(knob) - LID_STAND, arm.aside(knob)))
    yield from arm.open_to(0.9)
    yield from arm.move(raised(knob, 0.14), hand, tolerance=0.02, steps=160)
    yield from arm.move(knob, hand, tolerance=0.008, speed=0.5, steps=60)
    yield from arm.grip(True)
    grip = arm.position - np.append(knob[:2], bottom[2])
    lift = float(rim[2]) + 0.05 + grip[2]
    yield from arm.move(np.append(arm.position[:2], lift), hand, tolerance=0.03, speed=0.5)
    stand = arm.floor_point(arm.ahead(rim) - LID_STAND, arm.aside(rim))
    yield from arm.drive(stand, speed=0.5)
    on = rim + grip
    yield from arm.move(raised(on, 0.05), hand, tolerance=0.01, speed=0.5)
    yield from arm.move(
        raised(on, -PLUG), hand, tolerance=0.008, speed=0.3, steps=60, required=False
    )
    yield from arm.grip(False)
    yield from arm.move(arm.position - OFF_LID * hand[:, 2], hand, tolerance=0.03, required=False)


def _rise_above(arm: Arm, rim: float) -> Motion:
    """Raise the hand straight up, the fingers as they are: it may hang into the open vessel."""
    yield from arm.open_by(0)
    lift = rim + FINGERTIP + OVER_RIM - arm.position[2]
    if lift > 0.0:
        yield from arm.move(raised(arm.position, lift), tolerance=0.015, speed=0.6, steps=60)
