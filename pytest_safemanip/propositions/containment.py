"""Transfers: an object is released toward a receiver, and whether it ends up in it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from math import inf

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.grasp import looks_back, pressed
from pytest_safemanip.propositions.kernels.displacement import (
    REST_DRIFT,
    REST_WINDOW,
    DisplacementSinceRest,
)
from pytest_safemanip.propositions.kernels.filters import (
    falling,
    held,
    last_true,
    majority,
    rising,
    still,
)
from pytest_safemanip.propositions.kernels.forces import object_parts, robot_parts
from pytest_safemanip.propositions.kernels.interiors import (
    centre_within,
    holding_halves,
    interiors,
    place_in,
)
from pytest_safemanip.propositions.kernels.liquids import (
    departed,
    holding_frames,
    middle_of,
    share_in,
)
from pytest_safemanip.propositions.kernels.margins import (
    LEAST,
    lasting,
    over,
    stillness,
    under,
    within,
)
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.release import TOUCH
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import matrix, tilt, to_local

REACH = Parameter(
    "transfer.reach", "m", 0.1, "a gripper's width: what is let go this near was meant for it"
)
MIN_DISPLACEMENT = Parameter(
    "transfer.displacement",
    "m",
    0.04,
    "fingers that close, 8 cm apart, shift what they take by half",
)
FLOW = Parameter("transfer.share", "", 0.05, "a drop that runs down outside is no pouring")
SHARE = Parameter("contained.share", "", 0.95, "a few drops stay in what is poured out of")
LEANING = Parameter(
    "contained.tilt", "rad", float(np.deg2rad(60.0)), "a vessel on its side keeps nothing in"
)


def transfer(view: View, content: str, receiver: str) -> Bools:
    """The content leaves what carried it toward the receiver at this step: the robot's grasp of
    it ends, or it leaves the box of a container that the robot holds, or the robot lets go of that
    container, while the content's centre is above or inside the receiver's box, or beside it by
    less than ``transfer.reach``, and has been at least ``transfer.displacement`` from where it lay
    for ``contained.window`` before the hand held anything. Where the task has several receivers for
    it, the nearest one counts. Of a grasp, the last step at which the fingers pressed counts. A
    liquid starts to flow: at least ``transfer.share`` of its particles have left the object that
    they were in at the first step, and the middle of those is there.
    """
    if content in view.trace.scene.particles:
        return _flows(view, content, receiver)
    carried = view("obj_grasped", content)
    for body in view.trace.scene.bodies:
        if body.entity not in (content, receiver):
            held_too = view("obj_grasped", body.entity)
            if held_too.any():
                carried = carried | (held_too & centre_within(view, content, body.entity))
    displacement = view.fold(DisplacementSinceRest)[:, view.trace.scene.object_index[content]]
    ends = falling(carried)
    return ends & _toward(view, content, receiver, displacement) if ends.any() else ends


def _toward(view: View, content: str, receiver: str, displacement: NDArray[np.float64]) -> Bools:
    """Whether the content is where :func:`transfer` says, by when the fingers last pressed (T,)."""
    near = _meant_for(
        view, content, receiver, lambda name, number: place_in(view, content, name, number)
    )
    near &= displacement >= view.parameters["transfer.displacement"]
    # The debounced end of a grasp is late: what is flung is elsewhere by then.
    count = view.trace.count(view.parameters["obj_grasped.window"])
    left = last_true(pressed(view, content), count)
    return np.where(left >= 0, near[np.maximum(left, 0)], near)


def _meant_for(
    view: View, content: str, receiver: str, place_of: Callable[[str, int], Floats]
) -> Bools:
    """Whether what is let go was meant for a receiver: it is above or inside its box, or beside it
    by little, and no other receiver that the task has for it is nearer (T,).

    Args:
        view: what is looked at.
        content: what is let go.
        receiver: an object or a fixture.
        place_of: where it is, seen from the box of a receiver and a number (T, 3).
    """
    beside = _beside(view, receiver, place_of)
    meant = beside < view.parameters["transfer.reach"]
    for other in {r for c, r in view.binding.transfers if c == content and r != receiver}:
        if meant.any():
            meant &= beside <= _beside(view, other, place_of)
    return meant


def _beside(view: View, receiver: str, place_of: Callable[[str, int], Floats]) -> Floats:
    """How far beside a receiver's box something is, m: 0 above and inside it, inf below it (T,)."""
    least = np.full(len(view.trace), inf)
    for number, half in enumerate(holding_halves(view, receiver)):
        up, upward = _upward(view, receiver, number)
        place = place_of(receiver, number)
        out = np.maximum(np.abs(place) - half, 0.0)
        out[np.arange(len(out)), up] = 0.0
        height = upward * np.take_along_axis(place, up[:, None], axis=1)[:, 0]
        beside = np.where(height > -half[up], np.linalg.norm(out, axis=1), inf)
        least = np.minimum(least, beside)
    return least


