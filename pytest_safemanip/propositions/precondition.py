"""Action onset: whether the conditions of a skill hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.grasp import pressed
from pytest_safemanip.propositions.kernels.checks import Check, least_margin
from pytest_safemanip.propositions.kernels.filters import last_true
from pytest_safemanip.propositions.kernels.firmness import SAME_LEVEL
from pytest_safemanip.propositions.kernels.forces import finger_groups, object_parts
from pytest_safemanip.propositions.kernels.interiors import ROUNDING, lies_in
from pytest_safemanip.propositions.kernels.solids import body_boxes, solids
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.onset import opening_rate
from pytest_safemanip.propositions.operation import CLOSED, pouring_checks, switching_checks
from pytest_safemanip.propositions.release import (
    UPRIGHT,
    rested,
    rested_margin,
    settled_evidence,
)
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.geometry import (
    boxes_depth,
    boxes_overlap,
    centred,
    corners,
    to_local,
    to_world,
)
from pytest_safemanip.trace.kinematics import carried
from pytest_safemanip.trace.planar import breadth, footprints_overlap, hull_margin

DROP = Parameter("pre_safe.drop", "m", 0.05, "a fall of 5 cm ends at 1 m/s: cups break above it")
FLOOR = Parameter(
    "pre_safe.floor", "m", 0.01, "a vessel's floor is above the underside of its box: it is thick"
)
OVERLAP = Parameter("pre_safe.overlap", "m", 0.01, "boxes are larger than what is in them")
PICK_WINDOW = Parameter("pre_safe.pick_window", "s", 2.0, "a hand takes up to 2 s to close on it")
PLACE_WINDOW = Parameter("pre_safe.place_window", "s", 0.5, "the debounced end of a grasp is late")
SWEEP = np.linspace(0.0, 1.0, 9)
"""Where a moving part is tested against obstacles, from here to the end of its way."""

Array = NDArray[np.float64]
_Solid = tuple[float, str, Array]
"""Height, owner and box corners (8, 3) of something below an object."""


def pre_safe(view: View, skill: str, entity: str) -> Bools:
    """The conditions of a skill hold at this step. ``pick``: within the last
    ``pre_safe.pick_window`` the object was settled, or would have been had the robot not touched
    it, and no object stands on it but what lies inside it. ``place``:
    where it last was in the fingers, within ``pre_safe.place_window``, what lies below it is a
    permitted support, free of other objects, at most ``pre_safe.drop`` below (in a container, its
    floor, ``pre_safe.floor`` above the underside); below it is what it overlaps by more than
    ``pre_safe.overlap``, or by half its breadth, and of fixtures at one level that below its centre
    of mass. ``open`` and ``close``: no object stands in the
    rest of the part's way by more than ``pre_safe.overlap``. ``press``, ``turn``, ``slide``: in the
    basin, nothing raw lies with something ready to eat; an appliance that is off has its doors
    closed but for ``pre_safe.closed`` and, if it is a microwave, nothing of metal in it; a burner
    that is off has cookware (a metal container) on it and nothing combustible in what it heats. A
    burner, or an appliance with a knob of its own, counts where that knob is touched.
    ``pour``: a receiver that the task has for what leaves is below it and stands upright.

    Evaluated where the skill's onset is true, and true elsewhere.
    """
    result = np.ones(len(view.trace), bool)
    for step in _onsets(view, skill, entity):
        result[step] = all(check.holds for check in conditions(view, skill, entity, step))
    return result


def pre_safe_margin(view: View, skill: str, entity: str) -> Floats:
    """The least margin of the conditions; 1 where no skill starts (T,)."""
    result = np.ones(len(view.trace))
    for step in _onsets(view, skill, entity):
        result[step] = least_margin(conditions(view, skill, entity, step))
    return result


def pre_safe_evidence(view: View, skill: str, entity: str, step: int) -> list[str]:
    """The conditions that do not hold."""
    return [c.reason for c in conditions(view, skill, entity, step) if not c.holds]


def conditions(view: View, skill: str, entity: str, step: int) -> Iterator[Check]:
    """The conditions of a skill that starts at a step."""
    return _CONDITIONS[skill](view, entity, step)


def _onsets(view: View, skill: str, entity: str) -> list[int]:
    """Steps that are asked for at which the skill starts."""
    onset = np.flatnonzero(view("skill_onset", skill, entity))
    asked = (onset >= view.since) & (onset < view.until)
    return [int(step) for step in onset[asked]]


def _pick(view: View, name: str, step: int) -> Iterator[Check]:
    trace = view.trace
    count = trace.count(view.parameters["pre_safe.pick_window"])
    # A hand that lies against an object for long before it closes on it does not unsettle it.
    when = view, name, step - count + 1, step
    at_rest = rested(*when)
    reason = f"{name} was not at rest on a permitted support before it was grasped"
    if not at_rest:
        why = settled_evidence(view, name, max(step - count + 1, 0))
        reason += f": {'; '.join(why)}" if why else ""
    yield Check(at_rest, reason, lambda: rested_margin(*when))
    for other in sorted(_stacked(view, name, step) & set(trace.scene.object_index)):
        inside = bool(lies_in(view, other, name, np.array([step])).all())
        yield Check(inside, f"{other} stands on {name}")


def _stacked(view: View, name: str, step: int) -> set[str]:
    """What touches an object from above at a step, and has pressed on it within
    ``settled.window``: what is light hops while fingers close below it.
    """
    count = view.trace.count(view.parameters["settled.window"])
    own, parts = object_parts(view, name), view.trace.scene.parts
    contacts, pressing, touching = view.trace.steps.contacts, set[str](), set[str]()
    for row in range(*contacts.span(max(step - count + 1, 0), step + 1)):
        a, b = int(contacts.a[row]), int(contacts.b[row])
        upper, lift = (b, contacts.normal[row, 2]) if a in own else (a, -contacts.normal[row, 2])
        if (a in own) == (b in own) or lift <= 0.5:
            continue
        if contacts.force[row] > 0:
            pressing.add(parts[upper].entity)
        if contacts.step[row] == step:
            touching.add(parts[upper].entity)
    return pressing & touching


def _place(view: View, name: str, step: int) -> Iterator[Check]:
    trace, p = view.trace, view.parameters
    count = trace.count(p["pre_safe.place_window"])
    last = int(last_true(pressed(view, name), count)[step])
    # What came off the fingers within a control step has fallen by its end.
    held = step if last < 0 else last if last == 0 or _in_hand(view, name, last) else last - 1
    index = trace.scene.object_index[name]
    body = trace.scene.bodies[index]
    points = corners(trace.steps.object_pose[held, index], body.half, body.centre)
    height, below = _beneath(view, name, points, held)
    if below is None:
        yield Check(False, f"nothing lies below {name}")
        return
    permitted = below in view.binding.supports.get(name, frozenset())
    yield Check(permitted, f"{name} is let go above {below}, which is no permitted support")
    drop, limit = float(points[:, 2].min()) - height, p["pre_safe.drop"]
    reason = f"{name} is let go {100 * drop:.2g} cm above {below} (at most {100 * limit:g} cm)"
    yield Check(drop <= limit, reason, lambda: (limit - drop) / limit)


def _in_hand(view: View, name: str, step: int) -> bool:
    """Whether a finger presses on an object when a step ends."""
    contacts, own = view.trace.steps.contacts, object_parts(view, name)
    fingers = frozenset[int]().union(*(parts for hand in finger_groups(view) for parts in hand))
    return any(
        contacts.force[row] > 0
        and {int(contacts.a[row]), int(contacts.b[row])} & own
        and {int(contacts.a[row]), int(contacts.b[row])} & fingers
        for row in range(*contacts.span(step, step + 1))
    )


def _beneath(view: View, name: str, points: Array, step: int) -> tuple[float, str | None]:
    """Height and owner of the highest thing below an object's footprint."""
    slack = view.parameters["pre_safe.overlap"]
    bottom = points[:, 2].min()
    vessel, below = (-np.inf, ""), list[_Solid]()
    centre = points.mean(axis=0)
    reach = float(np.linalg.norm(points - centre, axis=1).max())
    owners, boxes, _ = solids(view, name, step, (centre, reach))
    low, top = boxes.min(axis=1), boxes.max(axis=1)
    # Shadows overlap no more than the upright rectangles around them.
    depth = np.minimum(top, points.max(axis=0)) - np.maximum(low, points.min(axis=0))
    # A straw is narrower than the overlap that is asked of what is broad.
    least = min(slack, breadth(points) / 2.0)
    near = (depth[:, :2] > least - ROUNDING).all(axis=1)
    over = (np.maximum(low - centre, centre - top)[:, :2] < ROUNDING).all(axis=1)
    for k in np.flatnonzero(near | over).tolist():
        entity, height = owners[k], float(top[k, 2])
        # A vessel's box is mostly air: what is let go inside it falls onto its floor or contents.
        if height > bottom + slack and over[k] and _in_vessel(view, entity, points, step):
            if not _holds(view, name, entity, step):
                vessel = max(vessel, (float(low[k, 2]), entity))
        elif near[k] and height <= bottom + slack:
            below.append((height, entity, boxes[k]))
    below.sort(key=lambda item: -item[0])
    found = (item for item in below if footprints_overlap(points, item[2], least))
    floor, around = vessel
    floor_of = floor + view.parameters["pre_safe.floor"], around or None
    uncovered = _uncovered(view, found, step)
    if uncovered is None:
        return floor_of
    height, owner, box = _under_the_middle(view, name, uncovered, below, step)
    lowest = float(box[:, 2].min())
    return floor_of if around and not lowest > floor else (height, owner)


