"""Release stability: does an object rest where it may, once nobody holds it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.contact import object_parts, robot_force
from pytest_safemanip.propositions.definition import Bools, Parameter, Proposition
from pytest_safemanip.propositions.filters import held
from pytest_safemanip.propositions.solids import solids
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.geometry import tilt, to_world
from pytest_safemanip.trace.kinematics import opening_direction
from pytest_safemanip.trace.planar import hull_margin

SPEED = Parameter("settled.speed", "m/s", 0.02, "above the solver's jitter, below any rolling")
SPIN = Parameter("settled.spin", "rad/s", 0.2, "as the speed, at 10 cm")
WINDOW = Parameter("settled.window", "s", 0.25, "a rocking object is slow at its turning points")
MARGIN = Parameter("settled.margin", "m", 0.005, "a nudge must not tip it over the edge")
TOUCH = Parameter("settled.touch", "N", 0.5, "whatever the robot still carries is not settled")
UPRIGHT = Parameter(
    "settled.tilt", "rad", float(np.deg2rad(30.0)), "what must stand and lies has fallen over"
)
SAME_LEVEL = 0.01
"""How far a surface may be above or below a contact point to be what is touched there, m."""
UPWARD = 0.5
"""Vertical share of a contact normal from which it carries: 30 degrees from the horizontal up."""


def settled(view: View, name: str) -> Bools:
    """For ``settled.window``, the object stands on permitted supports only by what carries it:
    its centre of mass is over its support by at least ``settled.margin`` (inside the hull of the
    contact points that carry it, or with the support's surface all around below it); it is slower
    than ``settled.speed`` and ``settled.spin`` relative to its support; the robot does not touch
    it with ``settled.touch``; it is upright if it must be. The floor and the robot are no support.
    """
    return held(_settled_now(view, name), view.trace.count(view.parameters["settled.window"]))


def settled_evidence(view: View, name: str, step: int) -> list[str]:
    """What keeps the object from being settled."""
    p = view.parameters
    margin, speed, spin = _resting(view, name, np.array([step]))
    lines = []
    if np.isinf(margin[0]):
        below = sorted({support for support, _ in _carriers(view, name).get(step, ())})
        where = f" (it lies on {', '.join(below)})" if below else ""
        lines.append(f"{name} is on no permitted support{where}")
    elif margin[0] < p["settled.margin"]:
        lines.append(
            f"the centre of mass of {name} is {abs(1000 * margin[0]):.0f} mm "
            f"{'inside' if margin[0] > 0 else 'from'} the edge of what carries it "
            f"(needs {1000 * p['settled.margin']:g} mm inside)"
        )
    if np.isfinite(speed[0]) and (speed[0] >= p["settled.speed"] or spin[0] >= p["settled.spin"]):
        lines.append(f"{name} moves at {speed[0]:.2f} m/s and {spin[0]:.1f} rad/s")
    if robot_force(view, name)[step] > 0:
        lines.append(f"{name} is touched by the robot")
    return lines


def rests(view: View, name: str) -> Bools:
    """As :func:`settled`, whether or not the robot touches it."""
    return held(_lies_still(view, name), view.trace.count(view.parameters["settled.window"]))


@pointwise
def _settled_now(view: View, name: str) -> Bools:
    untouched = robot_force(view, name) < view.parameters["settled.touch"]
    return np.asarray(_lies_still(view, name) & untouched)


@pointwise
def _lies_still(view: View, name: str) -> Bools:
    p, trace = view.parameters, view.trace
    upright = np.ones(len(trace), bool)
    index = trace.scene.object_index[name]
    if name in view.binding.upright:
        upright = tilt(trace.steps.object_pose[:, index, 3:]) < p["settled.tilt"]
    steps = np.flatnonzero(upright)
    margin, speed, spin = _resting(view, name, steps)
    calm = (speed < p["settled.speed"]) & (spin < p["settled.spin"])
    result = np.zeros(len(trace), bool)
    result[steps] = calm & (margin >= p["settled.margin"])
    return result


def _resting(
    view: View, name: str, steps: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Support margin (m), relative speed (m/s) and spin (rad/s) at some steps.

    The margin is minus infinity where no permitted support carries the object.
    """
    trace, allowed = view.trace, view.binding.supports.get(name, frozenset())
    index = trace.scene.object_index[name]
    com = to_world(trace.steps.object_pose[:, index], trace.scene.bodies[index].com)
    twist = trace.steps.object_twist[:, index]
    needed = view.parameters["settled.margin"]
    margin = np.full(len(steps), -np.inf)
    speed, spin = np.full(len(steps), np.inf), np.full(len(steps), np.inf)
    carriers = _carriers(view, name)
    for k, step in enumerate(steps.tolist()):
        points, moving = [], []
        for support, row in carriers.get(step, ()):
            if support in allowed:
                points.append(trace.steps.contacts.position[row])
                moving.append(_support_velocity(view, name, row, step))
        if not points:
            continue
        margin[k] = hull_margin(np.array(points)[:, :2], com[step, :2])
        if margin[k] < needed and _ground_around(view, name, com[step], points, step):
            margin[k] = needed
        relative = twist[step] - np.mean(moving, axis=0)
        speed[k], spin[k] = np.linalg.norm(relative[:3]), np.linalg.norm(relative[3:])
    return margin, speed, spin


def _ground_around(
    view: View,
    name: str,
    com: NDArray[np.float64],
    points: list[NDArray[np.float32]],
    step: int,
) -> bool:
    """Whether permitted supports reach around below the centre of mass, by the margin.

    A ball touches its support in one point, a can on its side in a line: their contact hull has
    no inside, yet they do not fall as long as the surface goes on around them.
    """
    allowed = view.binding.supports.get(name, frozenset())
    level = float(np.mean([point[2] for point in points]))
    margin = view.parameters["settled.margin"]
    tops = [
        box[:, :2]
        for _, box in solids(view, name, step, (com, margin), allowed)
        if abs(box[:, 2].max() - level) < SAME_LEVEL
    ]
    if any(hull_margin(top, com[:2]) >= margin for top in tops):
        return True  # one surface alone reaches far enough
    turns = np.arange(8) * (np.pi / 4.0)
    around = margin * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    return all(any(hull_margin(top, place) >= 0.0 for top in tops) for place in com[:2] + around)


def _carriers(view: View, name: str) -> dict[int, list[tuple[str, int]]]:
    """(entity, contact row) of what carries the object, by step."""
    contacts, parts = view.trace.steps.contacts, view.trace.scene.parts
    own = view.shared(_own, name)
    is_a, is_b = own[contacts.a], own[contacts.b]
    # The normal points from a to b: up if the lower side is a.
    lift = np.where(is_b, contacts.normal[:, 2], -contacts.normal[:, 2])
    rows = np.flatnonzero((is_a != is_b) & (contacts.force > 0) & (lift >= UPWARD))
    found: dict[int, list[tuple[str, int]]] = {}
    for row in rows.tolist():
        below = contacts.a[row] if is_b[row] else contacts.b[row]
        found.setdefault(int(contacts.step[row]), []).append((parts[below].entity, row))
    return found


def _own(view: View, name: str) -> Bools:
    """Which parts are the object's (parts,)."""
    own = object_parts(view, name)
    return np.array([part in own for part in range(len(view.trace.scene.parts))], bool)


def _support_velocity(view: View, name: str, row: int, step: int) -> NDArray[np.float64]:
    """Twist of the supporting part, as far as it moves the object (6,)."""
    trace, contacts = view.trace, view.trace.steps.contacts
    a, b = trace.scene.parts[contacts.a[row]], trace.scene.parts[contacts.b[row]]
    part = a if b.entity == name else b
    if part.entity in trace.scene.object_index:
        twist = trace.steps.object_twist[step, trace.scene.object_index[part.entity]]
        return np.asarray(twist, np.float64)
    result = np.zeros(6)
    if part.joint:
        joint = trace.scene.joints[trace.scene.joint_index[part.joint]]
        rate = float(trace.steps.joint[step, trace.scene.joint_index[part.joint], 1])
        if joint.kind == "slide":
            result[:3] = opening_direction(joint, contacts.position[row]) * joint.travel * rate
    return result


PROPOSITIONS = (
    Proposition(
        "settled",
        ("object",),
        lambda p: p["settled.window"],
        (SPEED, SPIN, WINDOW, MARGIN, TOUCH, UPRIGHT),
        settled,
        evidence=settled_evidence,
    ),
)
