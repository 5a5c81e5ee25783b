"""Turning a burner's knob, a tap's lever, a tap's spout."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import product

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import FINGER_HALF_THICK
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture, Part, Thing
from pytest_safemanip.expert.world.ways import Leg, first_free, go
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import about, rotate
from pytest_safemanip.trace.kinematics import carried

LEVER = "handle"
"""What the simulator calls a tap's lever."""
LEVER_ASIDE = (0.13, 0.22, 0.0)
"""Base to the lever, away from the spout, m: the forearm passes beside the spout."""
LEVER_STAND = (0.76, 0.70)
"""Greatest and least distance of the base from the lever, m."""
LEVER_TURN = 0.30
"""Nearer than this to the lever the hand is turned only after it drew back, m: the spout comes out
18 cm, and a wrist that turns beside it takes 10 cm."""
LEVER_HANDS = ((40.0, 0.0), (88.0, 20.0), (75.0, 0.0), (60.0, 20.0), (88.0, 40.0))
"""Pitch of the hand, and how far it is turned towards the side that the lever goes to, degrees."""
LEVER_BELOW = (0.02, 0.0)
"""Below the lever's top, m."""
LEVER_OPEN = 0.95
LEVER_SPEEDS = (0.2, 0.5, 0.9)
"""Shares of the top speed at which a lever is pushed, with 8 N, 20 N and 36 N: some are stiff."""
LEVER_STARTS = ((0.04, 0.0), (0.022, 0.004))
"""How far beside the lever's middle the grip point is before it pushes, and how much nearer, m: far
off, or in the gap of 3 cm between lever and spout."""


def turn_lever(arm: Arm, role: str) -> Motion:
    """Push a faucet's lever aside with closed fingers.

    Raises:
        SkillFailed: if nothing is free beside it.
    """
    sink = Furniture(arm, role)
    joint = sink.joint(Part.TAP_LEVER)
    yield from arm.grip(True)
    permits = (("finger", f"{sink.entity}/{LEVER}"),)
    goal = f"the lever of {sink.entity}"
    *way, push = first_free(arm, _lever_ways(arm, sink, joint), goal, permits)
    yield from go(arm, way)

    def opened() -> bool:
        return sink.openness(joint) > LEVER_OPEN

    for speed in LEVER_SPEEDS:
        if not opened():
            yield from arm.move(
                push.point, push.hand, speed=speed, steps=60, until=opened, required=False
            )
    if not opened():
        raise SkillFailed(f"{goal} stopped at {sink.openness(joint):.0%}")
    back = arm.position - 0.15 * arm.rotation[:, 2]
    yield from arm.move(back, tolerance=0.04, required=False)


def _lever_ways(arm: Arm, sink: Furniture, joint: Joint) -> Iterator[list[Leg]]:
    """Ways to push a lever, those that suit most taps first."""
    pose, half = sink.handle(joint)
    way = _lever_direction(arm, joint, raised(pose[:3], half[2]))
    aside = np.append(way * arm.left, 0.0)
    for stand, below, (beside, near), (pitch, yaw) in product(
        LEVER_ASIDE, LEVER_BELOW, LEVER_STARTS, LEVER_HANDS
    ):
        top = raised(pose[:3], half[2] - below) - arm.onward(near)
        ahead = float(np.clip(arm.ahead(arm.base), *(arm.ahead(top) - np.array(LEVER_STAND))))
        legs = [Leg(arm.floor_point(ahead, arm.aside(top) + way * stand))]
        hand = arm.hand(pitch, 90.0, way * yaw)
        if arm.ahead(arm.position) > arm.ahead(top) - LEVER_TURN:
            back = arm.ahead(top) - LEVER_TURN - 0.08
            free = arm.point(back, arm.aside(arm.position), top[2] + 0.10)
            legs.append(Leg(free, hand, 0.05, steps=100))
        start = top - beside * aside
        legs.append(Leg(start - 0.14 * hand[:, 2], hand, 0.02, 0.6))
        tight = near > 0.0
        legs.append(Leg(start, hand, 0.004 if tight else 0.012, 0.5, 80, exact=tight))
        yield [*legs, Leg(start + 0.10 * aside, hand, speed=0.2, steps=80)]


def _lever_direction(arm: Arm, joint: Joint, top: Array) -> float:
    """1 if the lever's top moves to the base's left when it opens, -1 to its right."""
    motion = np.cross(np.asarray(joint.axis), top - np.asarray(joint.anchor))
    return math.copysign(1.0, arm.aside(motion))


