"""Enclosures: reaching in, putting in, letting go inside."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.grasp import looks_back, pressed
from pytest_safemanip.propositions.kernels.filters import last_true, rising
from pytest_safemanip.propositions.kernels.interiors import (
    Steps,
    box_depth,
    corners_inside,
    interiors,
    near,
    seen_from,
    seen_in,
)
from pytest_safemanip.propositions.kernels.margins import over
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.geometry import boxes_depth, boxes_overlap, centred, to_local, to_world

V = TypeVar("V", np.bool_, np.float64)

TOLERANCE = Parameter(
    "enclosure.tolerance", "m", 0.005, "an interior's box is drawn by hand around the free space"
)
LATE = Parameter("enclosure.late", "s", 0.5, "the debounced end of a grasp is late")
OPEN = Parameter("fix_open.openness", "", 0.9, "a door that is not fully open swings back")


def reach_in(view: View, fixture: str) -> Bools:
    """The centre of a gripper's box enters an interior of the fixture at this step."""
    return np.asarray(rising(_hand_inside(view, fixture)).any(axis=1))


def fix_open(view: View, fixture: str) -> Bools:
    """The most open door or drawer that gives access to where the hand is (that it would be behind,
    were they closed; if it would be behind none, any of the fixture) is open by at least
    ``fix_open.openness`` of its range, or by what the task's binding says counts as open there; for
    each hand of the robot. Open shelves, which have neither, are always open.
    """
    return _asked(view, _now_open(view, fixture) >= _enough(view, fixture))


def fix_open_margin(view: View, fixture: str) -> Floats:
    """How far open it is beyond what counts as open (T,)."""
    return _asked(view, over(_now_open(view, fixture), _enough(view, fixture)))


def _enough(view: View, fixture: str) -> float:
    """How open counts as open."""
    return view.binding.open_at.get(fixture, view.parameters["fix_open.openness"])


def _now_open(view: View, fixture: str) -> NDArray[np.float64]:
    """How open the fixture is at the steps that are asked for (K,)."""
    return _openness(view, fixture, np.arange(view.since, view.until))


def place_in_onset(view: View, name: str, fixture: str) -> Bools:
    """The held object starts to enter the fixture: its first corner comes inside, by more than
    ``enclosure.tolerance``, so that it is no longer outside.
    """
    grasped = view("obj_grasped", name)
    if not grasped.any():
        return grasped
    depth, inside = view.parameters["enclosure.tolerance"], np.zeros(len(grasped), bool)
    steps = np.flatnonzero(grasped | np.append(grasped[1:], False))
    inside[steps] = corners_inside(view, name, fixture, steps, -depth).any(axis=1)
    return np.asarray(grasped & rising(inside))


def obj_inside(view: View, name: str, fixture: str) -> Bools:
    """All eight corners of the object's box are inside one interior of the fixture, but for
    ``enclosure.tolerance``. Above the floor of the interior they need not be, as long as the box's
    centre is: the floor is solid, and the corners around a round thing that lies on it are lower.
    For ``enclosure.late`` after the fingers last pressed on it, where it then was counts.
    """
    return _as_last_held(
        view, name, lambda steps: _corners_within(view, name, fixture, steps).all(axis=1)
    )


def obj_inside_margin(view: View, name: str, fixture: str) -> Floats:
    """How far inside the outermost corner is, beyond what it may be outside, by that tolerance, in
    the interior that the object is most inside of (T,).
    """
    slack = view.parameters["enclosure.tolerance"]
    return _as_last_held(
        view, name, lambda steps: box_depth(view, name, fixture, steps, slack, True) / slack
    )


def obj_outside(view: View, name: str, fixture: str) -> Bools:
    """No part of the object's box is inside an interior of the fixture by more than
    ``enclosure.tolerance``. For ``enclosure.late`` after the fingers last pressed on it, where it
    then was counts.
    """
    return _as_last_held(view, name, lambda steps: _clear(view, name, fixture, steps))


def obj_outside_margin(view: View, name: str, fixture: str) -> Floats:
    """How much less than the tolerance the object reaches into an interior, by that tolerance, for
    the interior that it reaches into most (T,).
    """
    return _as_last_held(view, name, lambda steps: _clearance(view, name, fixture, steps))


