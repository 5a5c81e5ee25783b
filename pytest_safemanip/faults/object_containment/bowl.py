"""Food that is let go toward a bowl, and does not end up in it."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.robot.arm import Arm, Motion, raised
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.things import Thing
from pytest_safemanip.faults.handling import OPEN, carry_over, pinch, release
from pytest_safemanip.trace.geometry import matrix

FOOD, BOWL = "vegetable", "bowl"
LOW = 0.01
"""Height of a release that is no fall, m."""
WITHIN = 0.035
"""Height above a bowl's bottom from which nothing falls far into it, m."""
SLACK = 0.01
"""How far before a bowl's middle a slow release begins, m: it ends as far behind."""


def let_go_outside(arm: Arm, height: float, gap: float, unsafe: bool) -> Motion:
    """Lets go of the food beside the bowl.

    Args:
        arm: the arm.
        height: above the bowl's bottom, m.
        gap: from the bowl's outside to the food's nearest side, m.
        unsafe: whether it lands where it may not.
    """
    food, bowl = Thing(arm, FOOD), Thing(arm, BOWL)
    yield from pinch(arm, FOOD)
    yield from _let_go_at(arm, _radius(bowl) + gap + _widest(food), height, unsafe)


def let_go_inside(arm: Arm, gap: float | None = None) -> Motion:
    """Lets go of the food in the bowl, in its middle, or so near to its outside, m."""
    food, bowl = Thing(arm, FOOD), Thing(arm, BOWL)
    yield from pinch(arm, FOOD)
    aside = 0.0 if gap is None else max(_radius(bowl) - gap - _widest(food), 0.0)
    yield from _let_go_at(arm, aside, min(bowl.height - LOW, WITHIN), unsafe=False)


def _let_go_at(arm: Arm, aside: float, height: float, unsafe: bool) -> Motion:
    """Let go of the food aside of the bowl's middle, above the bowl's bottom."""
    food, bowl = Thing(arm, FOOD), Thing(arm, BOWL)

    def place() -> Array:
        return np.append(bowl.middle[:2] - aside * arm.left, bowl.bottom + height)

    yield from carry_over(arm, food, place)
    if unsafe:
        _expect(arm, food, bowl)
    yield from release(arm)


def _expect(arm: Arm, food: Thing, bowl: Thing) -> None:
    """What is let go outside the bowl lies on the counter, where it may not."""
    counter = bowl.bottom

    def missed() -> bool:
        free = arm.step.gripper[0] > OPEN and food.bottom < counter + LOW
        gap = float(np.linalg.norm((food.centre - bowl.middle)[:2])) - _radius(bowl)
        return bool(free and gap > 0.0)

    arm.truth.begins("object_containment", FOOD, BOWL, when=missed)
    arm.truth.begins("release_stability", FOOD, when=missed)
    arm.truth.begins("action_onset", "place", FOOD, when=missed)


def _radius(bowl: Thing) -> float:
    return min(width for _, width in bowl.sides()) / 2.0


def _widest(food: Thing) -> float:
    return max(width for _, width in food.sides()) / 2.0


def let_go_in_passing(arm: Arm, speed: float, unsafe: bool) -> Motion:
    """Lets go while the hand moves on over the bowl, at a share of the top speed; if that is
    dangerous, the food flies past its rim.
    """
    food, bowl = Thing(arm, FOOD), Thing(arm, BOWL)
    yield from pinch(arm, FOOD)
    height = bowl.height + LOW if unsafe else min(bowl.height - LOW, WITHIN)
    # Fingers open within eight control steps; food that is thrown must be past the rim then.
    start = bowl.middle[:2] + (_radius(bowl) / 2.0 if unsafe else -SLACK) * arm.left
    yield from carry_over(arm, food, lambda: np.append(start, bowl.bottom + height))
    if unsafe:
        _expect(arm, food, bowl)
    yield from arm.fling(np.append(speed * arm.left, 0.0), 10)
    yield from release(arm)


def let_go_over(arm: Arm) -> Motion:
    """Lets go over a bowl that does not stand upright."""
    food, bowl = Thing(arm, FOOD), Thing(arm, BOWL)
    yield from pinch(arm, FOOD)
    yield from carry_over(arm, food, lambda: raised(bowl.top, LOW))

    def outside() -> bool:
        upright = matrix(bowl.pose[3:])[2, 2] > 0.5
        return arm.step.gripper[0] > OPEN and not upright

    arm.truth.begins("object_containment", FOOD, BOWL, when=outside)
    yield from release(arm)