def _under_the_middle(
    view: View, name: str, highest: _Solid, below: list[_Solid], step: int
) -> _Solid:
    """The highest thing below an object, as high as it is; but if that is a fixture, of what is
    level with it what is below the centre of mass, if anything is: a pan stands on the hob when its
    handle reaches over the counter.
    """
    scene = view.trace.scene
    if highest[1] in scene.object_index:
        return highest
    index = scene.object_index[name]
    com = to_world(view.trace.steps.object_pose[step, index], scene.bodies[index].com)
    level = (
        it
        for it in below
        if it[0] > highest[0] - SAME_LEVEL and hull_margin(it[2][:, :2], com[:2]) > 0.0
    )
    _, owner, box = next(level, highest)
    return highest[0], owner, box


def _uncovered(view: View, found: Iterator[_Solid], step: int) -> _Solid | None:
    """The highest of the things below an object, if there are any. What lies on a plate comes
    before the plate, whose rim may be higher.

    Args:
        view: what is looked at.
        found: the highest first; they are looked up as far as is needed.
        step: when.
    """
    highest = next(found, None)
    if highest is None or highest[1] not in view.trace.scene.object_index:
        return highest
    inside = (item for item in found if item[1] != highest[1])
    return next((item for item in inside if _in_vessel(view, highest[1], item[2], step)), highest)