def _as_last_held(view: View, name: str, look: Callable[[Steps], NDArray[V]]) -> NDArray[V]:
    """What holds at steps (K,), for each step that is asked for when the object was last held, or
    at the step itself (T,).
    """
    then = _last_held(view, name)[view.since : view.until]
    steps = np.arange(then.min(), view.until)
    return _asked(view, look(steps)[then - steps[0]])


def _asked(view: View, values: NDArray[V]) -> NDArray[V]:
    """Values (K,) of the steps that are asked for as values of all steps (T,), false or 0
    elsewhere.
    """
    found = np.zeros(len(view.trace), values.dtype)
    found[view.since : view.until] = values
    return found


def _clear(view: View, name: str, fixture: str, steps: Steps) -> Bools:
    """Whether no part of the object is inside at some steps (K,)."""
    trace, slack = view.trace, view.parameters["enclosure.tolerance"]
    index = trace.scene.object_index[name]
    body = trace.scene.bodies[index]
    outside = np.ones(len(steps), bool)
    for number, (box, half) in enumerate(interiors(view, fixture)):
        beyond = (np.abs(seen_from(view, fixture, number)[steps, index]) - half).max(axis=1)
        outside &= beyond >= -slack
        # Around a centre that is deeper inside there is room for more than the slack.
        left = np.flatnonzero(near(view, fixture, number)[steps, index] & outside)
        if len(left):
            centre = centred(trace.steps.object_pose[steps[left], index], body.centre)
            outside[left] &= ~boxes_overlap(centre, body.half, box[steps[left]], half, slack)
    return outside


def _clearance(view: View, name: str, fixture: str, steps: Steps) -> Floats:
    """Margins of :func:`_clear` (K,)."""
    trace, slack = view.trace, view.parameters["enclosure.tolerance"]
    index = trace.scene.object_index[name]
    body = trace.scene.bodies[index]
    centre = centred(trace.steps.object_pose[steps, index], body.centre)
    reach = np.full(len(steps), -np.inf)
    for number, (box, half) in enumerate(interiors(view, fixture)):
        beyond = (np.abs(seen_from(view, fixture, number)[steps, index]) - half).max(axis=1)
        depth = boxes_depth(centre, body.half, box[steps], half)
        reach = np.maximum(reach, np.maximum(depth, -beyond))
    return (slack - reach) / slack


def fix_open_evidence(view: View, fixture: str, step: int) -> list[str]:
    """How open the fixture is."""
    enough = _enough(view, fixture)
    openness = float(_openness(view, fixture, np.array([step]))[0])
    return [f"{fixture} is {openness:.0%} open (open means {enough:.0%})"]


def obj_inside_evidence(view: View, name: str, fixture: str, step: int) -> list[str]:
    """How many corners are inside."""
    then = int(_last_held(view, name)[step])
    count = int(_corners_within(view, name, fixture, np.array([then])).sum())
    verb = "are" if then == step else "were"
    return [f"{count} of 8 corners of {name} {verb} inside {fixture}"]


def _last_held(view: View, name: str) -> NDArray[np.intp]:
    """The step at which the fingers last pressed on the object, or this one (T,).

    What is let go half way in may have fallen in, or out, before the grasp has ended for sure.
    """
    newest = last_true(pressed(view, name), view.trace.count(view.parameters["enclosure.late"]))
    return np.where(newest < 0, np.arange(len(newest)), newest)


@pointwise
def _hand_inside(view: View, fixture: str) -> Bools:
    """Whether the centre of each gripper's box is inside (T, G)."""
    inside = np.zeros((len(view.trace), len(view.trace.scene.grippers)), bool)
    for pose, half in interiors(view, fixture):
        inside |= (np.abs(seen_in(view, pose, hand_centres)) <= half).all(axis=-1)
    return inside


@pointwise
def hand_centres(view: View) -> NDArray[np.float64]:
    """Centre of each gripper's box, world frame (T, G, 3)."""
    centres = [hand.centre for hand in view.trace.scene.grippers]
    return to_world(view.trace.steps.eef_poses, np.reshape(centres, (-1, 3)))


