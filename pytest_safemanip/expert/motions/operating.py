"""Opening, closing, turning and pressing what fixtures have: doors, drawers, racks, lids, knobs,
levers, spouts, buttons.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pytest_safemanip.expert.motions.joints import let_go, move_joint, take_hold
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import START_BUTTON, Furniture, Part, Thing
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import corners

WIDE, OUT, SHUT = 0.06, 0.03, 0.004
"""How far from open a door and a drawer may stay, and how far from shut, shares of their travel:
RoboCasa asks for nine tenths, and for half a percent."""
MOST = 0.03
"""Likewise for levers and switches, of their whole travel."""
RACK_MIDDLE = 0.75
"""A rack that is farther out than this is pushed in."""
KNOB_OFF, KNOB_ON, TIMED = 0.12, 1.2, 0.6
"""Angles of a burner's knob that is off for certain, and at a medium flame, and of a timer, rad:
RoboCasa's limits are 0.35 rad, and a tenth of 3.4 rad for a timer, which runs down."""
HOT = (0, 1, 4)
"""Prices of stages at what is hot: a hand that takes hold three times is there for 15 seconds."""
KNOB_NEAR = 0.2
"""How far from there a knob may stay, rad."""
SPOUT_TURN, SPOUT_NEAR = 0.58, 0.05
"""Angle to which a spout is swung, and how far from there it may stay, rad: RoboCasa's sectors
begin at 30 degrees."""
PRESSED, AWAY = 0.02, 0.22
"""How far behind a button's face the fingers aim, m, and how far the base draws back then, m:
RoboCasa wants 15 cm from the grip point to the button."""
LEVER_REST = 0.3
"""Openness below which a lever has come up again."""
LONGEST = 60.0
"""Seconds that are waited for that; RoboCasa's toasters take 25."""


def open_all(arm: Arm, role: str) -> Motion:
    """Open each door or drawer of a fixture, one after the other.

    Raises:
        SkillFailed: if one does not open; likewise the others here if something does not move.
    """
    fixture = Furniture(arm, role)
    for joint in _openings(fixture):
        yield from open_joint(arm, fixture, joint)


def _openings(fixture: Furniture) -> list[Joint]:
    """Doors and drawers of a fixture; none of shelves, which are open.

    Raises:
        SkillFailed: if it has neither them nor an inside.
    """
    doors = fixture.doors()
    return doors if doors or fixture.interiors() else fixture.lacks("door")


def open_joint(arm: Arm, fixture: Furniture, joint: Joint) -> Motion:
    """Open a door or drawer."""
    yield from move_joint(arm, fixture, joint, 1.0, WIDE if joint.kind == "hinge" else OUT)


def open_before(arm: Arm, role: str, object_role: str) -> Motion:
    """Open the doors of a fixture that an object is behind."""
    fixture, thing = Furniture(arm, role), Thing(arm, object_role)
    for joint in fixture.doors():
        if joint.kind == "hinge" and _before(arm, joint, thing.centre):
            yield from open_joint(arm, fixture, joint)


def _before(arm: Arm, joint: Joint, point: Array) -> bool:
    """Whether a door, closed, covers a point."""
    box = np.asarray(corners(np.array(joint.pose), np.array(joint.half)), np.float64)
    across = [arm.aside(corner) for corner in box]
    low, high = box[:, 2].min(), box[:, 2].max()
    return bool(low < point[2] < high and min(across) < arm.aside(point) < max(across))


def close_all(arm: Arm, role: str) -> Motion:
    """Close each door or drawer of a fixture that is open, one after the other."""
    fixture = Furniture(arm, role)
    for joint in _openings(fixture):
        yield from move_joint(arm, fixture, joint, 0.0, SHUT)


def slide_rack(arm: Arm, role: str) -> Motion:
    """Move the uppermost rack to its other end: out if it is not yet out, else in."""
    fixture = Furniture(arm, role)
    rack = fixture.upper_rack()
    goal = 0.0 if fixture.openness(rack) > RACK_MIDDLE else 1.0
    yield from move_joint(arm, fixture, rack, goal, OUT)