KNOB = "knob"
"""What the simulator calls a burner's knob."""
KNOB_STANDS = (0.66, 0.74, 0.82)
"""Base to knob, m."""
KNOB_ASIDE = (0.0, 0.12, -0.12)
"""How far to the left of a knob the base may stand, m."""
KNOB_HANDS = ((45.0, 0.0), (60.0, 0.0), (60.0, 25.0), (60.0, -25.0), (75.0, 0.0), (30.0, 0.0))
"""Pitch of the hand and its yaw, degrees: steeper than 45 is out of reach at most stoves' panels."""
KNOB_BACK = 0.25
"""How far the base draws back for the hand to be turned before the stove, m."""
KNOB_LOOKED = 0.5
"""Angle after which the way round a knob is looked at again, rad."""
KNOB_BEYOND = 0.0085
"""From a fin's end to the circle on which the fingertip goes round, m: it passes just beyond."""
KNOB_INWARD = (0.001, -0.004)
"""Grip point behind the knob's front, m: the fingertips overlap the fin by 1 cm or by 5 mm."""
KNOB_TRAIL = math.radians(42.0)
"""Angle by which the fingertip follows the fin's end when finger and fin touch."""
KNOB_LEAD = 0.3
"""How much farther round the fingertip then is before it touches, rad."""
FISTED_HALF, KNOB_PAST = 0.0145, 0.006
"""Half the width of both closed fingertips, m, and how far beside the fin they come in, m: the hand
errs by 3 mm, and on the fin's front they would press with 90 N."""
KNOB_PRESS = 0.03
"""How far along its circle's tangent the finger aims ahead of touching, m: knobs yield to that."""
KNOB_TOUCH, KNOB_YIELDED = 0.2, 0.02
"""Speed at which the finger meets the fin, and the angle from which the knob yields, rad: met
twice as fast, it is hit with 60 to 90 N."""
KNOB_TRIES = 2
"""A fingertip that slid along the fin towards its axis is set to its end once more."""
KNOB_OFF = 0.12
"""Knob angle that is off for certain, rad: RoboCasa's limit is 0.35."""
KNOB_ON = 1.2
"""Knob angle of a medium flame, rad."""


def turn_off_burners(arm: Arm, role: str) -> Motion:
    """Turn off each burner of a stove that is on.

    Raises:
        SkillFailed: if a knob did not turn.
    """
    stove = Furniture(arm, role)
    for joint in stove.burning():
        yield from turn_knob(arm, stove, joint, KNOB_OFF)


def turn_on_burner_under(arm: Arm, role: str, thing_role: str) -> Motion:
    """Turn on the burner that an object stands on.

    Raises:
        SkillFailed: if the knob did not turn.
    """
    stove = Furniture(arm, role)
    yield from turn_knob(arm, stove, stove.knob_under(Thing(arm, thing_role).centre), KNOB_ON)


def turn_knob(arm: Arm, stove: Furniture, joint: Joint, angle: float) -> Motion:
    """Push a knob's fin round to an angle: the upper end to turn it up, the lower one down.

    Args:
        arm: the arm.
        stove: whose knob it is.
        joint: the knob.
        angle: where to, rad.

    Raises:
        SkillFailed: if it did not turn.
    """
    fin = stove.foremost(joint)
    centre = (fin.min(axis=0) + fin.max(axis=0)) / 2.0
    ahead_of, aside_of = fin @ np.append(arm.forward, 0.0), fin @ np.append(arm.left, 0.0)
    out, thick, high = (float(np.ptp(v)) / 2.0 for v in (ahead_of, aside_of, fin[:, 2]))
    level = thick > high
    thick, high = sorted((thick, high))
    orbit = high + KNOB_BEYOND
    aside = math.asin(min(1.0, (thick + FISTED_HALF + KNOB_PAST) / orbit)) - KNOB_TRAIL
    down = stove.openness(joint) * joint.travel > angle
    way = -1.0 if down else 1.0
    end = way * (np.append(arm.left, 0.0) if level else np.array((0.0, 0.0, 1.0)))
    ahead = np.append(arm.forward, 0.0)

    def turned() -> float:
        return stove.openness(joint) * joint.travel

    def beside(lead: float, away: Array) -> Array:
        at = about(np.asarray(joint.axis), turned() + way * (lead - KNOB_TRAIL))
        return np.asarray(centre + orbit * rotate(at, end) - away)

    def pressing() -> Array:
        touching = beside(0.0, away)
        tangent = beside(0.01, away) - touching
        return touching + KNOB_PRESS / float(np.linalg.norm(tangent)) * tangent

    def there() -> bool:
        return (turned() - angle) * way >= 0.0

    def coming(hand: Array, away: Array, off: Array) -> list[Leg]:
        return [
            Leg(beside(-aside, away + 0.10 * off), hand, 0.02),
            Leg(beside(-aside, away + 0.03 * off), hand, 0.012, 0.5, 60),
            Leg(beside(-aside, away), hand, 0.01, KNOB_TOUCH, 60),
            Leg(beside(-KNOB_LEAD, away), hand, 0.004, KNOB_TOUCH, 60),
        ]

    def ways() -> Iterator[list[Leg]]:
        here = arm.ahead(arm.base), arm.aside(arm.base)
        for far, shift, (pitch, yaw), inward, over in product(
            KNOB_STANDS, KNOB_ASIDE, KNOB_HANDS, KNOB_INWARD, (False, True)
        ):
            hand, away = arm.hand(pitch, yaw=yaw), (out - inward) * ahead
            came = coming(hand, away, hand[:, 2] if over else ahead)
            stand = arm.ahead(centre) - far, arm.aside(centre) + shift
            back = min(stand[0], here[0] - KNOB_BACK)
            drawn = [Leg(arm.floor_point(back, side)) for side in (here[1], stand[1])]
            posed = Leg(came[0].point - arm.onward(stand[0] - back), hand, 0.02)
            leads = np.arange(0.0, abs(angle - turned()), KNOB_LOOKED)
            sweep = [Leg(beside(lead, away), tolerance=0.01, speed=KNOB_TOUCH) for lead in leads]
            yield [Leg(arm.floor_point(*stand)), *came, *sweep]
            yield [*drawn, posed, Leg(arm.floor_point(*stand)), *came, *sweep]

    yield from arm.grip(True)
    permits = (("finger", f"{stove.entity}/{KNOB}"),)
    rest = len(np.arange(0.0, abs(angle - turned()), KNOB_LOOKED))
    legs = first_free(arm, ways(), joint.key, permits, touching=rest + 2)[:-rest]
    hand, off = legs[-2].hand, 10.0 * (legs[-2].point - legs[-4].point)
    assert hand is not None
    away = (float(centre @ ahead - legs[-2].point @ ahead)) * ahead
    for _ in range(KNOB_TRIES):
        yield from go(arm, legs[:-2])
        for leg in legs[-2:]:
            yield from arm.move(
                leg.point, hand, tolerance=leg.tolerance, speed=leg.speed, steps=60, required=False
            )
        yield from arm.move(
            pressing, hand, speed=KNOB_TOUCH, steps=40, until=_knob_moves(turned), required=False
        )
        yield from arm.move(pressing, hand, speed=0.3, steps=80, until=there, required=False)
        yield from arm.move(arm.position - 0.12 * off, hand, tolerance=0.03, required=False)
        if there():
            return
        legs = coming(hand, away, off)
    if (turned() - angle) * way < -0.2:
        raise SkillFailed(f"{joint.key} stopped at {turned():.2f} rad")


