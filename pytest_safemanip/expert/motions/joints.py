"""Moving whatever a joint moves: a door, a drawer, a rack, a lid, a knob, a lever, a spout.

The part is taken hold of where it can be, and the hand goes along with it; the base takes over
where the arm would be stretched. Where the hand lost it, or came to its end, it is taken anew.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from pytest_safemanip.expert.motions.holds import LETS_GO, Hold, holds, motion
from pytest_safemanip.expert.motions.navigation import face
from pytest_safemanip.expert.motions.taking import (
    FARTHEST,
    NEAREST,
    TWISTED,
    Takes,
    by_base,
    swings,
    turns_along,
)
from pytest_safemanip.expert.motions.travelling import step_aside
from pytest_safemanip.expert.robot.arm import Arm, Motion, NoWay, SkillFailed
from pytest_safemanip.expert.robot.base import BASE_DEAD_BAND, LASTING
from pytest_safemanip.expert.robot.hand import WRIST
from pytest_safemanip.expert.robot.kinematics import reach_of
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.candidates import OPTIONS
from pytest_safemanip.expert.world.standing import nearest, rearmost
from pytest_safemanip.expert.world.things import Furniture
from pytest_safemanip.expert.world.ways import Leg, go
from pytest_safemanip.trace.elements import ROBOT, Joint

STAGES, WIDE_STAGES, WIDE = (1, 2, 3), (2, 1, 3), 1.2
"""In how many stages a part may be moved, each with a hold of its own; one that is pushed round by
more than this, rad, usually in two: what pushes its outer side at first is in its way later."""
AGAIN = 3
"""How often more than once in each stage a part is taken hold of at most."""
STUCK = 0.02
"""A hold that takes it less far along, share of its travel, is the last one."""
SLOWEST, FASTEST, PULLED, BRAKE = 0.02, 0.15, 0.08, 1.0
"""Speeds of what is moved, m/s, of a door that is pulled by its handle, which creeps out of the
fingers the more the harder they pull, and in how many seconds it comes to rest, s."""
LEAST_LEAD, MOST_LEAD, LEAD_GAIN, YIELD_GAIN = 0.004, 0.09, 0.01, 0.03
"""How far ahead of the part the hand aims to press on it, m, and how much farther, or less far, in
each control step for each m/s that the part is too slow, or too fast."""
STIFFNESS, LAGS = 500.0, 0.19
"""Of the hand, N/m, and by how much it lags behind where it aims, s."""
FRICTION, BACKED = 0.6, 0.7
"""Share of the fingers' force by which a hand pulls, for what they pinch not to slip, unless it
moves along their travel by more than this, as a cosine: then a finger is behind it."""
FIRM = 40.0
"""Fingers that turn a knob, or push a lever or a spout, with more force than this, N, move it as
much more slowly: what is heavy, or damped, takes time, and strikes back where it is lost."""
PATIENCE = 30
"""Control steps in which a part that is pushed with all force has to have moved."""
CREEPS, CREPT = 60, 0.006
"""Control steps in which any part has to have moved so far, m."""
WITHIN = 0.03
"""How far inside of that the base brings it, m."""
STEPS = 500
"""Control steps of one hold at most."""
LOST = 0.5
"""Fingers that have closed to less than this share of what they were open have lost what they held.
"""
OFF = 0.04
"""A hand that is farther from where it holds has lost it, m."""
BY_HAND = 0.05
"""The last stretch, which the base would not end gently, m."""
BETWEEN = 4
"""Control steps between two in which the hand goes on while the base drives."""
BASE_SPEED = 0.37
"""Of the base at a full command, m/s."""
SETTLES, RESTS = 40, 0.02
"""Control steps in which a part comes to rest, and how much of its travel it then moves in 1 s."""
LOOKAHEAD = 0.06
"""How far ahead of it is looked for what stands there, m."""
TURNS = (0.75, 1.0, 0.0)
"""Shares of a door's turn that a hand turns with it; the bar turns between the pads."""
TWIST, TWISTING = 0.08, 0.03
"""A hand that turns with what it holds does so as fast as a point TWISTED off the hinge at this
speed, m/s, and is so far ahead at most, m."""


