"""Grasping: the hand closes on what of a thing fits between its fingers, wherever it has room."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import partial

import numpy as np

from pytest_safemanip.expert.motions.approaching import (
    ARRIVES,
    draw_back,
    go_before,
    holding,
    turned_over,
)
from pytest_safemanip.expert.motions.dragging import drag
from pytest_safemanip.expert.motions.hand_ways import HandWays
from pytest_safemanip.expert.motions.handholds import (
    HOLLOW,
    PAN_WALLS,
    SHALLOW,
    TIPS_OFF,
    Part,
    grasp_poses,
    handholds,
)
from pytest_safemanip.expert.motions.joints import move_joint
from pytest_safemanip.expert.motions.placing import Grip, Placing, Spot
from pytest_safemanip.expert.motions.poses import Pose, Reach, Ways
from pytest_safemanip.expert.motions.reaching import (
    HEADINGS,
    LINK_CLEARANCES,
    SQUEEZED,
    Reaching,
    any_heading,
    turned_otherwise,
)
from pytest_safemanip.expert.motions.travelling import check_bent
from pytest_safemanip.expert.motions.turning import facing
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed
from pytest_safemanip.expert.robot.base import LASTING
from pytest_safemanip.expert.robot.choices import GRASP
from pytest_safemanip.expert.robot.hand import (
    FINGER_THICK,
    FINGERTIP,
    OPENING,
    finger_points,
    palm_points,
)
from pytest_safemanip.expert.world.contacts import touching
from pytest_safemanip.expert.world.room import Room, walls
from pytest_safemanip.expert.world.things import (
    Furniture,
    Thing,
    contents,
    other_things,
    spaces_around,
)
from pytest_safemanip.expert.world.ways import Leg, foresee

Goal = Callable[[], Sequence[Spot]]

PULLS, PULLED, PULLED_LEAST = 2, (0.1, 0.18), 0.03
"""How often a drawer is pulled out farther for the hand to have room in it, how far, and how far at
least, m: its end may be nearer, or beyond where it counts as open.
"""
GOOD, FEW, MOST_ASKED = 3, 60, 20
"""Ways to grasp something with which there is a way to put it down that are enough, how many poses
are looked at for that way, and for how many ways to grasp at most."""
MOST_SQUEEZED = 8
"""Ways to grasp something that are offered where the hand is squeezed in, for a rehearsal to tell.
"""
DRAWN, EDGE = (0.14, 0.12, 0.1, 0.08, 0.06), 0.04
"""How far a pan is drawn by its wall, and how far its centre of mass stays at least behind the edge
of what it stands on, m."""
LIFTED = 0.02
"""Rise that shows that an object is held, m."""
ASTRAY = 0.015
"""Farther before a grip point than this, the hand has met something, m."""
PROBED, NEARER, STEEP = 0.25, 0.004, 0.5
"""Speed and stride, m, at which it is looked for what a hand closes on, and how much it has to
point down, as a cosine."""
LONGEST = 1.0
"""A thing that reaches farther below a grip point, m, is no longer where it was."""
NARROWED, BITES = (0.7, 0.5, 0.4, 0.3), 0.008
"""How far fingers are open that would else not come so far below the top of what they close on,
share of the full opening and m."""
STOPS = ((0.03, 0.006, 0.6), (0.0, 0.004, 0.3))
"""On the straight way in: before the grip point, m, with tolerance, m, and speed."""


def grasp(
    arm: Arm, role: str, part: Part = "", goal: Goal | None = None, back: bool = True
) -> Motion:
    """Take hold of an object, lift it, and draw back with it.

    Args:
        arm: the arm.
        role: the object.
        part: by what; empty for what fits between the fingers.
        goal: finds where it is to be put.
        back: whether the base then draws back.

    Raises:
        SkillFailed: if nothing of it fits, if the hand has no room, or if it was not lifted.
    """
    thing = Thing(arm, role)
    if not part and handholds(thing)[0].name == "rim":
        # It may be a lid, which is higher in its middle.
        part = arm.choices.choose("what is pinched", ("", "knob"), (0, 2))
    yield from _make_room(arm, thing, part, goal)
    ways = turned_otherwise(arm, lambda but: _ways(arm, thing, part, goal, but))
    if not ways:
        raise SkillFailed(f"the hand has no room at {role}")
    reach = turned_over(arm, arm.choices.choose(GRASP, ways))
    yield from go_before(arm, reach)
    yield from come_in(arm, thing, reach)
    check_bent(arm)
    yield from lift(arm, thing, reach)
    if back:
        yield from holding(arm, draw_back(arm, reach, thing), thing)


def _make_room(arm: Arm, thing: Thing, part: Part, goal: Goal | None) -> Motion:
    """Pulls the drawer that a thing lies in, or draws it nearer, or off the wall behind it, if the
    hand needs that.
    """
    drawer = drawer_around(arm, thing)
    if drawer is not None and arm.choices.choose("drawer pulled first", (False, True)):
        yield from _pull(arm, drawer)
    for _ in range(PULLS):
        if drawer is None or _known_ways(arm, thing, part, goal):
            break
        yield from _pull(arm, drawer)
    if _ways(arm, thing, part, goal):
        return
    pan = not part and handholds(thing)[0].name == "handle" and thing.height >= HOLLOW
    by_wall = [_ways(arm, thing, wall, None) for wall in PAN_WALLS] if pan else []
    if any(by_wall):
        ways = arm.choices.choose("wall it is drawn by", [some for some in by_wall if some])
        yield from _draw(arm, thing, ways)
    else:
        yield from drag(arm, thing)


def _draw(arm: Arm, thing: Thing, ways: Sequence[Reach]) -> Motion:
    """Draw a pan by its wall to where the hand has room at its handle: too far from its centre of
    mass to lift it, but not to draw it towards the robot.
    """
    reach = turned_over(arm, arm.choices.choose("drawn", ways))
    far = arm.choices.choose("drawn so far", _staying_on(arm, thing)[:2] or DRAWN[-1:])
    hand = reach.pose.hand
    yield from go_before(arm, reach)
    yield from come_in(arm, thing, reach)
    yield from arm.grip(True, 14)
    goal = arm.position - arm.onward(far)
    yield from arm.move(goal, hand, tolerance=0.01, speed=0.3, steps=80, required=False)
    yield from arm.grip(False, 10)
    yield from arm.move(arm.position + reach.leave, hand, tolerance=0.01, speed=0.35, steps=50)
    yield from draw_back(arm, reach)


def _staying_on(arm: Arm, thing: Thing) -> list[float]:
    """How far something may be drawn towards the robot to stay on what it stands on, m."""
    room = Room.around(arm, [thing.centre], [thing.entity])
    com = np.append(thing.com[:2], thing.bottom - EDGE / 4.0)
    below = np.array([com - arm.onward(far + EDGE) for far in DRAWN]) @ arm.frame
    return [far for far, off in zip(DRAWN, room.exactly(below), strict=True) if off < 0.0]


def _ways(
    arm: Arm, thing: Thing, part: Part, goal: Goal | None, but: Sequence[float] = ()
) -> list[Reach]:
    """Ways to grasp a thing, those with the base turned in some ways left out; where links meet
    something on all, some on which the hand is squeezed in.
    """
    ways = _known_ways(arm, thing, part, goal, but=but)
    if not all(reach.meets for reach in ways):
        return ways
    squeezed = _known_ways(arm, thing, part, goal, (SQUEEZED,), but)[:MOST_SQUEEZED]
    return sorted(squeezed + ways, key=lambda reach: reach.meets)


def _known_ways(
    arm: Arm,
    thing: Thing,
    part: Part,
    goal: Goal | None,
    clearances: Sequence[float] = LINK_CLEARANCES,
    but: Sequence[float] = (),
) -> list[Reach]:
    state = arm.step.object_pose.tobytes(), arm.step.base_pose.tobytes()
    what = f"ways to grasp {thing.entity} {part} {clearances} {but}"

    def find() -> list[Reach]:
        squeezed = min(clearances) <= SQUEEZED
        look = partial(ways_to_grasp, arm, thing, part, goal, squeezed)
        ways = any_heading(arm, look, clearances, but)
        # Its box does not show which of its ends is slim enough to be pinched.
        return _closing(arm, thing, ways) if part == "end" else ways

    return arm.latest(what, state, find, LASTING)


def _closing(arm: Arm, thing: Thing, ways: list[Reach]) -> list[Reach]:
    """Those with which the fingers close on something; all if there are none."""
    return [reach for reach in ways if closes(arm, thing, reach)] or ways


def drawer_around(arm: Arm, thing: Thing) -> Furniture | None:
    """The drawer that a thing lies in."""
    for entity, _ in spaces_around(arm, thing, LIFTED):
        found = Furniture(arm, entity)
        if [door.kind for door in found.doors()] == ["slide"]:
            return found
    return None


def _pull(arm: Arm, drawer: Furniture) -> Motion:
    """Pull a drawer farther out, as far as it comes."""
    (joint,) = drawer.doors()
    before = drawer.openness(joint)
    farther = arm.choices.choose("drawer pulled", PULLED) / joint.travel
    try:
        # Where it stops it has come to its end: pulled again, it is pushed against that.
        yield from move_joint(arm, drawer, joint, before + farther, again=0)
    except SkillFailed:
        if (drawer.openness(joint) - before) * joint.travel < PULLED_LEAST:
            raise


def ways_to_grasp(
    arm: Arm, thing: Thing, part: Part, goal: Goal | None, squeezed: bool
) -> Callable[[float], list[Reach]]:
    """What finds ways to take hold of a thing, given the least clearance of the arm's links, m: the
    easiest first, last those with which there is no way to where it is to be put.

    Args:
        arm: the arm.
        thing: the thing.
        part: by what of it.
        goal: finds where it is to be put.
        squeezed: whether the hand is squeezed in.
    """
    along = inside(arm, thing)
    around = [
        v
        for v in other_things(arm, thing)
        if v.entity not in along and thing.entity in inside(arm, v)
    ]
    vessels = [vessel.entity for vessel in around]
    extra = [box for vessel in around for box in walls(vessel)]
    room = Room.around(arm, [thing.centre], [thing.entity, *along, *vessels], extra)
    hands = HandWays(arm, room, Ways(), squeezed)
    parts = handholds(thing, part)
    found = [
        pose
        for hold in parts
        for pose in grasp_poses(arm, thing, hold, thing.bottom)
        if not any(_hits(pose, Thing(arm, entity)) for entity in along)
    ]
    placings: dict[float, Placing] = {}

    def find(clearance: float) -> list[Reach]:
        reaching = Reaching(arm, hands, clearance, vessels, either=True)
        if goal is None:
            return reaching.find(found)
        ways = list[Reach]()
        # Where it is to be put, the base may have to be turned otherwise than to take it.
        for turns in (HEADINGS[:1], HEADINGS[1:]):
            for turn in turns:
                if turn not in placings:
                    with facing(arm, turn):
                        placings[turn] = Placing(arm, thing, goal(), squeezed=squeezed, either=True)
            places = [(turn, placings[turn]) for turn in turns]
            suited = _Suited(arm, thing, places, clearance, parts[0].around)
            ways = reaching.find(found, GOOD, suited)
            if suited.some or not ways:
                break
        return ways

    return find


class _Suited:
    """Whether there is a way to put down what is held as at some poses, which takes long to find
    out: those that are asked about are few.

    Args:
        arm: the arm.
        thing: what is held.
        placings: look for ways to put it down, each with a turn of the base to the left, degrees.
        clearance: least one of the arm's links, m.
        around: whether the thing is round.
    """

    def __init__(
        self,
        arm: Arm,
        thing: Thing,
        placings: Sequence[tuple[float, Placing]],
        clearance: float,
        around: bool,
    ) -> None:
        self._arm, self._placings, self._clearance = arm, placings, clearance
        self._opening = thing.sides()[0][1] / OPENING
        # What is round is turned about the vertical where it is put, however it is held.
        self._first = 2 if around else 0
        self._asked: dict[Hashable, bool | None] = {}

    @property
    def some(self) -> bool:
        """Whether any pose did."""
        return any(turn is not None for turn in self._asked.values())

    def __call__(self, pose: Pose) -> Pose | None:
        # Where along a handle it is held makes no difference there.
        place = pose.place if pose.family[0] != "handle" else 0.0
        hold = pose.family[self._first : -1], place
        if hold not in self._asked and len(self._asked) < MOST_ASKED:
            self._asked[hold] = self._turned(pose)
        turned = self._asked.get(hold)
        return pose if turned == pose.turned else None if turned is None else pose.turned_over()

    def _turned(self, pose: Pose) -> bool | None:
        """Whether the hand is to be turned over for a way to put it down; None if there is none."""
        grip = Grip(pose.point, pose.hand, self._opening)
        for turn, placing in self._placings:
            with facing(self._arm, turn):
                if ways := placing.ways(grip, self._clearance, 1, FEW):
                    return ways[0].pose.turned != pose.turned
        return None


def _hits(pose: Pose, thing: Thing) -> bool:
    """Whether the hand at a pose would be in a thing that lies in what it takes."""
    points = np.concatenate((palm_points(), finger_points(pose.opening)))
    return bool(thing.around(points @ pose.hand.T + pose.point).any())


def inside(arm: Arm, vessel: Thing) -> list[str]:
    """The entities that lie in an object, or on it."""
    return [thing.entity for thing in contents(arm, vessel)]


def closes(arm: Arm, thing: Thing, reach: Reach) -> bool:
    """Whether the fingers would close on something of a thing at the end of a way to it; true, too,
    where the simulator does not foresee that the hand gets there.
    """
    pose, raised = reach.pose, reach.torso - arm.torso
    come = [Leg(reach.base), Leg(pose.point + reach.entry, pose.hand, ARRIVES)]
    with facing(arm, reach.turn):
        if not foresee(arm, come, raised=raised, begins=len(come) - 1).free:
            return True
        try:
            deeper(arm, thing, pose, come, raised)
        except SkillFailed:
            return False
    return True


def deeper(
    arm: Arm, thing: Thing, pose: Pose, come: Sequence[Leg] = (), raised: float = 0.0
) -> tuple[float, float]:
    """How much farther a hand has to go that is before its grip point, m, for a thing is not
    everywhere as high as its box; and how far its fingers are to be open for that, for leaned ones
    meet what it lies on the sooner the wider they are.

    Args:
        arm: the arm.
        thing: the thing.
        pose: of the hand.
        come: how it comes before that point, if it is elsewhere.
        raised: how much farther the torso is raised for that, m.

    Raises:
        SkillFailed: if there is nothing to close on.
    """
    approach = pose.hand[:, 2]
    tips = float((finger_points(0.0) @ pose.hand.T + pose.point)[:, 2].min())
    most = max(0.0, tips - thing.bottom - TIPS_OFF) / max(STEEP, -float(approach[2]))
    if -approach[2] < STEEP or most == 0.0:
        return 0.0, pose.opening
    if most > LONGEST:
        raise SkillFailed(f"{thing.entity} fell away from between the fingers")
    # Where it is first touched: farther in, how deep says nothing about how far.
    offs = np.arange(most, -SHALLOW - FINGERTIP, -NEARER)[::-1]

    def met(opening: float, aside: float = 0.0) -> tuple[str, float]:
        at = pose.point + aside * pose.hand[:, 0]
        legs = [Leg(at + off * approach, pose.hand, NEARER / 2.0, PROBED) for off in offs]
        answer = foresee(arm, [*come, *legs], (), opening, raised=raised, begins=len(come))
        off = float((answer.hand[:3] - at) @ approach)
        return (answer.touch.other, off - answer.touch.depth) if answer.touch else ("", off)

    # What is between fully open fingers may be off their middle: closed ones probe the whole gap.
    side = OPENING / 2.0 - FINGER_THICK if pose.opening == 1.0 else 0.0
    probed = [met(0.0, aside) for aside in dict.fromkeys((0.0, side, -side))]
    if not any(other for other, _ in probed):
        raise SkillFailed(f"there is nothing of {thing.entity} between the fingers")
    tops = [off for other, off in probed if other == thing.entity]
    if not tops:
        return 0.0, pose.opening
    top, goals = min(tops), list[tuple[float, float]]()
    for opening in (pose.opening, *(share for share in NARROWED if share < pose.opening)):
        goals.append((max(0.0, min(top + SHALLOW + FINGERTIP, met(opening)[1])), opening))
        if goals[-1][0] > top + BITES:
            return goals[-1]
    if max(goals)[0] < top + BITES / 2.0:
        raise SkillFailed(f"the fingers do not come down beside {thing.entity}")
    return max(goals)


def come_in(arm: Arm, thing: Thing, reach: Reach) -> Motion:
    """Go straight to a grip point, as near as the hand gets.

    Raises:
        SkillFailed: if it meets something, or if there is nothing to close on.
    """
    far = float(np.linalg.norm(reach.entry))
    farther, opening = deeper(arm, thing, reach.pose)
    goal = reach.pose.point + farther * reach.pose.hand[:, 2]
    if opening < reach.pose.opening:
        yield from arm.open_to(opening)
    for before, tolerance, speed in STOPS:
        yield from arm.move(
            goal + before / far * reach.entry,
            reach.pose.hand,
            tolerance=tolerance,
            turn_tolerance=0.06,
            speed=speed,
            steps=60,
            required=False,
            exact=True,
        )
    short = float((goal - arm.position) @ reach.entry) / -far
    if short > ASTRAY:
        raise SkillFailed(f"something is in the hand's way, {100 * short:.0f} cm before its goal")


def lift(arm: Arm, thing: Thing, reach: Reach) -> Motion:
    """Close the fingers and rise, along the way out.

    Raises:
        SkillFailed: if the object did not come along, or if what it lay in did.
    """
    before = thing.underside
    # Not only its carriers: a light object presses on each point of a bowl with less than they ask.
    others, touched = other_things(arm, thing, *contents(arm, thing)), touching(arm, thing)
    beside = [other for other in others if other.entity in touched]
    high = [other.highest for other in beside]
    arm.stood = {**arm.stood, thing.entity: thing.pose}
    yield from arm.grip(True, 14)
    out = np.append(reach.leave[:2], max(0.03, float(reach.leave[2])))
    yield from arm.move(
        arm.position + out,
        reach.pose.hand,
        tolerance=0.008,
        speed=0.35,
        steps=50,
        required=False,
    )
    if thing.underside - before < LIFTED:
        raise SkillFailed("the object was not lifted")
    # One side of it is enough: fingers that pinch its wall, too, tilt it.
    for other, height in zip(beside, high, strict=True):
        if other.highest - height > LIFTED / 2.0:
            raise SkillFailed(f"{other.entity} came along")