def _flows(view: View, liquid: str, receiver: str) -> Bools:
    """Whether a liquid starts to flow toward a receiver at this step (T,)."""
    gone = departed(view, liquid)
    starts = rising(gone.mean(axis=1) >= view.parameters[FLOW.name])
    if not starts.any():
        return np.asarray(starts)
    middle = middle_of(view, liquid, gone)
    frames = cache(partial(holding_frames, view))
    meant = _meant_for(
        view, liquid, receiver, lambda name, number: to_local(frames(name)[number], middle)
    )
    return np.asarray(starts & meant)


def contained(view: View, content: str, receiver: str) -> Bools:
    """For ``contained.window``, the content is in the receiver: its centre is inside the receiver's
    box, or above that box while it touches the receiver in the majority of another such window (a
    plate is flat), and a receiver that can tip tilts less than ``contained.tilt``; it moved less
    than ``contained.drift`` in it from the beginning of the window to its end; the robot neither
    holds it nor touches it with ``settled.touch``. Of a liquid, at least ``contained.share`` of its
    particles are in the receiver, and that tilts less, for the window.
    """
    if content in view.trace.scene.particles:
        count = view.trace.count(view.parameters["contained.window"])
        enough = share_in(view, content, receiver) >= view.parameters[SHARE.name]
        return held(enough & _holds(view, receiver), count)
    trace, p = view.trace, view.parameters
    count = trace.count(p["contained.window"])
    touches = majority(_touch(view, content, receiver), count)
    rests = np.zeros(len(trace), bool)
    for number, half in enumerate(holding_halves(view, receiver)):
        place = place_in(view, content, receiver, number)
        over = (np.abs(place[:, :2]) <= half[:2]).all(axis=1) & (place[:, 2] >= -half[2])
        within = over & (touches | (place[:, 2] <= half[2])) & _holds(view, receiver)
        rests |= still(place, count, p["contained.drift"]) & held(within, count)
    # What a finger pins against the rim is not at rest, and falls when the hand draws back.
    free = _robot_force(view, content) < p["settled.touch"]
    return np.asarray(rests & free & ~view("obj_grasped", content))


def contained_margin(view: View, content: str, receiver: str) -> Floats:
    """The least margin of how far inside the content's centre has been in the window, by half the
    width of the box, of how still it is, how upright the receiver, and how free of the robot (T,).
    """
    trace, p = view.trace, view.parameters
    count, rests = trace.count(p["contained.window"]), []
    index = trace.scene.object_index.get(receiver)
    upright = np.ones(len(trace))
    if index is not None:
        upright = under(tilt(trace.steps.object_pose[:, index, 3:]), p["contained.tilt"])
    if content in trace.scene.particles:
        enough = over(share_in(view, content, receiver), p[SHARE.name])
        return lasting(np.minimum(enough, upright), count)
    touches = majority(_touch(view, content, receiver), count)
    for number, half in enumerate(holding_halves(view, receiver)):
        place = place_in(view, content, receiver, number)
        beside = within(place[:, :2], half[:2])
        height = max(half[2], LEAST)
        below_rim = np.where(touches, 1.0, (half[2] - place[:, 2]) / height)
        above_floor = (place[:, 2] + half[2]) / height
        inside = np.min((beside, above_floor, below_rim, upright), axis=0)
        still_there = stillness(place, count, p["contained.drift"])
        rests.append(np.minimum(still_there, lasting(inside, count)))
    free = under(_robot_force(view, content), p["settled.touch"])
    let_go = -view.margin("obj_grasped", content)
    return np.asarray(np.min((np.max(rests, axis=0), free, let_go), axis=0))


def _robot_force(view: View, content: str) -> NDArray[np.float32]:
    """How hard the robot presses on the content, N (T,)."""
    return view.trace.pair_table.force(robot_parts(view), object_parts(view, content))


