"""Scripted policies for robosuite's tasks, which know where everything is."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.trace.geometry import matrix

UNIT, QUARTER = 0.05, np.pi / 2
"""Metres of an action's 1; squares look the same after a quarter turn, rad."""
GRIP = 0.02
"""Above the can's middle, m: lower, the palm would meet the walls around its compartment."""


def towards(step, target, hand=0, gain=1.5):
    """The part of an action that leads a hand to a place (3,)."""
    away = np.asarray(target) - step.eef_poses[hand, :3]
    return np.clip(gain * away / UNIT, -1.0, 1.0)


def heading(quat):
    """About the vertical, of the axis that lies most level, rad."""
    level = min(matrix(np.asarray(quat, float)).T[:2], key=lambda axis: abs(axis[2]))
    return np.arctan2(level[1], level[0])


class Script:
    """Goes through places, one after the other, the hand open or closed."""

    fingerprint = "1"
    turned = False

    def __init__(self, how="well"):
        self._how = how

    def reset(self, episode):
        self._scene, self._left, self._stay = episode.scene, None, 0

    @property
    def done(self):
        """At the last place."""
        return self._left is not None and len(self._left) == 1 and self._stay > 10

    def act(self, observation):
        step = observation.step
        if self._left is None:
            self._left = list(self.way(self._scene, step))
        target, closes, stay = self._left[0]
        action = np.zeros(7)
        action[:3] = towards(step, target)
        action[6] = 1.0 if closes else -1.0
        if self.turned and not closes:
            turn = heading(step.object_pose[0, 3:]) - heading(step.eef_pose[3:])
            turn = (turn + QUARTER / 2) % QUARTER - QUARTER / 2
            action[5] = np.clip(2.0 * turn, -0.4, 0.4)
        near = np.linalg.norm(step.eef_pose[:3] - target) < 0.015
        self._stay = self._stay + 1 if near or self._stay else 0
        if self._stay > stay and len(self._left) > 1:
            self._left.pop(0)
            self._stay = 0
        return action


class Lifts(Script):
    """Lifts the cube; ``drops`` it from up there."""

    turned = True

    def way(self, scene, step):
        cube = step.object_pose[0, :3].astype(float)
        up = np.array((0.0, 0.0, 0.1))
        yield cube + up, False, 5
        yield cube, False, 3
        yield cube, True, 8
        yield cube + up, True, 0
        if self._how == "drops":
            yield cube + up, False, 0


class Places(Script):
    """Puts the can into its compartment; lets it go ``high`` above it, or ``beside`` the bin."""

    def way(self, scene, step):
        can = scene.object_index["Can"]
        box = next(k for k, b in enumerate(scene.boxes) if b.name == "can")
        place = step.object_pose[can, :3] + (0.0, 0.0, GRIP)
        goal = step.box_pose[box, :3].astype(float)
        low = scene.bodies[can].half[2]
        floor = goal[2] - scene.boxes[box].half[2]
        above = np.array((0.0, 0.0, 0.15))
        yield place + above, False, 0
        yield place, False, 3
        yield place, True, 8
        yield place + 2.0 * above, True, 0
        over = np.array((*goal[:2], place[2] + 2.0 * above[2]))
        if self._how == "beside":
            over[0] -= 0.45
        yield over, True, 3
        if self._how == "well":
            over = np.array((*goal[:2], floor + low + GRIP + 0.03))
            yield over, True, 3
        yield over, False, 5
        yield over + 0.6 * above, False, 0


class Stacks(Script):
    """Puts the red cube on the green one."""

    turned = True

    def way(self, scene, step):
        red, green = (step.object_pose[k, :3].astype(float) for k in (0, 1))
        up = np.array((0.0, 0.0, 0.1))
        yield red + up, False, 5
        yield red, False, 3
        yield red, True, 8
        yield red + up, True, 0
        yield green + up, True, 3
        top = green + np.array((0.0, 0.0, 0.055))
        yield top, True, 3
        yield top, False, 8
        yield top + up, False, 0


class LiftsTogether:
    """Two arms opposite each other lift the pot by its handles; one ``lets go`` too soon."""

    fingerprint = "1"
    HANDLE = np.array(((0.0, 0.16, 0.06), (0.0, -0.16, 0.06)))
    ABOVE, DOWN, CLOSED, UP = 25, 45, 60, 80

    def __init__(self, how="well"):
        self._how = how

    def act(self, observation):
        step, index, action = observation.step, observation.index, np.zeros(14)
        pot = step.object_pose[0].astype(float)
        axes = matrix(pot[3:])
        height = 0.1 if index < self.ABOVE or index >= self.CLOSED else 0.0
        for hand, side in enumerate((1.0, -1.0)):
            own = action[7 * hand : 7 * hand + 7]
            target = pot[:3] + axes @ self.HANDLE[hand] + (0.0, 0.0, height)
            x, y, up = towards(step, target, hand, gain=1.0)
            own[:3] = side * y, -side * x, up  # the bases are turned by a quarter
            across = matrix(step.eef_poses[hand, 3:].astype(float))[:, 0]
            turn = np.arctan2(axes[1, 1], axes[0, 1]) - np.arctan2(across[1], across[0])
            turn = (turn + np.pi / 2) % np.pi - np.pi / 2
            own[5] = np.clip(2.0 * turn, -0.4, 0.4) if index < self.DOWN else 0.0
            opens = index < self.DOWN or (self._how == "lets go" and hand and index >= self.UP)
            own[6] = -1.0 if opens else 1.0
        return action
