"""Motions that several faults are made of, and what a script sees of contacts."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Sequence
from functools import partial

import numpy as np

from pytest_safemanip.expert.motions.approaching import go_before
from pytest_safemanip.expert.motions.gripping import LIFTED, grasp
from pytest_safemanip.expert.motions.hand_ways import HandWays
from pytest_safemanip.expert.motions.handholds import Part
from pytest_safemanip.expert.motions.poses import Pose, Reach, Ways
from pytest_safemanip.expert.motions.reaching import Reaching, any_heading
from pytest_safemanip.expert.robot.arm import Arm, Motion, NoWay, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import FINGERTIP, finger_angle
from pytest_safemanip.expert.robot.rotations import Array, about_y, about_z, fold
from pytest_safemanip.expert.tasks.calls import Call
from pytest_safemanip.expert.tasks.handling import grasping, placing
from pytest_safemanip.expert.tasks.search import rehearsed
from pytest_safemanip.expert.world.room import Room
from pytest_safemanip.expert.world.standing import ASIDE, stand
from pytest_safemanip.expert.world.things import Furniture, Thing

FLOOR = 0.3
"""What is lower lies on the floor or falls onto it, m."""
CARRY_RISE = 0.1
"""Height above where an object is to be put at which it is carried there, m."""
JUST_ABOVE = 0.003
"""How far above a surface an object is let go when it is put down, m."""
STAND = 0.55
"""Base to where a hand that points down works, m."""
ARM_AHEAD, ARM_ASIDE = 0.1, 0.35
"""How far from there, and to the side, the arm reaches, m."""
OPEN = 0.9
"""Opening at which nothing is between the fingers."""
PRESS_PITCH, PRESS_STAND = 80.0, 0.62
"""Degrees from straight down, and base to button, m: the forearm stays level."""

go = partial(Arm.move, required=False)
"""Moves the hand as :meth:`Arm.move` does, as far as it comes."""


def take(arm: Arm, role: str, part: Part = "") -> Motion:
    """Take hold of an object, as the expert does, and lift it; the base stays.

    Raises:
        SkillFailed: if there is no way to.
    """
    yield from rehearse(arm, f"take {role}", lambda: grasp(arm, role, part, back=False), role)


def pick_and_place(arm: Arm, skill: str, role: str, *target_roles: str) -> Motion:
    """Take hold of an object, and put it down as a skill of the expert's does: grasped in a way in
    which it can be placed.

    Raises:
        SkillFailed: if there is no way to.
    """
    skills = {"grasp": grasping(), skill: placing(skill)}
    calls = [
        Call("grasp", (role,), f"grasp {role}"),
        Call(skill, (role, *target_roles), f"{skill} {role}"),
    ]
    yield from rehearsed(arm, calls, lambda call: skills[call.skill](arm, *call.roles))


def rehearse(arm: Arm, text: str, motion: Callable[[], Motion], *roles: str) -> Motion:
    """A motion in the first of its ways that knocks against nothing.

    Args:
        arm: the arm.
        text: what is done, in a few words.
        motion: begins it.
        roles: what it is about.

    Raises:
        SkillFailed: if none does.
    """
    yield from rehearsed(arm, [Call(text, roles, text)], lambda call: motion())


def rehearse_or(arm: Arm, text: str, motion: Callable[[], Motion], *roles: str) -> Motion:
    """The same, or, where all of its ways knock against something, the usual one: a fault comes
    before that.

    Raises:
        NoWay: if it has none.
    """
    try:
        yield from rehearse(arm, text, motion, *roles)
    except NoWay:
        raise
    except SkillFailed:
        yield from motion()


def pitched(arm: Arm, pitch: float) -> Array:
    """The hand as it is, but pitched so many degrees from straight down (3, 3)."""
    heading = about_z(math.degrees(math.atan2(arm.forward[1], arm.forward[0])))
    turned: Array = heading @ about_y(arm.pitch - pitch) @ heading.T @ arm.rotation
    return turned


def place(arm: Arm, thing: Thing) -> tuple[float, float]:
    """Where a thing's centre of mass is, ahead and aside, m."""
    return arm.ahead(thing.com), arm.aside(thing.com)


def way_to(arm: Arm, thing: Thing, ahead: float, aside: float, bottom: float) -> Array:
    """From where an object is to where its centre of mass has these coordinates (3,).

    Args:
        arm: the arm.
        thing: the object.
        ahead: along the base's forward direction, m.
        aside: along its left direction, m.
        bottom: height of its lowest corner, m.
    """
    here = thing.com
    return arm.point(ahead - arm.ahead(here), aside - arm.aside(here), bottom - thing.bottom)


