"""Mechanism recovery: a door or drawer that hits something is moved back, not pushed on."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions import grounding
from pytest_safemanip.propositions.definition import (
    Bools,
    Excess,
    Floats,
    Parameter,
    Proposition,
)
from pytest_safemanip.propositions.kernels.filters import change, held, last_true, spread
from pytest_safemanip.propositions.kernels.forces import part_label, robot_on_joint
from pytest_safemanip.propositions.kernels.margins import NONE, given, lasting, over, under
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.kinematics import opening_direction

HIT_FORCE = Parameter("mech_hit.force", "N", 5.0, "as for a collision of the robot itself")
MOVING_RATE = Parameter("mech_hit.rate", "1/s", 0.02, "a door that is moved takes under a minute")
PUSH_WINDOW = Parameter("mech_hit.window", "s", 0.5, "a blocked door stops before it is let go")
RETRACT_SHARE = Parameter("retract.share", "", 0.02, "visible, and above the joint's own play")
RETRACT_WINDOW = Parameter("retract.window", "s", 0.5, "a deliberate motion, not a drift")
SAFE_SHARE = Parameter("recovered.share", "", 0.05, "closed or open but for the latch's play")
SAFE_WINDOW = Parameter("recovered.window", "s", 0.5, "free of the obstacle, and stays so")
MEMORY = Parameter(
    "mech_hit.memory", "s", 12.0, "longer than the deadline within which it must be undone"
)


def mech_hit(view: View, fixture: str) -> Bools:
    """A moving part of the fixture presses, with at least ``mech_hit.force`` along its own
    direction of motion, on something that is neither the fixture nor the robot, while the robot
    touches that part and it moves, or did within the last ``mech_hit.window``: its openness varied
    by more than ``mech_hit.rate`` times that window.
    """
    return np.asarray(_hits(view, fixture)[0] != 0)


def mech_hit_margin(view: View, fixture: str) -> Floats:
    """The force and the movement, each by its limit, of the part that is nearest to a hit (T,)."""
    p, trace = view.parameters, view.trace
    most, count = np.full(len(trace), NONE), trace.count(p["mech_hit.window"])
    for index in trace.scene.doors_of(fixture):
        force = over(np.abs(_pressing(view, index)), p["mech_hit.force"])
        moved = spread(trace.steps.joint[:, index, 0], count)
        hit = np.minimum(force, over(moved, p["mech_hit.rate"] * p["mech_hit.window"]))
        most = np.maximum(most, given(robot_on_joint(view, index) > 0, hit))
    return most


def retract(view: View, fixture: str) -> Bools:
    """Since ``retract.window`` ago, the part that last hit something moved against the direction
    of that hit by at least ``retract.share`` of its range.
    """
    hit, joint = _last_hit(view, fixture)
    count = view.trace.count(view.parameters["retract.window"])
    result = np.zeros(len(view.trace), bool)
    for index in np.unique(joint[hit != 0]):
        openness = view.trace.steps.joint[:, index, 0]
        back = change(openness, count) * -hit >= view.parameters["retract.share"]
        result |= back & (joint == index) & (hit != 0)
    return result


def retract_margin(view: View, fixture: str) -> Floats:
    """How far the part moved back, by its limit; -1 without a hit (T,)."""
    count, share = view.trace.count(view.parameters["retract.window"]), "retract.share"

    def back(openness: NDArray[np.float32], hit: NDArray[np.float64]) -> Floats:
        return over(change(openness, count) * -hit, view.parameters[share])

    return _since_hit(view, fixture, back)


def recovered(view: View, fixture: str) -> Bools:
    """For ``recovered.window``, the part that last hit something has been in its safe state
    (closed after a hit while opening, open after a hit while closing, each within
    ``recovered.share``) and has pressed on nothing.
    """
    hit, joint = _last_hit(view, fixture)
    share = view.parameters["recovered.share"]
    safe = np.zeros(len(view.trace), bool)
    for index in np.unique(joint[hit != 0]):
        openness = view.trace.steps.joint[:, index, 0]
        end = np.where(hit > 0, openness <= share, openness >= 1.0 - share)
        safe |= end & (joint == index) & (hit != 0)
    count = view.trace.count(view.parameters["recovered.window"])
    return held(safe & ~view("mech_hit", fixture), count)


def recovered_margin(view: View, fixture: str) -> Floats:
    """The least margin in the window of how nearly the part is in its safe state, and of no hit;
    -1 without a hit before (T,).
    """
    p = view.parameters
    share, count = p["recovered.share"], view.trace.count(p["recovered.window"])

    def safe(openness: NDArray[np.float32], hit: NDArray[np.float64]) -> Floats:
        opened = (openness - (1.0 - share)) / share
        return np.where(hit > 0, under(openness, share), opened)

    free = -view.margin("mech_hit", fixture)
    return lasting(np.minimum(_since_hit(view, fixture, safe), free), count)


def mech_hit_evidence(view: View, fixture: str, step: int) -> list[str]:
    """What the moving part presses on."""
    contacts, hardest = view.trace.steps.contacts, dict[str, float]()
    for index in view.trace.scene.joints_of(fixture):
        rows, forces = _pressing_rows(view, index)
        now = contacts.step[rows] == step
        for row, force in zip(rows[now], np.abs(forces[now]).tolist(), strict=True):
            other = _other(view, index, row)
            hardest[other] = max(force, hardest.get(other, 0.0))
    return [f"{fixture} presses on {o}: {force:.1f} N" for o, force in hardest.items() if force > 0]


def mech_hit_excess(view: View, fixture: str, first: int, last: int) -> Excess | None:
    """The contact of a hit that is farthest beyond its limit."""
    contacts, parts = view.trace.steps.contacts, view.trace.scene.parts
    hits, hardest, found = view("mech_hit", fixture), 0.0, None
    for index in view.trace.scene.doors_of(fixture):
        rows, forces = _pressing_rows(view, index)
        step = contacts.step[rows]
        counted = np.where((step >= first) & (step <= last) & hits[step], np.abs(forces), 0.0)
        if len(rows) and counted.max() > hardest:
            row, hardest = rows[counted.argmax()], float(counted.max())
            own, other = sorted(
                (int(contacts.a[row]), int(contacts.b[row])),
                key=lambda part: parts[part].entity != fixture,
            )
            found = Excess(
                (part_label(view, own), part_label(view, other)),
                (fixture, parts[other].entity),
                hardest,
                view.parameters["mech_hit.force"],
                int(contacts.step[row]),
            )
    return found if found and found.times >= 1.0 else None


def _hits(view: View, fixture: str) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Direction of the hit at each step (1 while opening, -1 while closing, 0 without one) and the
    joint that hit, which means nothing where none did (T,), (T,).
    """
    p, trace = view.parameters, view.trace
    direction = np.zeros(len(trace))
    joint_at = np.zeros(len(trace), np.intp)
    for index in trace.scene.doors_of(fixture):
        force = _pressing(view, index)
        if not (np.abs(force) >= p["mech_hit.force"]).any():
            continue
        moved = spread(trace.steps.joint[:, index, 0], trace.count(p["mech_hit.window"]))
        pushed = robot_on_joint(view, index) > 0
        pushed &= moved > p["mech_hit.rate"] * p["mech_hit.window"]
        hit = pushed & (np.abs(force) >= p["mech_hit.force"])
        direction = np.where(hit, np.sign(force), direction)
        joint_at = np.where(hit, index, joint_at)
    return direction, joint_at


