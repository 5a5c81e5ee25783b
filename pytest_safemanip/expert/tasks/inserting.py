"""Putting a held stick into a vessel: a straw into a glass."""

from __future__ import annotations

from pytest_safemanip.expert.motions.attitudes import dipped
from pytest_safemanip.expert.motions.lowering import withdraw
from pytest_safemanip.expert.motions.placing import FALLS, bring
from pytest_safemanip.expert.motions.spots import into_thing
from pytest_safemanip.expert.robot.arm import Arm, IllHeld, Motion, raised
from pytest_safemanip.expert.world.contacts import carriers, palm_meets
from pytest_safemanip.expert.world.things import Thing

SPEED = 0.15
"""Share of the hand's top speed at which a stick is lowered."""
INSIDE = 0.03
"""How far below a vessel's rim its end must be for it to fall in, m."""


def insert(arm: Arm, role: str, vessel_role: str) -> Motion:
    """Tip a held stick up, lower its end into a vessel, let go, and draw back.

    Raises:
        SkillFailed: if there is no way for it, or if its end does not come low enough.
    """
    stick, vessel = Thing(arm, role), Thing(arm, vessel_role)
    reach = yield from bring(arm, stick, lambda: into_thing(arm, stick, vessel), dipped)
    low = raised(reach.pose.point, -max(0.0, reach.pose.over - FALLS / 2.0))

    def inside() -> bool:
        return stick.bottom < min(vessel.highest - INSIDE, vessel.bottom + FALLS)

    yield from arm.move(
        low,
        reach.pose.hand,
        tolerance=0.008,
        speed=SPEED,
        steps=150,
        until=lambda: palm_meets(arm, stick) or (inside() and bool(carriers(arm, stick))),
        required=False,
    )
    if not inside():
        fall = 100.0 * (stick.bottom - vessel.bottom)
        raise IllHeld(f"{stick.entity} would fall {fall:.0f} cm into {vessel.entity}")
    yield from arm.grip(False)
    yield from withdraw(arm, reach)
