"""What is what in a model of robosuite's, of any version, by how it is made and named.

What has motors is a robot, what moves freely an object, and what else collides a fixture. Of hands
robosuite has always said ``gripper``, of fingers ``left`` and ``right``, or ``l`` and ``r``.
"""

from __future__ import annotations

import dataclasses
import itertools
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from pytest_safemanip.errors import TraceError
from pytest_safemanip.importers.bindings import CLOSE, Bindings
from pytest_safemanip.importers.robosuite.hands import HandInModel, hand_labels, palms_below
from pytest_safemanip.sim.backend import GripperSpec
from pytest_safemanip.sim.mujoco.description import find
from pytest_safemanip.sim.mujoco.extents import below
from pytest_safemanip.sim.mujoco.layout import (
    FixtureLayout,
    HandLayout,
    JointLayout,
    Layout,
    ObjectLayout,
    Region,
    RobotLayout,
)
from pytest_safemanip.sim.mujoco.parts import collides
from pytest_safemanip.sim.robosuite.things import cameras_of
from pytest_safemanip.trace.elements import ActionEntry

CATEGORIES = {"SquareNut": "nut", "RoundNut": "nut"}
"""Of objects; of others their name in small letters, without a last letter or number."""
ATTACHED = {
    "cylinder": "peg",
    "peg_main": "peg",
    "hole": "hole",
    "hole_main": "hole",
    "hole_root": "hole",
}
"""Bodies on a robot's wrist that are things of the task, with their names."""
_ROOT = re.compile(r"(?<=\w)(_main|_root|0)$")
NOTHING = Bindings()


@dataclass(frozen=True)
class Convention:
    """What a source says of its robot and its actions.

    Attributes:
        robot: what the robot is called.
        limits: largest absolute value of each entry of the actions; None where there are none, and
            the grippers' commands are then the actions.
        grippers_last: whether the grippers of a robot with two arms come after both arms, as in
            robosuite 1.5, or each after its arm, as before.
        closes: value of a gripper's entry that closes it; -1 opens it.
    """

    robot: str
    limits: tuple[float, ...] | None = None
    grippers_last: bool = False
    closes: float = 1.0


def derive_layout(
    model: Any, period: float, convention: Convention, told: Bindings = NOTHING
) -> Layout:
    """The layout of a model.

    Args:
        model: a ``mujoco.MjModel``.
        period: control period, s.
        convention: what its source says.
        told: what the user says.

    Raises:
        TraceError: if nothing in it has motors.
    """
    children = _children(model)
    roots = children[0]
    motors = np.zeros(model.nbody, bool)
    for actuator in range(model.nu):
        if model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT:
            motors[model.jnt_bodyid[model.actuator_trnid[actuator, 0]]] = True
    attached = [b for b in ATTACHED if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, b) >= 0]
    if told.robot:
        robots = [find(model, "body", name, "the bindings' robot") for name in told.robot]
    else:
        robots = [body for body in roots if (motors & below(model, body)).any()]
    if not robots:
        raise TraceError("the model has no robot: nothing in it has motors; see --bindings")
    if told.hands:
        hands = told.hands
        labels = [f"{hand.spec.name}_" if len(hands) > 1 else "" for hand in hands]
    else:
        palms = [body for root in robots for body in palms_below(model, children, root)]
        labels = hand_labels(model, palms)
        hands = tuple(
            HandInModel(model, children, motors, palm, label).layout(convention.closes)
            for palm, label in zip(palms, labels, strict=True)
        )
        hands = hands or tuple(_bare_hand(model, body) for body in attached)
    free = [body for body in roots if _is_free(model, body)]
    rest = [body for body in roots if body not in robots and body not in free]
    derived = Layout(
        control_period=period,
        robot=RobotLayout(
            convention.robot,
            tuple(model.body(b).name for b in robots),
            hands,
            model.body(robots[0]).name,
        ),
        actions=action_entries(
            convention,
            [label for label, hand in zip(labels, hands, strict=False) if hand.fingers],
            len(robots),
        ),
        objects={
            **{name: _object(model, body) for name, body in _named(model, free).items()},
            **{ATTACHED[body]: ObjectLayout(body, ATTACHED[body]) for body in attached},
        },
        fixtures={
            name: _fixture(model, body)
            for name, body in _named(model, rest).items()
            if _is_solid(model, body)
        },
        cameras=cameras_of(model),
    )
    return _without_entries(told.apply(derived))


def _without_entries(layout: Layout) -> Layout:
    """A layout whose hands name no entries that the actions lack: how they move tells then."""
    names = {entry.name for entry in layout.actions}
    hands = tuple(
        hand
        if hand.spec.entry in names
        else dataclasses.replace(hand, spec=dataclasses.replace(hand.spec, entry=""))
        for hand in layout.robot.hands
    )
    return dataclasses.replace(layout, robot=dataclasses.replace(layout.robot, hands=hands))


