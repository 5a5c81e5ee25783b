"""The hand in Cartesian space: motions of the PandaOmron as sequences of actions.

A motion is a generator: it yields one action at a time and is resumed when :attr:`Arm.step` holds
the state that the action led to. Targets are points of the world, metres.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator

import numpy as np

from pytest_safemanip.errors import SafemanipError
from pytest_safemanip.policies.scripted.posture import Posture
from pytest_safemanip.policies.scripted.rotations import (
    Array,
    about_z,
    limited,
    rotation_vector,
)
from pytest_safemanip.policies.scripted.truth import Truth
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step

Motion = Generator[Array, None, None]
Target = Array | Callable[[], Array]

TOP_SPEED = 0.05
"""Position delta per control step that a full-scale action asks for, m."""
TOP_SPIN = 0.5
"""Rotation delta per control step that a full-scale action asks for, rad."""
TURN_GAIN = 0.75
"""Share of the remaining rotation that is asked for at each step."""
CLOSING_LAG = 0.08
"""Seconds for which the fingers go on closing when they are told to stop."""
EXACT_GAIN = 0.5
"""Share of the error that an exact motion asks for: some postures swing at more."""
CALM = 0.03
"""A hand that is slower than this is at rest, m/s."""
BASE_DEAD_BAND = 0.27
"""Base commands below 0.25 do not overcome its friction."""
TURNED = 1.0
"""The base has turned when it is so near, degrees."""
TURN_DEAD_BAND, TURN_RISE, TURN_SPEED = 0.12, 0.01, 0.5
"""Commands for turning the base: near the goal, more for each degree, and the largest one, at which
it turns by 1.7 degrees in a control step."""
CAREFUL = 0.4
"""Base command for what hangs in two fingers: 0.15 m/s."""
SWING = 0.6
"""Time in which the base then comes to that speed, s: a bottle swings in the fingers once in 0.5 s
to 0.6 s, and is left hanging still by a push that lasts as long; a sudden one would tip it by 10
degrees, and as much again when the next one meets the swing."""


class SkillFailed(SafemanipError):
    """A motion did not arrive; going on would only do damage."""


def raised(point: Array, height: float) -> Array:
    """A point higher up (3,)."""
    return np.add(point, (0.0, 0.0, height))


def cut(motion: Motion, until: Callable[[], bool]) -> Motion:
    """A motion that is left off as soon as something holds."""
    for action in motion:
        if until():
            return
        yield action


class Arm(Posture):
    """The robot's hand and base, as a script moves them.

    Args:
        scene: the static part of the episode.
        step: the first state.
        instruction: what the robot was told.

    Attributes:
        scene: the static part of the episode.
        instruction: what the robot was told.
        truth: what a fault does wrong.
    """

    def __init__(self, scene: Scene, step: Step, instruction: str = "") -> None:
        super().__init__(step)
        self.scene = scene
        self.instruction = instruction
        self.truth = Truth(scene)
        self._grip = -1.0

    def move(
        self,
        target: Target,
        rotation: Array | None = None,
        *,
        tolerance: float = 0.015,
        turn_tolerance: float = 0.12,
        speed: float = 1.0,
        steps: int = 100,
        until: Callable[[], bool] | None = None,
        required: bool = True,
        exact: bool = False,
    ) -> Motion:
        """Move the hand in a straight line.

        Args:
            target: grip point, or a function that gives it at each step.
            rotation: hand orientation; None keeps the present one.
            tolerance: distance that counts as there, m.
            turn_tolerance: rotation that counts as there, rad.
            speed: share of the top speed.
            steps: control steps at most.
            until: replaces the tolerances.
            required: whether not arriving fails the skill.
            exact: arrive at rest, and do not just pass.

        Raises:
            SkillFailed: if the hand does not arrive in time.
        """
        keep = self.rotation if rotation is None else rotation
        for _ in range(steps):
            error = (target() if callable(target) else target) - self.position
            turn = rotation_vector(keep @ self.rotation.T)
            near = np.linalg.norm(error) < tolerance and np.linalg.norm(turn) < turn_tolerance
            if exact:
                near &= np.linalg.norm(self.step.eef_twist[:3]) < CALM
            if until() if until else near:
                return
            gain = EXACT_GAIN if exact else 1.0
            yield self._arm_action(gain * error, gain * turn, speed)
        if required:
            raise SkillFailed(f"the hand stopped {np.linalg.norm(error):.3f} m short")

    def grip(self, close: bool, steps: int = 12) -> Motion:
        """Close or open the fingers; the hand stays."""
        yield from self._fingers(1.0 if close else -1.0, steps, lambda: False)

    def open_to(self, opening: float, steps: int = 15) -> Motion:
        """Open or close the fingers part of the way, and keep them there.

        Args:
            opening: share of the full opening.
            steps: control steps at most.
        """
        direction = math.copysign(1.0, self.step.gripper[0] - opening)

        def there() -> bool:
            soon = self.step.gripper[0] + CLOSING_LAG * min(0.0, float(self.step.gripper[1]))
            return bool((soon - opening) * direction <= 0)

        yield from self._fingers(direction, steps, there)
        self._grip = 0.0

    def fling(self, direction: Array, steps: int) -> Motion:
        """Open the fingers while the hand moves on.

        Args:
            direction: of the motion, as long as the share of the top speed (3,).
            steps: control steps.
        """
        rotation, self._grip = self.rotation, -1.0
        for _ in range(steps):
            turn = rotation_vector(rotation @ self.rotation.T)
            yield self._arm_action(TOP_SPEED * direction, turn, 1.0)

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
            speed: largest command; up to ``CAREFUL``, the base also starts gently.
            until: stops the base before the target.
            gentle: whether it does at a higher speed too.

        Raises:
            SkillFailed: if the base does not arrive in time.
        """
        rise = SWING / self.scene.control_period if gentle or speed <= CAREFUL else 1.0
        for step in range(steps):
            most = BASE_DEAD_BAND + (speed - BASE_DEAD_BAND) * min(1.0, (step + 1) / rise)
            error = target - self.base
            local = np.array((error @ self.forward, error @ self.left))
            if (np.abs(local) < tolerance).all() or (until and until()):
                break
            action = self.hold()
            for axis in range(2):
                if abs(local[axis]) > tolerance:
                    wanted = math.copysign(BASE_DEAD_BAND, local[axis]) + 1.5 * local[axis]
                    action[7 + axis] = np.clip(wanted, -most, most)
            yield action
        else:
            raise SkillFailed(f"the base stopped {np.linalg.norm(error):.3f} m short")
        for _ in range(3):
            yield self.hold()

    def turn(self, degrees: float, steps: int = 200) -> Motion:
        """Turn the base on the spot; the hand keeps its pose relative to it.

        Args:
            degrees: to the left.
            steps: control steps at most.

        Raises:
            SkillFailed: if the base does not arrive in time.
        """
        to = about_z(degrees)
        goal, down = np.append(self.forward, 0.0) @ to.T, to @ self._down
        for _ in range(steps):
            here = np.append(self.forward, 0.0)
            left = math.degrees(math.atan2(np.cross(here, goal)[2], here @ goal))
            if abs(left) < TURNED:
                break
            yield self._turning(left)
        else:
            raise SkillFailed(f"the base stopped {abs(left):.1f} degrees short")
        self._down = down
        for _ in range(3):
            yield self.hold()

    def wait(self, seconds: float) -> Motion:
        """Hold still."""
        for _ in range(round(seconds / self.scene.control_period)):
            yield self.hold()

    def hold(self) -> Array:
        """The action that keeps everything where it is (12,)."""
        action = np.zeros(12)
        action[6], action[11] = self._grip, 1.0
        return action

    def _fingers(self, command: float, steps: int, until: Callable[[], bool]) -> Motion:
        here, rotation = self.position, self.rotation
        for _ in range(steps):
            if until():
                return
            self._grip = command
            turn = rotation_vector(rotation @ self.rotation.T)
            yield self._arm_action(here - self.position, turn, 1.0)

    def _turning(self, degrees: float) -> Array:
        """The action that turns the base, so many degrees from where it should be (12,)."""
        action = self.hold()
        wanted = TURN_DEAD_BAND + TURN_RISE * abs(degrees)
        action[9] = math.copysign(min(wanted, TURN_SPEED), degrees)
        return action

    def _arm_action(self, error: Array, turn: Array, speed: float) -> Array:
        frame = matrix(self.step.base_pose[3:])
        action = self.hold()
        action[:3] = frame.T @ limited(error / TOP_SPEED, speed)
        action[3:6] = frame.T @ limited(turn * TURN_GAIN / TOP_SPIN, 1.0)
        action[11] = -1.0
        return action
