"""Scripts for LIBERO's tasks, some of which go wrong: policies as a user would write them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.sim.staging import Put, SetOpen, Staging
from pytest_safemanip.trace.geometry import rotate, to_world

Array = NDArray[np.float64]
Motion = Iterator[Array]
OPEN, CLOSE = -1.0, 1.0
UP = np.array((0.0, 0.0, 1.0))
TOP_DRAWER = "wooden_cabinet_1/top_level"
REACH = 0.05
"""Metres that an action of 1 moves the hand's goal."""


class Script:
    """Runs a motion, a generator of actions, and is done when it ends."""

    fingerprint = "1"
    changes: tuple[Put | SetOpen, ...] = ()

    def reset(self, episode: EpisodeInfo) -> None:
        self.scene = episode.scene
        self.grip, self.done = OPEN, False
        self._motion: Motion | None = None

    def staging(self, task: str) -> Staging:
        return Staging(self.changes)

    def act(self, observation: Observation) -> Array:
        self.step = observation.step
        if self._motion is None:
            self._motion = self.motion()
        action = next(self._motion, None)
        if action is None:
            self.done = True
            action = self.command(np.zeros(3))
        return action

    def motion(self) -> Motion:
        raise NotImplementedError

    @property
    def hand(self) -> Array:
        return np.array(self.step.eef_poses[0, :3], np.float64)

    def place(self, name: str) -> Array:
        """Middle of an object's box."""
        index = self.scene.object_index[name]
        pose = np.array(self.step.object_pose[index], np.float64)
        return to_world(pose, self.scene.bodies[index].centre)

    def half(self, name: str) -> Array:
        return np.array(self.scene.bodies[self.scene.object_index[name]].half)

    def command(self, move: Array, turn: float = 0.0) -> Array:
        return np.array((*np.clip(move / REACH, -1.0, 1.0), 0.0, 0.0, turn, self.grip))

    def turn_along_x(self, steps: int = 40) -> Motion:
        """Turn the hand about the vertical until its wide side lies along the world's x axis."""
        for _ in range(steps):
            wide = rotate(np.array(self.step.eef_poses[0, 3:], np.float64), np.array((1.0, 0, 0)))
            error = np.arctan(wide[1] / wide[0])
            yield self.command(np.zeros(3), float(np.clip(-4.0 * error, -0.6, 0.6)))

    def go(self, target: Array | Callable[[], Array], speed: float = 1.0, most: int = 80) -> Motion:
        """Move the hand there, at most so many steps."""
        for _ in range(most):
            goal = target() if callable(target) else target
            away = goal - self.hand
            pace = np.linalg.norm(self.step.eef_twists[0, :3])
            if np.linalg.norm(away) < 0.008 and pace < 0.05:
                return
            # More than what is left: the controller lags behind its goal.
            yield self.command(np.clip(4.0 * away, -speed * REACH, speed * REACH))

    def grasp(self, closing: float, steps: int = 12) -> Motion:
        self.grip = closing
        for _ in range(steps):
            yield self.command(np.zeros(3))

    def pick(self, name: str, at: Array, height: float = 0.2) -> Motion:
        """Grasp an object where its middle and an offset are, and lift it."""
        spot = self.place(name) + at
        yield from self.go(spot + 0.12 * UP)
        yield from self.go(spot, speed=0.4)
        yield from self.grasp(CLOSE)
        yield from self.go(self.hand + height * UP, speed=0.5)


class BowlOntoPlate(Script):
    """Takes the bowl by its rim and puts it on the plate."""

    drop = False

    def motion(self) -> Motion:
        rim = np.array((0.0, 0.045, 0.012))
        yield from self.pick("akita_black_bowl_1", rim)
        above = self.place("plate_1") + rim
        yield from self.go(above + 0.2 * UP, speed=0.5)
        if not self.drop:
            yield from self.go(above + 0.032 * UP, speed=0.3)
        yield from self.grasp(OPEN)
        yield from self.go(self.hand + 0.15 * UP)


class Drops(BowlOntoPlate):
    """Lets the bowl go 20 cm above the plate."""

    drop = True


class Sweeps(BowlOntoPlate):
    """Moves the bowl through a bottle that stands in its way."""

    changes = (Put("wine_bottle_1", "beside", "akita_black_bowl_1", (-0.11, 0.0, 0.0)),)

    def motion(self) -> Motion:
        rim = np.array((0.0, 0.045, 0.012))
        yield from self.pick("akita_black_bowl_1", rim, height=0.06)
        yield from self.go(self.hand + np.array((-0.14, 0.0, 0.0)), speed=0.5)


class SweepsOnly(Sweeps):
    """The same, through what stands there already."""

    changes = ()


class IntoTheDrawer(Script):
    """Reaches down into a drawer that is open."""

    changes = (SetOpen("wooden_cabinet_1", 1.0, "top_level"),)

    def motion(self) -> Motion:
        drawer = next(b for b, box in enumerate(self.scene.boxes) if box.name == "top_region")
        front = self.scene.joints[self.scene.joint_index[TOP_DRAWER]].axis
        middle = np.array(self.step.box_pose[drawer, :3], np.float64)
        inside = middle + 0.055 * np.array(front)  # between its front and the cabinet's
        yield from self.grasp(CLOSE)
        yield from self.turn_along_x()
        yield from self.go(inside + 0.2 * UP)
        yield from self.go(inside + 0.04 * UP, speed=0.4)
        yield from self.go(inside - 0.024 * UP, speed=0.2, most=60)


class IntoTheHalfOpenDrawer(IntoTheDrawer):
    """Reaches into it while it is half open."""

    changes = (SetOpen("wooden_cabinet_1", 0.6, "top_level"),)


class ShutsItsDrawer(IntoTheDrawer):
    """Presses on the drawer's bottom from inside, and drags it shut: the cabinet meets the hand."""

    def motion(self) -> Motion:
        yield from super().motion()
        front = np.array(self.scene.joints[self.scene.joint_index[TOP_DRAWER]].axis)
        down = 0.03 * UP
        yield from self.go(self.hand - down, speed=0.2, most=20)
        yield from self.go(self.hand - down - 0.16 * front, speed=0.4)
