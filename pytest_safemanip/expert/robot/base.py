"""The robot's mobile base: where it drives, how it turns on the spot, and what lies how from it."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Hashable
from typing import Any, TypeVar

import numpy as np

from pytest_safemanip.errors import SafemanipError
from pytest_safemanip.expert.robot.choices import Choices
from pytest_safemanip.expert.robot.rotations import Array, about_y, about_z
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step

T = TypeVar("T")
Motion = Generator[Array, None, None]
"""Actions (12,), one for each control step."""

BASE_DEAD_BAND = 0.27
"""Base commands below 0.25 do not overcome its friction."""
BASE_RISE, BASE_RISE_GENTLY = 3.0, 1.5
"""Commands above that for each m that is left, without and with a load: the base then comes to rest
in 0.3 s and in 0.6 s."""
TURN_TOLERANCE = 1.0
"""The base has turned when it is so near, degrees."""
TURN_DEAD_BAND, TURN_SPEED = 0.12, 0.5
"""Commands for turning the base: near the goal, and the largest one, at which it turns by 1.7
degrees in a control step."""
TURN_RISE, TURN_RISE_GENTLY = 0.03, 0.01
"""Commands above the former for each degree that is left, without and with a load."""
CAREFUL = 0.4
"""Base command for what hangs in two fingers: 0.15 m/s."""
SWING = 0.6
"""Time in which the base then comes to that speed, s: a bottle swings in the fingers once in 0.5 s
to 0.6 s, and is left hanging still by a push that lasts as long; a sudden one would tip it by 10
degrees, and as much again when the next one meets the swing."""


BLOCKS = 3.0
"""With less than this, N, the robot only touches something."""


NOTCHES = 10
"""From closed fingers to open ones: a control step in which they are told to move takes them one
farther, whether something holds them up or not."""
NOTCH, LAG = 1.0 / NOTCHES, 0.02
"""Share of their full opening, and by how much of it they stay behind."""


PACES = 1.0, 0.5
"""Factors on all speeds."""
TIPPED, TURNED = (0.0, 15.0, -15.0, 30.0), (0.0, 20.0, -20.0)
"""By how much the hand may be tipped forward and turned left otherwise than usual, degrees."""


class SkillFailed(SafemanipError):
    """A motion did not arrive; going on would only do damage."""


class NoWay(SkillFailed):
    """There is no way to do it as things stand, whatever is chosen."""


class IllHeld(SkillFailed):
    """It failed for how something is held: another grasp is likelier to help than another way."""


STATES, LASTING = 4, 32
"""In how many what has been found out is remembered, and of what takes long to find out: a search
comes back to them, and what it has found is then done."""


class Base:
    """The base, as a script moves it; hand and fingers keep their pose relative to it. Points are
    of the world, metres.

    Args:
        scene: the static part of the episode.
        step: the first state.

    Attributes:
        scene: the static part of the episode.
        step: the newest state.
        choices: decide what may be done in more than one way.
        straight_down: the hand (3, 3) that points straight down, its wrist turned as an episode
            begins.
        notch: to which the fingers are told to be open.
        torso: how far it is raised, m.
        turned: how far the base was turned to the left since it faced what it drove to, degrees.
    """

    def __init__(self, scene: Scene, step: Step) -> None:
        self.scene, self.step = scene, step
        self.choices = Choices()
        axis = self.rotation[:, 0].copy()
        axis[2] = 0.0
        axis /= np.linalg.norm(axis)
        down = np.array((0.0, 0.0, -1.0))
        self.straight_down = np.stack((axis, np.cross(down, axis), down), axis=1)
        self._grip = -1.0
        self._memory: dict[str, Any] = {}
        self.notch = round(NOTCHES * float(step.gripper[0]))
        self.torso, self.turned = 0.0, 0.0

    @property
    def position(self) -> Array:
        """Grip point (3,)."""
        return np.asarray(self.step.eef_pose[:3], np.float64)

    @property
    def rotation(self) -> Array:
        """Hand frame (3, 3): columns are the fingers' direction of travel, the normal of the hand,
        and the approach direction out of the palm.
        """
        return np.asarray(matrix(self.step.eef_pose[3:]), np.float64)

    @property
    def pitch(self) -> float:
        """Degrees from straight down to where the hand points, towards the base's forward."""
        return self.pitch_of(self.rotation)

    @property
    def base(self) -> Array:
        """Base position on the floor (2,)."""
        return np.asarray(self.step.base_pose[:2], np.float64)

    @property
    def forward(self) -> Array:
        """Where the base faces, on the floor (2,)."""
        return np.asarray(matrix(self.step.base_pose[3:])[:2, 0], np.float64)

    @property
    def left(self) -> Array:
        """To the left of the base, on the floor (2,)."""
        return np.asarray(matrix(self.step.base_pose[3:])[:2, 1], np.float64)

    @property
    def hand_ahead(self) -> float:
        """How far the grip point lies ahead of the base, m."""
        return self.ahead(self.position) - self.ahead(self.base)

    @property
    def frame(self) -> Array:
        """Forward, left and up of the base as columns (3, 3)."""
        forward, left = np.append(self.forward, 0.0), np.append(self.left, 0.0)
        return np.stack((forward, left, np.array((0.0, 0.0, 1.0))), axis=1)

    def ahead(self, point: Array) -> float:
        """How far a point lies along the base's forward direction, m."""
        return float(np.asarray(point)[:2] @ self.forward)

    def aside(self, point: Array) -> float:
        """How far a point lies along the base's left direction, m."""
        return float(np.asarray(point)[:2] @ self.left)

    def level(self, points: Array) -> Array:
        """How far points (..., 2) or (..., 3) lie ahead and to the left, m (..., 2)."""
        flat = np.asarray(points)[..., :2]
        return np.stack((flat @ self.forward, flat @ self.left), axis=-1)

    def bearing(self, way: Array) -> float:
        """Degrees about the vertical from the base's forward direction left to another one."""
        return math.degrees(math.atan2(self.aside(way), self.ahead(way)))

    def pitch_of(self, hand: Array) -> float:
        """Degrees from straight down to where a hand (3, 3) points, towards the base's forward."""
        approach = hand[:, 2]
        return math.degrees(math.atan2(approach[:2] @ self.forward, -approach[2]))

    def floor_point(self, ahead: float, aside: float) -> Array:
        """The point on the floor with these two coordinates (2,)."""
        return ahead * self.forward + aside * self.left

    def point(self, ahead: float, aside: float, height: float) -> Array:
        """The point with these coordinates (3,)."""
        return np.append(self.floor_point(ahead, aside), height)

    def before(self, ahead: float, height: float) -> Array:
        """The point so far straight before the base, m, at a height (3,)."""
        return self.point(self.ahead(self.base) + ahead, self.aside(self.base), height)

    def onward(self, distance: float) -> Array:
        """The way so far along the base's forward direction, m (3,)."""
        return np.append(distance * self.forward, 0.0)

    def hand(self, pitch: float = 0.0, roll: float = 0.0, yaw: float = 0.0) -> Array:
        """A hand orientation (3, 3).

        Args:
            pitch: degrees from straight down towards the base's forward direction.
            roll: degrees about the approach direction, before pitching.
            yaw: degrees about the vertical, applied last.
        """
        pitch += self.choices.choose("hand tipped farther", TIPPED)
        yaw += self.choices.choose("hand turned farther", TURNED)
        return self.pointing(pitch, roll, yaw)

    def pointing(self, pitch: float = 0.0, roll: float = 0.0, yaw: float = 0.0) -> Array:
        """A hand orientation (3, 3), as :meth:`hand` gives it where nothing else is chosen."""
        heading = about_z(math.degrees(math.atan2(self.forward[1], self.forward[0])))
        tipped = heading @ about_y(-pitch) @ heading.T @ about_z(roll) @ self.straight_down
        turned: Array = about_z(yaw) @ tipped
        return turned

    def memory(self, what: str, find: Callable[[], T]) -> T:
        """What has been found out about the scene, which stays as it is."""
        return self.latest(what, None, find)

    def latest(self, what: str, state: Hashable, find: Callable[[], T], most: int = STATES) -> T:
        """What has been found out in a state; forgotten when there were so many others since."""
        known: dict[Hashable, T] = self._memory.setdefault(what, {})
        if state not in known:
            for old in list(known)[: len(known) + 1 - most]:
                del known[old]
            known[state] = find()
        return known[state]

    def see(self, step: Step) -> None:
        """Take the state that the last action led to."""
        told = int(np.sign(step.commands[0]))
        self.notch, self.step = min(max(self.notch - told, 0), NOTCHES), step

    def drive(
        self,
        target: Array,
        *,
        tolerance: float = 0.02,
        steps: int = 150,
        speed: float = 0.7,
        until: Callable[[], bool] | None = None,
        gentle: bool = False,
    ) -> Motion:
        """Move the base in a straight line; the hand keeps its pose relative to it.

        Args:
            target: base position on the floor (2,).
            tolerance: along each axis of the base, m.
            steps: control steps at most.
            speed: largest command; up to ``CAREFUL``, the base also starts and stops gently.
            until: stops the base before the target.
            gentle: whether it starts and stops gently at a higher speed too.

        Raises:
            SkillFailed: if the base does not arrive in time.
        """
        pace = self.choices.choose("pace", PACES)
        # Only what a command has above the dead band moves the base.
        speed = BASE_DEAD_BAND + pace * (speed - BASE_DEAD_BAND)
        steps = round(steps / pace)
        gentle = gentle or speed <= CAREFUL
        rise = SWING / self.scene.control_period if gentle else 1.0
        slows = BASE_RISE_GENTLY if gentle else BASE_RISE
        for step in range(steps):
            most = BASE_DEAD_BAND + (speed - BASE_DEAD_BAND) * min(1.0, (step + 1) / rise)
            error = target - self.base
            local = self.level(error)
            if (np.abs(local) < tolerance).all() or (until and until()):
                break
            action = self.hold()
            # Straight, as both axes have their dead band.
            longer = float(np.abs(local).max())
            above = min(slows * longer, most - BASE_DEAD_BAND) * local / longer
            for axis in range(2):
                if abs(local[axis]) > tolerance:
                    action[7 + axis] = math.copysign(BASE_DEAD_BAND, local[axis]) + above[axis]
            yield action
        else:
            off = f"{100 * np.linalg.norm(error):.1f} cm"
            raise SkillFailed(f"the base stopped {off} short{self.in_the_way()}")
        for _ in range(3):
            yield self.hold()

    def turn(self, degrees: float, steps: int = 200, *, gentle: bool = False) -> Motion:
        """Turn the base on the spot; the hand keeps its pose relative to it.

        Args:
            degrees: to the left.
            steps: control steps at most.
            gentle: whether it stops gently.

        Raises:
            SkillFailed: if the base does not arrive in time.
        """
        to, slows = about_z(degrees), TURN_RISE_GENTLY if gentle else TURN_RISE
        goal, down = np.append(self.forward, 0.0) @ to.T, to @ self.straight_down
        for _ in range(steps):
            here = np.append(self.forward, 0.0)
            left = math.degrees(math.atan2(np.cross(here, goal)[2], here @ goal))
            if abs(left) < TURN_TOLERANCE:
                break
            action = self.hold()
            wanted = TURN_DEAD_BAND + slows * abs(left)
            action[9] = math.copysign(min(wanted, TURN_SPEED), left)
            yield action
        else:
            off = f"{abs(left):.1f} degrees"
            raise SkillFailed(f"the base stopped {off} short{self.in_the_way()}")
        self.straight_down = down
        self.turned = (self.turned + degrees) % 360.0
        for _ in range(3):
            yield self.hold()

    def wait(self, seconds: float) -> Motion:
        """Hold still."""
        for _ in range(round(seconds / self.scene.control_period)):
            yield self.hold()

    def in_the_way(self) -> str:
        """What the robot presses on the hardest, as the end of a sentence; empty if on nothing."""
        contacts, parts = self.step.contacts, self.scene.parts
        for row in np.argsort(-contacts.force).tolist():
            pair = parts[contacts.a[row]], parts[contacts.b[row]]
            own = [part.entity == ROBOT for part in pair]
            if any(own) and contacts.force[row] >= BLOCKS:
                mine, other = pair if own[0] else pair[::-1]
                force = f"{contacts.force[row]:.0f} N"
                return f": {mine.name} presses on {other.entity}'s {other.name} with {force}"
        return ""

    def hold(self) -> Array:
        """The action that keeps everything where it is (12,)."""
        action = np.zeros(12)
        action[6], action[11] = self._grip, 1.0
        return action
