"""A stove: kettles, pans and pots on its burners, food into them there."""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.expert.motions.driving import draw_in, pitched
from pytest_safemanip.expert.motions.grasping import (
    MOST_YAW,
    PLATE_PITCH,
    across,
    come_in,
    grasp_and_lift,
    lift,
)
from pytest_safemanip.expert.motions.handles import STEADY, handle
from pytest_safemanip.expert.motions.putting import (
    BRAKE,
    SOFTLY,
    carry_over,
    held_over,
    leave,
    set_down,
    straighten,
)
from pytest_safemanip.expert.places.cabinet.placing import hangs
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, cut, raised
from pytest_safemanip.expert.robot.base import CAREFUL
from pytest_safemanip.expert.robot.hand import GAP, Grasp, finger_angle, hand_corners, reach_at
from pytest_safemanip.expert.robot.rotations import Array, fold
from pytest_safemanip.expert.world.contacts import carried_by_something
from pytest_safemanip.expert.world.hand_room import beside_furniture, beside_things
from pytest_safemanip.expert.world.rims import overhung
from pytest_safemanip.expert.world.standing import before_others, duck, nearest, stand_before
from pytest_safemanip.expert.world.things import Furniture, Thing, other_things

TO_HANDLE = 0.035
"""How far before the middle of a burner, as its handle points, the middle of a pan goes, m: so the
handle's weight is over the burner too."""
PAN_OVER = 0.03
"""Free space below a pan before it is set down, m."""

LOW_PITCH = 40.0
"""Degrees from straight down of a hand below a microwave: wrist and elbow stay low enough."""
PALM_OFF_RIM = 0.006
"""Free space between a palm and the rim below it, m: a hand that held raw meat soils it."""


def drop_into_pan(arm: Arm, role: str, pan_role: str) -> Motion:
    """Let something into a pan on a stove, the palm above its rim, from the front.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    thing, pan = Thing(arm, role), Thing(arm, pan_role)
    yield from draw_in(arm)
    if overhung(arm, pan.middle):
        yield from straighten(arm)
    hand = pitched(arm, LOW_PITCH)
    yield from arm.move(arm.position, hand, tolerance=0.03, speed=0.5, required=False)
    yield from carry_over(arm, role, pan.middle, pan.highest + BRAKE)
    palm = float(hand_corners(arm.rotation)[:, 2].min())
    down = float(arm.position[2]) + palm - pan.highest - PALM_OFF_RIM
    yield from cut(
        arm.move(
            raised(arm.position, -max(0.0, down)),
            tolerance=0.003,
            speed=SOFTLY,
            steps=200,
            required=False,
        ),
        lambda: carried_by_something(arm, thing),
    )
    yield from arm.grip(False)
    yield from leave(arm)


def place_on_named_burner(arm: Arm, role: str, stove_role: str) -> Motion:
    """Put a held pan on the burner that the instruction names.

    Raises:
        SkillFailed: if it names none, or hand or base does not get there.
    """
    pan = Thing(arm, role)
    spot = named_burner(arm, Furniture(arm, stove_role)) - TO_HANDLE * handle(pan)[1]
    aside = arm.aside(arm.base) + arm.aside(spot) - arm.aside(pan.middle)
    yield from bring_to_burner(arm, role, spot, nearest(arm, aside, aside))
    over = held_over(arm, pan, spot, float(spot[2]) + PAN_OVER)
    yield from arm.move(over, speed=0.3, tolerance=0.006, steps=80, required=False, exact=True)
    yield from set_down(arm, role)
    yield from leave(arm)


def named_burner(arm: Arm, stove: Furniture) -> Array:
    """The burner (3,) of a stove that the instruction names.

    Raises:
        SkillFailed: if it names none.
    """
    for index in arm.scene.boxes_of(stove.entity, "burner"):
        if arm.scene.boxes[index].name.replace("_", " ") in arm.instruction:
            return np.asarray(arm.step.box_pose[index][:3], np.float64)
    raise SkillFailed("the instruction names no burner")


PICK_PITCH = 15.0
"""Degrees from straight down: the fingertips still reach below the middle of a mushroom."""
SET_PITCH = 40.0
"""Likewise over a pot: wrist and forearm pass below a microwave over the stove's rear."""
PINCH_TURNS = (0.0, 90.0, 45.0, 135.0)
"""Of the fingers about what they pinch, degrees; what is not round has but the first two."""
ROUND_RATIO = 1.02
"""Length by width below which a thing is round."""
OFF_POT_MIDDLE = 0.029
"""From the middle of a pot to that of either of two things beside each other in it, m."""
BEFORE_POT_MIDDLE = 0.012
"""How far before its middle they lie, m: behind them there is room for the blade."""
PALM_OFF_POT, OFF_FLOOR = 0.006, 0.012
"""Free space between palm and rim, and below what is let go, m."""
OPENED_FARTHER = 0.1
"""How much farther the fingers are opened to let go, share of their opening: what lies beside them
is not pushed."""


