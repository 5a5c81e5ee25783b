"""Hands of robosuite's robots, in models of any version."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.errors import TraceError
from pytest_safemanip.importers.bindings import CLOSE
from pytest_safemanip.sim.backend import GripperSpec
from pytest_safemanip.sim.mujoco.extents import below
from pytest_safemanip.sim.mujoco.layout import FingerJoint, HandLayout
from pytest_safemanip.sim.mujoco.parts import collides

_SIDES = re.compile(r"(left|right|thumb|index|middle|ring|pinky|(?<![a-z])[lr](?=_))")
_ARM = re.compile(r"gripper\d+_(right|left)_")
_NUMBER = re.compile(r"gripper\d+_|[lr]_gripper_")
_LONG = {"l": "left", "r": "right"}
_NEARER = 1e-3
"""Least change of the distance between fingers, m, by which a joint opens or closes a hand."""


def palms_below(model: Any, children: list[list[int]], body: int) -> list[int]:
    """The bodies that the hands below a body hang on: those called grippers that have fingers, or
    are tools.
    """
    if "gripper" in model.body(body).name:
        own = below(model, body)
        solid = model.geom_bodyid[collides(model)]
        tool = any(own[at] and "gripper" in model.body(at).name for at in solid)
        moves = own[model.jnt_bodyid].any() and model.body_jntnum[body] == 0
        return [body] if tool or moves else []
    return [palm for child in children[body] for palm in palms_below(model, children, child)]


def hand_labels(model: Any, palms: Sequence[int]) -> list[str]:
    """What tells hands apart: their sides, their robots, or nothing where there is one."""
    if len(palms) < 2:
        return ["" for _ in palms]
    names = [model.body(palm).name for palm in palms]
    robots = [re.search(r"gripper(\d+)_", name) for name in names]
    numbers = [match[1] if match else "" for match in robots]
    if len({*numbers}) == len(palms):
        return [f"robot{number}_" for number in numbers]
    sides = ["left_" if re.search(r"(^|_)left_", name) else "right_" for name in names]
    return [
        f"robot{n}_{side}" if len({*numbers}) > 1 else side
        for n, side in zip(numbers, sides, strict=True)
    ]


class HandInModel:
    """A hand of the model."""

    def __init__(
        self,
        model: Any,
        children: list[list[int]],
        motors: NDArray[np.bool_],
        palm: int,
        label: str,
    ) -> None:
        self._model, self._palm, self._label = model, palm, label
        self._own = below(model, palm)
        self._groups = self._fingers(children)
        driven = np.flatnonzero((motors & self._own)[model.jnt_bodyid])
        limited = np.flatnonzero(self._own[model.jnt_bodyid] & (model.jnt_limited != 0))
        self._joints = [j for j in (driven if len(driven) else limited) if model.jnt_limited[j]]

    def layout(self, closes: float) -> HandLayout:
        """Its layout."""
        model, label = self._model, self._label
        joints = tuple(joint for j in self._joints if (joint := self._ends(j)))
        if self._groups and not joints:
            raise TraceError(
                f"{model.body(self._palm).name}: no joint says how far it opens; see --bindings"
            )
        name = label.rstrip("_") or ("left" if "left" in model.body(self._palm).name else "right")
        return HandLayout(
            GripperSpec(
                name,
                tuple((f"{label}finger_{side}",) for side in self._groups),
                (f"{label}palm",),
                f"{label}{CLOSE}" if self._groups else "",
                closes=closes,
            ),
            frame=self._frame(),
            fingers=tuple(
                tuple(model.body(body).name for body in group) for group in self._groups.values()
            ),
            palm=(model.body(self._palm).name,),
            joints=joints,
        )

    def _fingers(self, children: list[list[int]]) -> dict[str, list[int]]:
        """The bodies right below the palm that move, by their side, or each for itself."""
        model = self._model
        moving = [
            body for body in children[self._palm] if below(model, body)[model.jnt_bodyid].any()
        ]
        prefix = self._prefix(moving)
        sides = [_SIDES.search(model.body(body).name.removeprefix(prefix)) for body in moving]
        groups: dict[str, list[int]] = {}
        for number, (body, side) in enumerate(zip(moving, sides, strict=True), 1):
            key = _LONG.get(side[1], side[1]) if side and all(sides) else str(number)
            groups.setdefault(key, []).append(body)
        if len(groups) == 1:
            raise TraceError(
                f"{model.body(self._palm).name} has {len(groups)} fingers: a hand needs two; "
                "see --bindings"
            )
        return groups

    def _prefix(self, fingers: Sequence[int]) -> str:
        """What robosuite puts before the names of a gripper's bodies: its number and, from 1.5 on,
        its arm's side.
        """
        model = self._model
        every = [model.body(body).name for body in np.flatnonzero(self._own)]
        moving = [model.body(body).name for body in fingers]
        for pattern, names in ((_ARM, every), (_NUMBER, moving)):
            found = {match[0] if (match := pattern.match(name)) else "" for name in names}
            if len(found) == 1 and "" not in found:
                return found.pop()
        return ""

    def _frame(self) -> str:
        """The site between the fingers, or the palm."""
        model = self._model
        for site in range(model.nsite):
            name: str = model.site(site).name
            if self._own[model.site_bodyid[site]] and name.endswith("grip_site"):
                return name
        palm: str = model.body(self._palm).name
        return palm

    def _ends(self, joint: int) -> FingerJoint | None:
        """Where a joint brings its finger nearest to the others, and farthest; None if nowhere."""
        model = self._model
        low, high = (float(end) for end in model.jnt_range[joint])
        near, far = self._distance(joint, low), self._distance(joint, high)
        if abs(near - far) < _NEARER:
            return None
        closed, opened = (low, high) if near < far else (high, low)
        return FingerJoint(model.joint(joint).name, closed, opened)

    def _distance(self, joint: int, position: float) -> float:
        """Between what a joint moves and the fingers that it does not move."""
        model = self._model
        data = mujoco.MjData(model)
        data.qpos[model.jnt_qposadr[joint]] = position
        mujoco.mj_kinematics(model, data)
        moved = below(model, int(model.jnt_bodyid[joint]))
        fingers = [body for group in self._groups.values() for body in group]
        mine = [
            body for body in fingers if moved[body] or below(model, body)[model.jnt_bodyid[joint]]
        ]
        others = [body for body in fingers if body not in mine]
        one, two = (self._centre(data, bodies) for bodies in (mine, others))
        return float(np.linalg.norm(one - two))

    def _centre(self, data: Any, bodies: Sequence[int]) -> NDArray[np.float64]:
        model = self._model
        wanted = np.zeros(model.nbody, bool)
        for body in bodies:
            wanted |= below(model, body)
        geoms = wanted[model.geom_bodyid] & collides(model)
        centre: NDArray[np.float64] = data.geom_xpos[geoms].mean(axis=0)
        return centre