def action_entries(
    convention: Convention, hands: Sequence[str], robots: int
) -> tuple[ActionEntry, ...]:
    """The entries of the actions: robot by robot, its arms and its grippers.

    Args:
        convention: of the source.
        hands: what the names of the entries of those that grip begin with.
        robots: how many there are; they are alike.
    """
    if convention.limits is None:
        return tuple(ActionEntry(f"{hand}{CLOSE}") for hand in hands)
    width, arms = len(convention.limits), max(len(hands), robots)
    names = [f"entry_{number}" for number in range(width)]
    if width % arms == 0 and len(hands) in (0, arms):
        labels = hands or [f"robot{n}_" if robots > 1 else "" for n in range(robots)]
        each = width // arms - bool(hands)
        ways = {hand: [f"{hand}arm_{n}" for n in range(1, each + 1)] for hand in labels}
        closes = {hand: [f"{hand}{CLOSE}"] * bool(hands) for hand in labels}
        together = convention.grippers_last and robots == 1
        blocks = [ways, closes] if together else [{h: ways[h] + closes[h] for h in labels}]
        names = [name for block in blocks for hand in labels for name in block[hand]]
    return tuple(
        ActionEntry(name, -most, most) for name, most in zip(names, convention.limits, strict=True)
    )


def _bare_hand(model: Any, attached: str) -> HandLayout:
    """The end of an arm without a gripper, that a thing is attached to."""
    wrist = model.body(int(model.body_parentid[model.body(attached).id])).name
    side = "left" if "left" in wrist else "right"
    return HandLayout(GripperSpec(side, (), (), ""), wrist, (), (), ())


def own_name(model: Any, body: int) -> str:
    """A thing's name in its task: that of its body, without what robosuite adds to it."""
    name: str = model.body(body).name
    return _ROOT.sub("", name)


def _named(model: Any, bodies: Sequence[int]) -> dict[str, int]:
    """Some bodies by the names of what they are; two that would have the same keep their own.

    What has no name and stands still is of the room.

    Raises:
        TraceError: if something that moves freely has no name.
    """
    own = {body: own_name(model, body) for body in bodies}
    nameless = [body for body, name in own.items() if not name]
    if any(_is_free(model, body) for body in nameless):
        raise TraceError(
            f"body {nameless[0]} of the model moves freely and has no name, so that nobody can say "
            "what it is"
        )
    twice = Counter(own.values())
    return {
        (name if twice[name] == 1 else model.body(body).name): body
        for body, name in own.items()
        if name
    }


def _object(model: Any, body: int) -> ObjectLayout:
    name = own_name(model, body)
    plain = re.sub(r"(?<=[a-z])([A-Z]|\d+)$", "", name).lower()
    return ObjectLayout(model.body(body).name, CATEGORIES.get(name, plain))


def _fixture(model: Any, body: int) -> FixtureLayout:
    name = own_name(model, body)
    own = below(model, body)
    # A latch turns with the handle that it is: nobody calls a door open for it.
    joints = [
        j for j in np.flatnonzero(own[model.jnt_bodyid]) if "latch" not in model.joint(j).name
    ]
    geoms = np.flatnonzero(own[model.geom_bodyid] & collides(model))
    names = [model.geom(geom).name for geom in geoms]
    handle = next((name for name in names if name.endswith("handle")), "")
    return FixtureLayout(
        bodies=(model.body(body).name,),
        category=name.rstrip("0123456789").capitalize(),
        joints={model.joint(joint).name: _way(model, joint) for joint in joints},
        interiors=_compartments(model, body),
        parts={n: "handle" for n in names if "handle" in n or "latch" in n},
        handles={"handle": handle} if handle else {},
    )


def _compartments(model: Any, body: int) -> dict[str, Region]:
    """The spaces between a bin's walls, which are boxes on a floor that is a box."""
    boxes = [
        (model.geom_pos[geom], model.geom_size[geom])
        for geom in np.flatnonzero((model.geom_bodyid == body) & collides(model))
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX
    ]
    floor = max(boxes, key=lambda box: float(box[1][0] * box[1][1]), default=None)
    walls = [box for box in boxes if box is not floor]
    if floor is None or len(walls) < 4:
        return {}
    low, high = floor[0][2] + floor[1][2], max(at[2] + half[2] for at, half in walls)
    gaps = []
    for axis in (0, 1):
        across = sorted(
            (at[axis] - half[axis], at[axis] + half[axis])
            for at, half in walls
            if half[axis] == half.min()
        )
        gaps.append([(one[1], two[0]) for one, two in itertools.pairwise(across)])
    spans = [(x, y, (low, high)) for x in gaps[0] for y in gaps[1]]
    return {
        f"bin{number}": Region(
            model.body(body).name,
            half=tuple(float(end - begin) / 2 for begin, end in span),
            centre=tuple(float(end + begin) / 2 for begin, end in span),
        )
        for number, span in enumerate(spans, 1)
    }


def _way(model: Any, joint: int) -> JointLayout:
    """Closed is 0, and open the farther end of the range; doors and drawers give access."""
    low, high = (float(end) for end in model.jnt_range[joint])
    moved = f"{model.joint(joint).name} {model.body(model.jnt_bodyid[joint]).name}".lower()
    opens = "door" in moved or "drawer" in moved
    return JointLayout(0.0, (low if abs(low) > abs(high) else high) or 1.0, opens)


def _children(model: Any) -> list[list[int]]:
    found: list[list[int]] = [[] for _ in range(model.nbody)]
    for body in range(1, model.nbody):
        found[model.body_parentid[body]].append(body)
    return found


def _is_free(model: Any, body: int) -> bool:
    joint = int(model.body_jntadr[body])
    return joint >= 0 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE


def _is_solid(model: Any, body: int) -> bool:
    return bool((below(model, body)[model.geom_bodyid] & collides(model)).any())