def move_both_into_pot(arm: Arm, role: str, other_role: str, pot_role: str) -> Motion:
    """Put two things from the counter into a pot, beside each other, the lower one first: the
    fingers that let go of the other one are beside it.

    Raises:
        SkillFailed: if hand or base does not get there, or one was not lifted.
    """
    sides = {role: -OFF_POT_MIDDLE, other_role: OFF_POT_MIDDLE}
    for name in sorted(sides, key=lambda name: Thing(arm, name).height):
        yield from grasp_among_others(arm, name)
        yield from set_into(arm, name, pot_role, sides[name])


def grasp_among_others(arm: Arm, role: str) -> Motion:
    """Pinch a thing on the counter, the fingers turned away from what stands beside it.

    Raises:
        SkillFailed: if there is no room for the fingers, or if it was not lifted.
    """
    thing = Thing(arm, role)
    yield from duck(arm, arm.aside(thing.centre))
    yield from stand_before(arm, thing.centre, reach_at(PICK_PITCH))
    (_, width), (_, length) = thing.sides()
    turns = PINCH_TURNS if length < ROUND_RATIO * width else PINCH_TURNS[:2]
    grasps = [
        across(arm, thing, PICK_PITCH, turn=turn) for turn in turns if turn == 0.0 or length < GAP
    ]
    free = [
        min(beside_things(arm, thing, grasp), beside_furniture(arm, grasp.point, grasp.hand))
        for grasp in grasps
    ]
    best = max(range(len(grasps)), key=lambda number: min(free[number], 0.0))
    if beside_things(arm, thing, grasps[best]) < 0.0:
        raise SkillFailed(f"there is no room for the fingers beside {thing.entity}")
    yield from grasp_and_lift(arm, thing, grasps[best])


def set_into(arm: Arm, role: str, pot_role: str, aside: float) -> Motion:
    """Let a held thing into a pot, the palm just above its rim.

    Args:
        arm: the arm.
        role: the held thing.
        pot_role: the pot.
        aside: how far to the left of its middle the thing goes, m.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    thing, pot = Thing(arm, role), Thing(arm, pot_role)
    yield from draw_in(arm)
    hand = arm.hand(SET_PITCH)
    yield from arm.move(arm.position, hand, tolerance=0.03, turn_tolerance=0.08, speed=0.5)
    spot = pot.middle + np.append(arm.floor_point(-BEFORE_POT_MIDDLE, aside), 0.0)
    yield from carry_over(arm, role, spot, pot.highest)
    palm = float(hand_corners(arm.rotation)[:, 2].min())
    down = float(arm.position[2]) + palm - pot.highest - PALM_OFF_POT
    low = thing.bottom - max(0.0, min(down, thing.bottom - pot.bottom - OFF_FLOOR))
    yield from arm.move(
        held_over(arm, thing, spot, low),
        hand,
        speed=0.1,
        steps=120,
        until=lambda: thing.bottom < low + 0.002,
        required=False,
    )
    yield from arm.let_go(OPENED_FARTHER)
    yield from leave(arm)


BOW = 0.010
"""Grip point below the top of a kettle, m: the middle of its bow."""
BOW_OPEN = 0.7
"""Share of the full opening on the way to a bow: 2 cm of free space on both sides."""
BEFORE_BOW = 0.15
"""How far in front of a bow, m, the hand comes down to its height: in below a wall cabinet, 45 cm
above the counter, with the wrist 30 cm above the hand."""
BOW_ENTRY = 0.06
"""Before the grip point along the approach, m, from where the hand goes straight: the fingertips
come in above the bow."""
ALONG_STOVE_BACK = 0.33
"""How far the base draws back before it drives along the stove, m: off what stands on it and what
hangs above."""
KETTLE_RISE = 0.05
"""How far it is lifted, m: a stove is as high as a counter, and something may hang above it."""
ALONG_STOVE_STEPS = 500
"""Control steps for the way along a counter."""
ROLLED_PITCH = 12.0
"""Degrees from straight down for fingers that are not level: more, and the bow turns in them."""
KETTLE_TOUCH, KETTLE_ROOM = 0.12, 0.24
"""From a kettle's middle to what stands beside it, on its way to a burner too, m: body and spout
reach 10 cm, and it swings by 2 cm; and what is better where it is driven towards a vessel behind.
Vessels side by side in front have it.
"""
OFF_BURNER = (0.0, 0.02, -0.02, 0.04, -0.04)
"""How far beside a burner's middle something may stand for what is beside it, m."""
BEFORE_BURNER = 0.03
"""How much nearer than a burner's middle it stands below a microwave, m: its handle stands out over
the front burners, 1 cm from a wrist above a kettle."""
WRIST_DEEP = 0.15
"""So far behind the front of a microwave, m, the wrist above a kettle does not get."""