def bring(
    arm: Arm,
    thing: Thing,
    ahead: float,
    aside: float,
    bottom: float,
    *,
    speed: float = 0.6,
    steps: int = 70,
) -> Motion:
    """Bring a held object to where :func:`way_to` says; the hand keeps its orientation."""
    yield from go(
        arm,
        lambda: arm.position + way_to(arm, thing, ahead, aside, bottom),
        tolerance=0.006,
        turn_tolerance=0.2,
        speed=speed,
        steps=steps,
    )


def carry_over(arm: Arm, thing: Thing, where: Callable[[], Array]) -> Motion:
    """Bring a held object's bottom to a height, the middle of its box over a point.

    Args:
        arm: the arm.
        thing: what is held.
        where: the point, at each step (3,).
    """

    def above(rise: float) -> Array:
        way = where() - np.append(thing.centre[:2], thing.bottom)
        return raised(arm.position + way, rise)

    if thing.bottom < where()[2] + CARRY_RISE / 2.0:
        yield from arm.move(raised(arm.position, CARRY_RISE), tolerance=0.03, speed=0.5)
    yield from go(arm, lambda: above(CARRY_RISE), tolerance=0.02, speed=0.5)
    yield from go(arm, lambda: above(0.0), tolerance=0.006, speed=0.3, steps=60)


def lower(arm: Arm, thing: Thing, surface: float, hand: Array) -> Motion:
    """Lower a held object to just above a surface, at a height, m."""
    ahead, aside = arm.ahead(arm.position), arm.aside(arm.position)
    yield from go(
        arm,
        lambda: arm.point(ahead, aside, arm.position[2] + surface + JUST_ABOVE - thing.bottom),
        hand,
        tolerance=0.004,
        turn_tolerance=0.2,
        speed=0.35,
        steps=60,
    )


def let_go(
    arm: Arm,
    fingers: int = 8,
    back: float = 0.08,
    *,
    tolerance: float = 0.03,
    speed: float = 0.5,
    steps: int = 25,
) -> Motion:
    """Open the fingers and draw the hand back.

    Args:
        arm: the arm.
        fingers: control steps for which they open.
        back: how far the hand goes, m.
        tolerance: distance that counts as there, m.
        speed: share of the top speed.
        steps: control steps at most for the way back.
    """
    yield from arm.grip(False, fingers)
    away = arm.position - back * arm.rotation[:, 2]
    yield from go(arm, away, tolerance=tolerance, speed=speed, steps=steps)


def release(arm: Arm) -> Motion:
    """Open the fingers wide, and draw the hand back farther."""
    yield from let_go(arm, 12, 0.12, tolerance=0.04, steps=30)


def put_back(
    arm: Arm,
    role: str = "obj",
    speed: float = 0.3,
    *,
    before: Sequence[tuple[float, float]] = (),
) -> Motion:
    """Takes hold of an object and puts it down where it stood.

    Args:
        arm: the arm.
        role: the object.
        speed: on the way down, as a share of the top speed.
        before: heights above where it stood that it comes to before, m, and speeds.

    Raises:
        SkillFailed: if there is no way to take hold of it.
    """
    thing = Thing(arm, role)
    where, bottom = place(arm, thing), thing.bottom
    yield from take(arm, role)
    for height, pace in (*before, (JUST_ABOVE, speed)):
        yield from bring(arm, thing, *where, bottom + height, speed=pace)
    yield from let_go(arm)


def away(arm: Arm, thing: Thing) -> float:
    """Distance of the grip point from the centre of an object, m."""
    return float(np.linalg.norm(arm.position - thing.centre))


def gaps(one: Thing, other: Thing, ahead: Array) -> tuple[float, float]:
    """Free space between the boxes of two objects along a horizontal direction and across it;
    negative where they overlap, m.
    """
    across = np.array((-ahead[1], ahead[0]))
    found = []
    for axis in (ahead, across):
        a, b = one.corners[:, :2] @ axis, other.corners[:, :2] @ axis
        found.append(float(max(a.min() - b.max(), b.min() - a.max())))
    return found[0], found[1]


