"""Action onset: the step at which a skill starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Parameter, Proposition
from pytest_safemanip.propositions.grasp import looks_back
from pytest_safemanip.propositions.kernels.filters import change, majority, recently, rising
from pytest_safemanip.propositions.kernels.forces import hand_parts, object_parts, robot_on_joint
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.operation import leaves
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import BUTTON, ROBOT

OPEN_RATE = Parameter("skill_onset.rate", "1/s", 0.02, "a door that is moved takes under a minute")
PRESS_FORCE = Parameter("skill_onset.force", "N", 0.5, "as for a finger in a grasp")
WINDOW = Parameter("skill_onset.window", "s", 0.25, "one motion is one onset, not five")


def skill_onset(view: View, skill: str, entity: str) -> Bools:
    """The skill starts on the entity at this step. ``pick``: the fingers have closed on it
    (``obj_grasped`` begins). ``place``: it is let go (``obj_released``). ``open`` and ``close``:
    over the last ``skill_onset.window`` a door or drawer of it moved that way faster than
    ``skill_onset.rate``, and the robot touches that part in its majority. ``press``, ``turn``,
    ``slide``: likewise, the hand touches a control of it (what a joint moves that is no door, or a
    button) with ``skill_onset.force``; or a switch of it comes on. ``pour``: the centre of another
    object leaves the box of this one while the robot holds it.
    """
    return _ONSETS[skill](view, entity)


def _pick(view: View, name: str) -> Bools:
    return rising(view("obj_grasped", name))


def _place(view: View, name: str) -> Bools:
    return view("obj_released", name)


def _open(view: View, fixture: str) -> Bools:
    return _moved(view, fixture, 1.0)


def _close(view: View, fixture: str) -> Bools:
    return _moved(view, fixture, -1.0)


def _moved(view: View, fixture: str, direction: float) -> Bools:
    trace = view.trace
    started = np.zeros(len(trace), bool)
    for index in trace.scene.doors_of(fixture):
        touched = majority(
            robot_on_joint(view, index) > 0, trace.count(view.parameters[WINDOW.name])
        )
        moves = direction * opening_rate(view, index) > view.parameters["skill_onset.rate"]
        started |= rising(moves & touched)
    return started


def opening_rate(view: View, joint: int) -> NDArray[np.float64]:
    """Rate at which a joint opened over the last ``skill_onset.window``, 1/s (T,)."""
    seconds = view.parameters[WINDOW.name]
    return change(view.trace.steps.joint[:, joint, 0], view.trace.count(seconds)) / seconds


def _pour(view: View, container: str) -> Bools:
    started = np.zeros(len(view.trace), bool)
    for body in view.trace.scene.bodies:
        if body.entity != container:
            started |= leaves(view, body.entity, container)
    return started


def _operate(view: View, fixture: str) -> Bools:
    count = view.trace.count(view.parameters["skill_onset.window"])
    # A button latches at a tap that is shorter than the vote: what comes on has been operated. A
    # press that goes on is the same onset.
    return rising(
        majority(_operated(view, fixture), count) | recently(_comes_on(view, fixture), count)
    )


def _comes_on(view: View, fixture: str) -> Bools:
    """Whether a switch of the fixture comes on at this step (T,)."""
    own = [k for k, switch in enumerate(view.trace.scene.switches) if switch.entity == fixture]
    return np.asarray(rising(view.trace.steps.switch[:, own] == 1.0).any(axis=1))


@pointwise
def _operated(view: View, fixture: str) -> Bools:
    """Whether the hand touches a control of the fixture (T,)."""
    scene = view.trace.scene
    controls = {
        part
        for part in object_parts(view, fixture)
        if scene.parts[part].name == BUTTON
        or (
            scene.parts[part].joint
            and not scene.joints[scene.joint_index[scene.parts[part].joint]].gives_access
        )
    }
    force = view.trace.pair_table.force(hand_parts(view), controls)
    return np.asarray(force >= view.parameters["skill_onset.force"])


_ONSETS = {
    "pick": _pick,
    "place": _place,
    "open": _open,
    "close": _close,
    "press": _operate,
    "turn": _operate,
    "slide": _operate,
    "pour": _pour,
}
SKILLS = tuple(_ONSETS)
"""The skills whose onset is known."""


def _reads(inputs: Inputs, skill: str, entity: str) -> Found:
    own, robot = inputs.parts(entity), inputs.parts(ROBOT)
    match skill:
        case "pick":
            return inputs.of("obj_grasped", entity)
        case "place":
            return inputs.of("obj_released", entity)
        case "pour":
            return inputs.of("obj_grasped", entity) | inputs.poses(*inputs.objects)
        case "open" | "close":
            return inputs.joints(entity) | inputs.touch(robot, own)
    return inputs.touch(inputs.hand_parts, own) | inputs.switches(entity)


PROPOSITIONS = (
    Proposition(
        "skill_onset",
        ("skill", "entity"),
        lambda p: max(p["skill_onset.window"], p["obj_released.window"], looks_back(p)),
        (OPEN_RATE, PRESS_FORCE, WINDOW),
        skill_onset,
        act=True,
        no_margin="an edge: a skill starts at this step or it does not",
        debounce=lambda p: min(p["skill_onset.window"], p["obj_grasped.window"]),
        lacks=grounding.skill,
        reads=_reads,
        distinct=True,
    ),
)
