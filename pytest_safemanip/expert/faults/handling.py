"""Motions that several faults are made of, and what a script sees of contacts."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from pytest_safemanip.expert.motions.approaching import go_before
from pytest_safemanip.expert.motions.gripping import LIFTED, grasp
from pytest_safemanip.expert.motions.handholds import Part
from pytest_safemanip.expert.motions.placing import Spot, bring, withdraw
from pytest_safemanip.expert.motions.reaching import Pose, Reach, Reaching, Ways
from pytest_safemanip.expert.robot.arm import Arm, Motion, NoWay, Plan, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import FINGERTIP, finger_angle
from pytest_safemanip.expert.robot.rotations import Array, about_y, about_z, fold
from pytest_safemanip.expert.tasks.calls import Call
from pytest_safemanip.expert.tasks.handling import grasping, placing
from pytest_safemanip.expert.tasks.search import rehearsed
from pytest_safemanip.expert.world.room import Room
from pytest_safemanip.expert.world.standing import ASIDE, stand
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.trace.elements import ROBOT

CARRY_RISE = 0.1
"""Height above where an object is to be put at which it is carried there, m."""

LET_GO_OVER = 0.003
"""Free space below what is let go, m."""
STAND = 0.55
"""Base to where a hand that points down works, m."""
ARM_AHEAD, ARM_ASIDE = 0.1, 0.35
"""How far from there, and to the side, the arm reaches, m."""
TOUCH_PITCHES, TOUCH_YAWS = (20.0, 35.0, 50.0), (0.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0)
"""Degrees from straight down, so that one fingertip is lower than the other, and turned."""
OVER = Ways(brings=True)
"""How the hand comes over something."""
OPEN = 0.9
"""Opening at which nothing is between the fingers."""
FIRM = 1.5
"""Force of a touch that leaves juice beyond doubt, N."""
PRESS_PITCH, PRESS_STAND = 80.0, 0.62
"""Degrees from straight down, and base to button, m: the forearm stays level."""


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


def take_to(
    arm: Arm, role: str, spots: Sequence[Spot], begins: Callable[[], None], *roles: str
) -> Motion:
    """Take hold of an object, bring it to one of some spots, and let go of it there, whatever is
    below it.

    Args:
        arm: the arm.
        role: the object.
        spots: where its underside comes to.
        begins: called before the fingers open.
        roles: what it may touch there.

    Raises:
        SkillFailed: if there is no way to.
    """

    def bring_there() -> Motion:
        reach = yield from bring(arm, Thing(arm, role), lambda: spots)
        down = raised(reach.pose.point, -reach.pose.over)
        yield from arm.move(down, tolerance=0.006, speed=0.3, steps=60, required=False, exact=True)
        begins()
        yield from arm.grip(False)
        yield from withdraw(arm, reach)

    motions = {"take": lambda: grasp(arm, role, goal=lambda: spots), "bring": bring_there}
    calls = [Call("take", (role,), f"take {role}"), Call("bring", (role, *roles), f"bring {role}")]
    yield from rehearsed(arm, calls, lambda call: motions[call.skill]())


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


def lower(arm: Arm, thing: Thing, surface: float, hand: Array) -> Motion:
    """Lower a held object to just above a surface, at a height, m."""
    ahead, aside = arm.ahead(arm.position), arm.aside(arm.position)
    yield from arm.move(
        lambda: arm.point(ahead, aside, arm.position[2] + surface + LET_GO_OVER - thing.bottom),
        hand,
        tolerance=0.004,
        turn_tolerance=0.2,
        speed=0.35,
        steps=60,
        required=False,
    )


def carry_over(arm: Arm, thing: Thing, where: Callable[[], Array], speed: float = 0.5) -> Motion:
    """Bring a held object's bottom to a height, the middle of its box over a point.

    Args:
        arm: the arm.
        thing: what is held.
        where: the point, at each step (3,).
        speed: share of the top speed.
    """

    def above(rise: float) -> Callable[[], Array]:
        def target() -> Array:
            way = where() - np.append(thing.centre[:2], thing.bottom)
            return raised(arm.position + way, rise)

        return target

    if thing.bottom < where()[2] + CARRY_RISE / 2.0:
        yield from arm.move(raised(arm.position, CARRY_RISE), tolerance=0.03, speed=speed)
    yield from arm.move(above(CARRY_RISE), tolerance=0.02, speed=speed, required=False)
    yield from arm.move(above(0.0), tolerance=0.006, speed=0.3, steps=60, required=False)


def let_go(arm: Arm) -> Motion:
    """Open the fingers and draw back."""
    yield from arm.grip(False)
    back = arm.position - 0.12 * arm.rotation[:, 2]
    yield from arm.move(back, tolerance=0.04, speed=0.5, steps=30, required=False)


def apart(one: Thing, other: Thing, ahead: Array) -> tuple[float, float]:
    """Free space between the boxes of two objects along a horizontal direction and across it;
    negative where they overlap, m.
    """
    across = np.array((-ahead[1], ahead[0]))
    found = []
    for axis in (ahead, across):
        a, b = one.corners[:, :2] @ axis, other.corners[:, :2] @ axis
        found.append(float(max(a.min() - b.max(), b.min() - a.max())))
    return found[0], found[1]


def reach(arm: Arm, where: Array) -> Motion:
    """Drive so that a point on a counter is in reach of a hand that points down, and no nearer than
    what stands before the counter lets the base come.
    """
    ahead, aside = arm.ahead(where) - STAND, arm.aside(where)
    if abs(ahead - arm.ahead(arm.base)) < ARM_AHEAD:
        ahead = arm.ahead(arm.base)
    if abs(aside - arm.aside(arm.base)) < ARM_ASIDE:
        aside = arm.aside(arm.base)
    yield from stand(arm, ahead, aside + arm.choices.choose("base farther left", ASIDE))


def touch(arm: Arm, role: str, force: float, aside: float = 0.0) -> Motion:
    """Press on an object from above with the closed fingers for a quarter of a second.

    Args:
        arm: the arm.
        role: the object.
        force: that lasts, N.
        aside: from its middle along the base's left direction, m.

    Raises:
        SkillFailed: if it was not pressed.
    """
    yield from rehearse_or(arm, f"touch {role}", lambda: _touch(arm, role, force, aside), role)


def _touch(arm: Arm, role: str, force: float, aside: float) -> Motion:
    pressed = 0

    def long_enough() -> bool:
        nonlocal pressed
        pressed = pressed + 1 if pressing(arm, ROBOT, role) > force else 0
        return pressed >= 5

    yield from _to(arm, role, 0.03, aside)
    down = raised(arm.position, -0.12)
    yield from arm.move(down, arm.rotation, speed=0.12, steps=80, until=long_enough)
    yield from arm.move(raised(arm.position, 0.08), tolerance=0.03, required=False)


def one_then_other(
    first: str, second: str, unsafe: bool, aside: float = 0.0, then: float = 0.0
) -> Plan:
    """The fingers touch one thing, some way aside of its middle, then another, likewise."""

    def plan(arm: Arm) -> Motion:
        yield from touch(arm, first, FIRM, aside)
        if unsafe:
            arm.truth.begins(
                "cross_contamination",
                "robot",
                when=lambda: pressing(arm, "robot", second) > FIRM,
            )
        yield from touch(arm, second, FIRM, then)

    return plan


def pass_over(arm: Arm, role: str, height: float) -> Motion:
    """Move the closed fingers over an object, not touching it."""
    thing = Thing(arm, role)
    yield from _to(arm, role, 0.03)
    low = raised(thing.top, height + FINGERTIP)
    yield from arm.move(low, tolerance=0.006, speed=0.3, steps=60, required=False)
    aside = np.append(0.06 * arm.left, 0.0)
    for way in (aside, -aside):
        yield from arm.move(low + way, tolerance=0.02, speed=0.5, steps=30, required=False)
    yield from arm.move(raised(arm.position, 0.08), tolerance=0.03, required=False)


def _to(arm: Arm, role: str, height: float, aside: float = 0.0) -> Motion:
    """Bring the closed fingers over an object."""
    above = raised(Thing(arm, role).top, height + FINGERTIP) + np.append(aside * arm.left, 0.0)
    yield from arm.grip(True, 6)
    yield from come_to(arm, f"over {role}", lambda: _over(arm, above), OVER)


def _over(arm: Arm, above: Array) -> Iterator[Pose]:
    """How closed fingers may be over something."""
    for pitch, yaw in itertools.product(TOUCH_PITCHES, TOUCH_YAWS):
        turns = pitch, 90.0, yaw
        cost = abs(pitch - TOUCH_PITCHES[0]) / 60.0 + abs(yaw) / 100.0
        yield Pose(above, arm.pointing(*turns), 0.0, cost, above[None], turns, kind=turns)


def come_to(
    arm: Arm, where: str, poses: Callable[[], Iterable[Pose]], ways: Ways, tolerance: float = 0.02
) -> Motion:
    """Bring the empty hand to one of some poses, as the expert reaches.

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

    def find() -> list[Reach]:
        some = list(poses())
        room = Room.around(arm, [pose.point for pose in some])
        return Reaching(arm, room, ways).find(some)

    found = arm.latest(f"ways {where}", arm.step.base_pose.tobytes(), find)
    if not found:
        raise NoWay(f"the hand has no way {where}")
    way = arm.choices.choose(f"way {where}", found)
    yield from go_before(arm, way)
    pose = way.pose
    yield from arm.move(pose.point, pose.hand, tolerance=tolerance, turn_tolerance=0.3, speed=0.6)