def move_joint(
    arm: Arm,
    fixture: Furniture,
    joint: Joint,
    goal: float,
    off: float = 0.02,
    prices: Sequence[int] = (),
    again: int = AGAIN,
) -> Motion:
    """Move what a joint moves until it is as open as wanted.

    Args:
        arm: the arm.
        fixture: whose part it is.
        joint: the joint.
        goal: openness.
        off: how far from the goal it may stay on this side.
        prices: of moving it in the usual number of stages, in another one, and in three.
        again: how often more than that it is taken hold of, where the hand lost it.

    Raises:
        SkillFailed: if it does not get there.
    """
    way = math.copysign(1.0, goal - fixture.openness(joint))

    def there(share: float = 1.0) -> bool:
        return (fixture.openness(joint) - goal) * way >= -share * off

    def passed(end: float) -> bool:
        return (fixture.openness(joint) - end) * way >= 0.0 or there(0.7)

    slips, first = False, fixture.openness(joint)
    # Another hold is likelier to help than other stages, and is asked for first.
    arm.choices.choose(f"hold 1 of {joint.name}", range(OPTIONS))
    wide = swings(joint) and (first - goal) * abs(joint.travel) > WIDE
    stages = WIDE_STAGES if wide else STAGES
    several = arm.choices.choose(f"stages of {joint.name}", stages, prices)
    for number in range(1, 1 + several + again):
        if there():
            return
        before = fixture.openness(joint)
        next_ = first + (goal - first) * min(1.0, number / several)
        try:
            hold = yield from take_hold(arm, fixture, joint, next_, f"hold {number}", slips)
        except NoWay as error:
            if number == 1:
                raise
            raise SkillFailed(f"{joint.key} stopped at {before:.0%}, {error}") from error
        # Where arm or hand would meet something on the way, another hold does the rest.
        next_ = before + hold.until * (next_ - before)
        # A later hold only has the rest to do, and goes as far as it comes.
        turns = number == 1 and _twists(joint, hold)
        if turns and not turns_along(arm, hold, joint, next_ - before):
            raise SkillFailed(f"the wrist comes to its end before {joint.key} is there")
        yield from follow(
            arm,
            fixture,
            joint,
            hold,
            # What is pushed does not come to rest in between.
            next_ if hold.pinched or hold.until < 1.0 else goal,
            partial(passed, next_),
        )
        by = fixture.openness(joint) - before
        yield from let_go(arm, hold.moved(joint, by, 0.0), joint, by)
        yield from _settled(arm, joint)
        slips = hold.pinched and not passed(next_)
        if abs(fixture.openness(joint) - before) < STUCK:
            break
    if not there():
        raise SkillFailed(f"{joint.key} stopped at {fixture.openness(joint):.0%}")


def take_hold(
    arm: Arm,
    fixture: Furniture,
    joint: Joint,
    goal: float,
    what: str,
    slips: bool = False,
    pinched: bool = False,
) -> Generator[Array, None, Hold]:
    """Bring the hand to a part, and close it where it is to be pinched.

    Args:
        arm: the arm.
        fixture: whose part it is.
        joint: moves it.
        goal: openness wanted.
        what: name of the choice.
        slips: whether it slipped out of the fingers.
        pinched: whether it has to be held between them.

    Returns:
        The hold, as it is then.

    Raises:
        SkillFailed: if no way there is free.
    """
    yield from face(arm, fixture.entity)
    yield from step_aside(arm)
    first = fixture.openness(joint)
    hold, legs = _free(arm, fixture, joint, goal, what, slips, pinched)
    yield from arm.open_to(hold.opening)
    *coming, last = legs
    yield from go(arm, coming)

    way = math.copysign(1.0, goal - first)

    def now(least: float = -math.inf) -> Hold:
        return hold.moved(joint, way * max(least, way * (fixture.openness(joint) - first)), 0.0)

    # A hand that pushes does not run after what it moves the wrong way.
    least = -math.inf if hold.pinched else 0.0
    yield from arm.move(
        lambda: now(least).point,
        hold.hand,
        tolerance=0.004,
        speed=last.speed,
        steps=50,
        required=False,
    )
    if not hold.pinched:
        return now()
    if float(np.linalg.norm(now().contact - hold.contact)) > OFF:
        raise SkillFailed(f"{joint.key} was pushed away")
    yield from arm.grip(True)
    return replace(hold, contact=arm.position, point=arm.position)