def _knob_moves(turned: Callable[[], float]) -> Callable[[], bool]:
    """Whether a knob yields, compared with now."""
    start = turned()
    return lambda: abs(turned() - start) > KNOB_YIELDED


SPOUT_PITCH = 50.0
SPOUT_REACH = 0.62
SPOUT_AWAY = 0.15
"""How far before and above the spout the hand changes sides, m."""
SPOUT_END = 0.03
"""From the end of a spout's arm to where it is pushed, m."""
SPOUT_GAP = 0.07
"""From the fingers to the spout before it is touched, m: half the palm, and room to stop."""
SPOUT_TURN = 0.58
"""Angle to which it is swung, rad: RoboCasa's sectors begin at 30 degrees."""


def swing_spout(arm: Arm, role: str) -> Motion:
    """Swing a tap's spout to both sides with closed fingers beside its arm.

    Raises:
        SkillFailed: if it does not turn.
    """
    sink = Furniture(arm, role)
    joint = sink.joint(Part.SPOUT)
    yield from arm.grip(True)
    for way in (1.0, -1.0):
        yield from push_spout(arm, sink, joint, way)


def push_spout(arm: Arm, sink: Furniture, joint: Joint, way: float) -> Motion:
    """Swing a spout to one side of the base: 1 to the left, -1 to the right."""
    anchor, middle = np.asarray(joint.anchor), np.asarray(joint.pose[:3])
    length = 2.0 * abs(arm.ahead(middle) - arm.ahead(anchor)) - SPOUT_END
    height = middle[2] + joint.half[2] - 2.0 * FINGER_HALF_THICK
    end = np.append(anchor[:2] - length * arm.forward, height)
    left = np.append(arm.left, 0.0)
    sense = math.copysign(1.0, arm.aside(np.cross(joint.axis, end - anchor)))

    def beside(angle: float, gap: float) -> Array:
        at = np.array(angle * sense / joint.travel)
        pose = np.append(end - way * gap * left, (1.0, 0.0, 0.0, 0.0))
        return np.asarray(carried(joint, pose, at)[:3])

    def angle() -> float:
        return sink.openness(joint) * joint.travel * sense

    hand = arm.hand(SPOUT_PITCH, 90.0, -math.degrees(angle()))
    start = beside(angle(), SPOUT_GAP)
    away = raised(start - arm.onward(SPOUT_AWAY), SPOUT_AWAY)
    yield from arm.move(away, hand, tolerance=0.04, turn_tolerance=0.3, steps=160)
    yield from arm.drive(arm.floor_point(arm.ahead(end) - SPOUT_REACH, arm.aside(start)))
    yield from arm.move(start - 0.1 * hand[:, 2], hand, tolerance=0.03, steps=160)
    yield from arm.move(start, hand, tolerance=0.02, speed=0.6, steps=60)
    yield from arm.move(
        lambda: beside(angle() + 0.25 * way, 0.03),
        hand,
        speed=0.5,
        steps=150,
        until=lambda: angle() * way >= SPOUT_TURN,
        required=False,
    )
    yield from arm.move(
        arm.position - 0.16 * hand[:, 2] - 0.03 * way * left, hand, tolerance=0.04, required=False
    )
    if angle() * way < SPOUT_TURN - 0.05:
        raise SkillFailed(f"the spout stopped at {angle():.2f} rad")
