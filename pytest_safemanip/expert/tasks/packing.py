"""Packing lunches: two things of a kind out of an open fridge, one into either box."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.grasping import LIFTED
from pytest_safemanip.expert.motions.putting import BRAKE, SOFTLY, carry_over, leave, set_down
from pytest_safemanip.expert.places.fridge.compartment import compartment
from pytest_safemanip.expert.places.fridge.shelf_grasps import ShelfGrasp, best_shelf_grasp
from pytest_safemanip.expert.robot.arm import GENTLY, Arm, Motion, SkillFailed, raised
from pytest_safemanip.expert.robot.hand import finger_angle
from pytest_safemanip.expert.robot.rotations import Array, about_z
from pytest_safemanip.expert.robot.torso import lift_torso
from pytest_safemanip.expert.world.standing import nearest, stand
from pytest_safemanip.expert.world.things import Furniture, Thing, other_things

HIGH_SHELF, RAISES = 1.3, (0.10, 0.18, 0.26)
"""Height of a shelf for which the torso is raised, and how far it may be, m."""
TUCKED, OUTSIDE = 0.46, 0.21
"""Base to hand before it goes in, and from there to the front of the shelf, m."""
EMPTY, LOADED = (0.42, 1.25, 30.0), (TUCKED, 1.2)
"""Base to hand, its height, m, and its pitch, degrees, on its way along the fridge; likewise with a
load."""
ROW = 0.79
"""From the base to the shelves where it drives along the fridge, m: hand and arm pass before the
open door."""
PARK = 0.12
"""How far the base draws back before a load is lowered and turned, m: off the shelf, which begins
2 cm behind it, and off the open door."""
CARRIED = 0.6
"""Largest command to the base with a load before the counter."""
ALONG_COUNTER_STEPS = 300
"""Control steps for the way along the counter."""
ASTRAY = 0.015
"""Farther from the grip point than this, the hand has met something, m."""
OFF_BOX_MIDDLE = 0.08
"""From a box's middle to where either thing goes, along it, at most, m."""
OFF_RIM = 0.03
"""From its end to the end of the box, m: the hand comes there to within 1.5 cm, and meat leans."""
INSIDE = 0.15
"""What is within this of a box's middle is in it, m."""
COUNTER_BACK = 0.4
"""How far the base draws back from the counter, m."""


def move_into_boxes(
    arm: Arm, one: str, other: str, fridge_role: str, box_role: str, other_box_role: str
) -> Motion:
    """Put one of two things that are alike into each of two boxes.

    Raises:
        SkillFailed: if the hand has no room at one of them, or it was not lifted.
    """
    left = [one, other]
    yield from back_off(arm, fridge_role)
    for box in (box_role, other_box_role):
        role, reach = next_of(arm, left, fridge_role)
        left.remove(role)
        yield from bring_out(arm, role, fridge_role, reach)
        yield from put_into(arm, role, box)
        yield from back_off(arm, fridge_role)


def back_off(arm: Arm, fridge_role: str) -> Motion:
    """Back off from an open fridge, and hold the empty hand close before the base."""
    pose, half = Furniture(arm, fridge_role).interiors()[-1]
    row = arm.ahead(pose) - float(half[1]) - ROW
    yield from arm.drive(arm.floor_point(min(row, arm.ahead(arm.base)), arm.aside(arm.base)))
    ahead, height, pitch = EMPTY
    tucked = arm.before(ahead, height)
    yield from arm.move(tucked, arm.hand(pitch), tolerance=0.04, turn_tolerance=0.2, steps=120)


def next_of(arm: Arm, roles: list[str], fridge_role: str) -> tuple[str, ShelfGrasp]:
    """What comes out first, the nearest that the hand has room at, and how it is reached.

    Raises:
        SkillFailed: if it has room at none.
    """
    for role in sorted(roles, key=lambda role: arm.ahead(Thing(arm, role).centre)):
        thing = Thing(arm, role)
        space = compartment(arm, thing, Furniture(arm, fridge_role))
        raises = RAISES if thing.bottom > HIGH_SHELF else (0.0,)
        like = next((name for name in roles if name != role), "")
        reach = best_shelf_grasp(arm, thing, space, raises, like)
        if reach:
            return role, reach
    raise SkillFailed(f"there is no room for the hand at {' or '.join(roles)}")


