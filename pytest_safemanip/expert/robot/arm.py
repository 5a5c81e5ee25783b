"""The hand in Cartesian space: motions of the PandaOmron as sequences of actions.

A motion is a generator: it yields one action at a time and is resumed when :attr:`Arm.step` holds
the state that the action led to. Targets are points of the world, metres.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from pytest_safemanip.expert.robot.base import (
    LAG,
    NOTCH,
    NOTCHES,
    PACES,
    Base,
    IllHeld,
    Motion,
    NoWay,
    SkillFailed,
)
from pytest_safemanip.expert.robot.rotations import Array, limited, rotation_vector
from pytest_safemanip.expert.truth import Truth
from pytest_safemanip.policies.base import Permissions
from pytest_safemanip.sim.clearance import Clearance, Path, blind
from pytest_safemanip.sim.rehearsal import Rehearsal
from pytest_safemanip.trace.geometry import matrix
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import Step

Foresee = Callable[[Sequence[Path]], list[Clearance]]
Target = Array | Callable[[], Array]

TOP_SPEED = 0.05
"""Position delta per control step that a full-scale action asks for, m."""
TOP_SPIN = 0.5
"""Rotation delta per control step that a full-scale action asks for, rad."""
TURN_GAIN = 0.75
"""Share of the remaining rotation that is asked for at each step."""
FOLLOWS, STILL = 8, 0.05
"""Control steps in which fingers come to where they were told to be, and the rate at which they are
there, 1/s."""
EXACT_GAIN = 0.5
"""Share of the error that an exact motion asks for: some postures swing at more."""
STUCK_GAIN, STUCK = 0.1, 0.015
"""Share of the error by which more is asked for in each control step of an exact motion that has
come to rest before its goal, for joints stick, and the most of that, m."""
GENTLY = 0.4
"""Share of the top speed, of base and hand, at which what hangs in the fingers, or lies on what is
moved, hardly moves itself."""
FOLDED = (0.25, 1.30, 16.0)
"""Base to hand, m, its height, m, and its pitch, degrees, as an episode begins: the arm folded."""
CALM = 0.03
"""A hand that is slower than this is at rest, m/s."""


def raised(point: Array, height: float) -> Array:
    """A point higher up (3,)."""
    return np.add(point, (0.0, 0.0, height))


def cut(motion: Motion, until: Callable[[], bool]) -> Motion:
    """A motion that is left off as soon as something holds."""
    for action in motion:
        if until():
            return
        yield action


class Arm(Base):
    """The robot's hand and base, as a script moves them.

    Args:
        scene: the static part of the episode.
        step: the first state.
        instruction: what the robot was told.
        foresee: says what would be touched on some paths from here.

    Attributes:
        instruction: what the robot was told.
        truth: what a fault does wrong.
        foresee: says what would be touched on some paths from here.
        upcoming: calls of skills that follow the present one.
        stood: how things stood before they were taken hold of (7,), by their entities.
    """

    def __init__(
        self, scene: Scene, step: Step, instruction: str = "", foresee: Foresee = blind
    ) -> None:
        super().__init__(scene, step)
        self.foresee = foresee
        self.instruction = instruction
        self.truth = Truth(scene)
        self.rehearsal: Rehearsal | None = None
        self.permissions: Permissions | None = None
        self.upcoming: Sequence[Any] = ()
        self.stood: Mapping[str, Array] = {}

    def save(self) -> dict[str, Any]:
        """All that it knows."""
        return {**vars(self), "truth": self.truth.copy()}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Know what was saved, and nothing else."""
        vars(self).update({**saved, "truth": saved["truth"].copy()})

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
        pace = self.choices.choose("pace", PACES)
        stuck = np.zeros(3)
        for _ in range(round(steps / pace)):
            error = (target() if callable(target) else target) - self.position
            turn = rotation_vector(keep @ self.rotation.T)
            near = np.linalg.norm(error) < tolerance and np.linalg.norm(turn) < turn_tolerance
            calm = np.linalg.norm(self.step.eef_twist[:3]) < CALM
            if until() if until else near and (calm or not exact):
                return
            if exact and calm:
                stuck = limited(stuck + STUCK_GAIN * error, STUCK)
            gain = EXACT_GAIN if exact else 1.0
            yield self._arm_action(gain * error + stuck, gain * turn, speed * pace)
        if required and (until or not near):
            off = f"{100 * np.linalg.norm(error):.1f} cm"
            if np.linalg.norm(turn) >= turn_tolerance:
                off += f" and {math.degrees(np.linalg.norm(turn)):.0f} degrees"
            raise SkillFailed(f"the hand stopped {off} short{self.in_the_way()}")

    def towards(self, target: Array, rotation: Array, speed: float = 1.0) -> Array:
        """The action that moves the hand towards a grip point (3,) and an orientation (3, 3), at a
        share of the top speed (12,).
        """
        turn = rotation_vector(rotation @ self.rotation.T)
        return self._arm_action(target - self.position, turn, speed)

    def grip(self, close: bool, steps: int = 12) -> Motion:
        """Close or open the fingers; the hand stays."""
        yield from self._fingers(1.0 if close else -1.0, steps)

    def let_open(self) -> None:
        """Have the fingers open on whatever comes next."""
        self._grip = -1.0

    def open_to(self, opening: float) -> Motion:
        """Open or close the fingers part of the way, and keep them there.

        Args:
            opening: share of the full opening; the notch next to it is taken.
        """
        yield from self.open_by(round(opening / NOTCH) - self.notch)

    def open_by(self, notches: int) -> Motion:
        """Open the fingers by so many notches, close them by so many if negative, and keep them
        there. Fingers that hold something open when they have passed the notches it is wide.
        """
        notch = min(max(self.notch + notches, 0), NOTCHES)
        yield from self._fingers(math.copysign(1.0, self.notch - notch), abs(self.notch - notch))
        yield from cut(self._fingers(0.0, FOLLOWS), lambda: abs(self.step.gripper[1]) < STILL)

    def let_go(self, farther: float) -> Motion:
        """Open the fingers no farther from what they hold than needed.

        Args:
            farther: than they are, at least, share of the full opening.
        """
        wanted = (float(self.step.gripper[0]) + farther + LAG) / NOTCH
        yield from self.open_by(math.ceil(wanted) - self.notch)

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

    def _fingers(self, command: float, steps: int) -> Motion:
        here, rotation, self._grip = self.position, self.rotation, command
        for _ in range(steps):
            yield self.towards(here, rotation)

    def _arm_action(self, error: Array, turn: Array, speed: float) -> Array:
        frame = matrix(self.step.base_pose[3:])
        action = self.hold()
        action[:3] = frame.T @ limited(error / TOP_SPEED, speed)
        action[3:6] = frame.T @ limited(turn * TURN_GAIN / TOP_SPIN, 1.0)
        action[11] = -1.0
        return action


def fold_arm(arm: Arm, required: bool = True) -> Motion:
    """Fold the arm as an episode begins: from there it comes to any posture.

    Args:
        arm: the arm.
        required: whether not arriving fails the skill.

    Raises:
        SkillFailed: if the hand does not arrive in time.
    """
    far, height, pitch = FOLDED
    yield from arm.move(
        arm.before(far, height),
        arm.hand(pitch),
        tolerance=0.05,
        turn_tolerance=0.2,
        required=required,
    )


Plan = Callable[[Arm], Motion]
"""Makes the motion of a whole episode."""


__all__ = ["Arm", "IllHeld", "Motion", "NoWay", "Plan", "SkillFailed", "cut", "fold_arm", "raised"]