def _in_vessel(view: View, entity: str, points: Array, step: int) -> bool:
    """Whether the middle of an object's underside is inside the box of a vessel."""
    index = view.trace.scene.object_index.get(entity)
    if index is None or "container" not in view.binding.attributes_of(entity):
        return False
    body = view.trace.scene.bodies[index]
    pose = np.asarray(view.trace.steps.object_pose[step, index], np.float64)
    # Of what leans, the lowest corner is lowest; that of a ball's box is lower than the ball.
    heights = np.sort(points[:, 2])
    under = np.tile(points.mean(axis=0), (2, 1))
    under[:, 2] = heights[0], heights[:4].mean()
    # What stands where the vessel stands is as deep as its box: it is not in it.
    limit = np.subtract(body.half, ROUNDING)
    inside = np.abs(to_local(centred(pose, body.centre), under)) < limit
    return bool(inside.all(axis=1).any())


def _holds(view: View, name: str, other: str, step: int) -> bool:
    """Whether another object lies in an object, and not the object in it: where their boxes reach
    into one another, the smaller one lies in the larger.
    """
    scene = view.trace.scene
    own, its = (math.prod(scene.bodies[scene.object_index[n]].half) for n in (name, other))
    return own > its and bool(lies_in(view, other, name, np.array([step])).all())


