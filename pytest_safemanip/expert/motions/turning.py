"""Turning a burner's knob, a tap's lever, a tap's spout."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import product

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed, fold_arm, raised
from pytest_safemanip.expert.robot.hand import FINGER_HALF_THICK, OPENING
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Furniture, Part, Thing
from pytest_safemanip.expert.world.ways import Leg, first_free, go
from pytest_safemanip.trace.elements import Joint
from pytest_safemanip.trace.geometry import about, matrix, rotate
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
KNOB_PITCHES = (90.0, 75.0, 60.0)
"""Of the hand, degrees from straight down."""
KNOB_BACK = 0.25
"""How far the base draws back for the hand to be turned before the stove, m."""
KNOB_DEEP, KNOB_OFF_BACK = 0.008, 0.0125
"""Grip point behind the fin's front at most, m, and before its back at least: the fingertips do not
press on the disc behind it."""
KNOB_BESIDE = 0.012
"""From the open fingers to the fin on both sides, m."""
KNOB_TURNS = (2.4, 0.8)
"""Angle that one grasp turns a knob by at most, rad: as far as the wrist turns."""
KNOB_STEP, KNOB_LEAD, KNOB_RAMP = 0.25, 0.6, 0.03
"""Angle after which a way round is looked at, by which the hand leads the knob at most, rad, and
how much more at each control step: stiff knobs take 1 N m."""
KNOB_STEPS = 200
"""Control steps of one turn at most."""
KNOB_GRASPS = 6
"""How often a knob is taken hold of at most."""
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
    """Turn a knob by its fin, between the fingers, as often as the wrist needs.

    Args:
        arm: the arm.
        stove: whose knob it is.
        joint: the knob.
        angle: where to, rad.

    Raises:
        SkillFailed: if no way to it is free, or it did not turn.
    """

    def left() -> float:
        return angle - stove.openness(joint) * joint.travel

    way = math.copysign(1.0, left())
    for _ in range(KNOB_GRASPS):
        if left() * way <= 0.0:
            return
        yield from _turn_once(arm, stove, joint, left)
    if left() * way > 0.2:
        raise SkillFailed(f"{joint.key} stopped {left():.2f} rad short")


def _turn_once(arm: Arm, stove: Furniture, joint: Joint, left: Callable[[], float]) -> Motion:
    """Take hold of a knob's fin and turn it as far as the wrist turns."""
    knob = _Fin(arm, stove, joint)
    yield from arm.open_to(knob.opening)
    permits = (("finger", f"{stove.entity}/{KNOB}"),)
    turns = [float(np.clip(left(), -turn, turn)) for turn in KNOB_TURNS]
    ways = [(angle, legs) for angle in turns for legs in _knob_ways(arm, knob, angle)]
    while True:
        legs = first_free(arm, (legs for _, legs in ways), joint.key, permits)
        taken = next(n for n, (_, other) in enumerate(ways) if other is legs)
        *coming, last = legs[: 1 + next(n for n, leg in enumerate(legs) if leg.touches)]
        try:
            yield from go(arm, coming)
            break
        except SkillFailed:
            # A posture that the arm does not come to: the next one, from where it comes to any.
            yield from arm.drive(arm.base - KNOB_BACK * arm.forward)
            yield from fold_arm(arm, required=False)
            ways = ways[taken + 1 :]
    angle, hand = ways[taken][0], arm.rotation if last.hand is None else last.hand
    yield from arm.move(last.point, hand, tolerance=0.006, speed=0.3, steps=60, required=False)
    yield from arm.grip(True)
    start, way = left(), math.copysign(1.0, angle)

    def turned() -> float:
        return start - left()

    for step in range(KNOB_STEPS):
        if turned() * way >= abs(angle):
            break
        lead = way * min(KNOB_LEAD, step * KNOB_RAMP)
        ahead = np.asarray(matrix(about(np.asarray(joint.axis), turned() + lead)))
        yield from arm.move(last.point, ahead @ hand, steps=1, required=False)
    yield from arm.open_to(knob.opening)
    yield from arm.move(coming[-1].point, tolerance=0.03, required=False)


class _Fin:
    """The fin of a knob, as it is now: where it is held, and the way round."""

    def __init__(self, arm: Arm, stove: Furniture, joint: Joint) -> None:
        fin = stove.foremost(joint)
        self._ahead, self._axis = arm.onward(1.0), np.asarray(joint.axis)
        aside, up = np.append(arm.left, 0.0), np.array((0.0, 0.0, 1.0))
        out, across, high = (float(np.ptp(fin @ axis)) / 2.0 for axis in (self._ahead, aside, up))
        turned = about(self._axis, stove.openness(joint) * joint.travel)
        anchor, centre = np.asarray(joint.anchor), (fin.min(axis=0) + fin.max(axis=0)) / 2.0
        deep = min(KNOB_DEEP, 2.0 * out - KNOB_OFF_BACK)
        self.point = anchor + rotate(turned, centre - anchor) - (out - deep) * self._ahead
        self.opening = min(1.0, 2.0 * (min(across, high) + KNOB_BESIDE) / OPENING)
        self._across = np.asarray(rotate(turned, aside if across < high else up))

    def hands(self, hand: Array) -> list[Array]:
        """A hand turned about its approach for its fingers to be on both sides, both ways."""
        roll = math.atan2(self._across @ hand[:, 1], self._across @ hand[:, 0])
        rolls = sorted((roll, roll - math.copysign(math.pi, roll)), key=abs)
        return [np.asarray(matrix(about(hand[:, 2], angle))) @ hand for angle in rolls]

    def coming(self, hand: Array) -> list[Leg]:
        """The way of a hand to it from before it."""
        near = Leg(self.point - 0.03 * hand[:, 2], hand, 0.008, 0.4, 160, exact=True)
        last = Leg(self.point, hand, 0.006, 0.3, 60, touches=True)
        return [Leg(self.point - 0.10 * hand[:, 2], hand, 0.02), near, last]

    def turning(self, hand: Array, angle: float) -> list[Leg]:
        """The way of a hand that turns it by an angle, rad."""
        parts = np.linspace(0.0, angle, math.ceil(abs(angle) / KNOB_STEP) + 1)[1:]
        return [
            Leg(self.point, np.asarray(matrix(about(self._axis, part))) @ hand, 0.01)
            for part in parts
        ]


def _knob_ways(arm: Arm, knob: _Fin, angle: float) -> Iterator[list[Leg]]:
    """Ways to take hold of a knob and to turn it by an angle, rad."""
    for hand in (hand for pitch in KNOB_PITCHES for hand in knob.hands(arm.hand(pitch))):
        yield [*knob.coming(hand), *knob.turning(hand, angle)]
    here = arm.ahead(arm.base), arm.aside(arm.base)
    for posed, far, shift, pitch in product((True, False), KNOB_STANDS, KNOB_ASIDE, KNOB_PITCHES):
        stand = arm.ahead(knob.point) - far, arm.aside(knob.point) + shift
        back = min(stand[0], here[0] - KNOB_BACK)
        drawn = [Leg(arm.floor_point(back, side)) for side in (here[1], stand[1])]
        base = Leg(arm.floor_point(*stand), tolerance=0.01)
        for hand in knob.hands(arm.hand(pitch)):
            coming = knob.coming(hand)
            legs = [Leg(coming[0].point - arm.onward(stand[0] - back), hand, 0.02)] if posed else []
            yield [*drawn, *legs, base, *coming, *knob.turning(hand, angle)]


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
