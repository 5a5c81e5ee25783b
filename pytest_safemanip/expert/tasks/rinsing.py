"""Holding something under the water of a tap."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.expert.motions.approaching import draw_back
from pytest_safemanip.expert.motions.placing import Spot, bring
from pytest_safemanip.expert.robot.arm import Arm, Motion
from pytest_safemanip.expert.world.things import Furniture, Thing

RINSE = 2.0
"""How long, s: RoboCasa wants 25 control steps."""
BELOW = (0.15, 0.18, 0.12, 0.22)
"""From the outlet of a spout down to the middle of what is rinsed, m."""
BESIDE = (0.0, 0.01, -0.01, 0.02, -0.02)
"""How far beside the middle of the water it may be, m."""
BACK = 0.25
"""How far the base then draws back at least, m."""


def rinse(arm: Arm, role: str, sink_role: str) -> Motion:
    """Hold something under the water of a running tap for a while, and bring it out again.

    Raises:
        SkillFailed: if there is no way for it.
    """
    thing = Thing(arm, role)
    reach = yield from bring(arm, thing, lambda: watered(arm, thing, Furniture(arm, sink_role)))
    yield from arm.move(
        reach.pose.point, reach.pose.hand, tolerance=0.012, speed=0.4, steps=80, required=False
    )
    yield from arm.wait(RINSE)
    yield from arm.move(
        reach.pose.point + reach.leave, tolerance=0.02, speed=0.5, steps=60, required=False
    )
    yield from draw_back(arm, reach, thing, BACK)


def watered(arm: Arm, thing: Thing, sink: Furniture) -> list[Spot]:
    """Where a held thing is in the water of a tap."""
    pose, half = sink.water()
    outlet, half_high = float(pose[2] + half[2]), thing.height / 2.0
    aside = np.append(arm.left, 0.0)
    return [
        Spot(
            np.append((pose[:3] + beside * aside)[:2], outlet - below - half_high),
            0.1 * number + abs(beside),
            f"water {below} {beside}",
        )
        for number, below in enumerate(BELOW)
        for beside in BESIDE
    ]