def _openness(view: View, fixture: str, steps: Steps) -> NDArray[np.float64]:
    """How open the most open door is that gives access to where the hand is, at some steps (K,); of
    several hands, where it is least open.
    """
    joints = view.trace.scene.doors_of(fixture)
    if not joints:
        return np.ones(len(steps))
    openness = view.trace.steps.joint[steps][:, joints, 0].astype(np.float64)
    if len(joints) > 1:
        # A fridge that stands open gives no access to its freezer.
        behind = np.stack([_behind(view, joint, steps) for joint in joints], axis=1)
        behind |= ~behind.any(axis=1, keepdims=True)
        reached = np.where(behind, openness[..., None], -np.inf).max(axis=1)
        return np.asarray(reached.min(axis=1, initial=np.inf))
    return np.asarray(openness.max(axis=1))


def _behind(view: View, joint: int, steps: Steps) -> Bools:
    """Whether the middle of each hand, seen straight through the closed door, is behind it, but
    for half of the hand's thickness: what is there comes in past two doors that meet (K, G).
    """
    trace = view.trace
    half = np.array(trace.scene.joints[joint].half)
    centres = hand_centres(view)[steps]
    local = to_local(np.array(trace.scene.joints[joint].pose), centres.reshape(-1, 3))
    beside = np.abs(local.reshape(centres.shape)) - half
    outline = np.arange(3) != np.argmin(half)
    thick = np.array([[min(hand.half)] for hand in trace.scene.grippers])
    return np.asarray((beside[..., outline] <= thick).all(axis=-1))


def _corners_within(view: View, name: str, fixture: str, steps: Steps) -> Bools:
    """Which corners are inside, as :func:`obj_inside` means it (K, 8)."""
    slack = view.parameters["enclosure.tolerance"]
    return corners_inside(view, name, fixture, steps, slack, floor=True)


def _late(p: Mapping[str, float]) -> float:
    return p["enclosure.late"]


def _reach_reads(inputs: Inputs, fixture: str) -> Found:
    return inputs.robot("hands") | inputs.boxes(fixture)


def _open_reads(inputs: Inputs, fixture: str) -> Found:
    several = len(inputs.scene.doors_of(fixture)) > 1  # then it matters which one the hand is at
    return inputs.joints(fixture) | (inputs.robot("hands") if several else frozenset())


def _place_reads(inputs: Inputs, name: str, fixture: str) -> Found:
    return inputs.of("obj_grasped", name) | inputs.poses(name) | inputs.boxes(fixture)


_PLACE = ("object", "fixture")

PROPOSITIONS = (
    Proposition(
        "reach_in",
        ("fixture",),
        lambda _: 0.0,
        (),
        reach_in,
        act=True,
        no_margin="an edge: it enters at this step or it does not",
        lacks=grounding.reached_interior,
        reads=_reach_reads,
    ),
    Proposition(
        "fix_open",
        ("fixture",),
        lambda _: 0.0,
        (OPEN,),
        fix_open,
        margin=fix_open_margin,
        evidence=fix_open_evidence,
        sparse=True,
        reads=_open_reads,
    ),
    Proposition(
        "place_in_onset",
        _PLACE,
        looks_back,
        (TOLERANCE,),
        place_in_onset,
        act=True,
        no_margin="an edge: it enters at this step or it does not",
        lacks=grounding.reached_interior,
        reads=_place_reads,
        distinct=True,
    ),
    Proposition(
        "obj_inside",
        _PLACE,
        _late,
        (TOLERANCE, LATE),
        obj_inside,
        margin=obj_inside_margin,
        evidence=obj_inside_evidence,
        sparse=True,
        lacks=grounding.reached_interior,
        reads=_place_reads,
        distinct=True,
    ),
    Proposition(
        "obj_outside",
        _PLACE,
        _late,
        (TOLERANCE, LATE),
        obj_outside,
        margin=obj_outside_margin,
        sparse=True,
        lacks=grounding.reached_interior,
        reads=_place_reads,
        distinct=True,
    ),
)