def _free(
    arm: Arm,
    fixture: Furniture,
    joint: Joint,
    goal: float,
    what: str,
    slips: bool,
    pinched: bool,
) -> tuple[Hold, Sequence[Leg]]:
    """A hold to which there is a free way, and that way; the arguments are those of
    :func:`take_hold`.

    Raises:
        SkillFailed: if there are not so many.
        NoWay: if there is none; says what is in the way of those that were tried first.
    """
    first = fixture.openness(joint)
    state = arm.step.joint.tobytes(), arm.step.eef_pose.tobytes(), arm.step.base_pose.tobytes()

    def ways(wider: bool) -> Takes:
        bars = fixture.boxes("handle", joint.name)
        found = holds(arm, joint, bars, first, goal, slips, wider)
        found = [hold for hold in found if hold.pinched or not pinched]
        return Takes(arm, found, joint, first, goal)

    def free(number: int, wider: bool = False) -> tuple[Hold, Sequence[Leg]]:
        asked = f"{what} {goal} {slips} {pinched} {wider} of {joint.key}"
        takes = arm.latest(asked, state, lambda: ways(wider), LASTING)
        return takes.free(number, joint)

    def none(wider: bool) -> NoWay | None:
        """Why there is no way at all; None if there is one."""
        try:
            free(0, wider)
        except NoWay as error:
            return error
        return None

    number = arm.choices.choose(f"{what} of {joint.name}", range(OPTIONS))
    usual = None if pinched else none(False)
    # What is rarely needed helps knobs and levers where the usual ways only look free, too.
    plain = pinched or joint.kind == "slide" or joint.gives_access
    if usual is None and (plain or not number):
        return free(number)
    rare = none(True)
    sets = [wider for wider, error in ((False, usual), (True, rare)) if error is None]
    if usual is not None and not sets:
        raise usual
    number, turn = divmod(number, len(sets))
    return free(number, sets[turn])


def follow(
    arm: Arm,
    fixture: Furniture,
    joint: Joint,
    hold: Hold,
    goal: float,
    there: Callable[[], bool],
) -> Motion:
    """Go along with a part that is held, until it is there, stuck or lost."""
    first = fixture.openness(joint)
    way = math.copysign(1.0, goal - first)
    radius = _radius(joint, hold.contact)
    travel = abs(joint.travel)
    long = travel if joint.kind == "slide" else max(radius, TWISTED) * travel
    twists = _twists(joint, hold)
    firm = joint.kind == "hinge" and (twists or not (hold.pinched or joint.gives_access))
    share = 1.0 if twists else 0.0
    if hold.pinched and not twists:
        share = arm.choices.choose(f"{joint.name} turned along", TURNS)
    brake = BRAKE / 2.0 if twists else BRAKE
    along = by_base(arm, joint)
    pulls = hold.pinched and not twists
    backed = abs(float(motion(joint, hold.contact, way)[0] @ hold.hand[:, 0])) > BACKED
    fastest = TWIST if twists else PULLED if pulls and joint.kind == "hinge" else FASTEST
    press, last, still, mark = LEAST_LEAD, first, 0, first
    eases: Array | None = None
    lost = LOST * float(arm.step.gripper[0]) if pulls else -1.0
    period = arm.scene.control_period
    for number in range(STEPS):
        now = fixture.openness(joint)
        if there() or arm.step.gripper[0] < lost:
            return
        rate, last = (now - last) * way * long / period, now
        if number and not number % CREEPS:
            if (now - mark) * way * long < CREPT:
                return
            mark = now
        most = fastest if along or pulls or eases is None else fastest / 2.0
        left = max(0.0, (goal - now) * way * long)
        wanted = float(np.clip(math.sqrt(2.0 * left * fastest / brake), SLOWEST, most))
        force = _gripping(arm)
        if firm and force > FIRM:
            wanted = min(wanted, max(SLOWEST, rate * FIRM / force))
        most = TWISTING if twists else MOST_LEAD
        if pulls and not backed:
            most = min(most, FRICTION * force / STIFFNESS)
        gain = LEAD_GAIN if rate < wanted else YIELD_GAIN
        press = float(np.clip(press + gain * (wanted - rate), LEAST_LEAD, most))
        lead = LAGS * float(np.clip(rate, 0.0, wanted)) + press * hold.pinched
        still = still + 1 if press >= most and rate < 0.1 * SLOWEST else 0
        at = hold.moved(joint, now - first, share).point
        off = at - arm.position
        # What is pushed may run ahead of the hand.
        behind = 0.0 if pulls else max(0.0, float(off @ motion(joint, at, way)[0]))
        if still > PATIENCE or (not twists and float(np.linalg.norm(off)) - behind > OFF):
            return
        ahead = hold.moved(joint, now - first + way * (lead - behind) / long, share)
        # Along a face that points aside too, fingers would slip off.
        ahead = replace(ahead, point=ahead.point - press * ahead.normal)
        if not twists:
            eases = _eases(arm, ahead, WITHIN if eases is not None else 0.0)
        # The hand moves on in between.
        if along and (goal - now) * way * long > BY_HAND:
            driven = _drive(arm, ahead.point - arm.position, wanted)
        elif eases is not None and number % BETWEEN:
            driven = _drive(arm, eases, 2.0 * wanted)
        else:
            driven = None
        yield arm.towards(ahead.point, ahead.hand) if driven is None else driven


