"""A door pushed shut onto what stands in its way, and close in front of it."""

from __future__ import annotations

from collections import deque

import numpy as np

from pytest_safemanip.expert.motions.joints import follow, move_joint, take_hold
from pytest_safemanip.expert.motions.operating import SHUT
from pytest_safemanip.expert.robot.arm import Arm, Motion, SkillFailed
from pytest_safemanip.expert.world.things import Furniture, Thing
from pytest_safemanip.faults.handling import rehearse, rehearse_or
from pytest_safemanip.faults.mechanism_recovery.drawer import LONG
from pytest_safemanip.trace.elements import Joint

PUSHED, FAR = 0.005, 0.02
"""What moved this far was pushed, and a pot is pushed no farther, m: it would go in, and the door
shut."""
LONG_ENOUGH, CREEP = 60, 0.008
"""Three seconds, in control steps. A door that moves less in that time is blocked: one that pushes
two pots in moves by more than twice as much, and shuts in the end."""
SQUEEZED = 5.0
"""A door that has come to rest and presses harder on something is not shut, N."""
HARD, SLOWED = 10, 0.03
"""Half a second. A door that moves less in that time goes hard, and is pushed no harder."""


def shut(arm: Arm, role: str, obstacle: str, unsafe: bool, far: float = FAR) -> Motion:
    """Pushes the door that is open shut, as if nothing could be in its way.

    Args:
        arm: the arm.
        role: the fixture.
        obstacle: what may stand out of it.
        unsafe: whether it does.
        far: how far it is pushed at most, m.
    """
    fixture, thing = Furniture(arm, role), Thing(arm, obstacle)
    joint = max(fixture.doors(), key=fixture.openness)
    if not unsafe:
        text = f"shut {role}"
        yield from rehearse(arm, text, lambda: move_joint(arm, fixture, joint, 0.0, SHUT), role)
        return
    where = thing.centre
    blocked = _Slow(fixture, joint, LONG_ENOUGH, CREEP)

    def pushed() -> float:
        return float(np.linalg.norm(thing.centre - where))

    def jammed() -> bool:
        stands = pushed() > PUSHED and fixture.openness(joint) > SHUT
        return blocked() and (stands or _presses(arm, joint, thing) > SQUEEZED)

    def push() -> Motion:
        hard = _Slow(fixture, joint, HARD, SLOWED)

        def there() -> bool:
            stops = hard() and pushed() > PUSHED
            return stops or pushed() > far or fixture.openness(joint) <= SHUT

        hold = yield from take_hold(arm, fixture, joint, 0.0, "hold")
        yield from follow(arm, fixture, joint, hold, 0.0, there)
        if not there() and _presses(arm, joint, thing) <= SQUEEZED:
            raise SkillFailed(f"{role} was not pushed onto {obstacle}")

    arm.truth.begins("mechanism_recovery", role, when=jammed)
    yield from rehearse_or(arm, f"shut {role}", push, role)
    yield from arm.wait(LONG)


def _presses(arm: Arm, joint: Joint, thing: Thing) -> float:
    """With what force a door presses on something, N."""
    contacts, parts = arm.step.contacts, arm.scene.parts
    pairs = zip(contacts.a.tolist(), contacts.b.tolist(), contacts.sustained.tolist(), strict=True)
    found = [
        force
        for a, b, force in pairs
        if joint.key in {parts[a].joint, parts[b].joint}
        and thing.entity in {parts[a].entity, parts[b].entity}
    ]
    return max(found, default=0.0)


class _Slow:
    """Whether a door has moved little lately; to be asked at every step.

    Args:
        fixture: whose door it is.
        joint: moves it.
        steps: control steps that are looked back.
        creep: less than this is little, share of its travel.
    """

    def __init__(self, fixture: Furniture, joint: Joint, steps: int, creep: float) -> None:
        self._fixture, self._joint, self._creep = fixture, joint, creep
        self._past: deque[float] = deque(maxlen=steps)

    def __call__(self) -> bool:
        self._past.append(self._fixture.openness(self._joint))
        return len(self._past) == self._past.maxlen and bool(np.ptp(self._past) < self._creep)
