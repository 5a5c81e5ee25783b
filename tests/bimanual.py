"""A backend with another robot: two hands, one of three fingers, eight numbers for an action."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.sim.backend import (
    ActionSpec,
    BackendSpec,
    GripperSpec,
    Provenance,
    RobotSpec,
    Simulator,
    Start,
)
from pytest_safemanip.trace import Contacts, Entity, Part, Scene, Step
from pytest_safemanip.trace.elements import ActionEntry, Body, Surface

DT = 0.05
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
ON_COUNTER = 0.95
"""Height of the mug where it stands."""
REACH, FIRM = 0.1, 0.03
"""A closed hand holds the mug this near, m, unless it moves by more than this in a step."""
ENTRIES = (
    *(ActionEntry(f"left_{axis}", -0.05, 0.05) for axis in "xyz"),
    ActionEntry("left_width", 0.0, 0.08),
    *(ActionEntry(f"right_{axis}", -0.05, 0.05) for axis in "xyz"),
    ActionEntry("right_force", -10.0, 10.0),
)
LEFT = GripperSpec("left", (("jaw_a",), ("jaw_b",)), ("palm",), "left_width", 0.08, 0.0)
RIGHT = GripperSpec(
    "right",
    (("thumb",), ("index", "index_tip"), ("middle",)),
    (),
    "right_force",
    opens=-10.0,
    closes=10.0,
)
PRESSING = (("jaw_a", "jaw_b"), ("thumb", "index_tip", "middle"))
"""The parts of each hand that press on what it holds, all round it."""


def hold(actions):
    still = np.zeros(len(ENTRIES))
    still[[3, 7]] = actions[-1][[3, 7]] if len(actions) else (0.04, 0.0)
    return still


SPEC = BackendSpec(
    RobotSpec("Bimanual", ActionSpec(ENTRIES, hold), (LEFT, RIGHT)),
    scenes=("bench", "shop floor"),
    steppings=("whole",),
)
PARTS = (
    *(Part("robot", name) for hand in (LEFT, RIGHT) for group in hand.fingers for name in group),
    Part("robot", "palm"),
    Part("counter", "body"),
    Part("mug", "body"),
)
SCENE = Scene(
    control_period=DT,
    entities=(
        Entity("robot", "robot", "Bimanual"),
        Entity("counter", "fixture", "Bench"),
        Entity("mug", "object", "mug"),
    ),
    bodies=(Body("mug", (0.05, 0.05, 0.05), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.3),),
    parts=PARTS,
    joints=(),
    boxes=(),
    switches=(),
    surfaces=(Surface("counter", "", (1.0, 0.5, 0.45), (0.0, 0.0, 0.45, *UPRIGHT)),),
    grippers=tuple(h.in_scene((0.05, 0.05, 0.05), (0.0, 0.0, 0.0)) for h in (LEFT, RIGHT)),
    actions=ENTRIES,
    roles={"obj": "mug", "counter": "counter"},
)


class Bench:
    """The hands go where they are told; the mug goes with the last one that closed on it."""

    spec = SPEC
    provenance = Provenance("bench", "primitive", {}, {"backend": "1"})

    def reset(self, request):
        self._hands = np.array([(-0.3, 0.0, ON_COUNTER), (0.05, 0.0, ON_COUNTER)])
        self._mug, self._holding = np.array((0.0, 0.0, ON_COUNTER)), []
        self._told, self._open, self._rate = np.zeros(2), np.ones(2), np.zeros(2)
        return Start(SCENE, self._state(), "hand it over", 60, f"seed {request.seed}")

    def step(self, action):
        moves = np.array((action[:3], action[4:7]))
        self._hands = self._hands + moves
        self._told = SPEC.robot.commands(action)
        before, self._open = self._open, np.where(self._told > 0, 0.3, 1.0)
        self._rate = (self._open - before) / DT
        for hand in range(2):
            near = np.linalg.norm(self._hands[hand] - self._mug - moves[hand]) < REACH
            holds = self._told[hand] > 0 and near and np.linalg.norm(moves[hand]) <= FIRM
            if holds and hand not in self._holding:
                self._holding.append(hand)
            elif not holds and hand in self._holding:
                self._holding.remove(hand)
        if self._holding:
            self._mug = self._mug + moves[self._holding[-1]]
        else:
            self._mug[2] = ON_COUNTER
        return self._state()

    def observe(self):
        return {}

    def close(self):
        pass

    def _state(self):
        floats = {
            "eef_poses": [(*hand, *UPRIGHT) for hand in self._hands],
            "eef_twists": np.zeros((2, 6)),
            "openings": np.stack((self._open, self._rate), axis=1),
            "commands": self._told,
            "base_pose": (0.0, -1.0, 0.0, *UPRIGHT),
            "object_pose": [(*self._mug, *UPRIGHT)],
            "object_twist": np.zeros((1, 6)),
            "joint": np.zeros((0, 2)),
            "box_pose": np.zeros((0, 7)),
            "switch": np.zeros(0),
            "qpos": np.zeros(1),
            "qvel": np.zeros(1),
        }
        arrays = {name: np.array(value, np.float32) for name, value in floats.items()}
        return Step(**arrays, success=False, contacts=self._contacts())

    def _contacts(self):
        names, mug = [part.name for part in PARTS], len(PARTS) - 1
        rows = []
        for hand in self._holding:
            for number, name in enumerate(PRESSING[hand]):
                angle = 2.0 * np.pi * number / len(PRESSING[hand])
                normal = (np.cos(angle), np.sin(angle), 0.0)
                rows.append((names.index(name), 10.0, (0.0, 0.0, 0.0), normal))
        if self._mug[2] == ON_COUNTER:
            corners = [(x, y, -0.05) for x in (-0.04, 0.04) for y in (-0.04, 0.04)]
            rows += [(names.index("body"), 3.0, corner, (0.0, 0.0, 1.0)) for corner in corners]
        if not rows:
            return Contacts.empty()
        parts, force, place, normal = zip(*sorted(rows), strict=True)
        newtons, count = np.array(force, np.float32), len(rows)
        return Contacts(
            step=np.zeros(count, np.int32),
            a=np.array(parts, np.int32),
            b=np.full(count, mug, np.int32),
            force=newtons,
            sustained=newtons.copy(),
            position=(self._mug + place).astype(np.float32),
            normal=np.array(normal, np.float32),
        )


SIMULATOR = Simulator(SPEC, lambda options: Bench())


class HandsOver:
    """The right hand lifts the mug and gives it to the left one, which puts it down.

    ``yanks``: the left hand moves too fast, and it slips out.
    """

    fingerprint = "1"
    LIFTED, GIVEN, PUT = 12, 30, 45

    def __init__(self, how="well"):
        self._how = how

    def reset(self, episode):
        self._actions = episode.robot.actions

    def act(self, observation):
        step, action = observation.index, np.zeros(self._actions.size)
        left, right = 0.08, 10.0 if step >= 2 else -10.0
        if 4 <= step < self.LIFTED:
            action[6] = 0.02
        if step == self.LIFTED:
            self._way = (
                observation.step.object_pose[0, :3] - observation.step.eef_poses[0, :3]
            ) / 10
        if self.LIFTED <= step < self.LIFTED + 10:
            action[:3] = 0.8 * self._way
        if step >= self.LIFTED + 10:
            left = 0.0
        if step >= self.GIVEN:
            right = -10.0
        if self._how == "yanks" and step == self.GIVEN + 8:
            action[0] = -0.05
        if self.GIVEN + 5 <= step < self.GIVEN + 12 and self._how == "well":
            action[2] = -0.02
        if step >= self.PUT:
            left = 0.08
        action[3], action[7] = left, right
        return action