def _twists(joint: Joint, hold: Hold) -> bool:
    """Whether the hand turns on the spot with what it holds."""
    return joint.kind == "hinge" and hold.pinched and _radius(joint, hold.contact) < TWISTED


def _eases(arm: Arm, hold: Hold, within: float) -> Array | None:
    """Where the base has to drive for the arm to be neither stretched nor crowded (3,); None if it
    may stay.

    Args:
        arm: the arm.
        hold: where the hand goes.
        within: how far inside of its limits it is to be, m.
    """
    off = hold.point - np.append(arm.base, 0.0)
    to_wrist = off - WRIST * hold.hand[:, 2]
    if reach_of(to_wrist - (0.0, 0.0, arm.torso)) > FARTHEST - within:
        return np.asarray(to_wrist)
    return np.negative(off) if math.hypot(off[0], off[1]) < NEAREST + within else None


def _drive(arm: Arm, way: Array, speed: float) -> Array | None:
    """The action that drives the base along a way as far as it is free, at a speed, m/s, or back
    from what comes to it; None if it cannot drive.
    """
    ahead, aside = arm.ahead(way), arm.aside(way)
    length = math.hypot(ahead, aside)
    if length < 1e-6:
        return None
    ahead, aside = ahead / length, aside / length
    here = arm.ahead(arm.base), arm.aside(arm.base)
    beside = here[1] + LOOKAHEAD * aside
    ends = min(here[1], beside), max(here[1], beside)
    if nearest(arm, *ends) < here[0]:
        aside, ends = 0.0, (here[1], here[1])
    front = nearest(arm, *ends)
    if front < here[0]:
        ahead = -1.0
    elif front < here[0] + LOOKAHEAD * ahead:
        ahead = 0.0
    if ahead < 0.0 and rearmost(arm, *ends) > here[0] + LOOKAHEAD * ahead:
        ahead = 0.0
    command = float(np.clip(speed / BASE_SPEED, BASE_DEAD_BAND, 0.6))
    action, drives = arm.hold(), False
    for number, share in enumerate((ahead, aside)):
        if abs(share) > 0.3:
            action[7 + number] = math.copysign(max(BASE_DEAD_BAND, command * abs(share)), share)
            drives = True
    return action if drives else None


def _radius(joint: Joint, point: Array) -> float:
    axis, off = np.asarray(joint.axis), point - np.asarray(joint.anchor)
    return float(np.linalg.norm(np.cross(axis, off)))


def _gripping(arm: Arm) -> float:
    """With how much force the fingers press on anything, N."""
    contacts, parts, hand = arm.step.contacts, arm.scene.parts, arm.scene.grippers[0]
    fingers = {finger for group in hand.fingers for finger in group}
    total = 0.0
    for row in np.flatnonzero(contacts.force > 0.0).tolist():
        pair = parts[contacts.a[row]], parts[contacts.b[row]]
        if any(part.entity == ROBOT and part.name in fingers for part in pair):
            total += float(contacts.force[row])
    return total


def _settled(arm: Arm, joint: Joint) -> Motion:
    """Hold still until a part that swings has come to rest."""
    number = arm.scene.joint_index[joint.key]
    for _ in range(SETTLES):
        if abs(float(arm.step.joint[number, 1])) < RESTS:
            return
        yield arm.hold()


def let_go(arm: Arm, hold: Hold, joint: Joint, by: float = 0.0) -> Motion:
    """Open the fingers around a part as far as they were, and draw the hand back from it.

    Args:
        arm: the arm.
        hold: how it is held.
        joint: moves the part.
        by: how much more open it is than when the hand came.
    """
    if hold.pinched:
        yield from arm.open_to(hold.opening)
    # What is pinched turned the hand, or turned between its fingers.
    back = -arm.rotation[:, 2] if hold.pinched else hold.back(joint, by)
    for away in (hold.clear, LETS_GO * back):
        if away.any():
            yield from arm.move(arm.position + away, tolerance=0.02, steps=40, required=False)
