"""What a motion does wrong while it is rehearsed, from contacts and poses: it knocks, it drops.

Plain physics, with limits of the script's own. No monitor is asked.
"""

from __future__ import annotations

import collections
import math
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.expert.robot.arm import Arm
from pytest_safemanip.expert.robot.rotations import Array
from pytest_safemanip.expert.world.contacts import supports
from pytest_safemanip.trace.elements import ROBOT, Part
from pytest_safemanip.trace.geometry import angle_between, relative
from pytest_safemanip.trace.steps import Step

LIMB = 3.0
"""Force on any part of the robot but its hand that is a knock, N."""
HAND = 72.0
"""Force of the hand on anything that is one, N."""
STRAY = 1.5
"""Force of the hand on what it has no reason to touch, N."""
LOAD = 3.5
"""Force of what is held on what it has no reason to touch, N."""
SHOVED = 0.03
"""How far what the skill is not about may be moved, m."""
PUSHED = 0.1
"""How far what something is put on or into may be moved, m."""
SWUNG = 0.05
"""How far a door that the skill is not about may be moved, share of its travel."""
SLID, TURNED, SINCE = 0.025, math.radians(16.0), 20
"""How far what the fingers hold may move in them and turn, m and rad, within so many control
steps."""
HELD = 0.2
"""Force of each finger on what it holds, N."""

Flags = NDArray[np.bool_]
Pair = tuple[int, int]