def bring_out(arm: Arm, role: str, fridge_role: str, reach: ShelfGrasp) -> Motion:
    """Take something off its shelf, and bring it to before the base.

    Raises:
        SkillFailed: if hand or base do not get there, or it was not lifted.
    """
    thing, grasp, hand = Thing(arm, role), reach.grasp, reach.grasp.hand
    space = compartment(arm, thing, Furniture(arm, fridge_role))
    start, beside = space.front - OUTSIDE - TUCKED, arm.aside(reach.base)
    over = raised(grasp.point, reach.rise)
    yield from stand(arm, min(start, arm.ahead(arm.base)), beside)
    yield from stand(arm, start, beside)
    yield from lift_torso(arm, reach.raised)
    yield from arm.open_to(grasp.opening)
    # Turned straight before the base, and only then beside the door.
    for aside, tolerance in ((reach.straight, 0.03), (arm.aside(over) + reach.shift, 0.02)):
        tucked = arm.point(arm.ahead(arm.base) + TUCKED, aside, over[2])
        yield from arm.move(tucked, hand, tolerance=tolerance, turn_tolerance=0.1, steps=200)
    inside = min(arm.ahead(reach.base), nearest(arm, beside, beside))
    yield from arm.drive(arm.floor_point(inside, beside), speed=GENTLY)
    yield from come_down(arm, over, reach)
    yield from lift_below_shelf(arm, thing, over, hand)
    if reach.shift:
        out = arm.position + np.append(reach.shift * arm.left, 0.0)
        yield from arm.move(out, hand, tolerance=0.01, speed=0.3, steps=60, required=False)
    yield from arm.drive(arm.floor_point(start, beside), speed=GENTLY)
    inwards = arm.point(arm.ahead(arm.position), reach.straight, arm.position[2])
    yield from arm.move(inwards, hand, tolerance=0.03, speed=0.4, steps=100)
    yield from arm.drive(arm.base - PARK * arm.forward, speed=CARRIED)
    yield from lift_torso(arm, -reach.raised)


def come_down(arm: Arm, over: Array, reach: ShelfGrasp) -> Motion:
    """Bring the hand over a thing (3,) and down around it.

    Raises:
        SkillFailed: if something is in its way.
    """
    point, hand = reach.grasp.point, reach.grasp.hand
    for target, tolerance, speed in ((over, 0.008, 0.4), (point, 0.004, 0.2)):
        yield from arm.move(
            target,
            hand,
            tolerance=tolerance,
            turn_tolerance=0.08,
            speed=speed,
            steps=80,
            required=False,
            exact=True,
        )
    if np.linalg.norm(arm.position - point) > ASTRAY:
        raise SkillFailed("something is in the hand's way")


def lift_below_shelf(arm: Arm, thing: Thing, over: Array, hand: Array) -> Motion:
    """Close the fingers, and rise to over where a thing stands (3,), no higher: a shelf is there.

    Raises:
        SkillFailed: if it was not lifted.
    """
    before = thing.underside
    yield from arm.grip(True, 14)
    yield from arm.move(
        over, hand, tolerance=0.004, speed=0.3, steps=60, required=False, exact=True
    )
    if thing.underside - before < LIFTED:
        raise SkillFailed("the object was not lifted")


def put_into(arm: Arm, role: str, box_role: str) -> Motion:
    """Carry something to a box and lower it into its far half, or into the near one if something
    is in it.
    """
    box, thing = Thing(arm, box_role), Thing(arm, role)
    ahead, height = LOADED
    tucked = arm.before(ahead, height)
    hand = fingers_level(arm)
    yield from arm.move(tucked, hand, tolerance=0.03, turn_tolerance=0.1, speed=0.5, steps=200)
    spot = spot_in(arm, box, thing)
    along = arm.floor_point(arm.ahead(arm.base), arm.aside(spot))
    yield from arm.drive(along, speed=CARRIED, steps=ALONG_COUNTER_STEPS, gentle=True)
    yield from carry_over(arm, role, spot, box.highest + BRAKE)
    yield from arm.move(
        arm.position, tolerance=BRAKE, turn_tolerance=0.3, steps=20, required=False, exact=True
    )
    yield from set_down(arm, role, speed=SOFTLY)
    yield from leave(arm, COUNTER_BACK)


def spot_in(arm: Arm, box: Thing, load: Thing) -> Array:
    """Where in a box a load goes (3,): into the far half, or the near one if something is in it."""
    (near, far), (_, end) = load.extent_ahead(), box.extent_ahead()
    beside = min(OFF_BOX_MIDDLE, end - arm.ahead(box.middle) - (far - near) / 2.0 - OFF_RIM)
    side = -beside if filled(arm, box, load) else beside
    return np.asarray(box.middle + arm.onward(side))


def filled(arm: Arm, box: Thing, load: Thing) -> bool:
    """Whether anything but a load is in a box, or over it."""
    others = other_things(arm, box, load)
    return any(np.linalg.norm((o.middle - box.middle)[:2]) < INSIDE for o in others)


def fingers_level(arm: Arm) -> Array:
    """The hand, turned until its fingers close along the base's left and are level (3, 3): a load
    that lay level lies level along the base's forward direction, but may be rolled about it.
    """
    level = about_z(-finger_angle(arm, arm.rotation[:, 0])) @ arm.rotation
    return arm.hand(arm.pitch_of(level))