def come_near(arm: Arm, where: Array) -> Motion:
    """Drive so that a point on a counter is in reach of a hand that points down, and no nearer than
    what stands before the counter lets the base come.
    """
    ahead, aside = arm.ahead(where) - STAND, arm.aside(where)
    if abs(ahead - arm.ahead(arm.base)) < ARM_AHEAD:
        ahead = arm.ahead(arm.base)
    if abs(aside - arm.aside(arm.base)) < ARM_ASIDE:
        aside = arm.aside(arm.base)
    yield from stand(arm, ahead, aside + arm.choices.choose("base farther left", ASIDE))


def come_to(
    arm: Arm, where: str, poses: Callable[[], Iterable[Pose]], ways: Ways, tolerance: float = 0.02
) -> Generator[Array, None, Reach]:
    """Bring the empty hand to one of some poses, as the expert reaches; returns how it came.

    Args:
        arm: the arm.
        where: in a few words.
        poses: how it may be there.
        ways: how it may come.
        tolerance: how far off it may stay, m.

    Raises:
        NoWay: if it has no way to any.
        SkillFailed: if it does not arrive.
    """

    def look() -> Callable[[float], list[Reach]]:
        some = list(poses())
        hands = HandWays(arm, Room.around(arm, [pose.point for pose in some]), ways)
        return lambda clearance: Reaching(arm, hands, clearance).find(some)

    state = arm.step.base_pose.tobytes()
    found = arm.latest(f"ways {where}", state, lambda: any_heading(arm, look))
    if not found:
        raise NoWay(f"the hand has no way {where}")
    way = arm.choices.choose(f"way {where}", found)
    yield from go_before(arm, way)
    pose = way.pose
    yield from arm.move(pose.point, pose.hand, tolerance=tolerance, turn_tolerance=0.3, speed=0.6)
    return way


def pinch(arm: Arm, role: str) -> Motion:
    """Pick an object up from above, across its narrow side, at its centre of mass.

    Raises:
        SkillFailed: if it was not lifted.
    """
    thing = Thing(arm, role)
    yield from come_near(arm, thing.com)
    # Within a quarter turn, across the narrow side.
    hand = arm.hand(0.0, fold(finger_angle(arm, thing.sides()[0][0]), 90.0))
    low = np.append(thing.com[:2], thing.bottom + FINGERTIP)
    yield from arm.open_to(0.98)
    yield from arm.move(raised(low, 0.12), hand, tolerance=0.02, turn_tolerance=0.08, steps=140)
    yield from go(arm, low, hand, tolerance=0.006, speed=0.4, steps=50)
    before = thing.bottom
    yield from arm.grip(True, 14)
    yield from go(arm, raised(arm.position, 0.08), tolerance=0.02, speed=0.4)
    if thing.bottom - before < LIFTED:
        raise SkillFailed("the object was not lifted")


def press(arm: Arm, role: str, button: str) -> Motion:
    """Press a fixture's button on an upright front with the tips of the closed fingers, until it
    acts.
    """
    yield from rehearse_or(arm, f"press {button}", lambda: _press(arm, role, button), role)


def _press(arm: Arm, role: str, button: str) -> Motion:
    where = Furniture(arm, role).control(button)[0][:3]
    hand = arm.hand(PRESS_PITCH, roll=90.0)
    approach = hand[:, 2]
    yield from arm.grip(True)
    yield from arm.drive(arm.floor_point(arm.ahead(where) - PRESS_STAND, arm.aside(where)))
    yield from arm.move(where - 0.10 * approach, hand, tolerance=0.02, steps=120)
    deep = where + 0.02 * approach
    yield from go(arm, deep, hand, speed=0.1, steps=100, until=lambda: is_on(arm, role))
    yield from go(arm, where - 0.12 * approach, hand, tolerance=0.03, steps=40)


def is_on(arm: Arm, role: str) -> bool:
    """Whether an appliance runs."""
    fixture = arm.scene.roles[role]
    found = [k for k, switch in enumerate(arm.scene.switches) if switch.entity == fixture]
    return any(arm.step.switch[k] > 0.5 for k in found)


def pressing(arm: Arm, one_role: str, other_role: str) -> float:
    """Largest sustained force between two entities in the newest control step, N."""
    contacts, parts = arm.step.contacts, arm.scene.parts
    wanted = {arm.scene.roles.get(role, role) for role in (one_role, other_role)}
    rows = zip(contacts.a.tolist(), contacts.b.tolist(), contacts.sustained.tolist(), strict=True)
    return max((f for a, b, f in rows if {parts[a].entity, parts[b].entity} == wanted), default=0.0)