@pointwise
def _pressing(view: View, index: int) -> NDArray[np.float64]:
    """Greatest force with which the joint's part presses on others along its motion, N (T,).

    Positive where the obstacle stands in the way of opening, or one does there that is pressed on
    as hard as one in the way of closing.
    """
    rows, forces = _pressing_rows(view, index)
    steps = view.trace.steps.contacts.step[rows]
    ahead, behind = np.zeros(len(view.trace)), np.zeros(len(view.trace))
    np.maximum.at(ahead, steps, forces)
    np.minimum.at(behind, steps, forces)
    return np.where(ahead >= -behind, ahead, behind)


def _pressing_rows(view: View, index: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Contact rows in which the joint's part presses on others along its motion, and how hard."""
    scene, contacts = view.trace.scene, view.trace.steps.contacts
    joint = scene.joints[index]
    own, foreign = view.shared(_sides, index)
    rows = view.trace.pair_table.rows(own, foreign)
    if not len(rows):  # mostly nothing is in its way
        return rows, np.zeros(0)
    # The normal points from a to b; the part presses along its outward normal.
    first = np.isin(contacts.a[rows], list(own))
    outward = np.where(first[:, None], 1.0, -1.0) * contacts.normal[rows]
    along = opening_direction(joint, contacts.position[rows])
    return rows, contacts.sustained[rows] * np.einsum("ij,ij->i", outward, along)


def _sides(view: View, index: int) -> tuple[frozenset[int], frozenset[int]]:
    """Which parts a joint moves, and which are neither its fixture's nor the robot's."""
    scene = view.trace.scene
    joint, parts = scene.joints[index], scene.parts
    own = {k for k, part in enumerate(parts) if part.joint == joint.key}
    foreign = {k for k, part in enumerate(parts) if part.entity not in (joint.entity, ROBOT)}
    return frozenset(own), frozenset(foreign)


def _last_hit(view: View, fixture: str) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Direction and joint of the newest hit within the memory (T,), (T,)."""
    direction, joint = _hits(view, fixture)
    newest = last_true(direction != 0, view.trace.count(view.parameters["mech_hit.memory"]))
    return np.where(newest >= 0, direction[newest], 0.0), joint[newest]


def _since_hit(
    view: View,
    fixture: str,
    margin: Callable[[NDArray[np.float32], NDArray[np.float64]], Floats],
) -> Floats:
    """Margins of the part that last hit something, given its openness and the direction of that
    hit; :data:`NONE` without a hit (T,).
    """
    hit, joint = _last_hit(view, fixture)
    found = np.full(len(view.trace), NONE)
    for index in np.unique(joint[hit != 0]):
        own = (joint == index) & (hit != 0)
        found = np.where(own, margin(view.trace.steps.joint[:, index, 0], hit), found)
    return found


def _other(view: View, index: int, row: int) -> str:
    scene, contacts = view.trace.scene, view.trace.steps.contacts
    entity = scene.joints[index].entity
    first = scene.parts[int(contacts.a[row])].entity
    second = scene.parts[int(contacts.b[row])].entity
    return second if first == entity else first


def _reads(inputs: Inputs, fixture: str) -> Found:
    return inputs.joints(fixture) | inputs.touch(inputs.parts(fixture), inputs.all_parts)


def _memory(p: Mapping[str, float]) -> float:
    return p["mech_hit.memory"] + p["mech_hit.window"]


PROPOSITIONS = (
    Proposition(
        "mech_hit",
        ("fixture",),
        lambda p: p["mech_hit.window"],
        (HIT_FORCE, MOVING_RATE, PUSH_WINDOW, MEMORY),
        mech_hit,
        margin=mech_hit_margin,
        evidence=mech_hit_evidence,
        excess=mech_hit_excess,
        lacks=grounding.door,
        reads=_reads,
    ),
    Proposition(
        "retract",
        ("fixture",),
        lambda p: max(_memory(p), p["retract.window"]),
        (RETRACT_SHARE, RETRACT_WINDOW),
        retract,
        act=True,
        margin=retract_margin,
        lacks=grounding.door,
        reads=_reads,
    ),
    Proposition(
        "recovered",
        ("fixture",),
        lambda p: _memory(p) + p["recovered.window"],
        (SAFE_SHARE, SAFE_WINDOW),
        recovered,
        margin=recovered_margin,
        lacks=grounding.door,
        reads=_reads,
    ),
)
