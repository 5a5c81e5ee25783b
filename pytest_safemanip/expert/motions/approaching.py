"""Coming: base and hand are brought to where a way to a goal begins, and drawn back from it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from pytest_safemanip.expert.motions.handholds import outline
from pytest_safemanip.expert.motions.poses import Pose, Reach
from pytest_safemanip.expert.motions.travelling import (
    THERE,
    arrives,
    check_bent,
    drive,
    fold,
    lowering_back,
    swing_back,
    swing_to,
    travel,
)
from pytest_safemanip.expert.motions.turning import turn_base
from pytest_safemanip.expert.robot.arm import Arm, IllHeld, Motion
from pytest_safemanip.expert.robot.rotations import Array, rotation_vector
from pytest_safemanip.expert.robot.torso import lift_torso
from pytest_safemanip.expert.world.standing import rearmost
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.expert.world.ways import Leg, foresee, held
from pytest_safemanip.trace.geometry import to_local, to_world

TURNS_FAR = 1.8
"""An empty hand that is to be turned by more is first brought before the base, rad: a joint might
come to its limit.
"""
CLOSE, EXACTLY = 0.02, 0.006
"""Where links have less room than this, m, the base has to stand so exactly, m, for it would take
them there beside their way: the hand comes to where it is to be, whatever the base does.
"""
ARRIVES = 0.01
"""Distance that counts as there before and at a goal, m."""
BARELY = 0.008
"""Room around links that is enough, by their own shapes, m: so far an arm is from where it is
foreseen while its base drives."""
GOES_ON = 2.0
"""A load that sags in the fingers is brought in higher by this many times what it sags by then: it
goes on sagging on the last stretch."""
HAND_PARTS = ("finger", "palm")
"""How the names of the hand's parts begin."""
SLIPS = 0.03
"""How far what is between the fingers moves that is about to be lost, m: it may turn there."""


def holding(arm: Arm, motion: Motion, load: Thing) -> Motion:
    """A motion that is given up when what is held slips in the fingers, or out of them.

    Raises:
        IllHeld: if it does.
    """
    held = to_local(load.pose, arm.position)
    hangs = (load.centre - arm.position) @ arm.rotation
    for action in motion:
        # What turns in the fingers turns about them, or, a ball, about its own centre.
        slid = to_world(load.pose, held) - arm.position
        moved = (load.centre - arm.position) @ arm.rotation - hangs
        if min(float(np.linalg.norm(slid)), float(np.linalg.norm(moved))) > SLIPS:
            raise IllHeld(f"{load.entity} slipped in the fingers")
        yield action


def links_pass(arm: Arm, reach: Reach) -> bool:
    """Whether the arm's links touch nothing on a way, from where the base stands off to where it
    stands after, by the simulator; asked only where their room is scarce, or the hand comes or goes
    below an edge: there the arm bends otherwise than their room was computed for.
    """
    if reach.room > CLOSE and not reach.below_edge:
        return True
    pose, come, go = reach.pose, reach.base + reach.come, reach.base + reach.go
    entry, hand = pose.point + reach.entry, pose.hand
    legs = [
        Leg(come, touches=True),
        Leg(entry + np.append(reach.come, 0.0), hand, ARRIVES),
        Leg(reach.base),
        Leg(entry, hand, ARRIVES),
        Leg(pose.point, hand, ARRIVES),
        Leg(pose.point + reach.leave, hand, ARRIVES),
        Leg(go),
    ]
    # Whether hand and base have room has been looked at.
    permits = [(own, "") for own in ("finger", "palm", "base", *held(arm))]
    raised = reach.torso - arm.torso
    return foresee(arm, legs, permits, margin=BARELY, raised=raised, begins=2).touch is None


def hand_passes(arm: Arm, reach: Reach, vessels: Sequence[str]) -> bool:
    """Whether the hand, its fingers open as there, meets none of some vessels on its straight way
    to a goal in them, by the simulator: the walls that it was planned with are upright.
    """
    if not vessels:
        return True
    pose, raised = reach.pose, reach.torso - arm.torso
    entry = Leg(pose.point + reach.entry, pose.hand, ARRIVES)
    legs = [Leg(reach.base), entry, Leg(pose.point, pose.hand, ARRIVES, touches=True)]
    others = [entity for entity in arm.scene.entity if entity not in vessels]
    permits = [("link", ""), ("base", ""), *itertools.product(HAND_PARTS, others)]
    foreseen = foresee(arm, legs, permits, pose.opening, 0.0, raised, begins=len(legs) - 1)
    return foreseen.touch is None