def _open(view: View, fixture: str, step: int) -> Iterator[Check]:
    return _sweep(view, fixture, step, 1.0)


def _close(view: View, fixture: str, step: int) -> Iterator[Check]:
    return _sweep(view, fixture, step, 0.0)


def _sweep(view: View, fixture: str, step: int, end: float) -> Iterator[Check]:
    """Whether objects are in the way of the fixture's moving parts, from here to their end."""
    trace, scene, slack = view.trace, view.trace.scene, view.parameters["pre_safe.overlap"]
    half, centre = (sizes[:, None] for sizes in view.shared(body_boxes))
    boxes = centred(np.asarray(trace.steps.object_pose[step], float)[:, None], centre)
    for index in scene.doors_of(fixture):
        joint = scene.joints[index]
        rate = float(opening_rate(view, index)[step])
        if rate * (1.0 if end > 0.5 else -1.0) <= 0:
            continue
        now = float(trace.steps.joint[step, index, 0])
        way = carried(joint, np.asarray(joint.pose), now + (end - now) * SWEEP)
        meets = boxes_overlap(way, joint.half, boxes, half, slack)
        # What is met from the start lies in the drawer and moves with it.
        for k in np.flatnonzero(~meets[:, 0]).tolist():
            reason = f"{scene.bodies[k].entity} is in the way of {fixture}/{joint.name}"
            sides = way, joint.half, boxes[k], half[k]
            yield Check(not meets[k].any(), reason, partial(_clearance, *sides, slack))


def _clearance(way: Array, half: ArrayLike, box: Array, its: Array, slack: float) -> float:
    """The margin of a box meeting another one nowhere on its way, but for a slack, m."""
    return (slack - float(boxes_depth(way, half, box, its).max())) / slack


_CONDITIONS: dict[str, Callable[[View, str, int], Iterator[Check]]] = {
    "pick": _pick,
    "place": _place,
    "open": _open,
    "close": _close,
    **dict.fromkeys(("press", "turn", "slide"), switching_checks),
    "pour": pouring_checks,
}


def _reads(inputs: Inputs, skill: str, entity: str) -> Found:
    if inputs.known("skill_onset", skill, entity) is False:
        return frozenset()
    own, things = inputs.parts(entity), inputs.poses(*inputs.objects)
    found = inputs.of("skill_onset", skill, entity) | things
    match skill:
        case "pick":
            touched = inputs.touch(own, inputs.all_parts)
            return found | inputs.of("settled", entity) | touched
        case "place":
            fixtures = (e.name for e in inputs.scene.entities)
            touched = inputs.touch(inputs.finger_parts, own)
            return found | inputs.joints(*fixtures) | touched
        case "pour":
            transfers = inputs.binding.transfers
            return found.union(*(inputs.place(receiver) for _, receiver in transfers))
    return found | inputs.joints(entity) | inputs.boxes(entity) | inputs.switches(entity)


PROPOSITIONS = (
    Proposition(
        "pre_safe",
        ("skill", "entity"),
        lambda p: max(p["pre_safe.pick_window"] + p["settled.window"], p["skill_onset.window"]),
        (DROP, FLOOR, OVERLAP, PICK_WINDOW, PLACE_WINDOW, CLOSED, UPRIGHT),
        pre_safe,
        margin=pre_safe_margin,
        evidence=pre_safe_evidence,
        lacks=grounding.precondition,
        reads=_reads,
        distinct=True,
    ),
)