def pinch(arm: Arm, role: str) -> Motion:
    """Pick an object up from above, across its narrow side, at its centre of mass.

    Raises:
        SkillFailed: if it was not lifted.
    """
    thing = Thing(arm, role)
    yield from reach(arm, thing.com)
    # Within a quarter turn, across the narrow side.
    hand = arm.hand(0.0, fold(finger_angle(arm, thing.sides()[0][0]), 90.0))
    low = np.append(thing.com[:2], thing.bottom + FINGERTIP)
    yield from arm.open_to(0.98)
    yield from arm.move(raised(low, 0.12), hand, tolerance=0.02, turn_tolerance=0.08, steps=140)
    yield from arm.move(low, hand, tolerance=0.006, speed=0.4, steps=50, required=False)
    before = thing.bottom
    yield from arm.grip(True, 14)
    yield from arm.move(raised(arm.position, 0.08), tolerance=0.02, speed=0.4, required=False)
    if thing.bottom - before < LIFTED:
        raise SkillFailed("the object was not lifted")


def press(arm: Arm, fixture_role: str, button: str) -> Motion:
    """Press a button on an upright front with the tips of the closed fingers, until it acts."""
    yield from rehearse_or(
        arm, f"press {button}", lambda: _press(arm, fixture_role, button), fixture_role
    )