def turned_over(arm: Arm, reach: Reach) -> Reach:
    """A way to a grasp, or the same with the hand turned over, for its fingers are alike: where the
    arm does not come to the end of a joint.
    """
    flipped = reach.turned_over()
    shift = np.append(arm.base - reach.base, -reach.torso)
    ways = [
        way
        for way in (reach, flipped)
        if arrives(arm, way.pose.point + way.entry + shift, way.pose.hand)
    ]
    return arm.choices.choose("hand turned over", ways or [reach])


def go_before(arm: Arm, reach: Reach, load: Thing | None = None, speed: float = 1.0) -> Motion:
    """Bring base and hand to where the hand goes straight to its goal.

    Args:
        arm: the arm.
        reach: the way.
        load: what it holds.
        speed: share of the usual ones.

    Raises:
        SkillFailed: if base or hand does not get there.
    """
    pose = reach.pose
    entry = pose.point + reach.entry
    if reach.turn:
        yield from turn_base(arm, reach.turn, load)
    if load is None:
        if pose.opening < 1.0:
            yield from arm.open_to(pose.opening)
        else:
            arm.let_open()
        if float(np.linalg.norm(rotation_vector(pose.hand @ arm.rotation.T))) > TURNS_FAR:
            yield from fold(arm)

    off = np.zeros(3)

    def standing_off() -> Array:
        off[:2] = swing_back(arm, entry, pose.hand, reach.base, reach.torso, reach.come, load)
        return np.asarray(reach.base + off[:2])

    near = EXACTLY if reach.room < CLOSE else THERE
    yield from travel(arm, standing_off, load, near)
    yield from lift_torso(arm, reach.torso)
    if load is not None and not reach.entry[:2].any():
        entry = entry + np.array((0.0, 0.0, GOES_ON * _sags(arm, pose, load)))
    # The base may be beside its place, the hand not: it passes close to what stands there.
    yield from swing_to(arm, entry + off, pose.hand, speed)
    yield from drive(arm, reach.base, load, near)
    yield from arm.move(
        entry, pose.hand, tolerance=ARRIVES, turn_tolerance=0.08, speed=0.7 * speed, steps=60
    )
    check_bent(arm)


def _sags(arm: Arm, pose: Pose, load: Thing) -> float:
    """How much lower than planned a load comes to hang when the hand is turned as at a goal, m:
    what is heavy turns in the fingers on the way.
    """
    local = (outline(load) - arm.position) @ arm.rotation
    lowest = float((local @ pose.hand.T)[:, 2].min())
    return max(0.0, float(pose.load[:, 2].min() - pose.point[2]) - lowest)


def draw_back(arm: Arm, reach: Reach, load: Thing | None = None, least: float = 0.0) -> Motion:
    """Drive back from a goal that the hand has risen from, and lower the torso.

    Args:
        arm: the arm.
        reach: the way.
        load: what it holds.
        least: how far it drives back at least, m, if nothing is behind it.

    Raises:
        SkillFailed: if the base does not get there.
    """
    length = float(np.linalg.norm(reach.go))
    way = reach.go / length if length else -arm.forward
    out = reach.go if length >= least else max(length, _room_behind(arm, way, least)) * way
    if reach.torso:
        out = lowering_back(arm, reach.torso, out, load)
    # From where it is: the hand has come in exactly, the base has not.
    yield from drive(arm, arm.base + out, load)
    yield from lift_torso(arm, -reach.torso)


def _room_behind(arm: Arm, way: Array, most: float) -> float:
    """How far the base may drive in a direction (2,) before it meets what is behind it, m.

    Args:
        arm: the arm.
        way: the direction, a unit vector.
        most: given where nothing is behind it, m.
    """
    here, there = arm.base, arm.base + most * way
    ends = arm.aside(here), arm.aside(there)
    short = rearmost(arm, min(ends), max(ends), arm.ahead(here)) - arm.ahead(there)
    backwards = -arm.ahead(way)
    return most - max(0.0, short) / backwards if backwards > 0.0 else most