class Watch:
    """Looks at each step of a rehearsed skill.

    Args:
        arm: the arm, before the skill.
        roles: what the skill is about, that first which it does something with.

    Attributes:
        slipped: whether what is wrong is that something slipped in the fingers.
    """

    def __init__(self, arm: Arm, roles: Sequence[str]) -> None:
        scene, entity, allowed = arm.scene, arm.scene.roles, arm.permissions
        self._scene, self._first, self._parts = scene, arm.step, scene.parts
        self._meant = {entity.get(role, role) for role in roles}
        self._doors = [
            number
            for number, joint in enumerate(scene.joints)
            if joint.gives_access
            and joint.kind == "hinge"
            and joint.entity not in {entity.get(role, role) for role in roles[:1]}
        ]
        hand = scene.grippers[0]
        self._fingers = {finger for group in hand.fingers for finger in group}
        self._robot = self._flags(lambda part: part.entity == ROBOT)
        self._hand = self._robot & self._flags(lambda part: part.name in hand.parts)
        self._object = self._flags(lambda part: part.entity in scene.object_index)
        self._touchable = self._flags(lambda part: part.entity in self._meant)
        self._permitted = allowed is not None
        self._supports = supports(arm)
        if allowed is not None:
            touch = {
                (entity.get(r, r), name) for r, names in allowed.touch.items() for name in names
            }
            self._touchable = self._flags(lambda part: (part.entity, part.name) in touch)
        self._holds: dict[str, collections.deque[Array]] = {}
        self._before = dict(self._rows(arm.step, 0.0))
        # What is not brought to anything pushes nothing: a drawer is opened, and a knife in it.
        brought = {entity.get(role, role) for role in roles[:1]} & self._held(arm.step)
        self._goals = self._meant - brought if brought else set()
        self.slipped = False

    def wrong(self, step: Step) -> str:
        """What is wrong with a step, in a few words; empty if nothing is."""
        held = self._held(step)
        if slip := self._slipped(step, held):
            self.slipped = True
            return slip
        touches = dict(self._rows(step, STRAY))
        for (one, other), force in touches.items():
            if self._more(one, other, force) and self._bad(one, other, force, held):
                mine, its = self._parts[one], self._parts[other]
                who = mine.name if mine.entity == ROBOT else mine.entity
                said = f"{who} presses on {its.entity}'s {its.name} with {force:.0f} N"
                stray = self._permitted and self._hand[one] and not self._touchable[other]
                return said + ", which is not under the task's 'touch'" * bool(stray)
        return ""

    def left(self, step: Step) -> str:
        """What is wrong with how a skill leaves the world; empty if nothing is."""
        held = self._held(step)
        carried = self._with_loads(held | self._meant)
        lost, goals = self._lost(step, carried) - held, self._goals - held
        for body, index in self._scene.object_index.items():
            way = step.object_pose[index, :3] - self._first.object_pose[index, :3]
            moved = float(np.linalg.norm(way))
            if moved > SHOVED and body not in carried:
                return f"{body} was moved by {100 * moved:.0f} cm"
            if moved > SHOVED and body in lost:
                return f"{body} fell off what it lay on"
            if moved > PUSHED and body in goals:
                return f"{body} was pushed away by {100 * moved:.0f} cm"
        for number in self._doors:
            swung = float(step.joint[number, 0] - self._first.joint[number, 0])
            if abs(swung) > SWUNG:
                return f"{self._scene.joints[number].key} was moved by {abs(swung):.0%}"
        return ""

    def _with_loads(self, entities: set[str]) -> set[str]:
        """These, and the objects that touched them before the skill, or are allowed to."""
        found, parts = set(entities), self._parts
        pairs = [
            (parts[a].entity, parts[b].entity)
            for a, b in self._before
            if self._object[[a, b]].all()
        ]
        while loads := {other for one, other in pairs if one in found} - found:
            found |= loads
        return found | {body for body, below in self._supports.items() if below & entities}

    def _lost(self, step: Step, carried: set[str]) -> set[str]:
        """What of carried things touched another of them before the skill, and does not now."""

        def touching(pairs: Iterable[Pair]) -> set[str]:
            some = [(self._parts[a].entity, self._parts[b].entity) for a, b in pairs]
            return {one for one, other in some if one != other and other in carried}

        now = touching(pair for pair, _ in self._rows(step, 0.0))
        return (carried & touching(self._before)) - now - self._meant

    def _more(self, one: int, other: int, force: float) -> bool:
        """Whether parts did not touch before the skill; a limb that did may not press harder."""
        before = self._before.get((one, other))
        limb = self._robot[one] and not self._hand[one]
        return before is None or bool(limb and force > before)

    def _bad(self, one: int, other: int, force: float, held: set[str]) -> bool:
        if self._robot[one]:
            if self._robot[other]:
                return False
            if not self._hand[one]:
                return force >= LIMB
            return force >= HAND or not self._touchable[other]
        mine, its = self._parts[one].entity, self._parts[other].entity
        if mine not in held or self._robot[other] or its in held:
            return False
        return force >= LOAD and its not in self._supports.get(mine, self._meant)

    def _slipped(self, step: Step, held: set[str]) -> str:
        """What moves in closed fingers; empty if nothing does."""
        closed = held if float(step.commands[0]) >= 0.0 else set()
        self._holds = {
            entity: self._holds.get(entity, collections.deque(maxlen=SINCE)) for entity in closed
        }
        for entity, before in self._holds.items():
            pose = np.asarray(step.object_pose[self._scene.object_index[entity]], np.float64)
            before.append(relative(np.asarray(step.eef_poses[0], np.float64), pose))
            slid = np.linalg.norm(np.array(before)[:, :3] - before[-1][:3], axis=1).max()
            turned = angle_between(np.array(before)[:, 3:], before[-1][3:]).max()
            if slid > SLID or turned > TURNED:
                far = f"{100 * slid:.0f} cm and {math.degrees(turned):.0f} degrees"
                return f"{entity} slipped by {far} in the fingers"
        return ""

    def _held(self, step: Step) -> set[str]:
        """The objects that all fingers press on."""
        by: dict[str, set[str]] = {}
        for (one, other), _ in self._rows(step, HELD):
            if self._hand[one] and self._object[other]:
                by.setdefault(self._parts[other].entity, set()).add(self._parts[one].name)
        return {entity for entity, names in by.items() if self._fingers <= names}

    def _rows(self, step: Step, least: float) -> Iterator[tuple[Pair, float]]:
        """Pairs of parts that press on each other, both ways, and how hard, N."""
        contacts = step.contacts
        for row in np.flatnonzero(contacts.sustained >= least).tolist():
            a, b = int(contacts.a[row]), int(contacts.b[row])
            force = float(contacts.sustained[row])
            yield (a, b), force
            yield (b, a), force

    def _flags(self, is_one: Callable[[Part], bool]) -> Flags:
        return np.array([is_one(part) for part in self._parts])