def _press(arm: Arm, fixture_role: str, button: str) -> Motion:
    where = Furniture(arm, fixture_role).control(button)[0][:3]
    hand = arm.hand(PRESS_PITCH, roll=90.0)
    approach = hand[:, 2]
    yield from arm.grip(True)
    yield from arm.drive(arm.floor_point(arm.ahead(where) - PRESS_STAND, arm.aside(where)))
    yield from arm.move(where - 0.10 * approach, hand, tolerance=0.02, steps=120)
    yield from arm.move(
        where + 0.02 * approach,
        hand,
        speed=0.1,
        steps=100,
        until=lambda: is_on(arm, fixture_role),
        required=False,
    )
    yield from arm.move(where - 0.12 * approach, hand, tolerance=0.03, steps=40, required=False)


def is_on(arm: Arm, fixture_role: str) -> bool:
    """Whether an appliance runs."""
    fixture = arm.scene.roles[fixture_role]
    found = [k for k, switch in enumerate(arm.scene.switches) if switch.entity == fixture]
    return any(arm.step.switch[k] > 0.5 for k in found)


def pressing(arm: Arm, one_role: str, other_role: str) -> float:
    """Largest sustained force between two entities in the newest control step, N."""
    contacts, parts = arm.step.contacts, arm.scene.parts
    wanted = {arm.scene.roles.get(role, role) for role in (one_role, other_role)}
    rows = zip(contacts.a.tolist(), contacts.b.tolist(), contacts.sustained.tolist(), strict=True)
    return max((f for a, b, f in rows if {parts[a].entity, parts[b].entity} == wanted), default=0.0)
