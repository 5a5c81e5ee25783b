from __future__ import annotations

import dataclasses

import pytest

from pytest_safemanip.expert.motions.resting import check_inside, check_steady
from pytest_safemanip.expert.robot.arm import Arm, SkillFailed
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.trace.elements import Surface
from tests import toy

UP, ASIDE, TOP = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.9
FOUR = ((0.02, 0.02), (0.02, -0.02), (-0.02, 0.02), (-0.02, -0.02))
EDGE = "mug came to rest at an edge"


def counter(x=0.0, half=1.0, top=TOP):
    return Surface("counter", "", (half, 0.5, 0.45), (x, 0.0, top - 0.45, *toy.UPRIGHT))


WHOLE = (counter(),)


def wrong(check, points, surfaces=WHOLE, normal=UP, vessel=None):
    """What is wrong with how the mug, above the origin, rests on some points (x, y)."""
    scene = dataclasses.replace(toy.SCENE, surfaces=surfaces)
    below = f"{vessel or 'counter'}/body"
    rows = [(0, below, "mug/body", 1.0, normal, (*at, TOP), 1.0) for at in points]
    mug, apple = ((0.0, 0.0, z, *toy.UPRIGHT) for z in (0.95, 0.94))
    if not vessel:
        apple = (0.4, *apple[1:])
    step = toy.at_rest(object_pose=(mug, apple))
    arm = Arm(scene, dataclasses.replace(step, contacts=toy.contacts(*rows)))
    try:
        check(arm, Thing(arm, "obj"), *([Thing(arm, vessel)] if vessel else []))
    except SkillFailed as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("points", "surfaces", "said"),
    [
        (FOUR, WHOLE, ""),
        (FOUR[:1], WHOLE, ""),  # a ball, whose one point has the counter around it
        (FOUR, (), ""),  # on four feet
        (FOUR[:3], (), EDGE),
        (((0.0, 0.02), (0.0, -0.02)), (counter(half=0.003),), EDGE),  # balanced on a wire
        (((-0.03, 0.0),), (counter(-0.5, half=0.47),), EDGE),
        (((-0.03, 0.0),), (counter(-0.5, 0.47), counter(0.5, 0.52, TOP - 0.008)), ""),  # leans
        (((-0.03, 0.0),), (counter(-0.5, 0.47), counter(0.5, 0.52, TOP - 0.03)), EDGE),
    ],
)
def test_what_would_tip_off_if_it_were_nudged_does_not_rest(points, surfaces, said):
    assert wrong(check_steady, points, surfaces) == said


@pytest.mark.parametrize(("normal", "held"), [(ASIDE, False), ((0.9, 0.0, 0.4), False), (UP, True)])
def test_what_is_wedged_does_not_rest(normal, held):
    assert bool(wrong(check_steady, FOUR, normal=normal)) != held
    said = wrong(check_inside, FOUR, normal=normal, vessel="apple")
    assert ("wedged" in said) != held