def open_rack(arm: Arm, role: str) -> Motion:
    """Draw the uppermost rack out."""
    fixture = Furniture(arm, role)
    yield from move_joint(arm, fixture, fixture.upper_rack(), 1.0, OUT)


def close_rack(arm: Arm, role: str) -> Motion:
    """Push the uppermost rack in."""
    fixture = Furniture(arm, role)
    yield from move_joint(arm, fixture, fixture.upper_rack(), 0.0, OUT)


def lift_head(arm: Arm, role: str) -> Motion:
    """Lift the head of a stand mixer."""
    mixer = Furniture(arm, role)
    yield from move_joint(arm, mixer, mixer.joint(Part.MIXER_HEAD), 1.0, SHUT)


def turn_lever(arm: Arm, role: str) -> Motion:
    """Push a faucet's lever aside."""
    sink = Furniture(arm, role)
    yield from move_joint(arm, sink, sink.joint(Part.TAP_LEVER), 1.0, MOST)


def swing_spout(arm: Arm, role: str) -> Motion:
    """Swing a tap's spout to both sides."""
    sink = Furniture(arm, role)
    joint = sink.joint(Part.SPOUT)
    for way in (1.0, -1.0):
        yield from turn_to(arm, sink, joint, way * SPOUT_TURN, SPOUT_NEAR)


def turn_to(
    arm: Arm,
    fixture: Furniture,
    joint: Joint,
    angle: float,
    near: float = KNOB_NEAR,
    prices: Sequence[int] = (),
) -> Motion:
    """Turn a knob or a spout to an angle, rad, or as near to it; prices are those of stages."""
    goal, off = angle / joint.travel, near / joint.travel
    yield from move_joint(arm, fixture, joint, goal, off, prices=prices)


def turn_off_burners(arm: Arm, role: str) -> Motion:
    """Turn off each burner of a stove that is on.

    Raises:
        SkillFailed: if it has no burners, or one stays on.
    """
    stove = Furniture(arm, role)
    for joint in stove.burning():
        yield from turn_to(arm, stove, joint, KNOB_OFF, KNOB_OFF, HOT)


def turn_on_burner_under(arm: Arm, role: str, thing_role: str) -> Motion:
    """Turn on the burner that an object stands on."""
    stove = Furniture(arm, role)
    yield from turn_to(arm, stove, stove.knob_under(Thing(arm, thing_role).centre), KNOB_ON)


def turn_timer(arm: Arm, role: str) -> Motion:
    """Turn up an oven's timer."""
    oven = Furniture(arm, role)
    yield from turn_to(arm, oven, oven.joint(Part.TIMER), TIMED)


def press(arm: Arm, role: str) -> Motion:
    """Push down a fixture's lever or switch, or press its start button.

    Raises:
        SkillFailed: if it has neither, or it does not move.
    """
    fixture = Furniture(arm, role)
    for part in (Part.TOASTER_LEVER, Part.SWITCH):
        for joint in fixture.joints(part)[:1]:
            yield from move_joint(arm, fixture, joint, 1.0, MOST)
            return
    yield from press_button(arm, fixture, fixture.button(START_BUTTON))


def press_button(arm: Arm, fixture: Furniture, button: Joint) -> Motion:
    """Press a button that nothing is known to move, and draw back.

    Raises:
        SkillFailed: if that starts nothing.
    """
    hold = yield from take_hold(arm, fixture, button, 1.0, "hold")
    into = hold.point + PRESSED * np.asarray(button.axis)
    yield from arm.move(into, hold.hand, tolerance=0.004, speed=0.1, steps=30, required=False)
    yield from let_go(arm, hold, button)
    if fixture.off():
        raise SkillFailed(f"{button.key} was pressed in vain")
    yield from arm.drive(arm.base - AWAY * arm.forward)


def wait_for_release(arm: Arm, role: str) -> Motion:
    """Hold still until a fixture's lever has come up again.

    Raises:
        SkillFailed: if it does not.
    """
    fixture = Furniture(arm, role)
    joint = fixture.only(Part.TOASTER_LEVER)
    for _ in range(round(LONGEST / arm.scene.control_period)):
        if fixture.openness(joint) < LEVER_REST:
            return
        yield arm.hold()
    raise SkillFailed(f"the lever of {fixture.entity} stayed down")
