"""Pressing a button on a panel, a switch or a lever."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import FINGERTIP
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.standing import stand, stand_before
from pytest_safemanip.expert.world.things import START_BUTTON, Furniture, Part
from pytest_safemanip.trace.elements import Joint

BUTTON_HEIGHTS, BUTTON_PITCHES, BUTTON_STANDS = (1.25, 1.45), (65.0, 75.0), (0.50, 0.65)
"""Height of a button, m; from straight down to the hand, degrees, and base to button, m: before a
low one, an arm that reaches far with a level hand is in a singular posture."""
BUTTON_AWAY = 0.22
"""How far the base draws back, m: RoboCasa wants 15 cm from the grip point to the button."""

SWITCH_PITCH = 45.0
SWITCH_YAW = 45.0
"""Degrees: the hand comes from the side on which the switch sticks out."""
SWITCH_STAND = (0.56, 0.38)
"""Base to switch, and to that side of it, m."""

TOASTER_LEVER_PITCH = 30.0
"""Degrees from straight down: the knuckles stay off the toaster's front, the wrist off what hangs
above it."""
TOASTER_LEVER_STAND = 0.60
LEVER_REST = 0.3
"""Openness below which a lever has come up again."""
LONGEST = 60.0
"""Seconds that are waited for that; RoboCasa's toasters take 25."""


def press(arm: Arm, role: str) -> Motion:
    """Press a fixture's start button, or push down its switch or lever, with closed fingertips.

    Raises:
        SkillFailed: if it has neither.
    """
    fixture = Furniture(arm, role)
    yield from arm.grip(True)
    switches, levers = fixture.joints(Part.SWITCH), fixture.joints(Part.TOASTER_LEVER)
    if levers:
        yield from push_lever(arm, fixture, levers[0])
    elif switches:
        yield from push_switch(arm, fixture, switches[0])
    else:
        yield from push_button(arm, fixture.control(START_BUTTON)[0][:3])


def push_button(arm: Arm, button: Array) -> Motion:
    """Push a button on a front panel, and draw back.

    Args:
        arm: the arm, its fingers closed.
        button: middle of the button (3,).
    """
    ahead = np.append(arm.forward, 0.0)
    hand = arm.hand(float(np.interp(button[2], BUTTON_HEIGHTS, BUTTON_PITCHES)), 90.0)
    far = float(np.interp(button[2], BUTTON_HEIGHTS, BUTTON_STANDS))
    if arm.ahead(arm.base) < arm.ahead(button) - far:
        # Raised before the base comes nearer: something may stand below the button.
        front = arm.point(arm.ahead(arm.base) + far - 0.12, arm.aside(arm.base), button[2])
        yield from arm.move(front, hand, tolerance=0.03, steps=160)
    yield from stand(arm, arm.ahead(button) - far, arm.aside(button))
    yield from arm.move(button - 0.12 * ahead, hand, tolerance=0.02, steps=160)
    yield from arm.move(button - 0.04 * ahead, hand, tolerance=0.006, speed=0.5, steps=60)
    yield from arm.move(button, hand, tolerance=0.005, speed=0.1, steps=30, required=False)
    yield from arm.move(button - 0.06 * ahead, hand, tolerance=0.03, steps=60)
    yield from arm.drive(arm.base - BUTTON_AWAY * arm.forward)


def push_switch(arm: Arm, fixture: Furniture, joint: Joint) -> Motion:
    """Push a switch along its joint, from above."""
    top = raised(np.asarray(joint.pose[:3]), joint.half[2])
    low, high = fixture.extent()
    side = math.copysign(1.0, arm.aside(top) - arm.aside((low + high) / 2.0))
    stand = np.array((arm.ahead(top), arm.aside(top))) + np.array((-1.0, side)) * SWITCH_STAND
    yield from arm.drive(arm.floor_point(*stand))
    hand = arm.hand(SWITCH_PITCH, yaw=-side * SWITCH_YAW)
    above = top + np.append(0.012 * side * arm.left, FINGERTIP)
    yield from arm.move(above - 0.14 * hand[:, 2], hand, tolerance=0.02, steps=160)
    yield from arm.move(raised(above, 0.03), hand, tolerance=0.018, speed=0.5, steps=60)
    yield from _push_down(arm, fixture, joint, hand, raised(above, -0.025))


def push_lever(arm: Arm, fixture: Furniture, joint: Joint) -> Motion:
    """Push a lever that sticks out of a front panel down along its joint, and draw back."""
    top = raised(np.asarray(joint.pose[:3]), joint.half[2])
    hand = arm.hand(TOASTER_LEVER_PITCH)
    yield from stand_before(arm, top, TOASTER_LEVER_STAND)
    above = raised(top, FINGERTIP)
    yield from arm.move(above - 0.14 * hand[:, 2], hand, tolerance=0.02, steps=160)
    yield from arm.move(raised(above, 0.02), hand, tolerance=0.008, speed=0.5, steps=60)
    yield from _push_down(arm, fixture, joint, hand, raised(above, -abs(joint.travel) - 0.02))


def _push_down(arm: Arm, fixture: Furniture, joint: Joint, hand: Array, lowest: Array) -> Motion:
    """Push a control down to the end of its travel, at most to a point (3,), and draw back."""
    yield from arm.move(
        lowest,
        hand,
        speed=0.2,
        steps=60,
        until=lambda: fixture.openness(joint) >= 0.97,
        required=False,
    )
    yield from arm.move(arm.position - 0.15 * hand[:, 2], hand, tolerance=0.03, required=False)


def wait_for_release(arm: Arm, role: str) -> Motion:
    """Hold still until a fixture's lever has come up again.

    Raises:
        SkillFailed: if it does not.
    """
    fixture = Furniture(arm, role)
    (joint,) = fixture.joints(Part.TOASTER_LEVER)
    for _ in range(round(LONGEST / arm.scene.control_period)):
        if fixture.openness(joint) < LEVER_REST:
            return
        yield arm.hold()
    raise SkillFailed(f"the lever of {fixture.entity} stayed down")