def grasp_bow(arm: Arm, role: str) -> Motion:
    """Pick up a kettle by its bow, which runs along its longer side.

    Raises:
        SkillFailed: if it was not lifted.
    """
    thing = Thing(arm, role)
    roll = fold(finger_angle(arm, thing.sides()[0][0]), 120.0)
    yaw = fold(roll, 90.0)
    level = abs(yaw) <= MOST_YAW
    pitch = PLATE_PITCH if level else ROLLED_PITCH
    hand = arm.hand(pitch, yaw=yaw) if level else arm.hand(pitch, roll)
    yield from stand_before(arm, thing.middle, reach_at(pitch))
    point = np.append(thing.middle[:2], thing.highest - BOW)
    entry = point - BOW_ENTRY * hand[:, 2]
    yield from arm.open_to(BOW_OPEN)
    front = entry - arm.onward(BEFORE_BOW)
    yield from arm.move(front, hand, tolerance=0.02, turn_tolerance=0.08, steps=140)
    stops = ((BOW_ENTRY, 0.006, 0.8), (0.0, 0.006, 0.3))
    yield from come_in(arm, Grasp(point, hand, BOW_OPEN), stops, 0.06)
    yield from lift(arm, thing, hand, KETTLE_RISE)


def place_on_free_burner(arm: Arm, role: str, stove_role: str) -> Motion:
    """Put a held vessel on a stove's burner: of those with room, in front and the nearest.

    Raises:
        SkillFailed: if none has room, or hand or base does not get there.
    """
    spot = free_burner(arm, Thing(arm, role), Furniture(arm, stove_role))
    yield from bring_to_burner(arm, role, spot)
    yield from set_down(arm, role)
    yield from leave(arm)


def bring_to_burner(arm: Arm, role: str, spot: Array, most: float = math.inf) -> Motion:
    """Bring a held vessel over a burner, in low from the front.

    Args:
        arm: the arm.
        role: the vessel.
        spot: the burner (3,).
        most: how far ahead the base may come, m; the hand goes the rest.

    Raises:
        SkillFailed: if hand or base does not get there.
    """
    thing = Thing(arm, role)
    back = arm.ahead(arm.base) - ALONG_STOVE_BACK
    aside = arm.aside(arm.base) + arm.aside(spot) - arm.aside(thing.middle)
    into = min(most, arm.ahead(arm.base) + arm.ahead(spot) - arm.ahead(thing.middle))
    back = min(back, before_others(arm, thing, aside))
    for ahead, side in ((back, arm.aside(arm.base)), (back, aside)):
        yield from arm.drive(arm.floor_point(ahead, side), speed=CAREFUL, steps=ALONG_STOVE_STEPS)
    low = raised(arm.position, min(0.0, float(spot[2]) + KETTLE_RISE - thing.bottom))
    yield from arm.move(low, speed=STEADY, tolerance=0.02)
    yield from arm.drive(arm.floor_point(into, aside), speed=CAREFUL)


def free_burner(arm: Arm, thing: Thing, stove: Furniture) -> Array:
    """Where on a burner (3,) there is most room; with room enough, in front, then on its middle,
    then with room to swing, near.

    Raises:
        SkillFailed: if there is room on none.
    """
    others = other_things(arm, thing)

    def good(place: tuple[float, Array]) -> tuple[float, ...]:
        off, spot = place
        way = [spot[:2] - back * arm.forward for back in np.linspace(0.0, ALONG_STOVE_BACK, 12)]
        room = min((_gap(other, point) for other in others for point in way), default=KETTLE_ROOM)
        aside = abs(arm.aside(thing.middle) - arm.aside(spot))
        front = -round(arm.ahead(spot), 2)
        return min(room, KETTLE_TOUCH), front, -abs(off), min(room, KETTLE_ROOM), -aside

    return max(_places(arm, thing, stove), key=good)[1]


def _places(arm: Arm, thing: Thing, stove: Furniture) -> list[tuple[float, Array]]:
    """Where on its burners a held vessel could stand (3,), and how far to the left of the middle
    that is, m; the wrist above what hangs in the fingers is as high as what hangs over the stove.
    """
    number = arm.scene.boxes_of(stove.entity, "burner")
    spots = [np.asarray(arm.step.box_pose[k][:3], np.float64) for k in number]
    if hangs(arm, thing):
        nearer, high = (
            BEFORE_BURNER * np.append(arm.forward, 0.0),
            float(arm.position[2]) - thing.bottom,
        )
        spots = [
            spot - nearer if overhung(arm, raised(spot, high)) else spot
            for spot in spots
            if not overhung(arm, raised(spot, high), WRIST_DEEP)
        ]
    if not spots:
        raise SkillFailed(f"the hand has no room over {stove.entity}")
    aside = np.append(arm.left, 0.0)
    return [(off, spot + off * aside) for spot in spots for off in OFF_BURNER]


def _gap(vessel: Thing, point: Array) -> float:
    """Distance on the level from a point (2,) to a round vessel and to its handle, which lies along
    the middle of its box, m.
    """
    (_, width), (axis, length) = vessel.sides()
    way = point - vessel.centre[:2]
    along = float(np.clip(way @ axis[:2], -length / 2.0, length / 2.0))
    body = float(np.linalg.norm(point - vessel.middle[:2])) - width / 2.0
    return min(body, float(np.linalg.norm(way - along * axis[:2])))