def contained_evidence(view: View, content: str, receiver: str, step: int) -> list[str]:
    """Where the content is, seen from the receiver."""
    if content in view.trace.scene.particles:
        share = float(share_in(view, content, receiver)[step])
        return [f"{share:.0%} of {content} is in {receiver}"]
    lines = [] if _holds(view, receiver)[step] else [f"{receiver} does not stand upright"]
    for number, half in enumerate(holding_halves(view, receiver)):
        place = place_in(view, content, receiver, number)[step]
        outside = np.maximum(np.abs(place) - half, 0.0)
        if outside.any():
            across, up = float(np.linalg.norm(outside[:2])), float(outside[2])
            lines.append(
                f"the centre of {content} is {100 * across:.0f} cm beside and {100 * up:.0f} cm "
                f"above or below the box of {receiver}"
            )
        else:
            lines.append(f"the centre of {content} is inside the box of {receiver}")
    return lines


def _upward(view: View, receiver: str, number: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Which axis of where a receiver holds things is the most upright one, and its sense: 1 if it
    points up, -1 if down, as where a bowl is upside down (T,).
    """
    index = view.trace.scene.object_index.get(receiver)
    steps = view.trace.steps
    pose = interiors(view, receiver)[number][0] if index is None else steps.object_pose[:, index]
    rise = matrix(np.asarray(pose[:, 3:], np.float64))[:, 2]
    up = np.argmax(np.abs(rise), axis=1)
    return up, np.sign(np.take_along_axis(rise, up[:, None], axis=1)[:, 0])


@pointwise
def _holds(view: View, receiver: str) -> Bools:
    """Whether a receiver is not tipped over; a fixture never is (T,)."""
    index = view.trace.scene.object_index.get(receiver)
    if index is None:
        return np.ones(len(view.trace), bool)
    leaning = tilt(view.trace.steps.object_pose[:, index, 3:])
    return np.asarray(leaning < view.parameters["contained.tilt"])


@pointwise
def _touch(view: View, content: str, receiver: str) -> Bools:
    parts = object_parts(view, content), object_parts(view, receiver)
    return np.asarray(view.trace.pair_table.force(*parts) > 0)


def _transfer_reads(inputs: Inputs, content: str, receiver: str) -> Found:
    others = [r for c, r in inputs.binding.transfers if c == content]
    places = inputs.place(receiver).union(*map(inputs.place, others))
    if content in inputs.scene.particles:
        vessels = inputs.poses(*inputs.objects, seconds=inf) | places
        return vessels | inputs.particles(content, seconds=inf)
    found = inputs.poses(*inputs.objects) | places
    for name in inputs.objects:
        found |= inputs.of("obj_grasped", name)
    fingers, things = inputs.finger_parts, inputs.parts(*inputs.objects)
    # It remembers where the content lay before the hand held anything.
    return found | inputs.poses(content, seconds=inf) | inputs.touch(fingers, things, seconds=inf)


def _contained_reads(inputs: Inputs, content: str, receiver: str) -> Found:
    if content in inputs.scene.particles:
        return inputs.particles(content) | inputs.place(receiver)
    own = inputs.parts(content)
    near = inputs.touch(own, inputs.parts(receiver, ROBOT))
    return near | inputs.of("obj_grasped", content) | inputs.poses(content) | inputs.place(receiver)


_PAIR = ("object or liquid", "entity")

PROPOSITIONS = (
    Proposition(
        "transfer",
        _PAIR,
        looks_back,
        (REACH, MIN_DISPLACEMENT, REST_WINDOW, REST_DRIFT, FLOW),
        transfer,
        act=True,
        no_margin="an edge: the content leaves what carried it at this step or it does not",
        debounce=lambda p: p["obj_grasped.window"],
        lacks=grounding.gripper,
        reads=_transfer_reads,
        exempt={"window": "it remembers where the content lay"},
        distinct=True,
    ),
    Proposition(
        "contained",
        _PAIR,
        lambda p: max(2.0 * p["contained.window"], looks_back(p)),
        (REST_WINDOW, REST_DRIFT, LEANING, TOUCH, SHARE),
        contained,
        margin=contained_margin,
        evidence=contained_evidence,
        reads=_contained_reads,
        distinct=True,
    ),
)
