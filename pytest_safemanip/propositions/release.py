"""Release stability: does an object rest where it may, once nobody holds it."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.propositions.definition import Bools, Parameter, Proposition
from pytest_safemanip.propositions.filters import held
from pytest_safemanip.propositions.firmness import firm
from pytest_safemanip.propositions.forces import forces_on
from pytest_safemanip.propositions.support import carried_objects, carrying_rows, margin_at
from pytest_safemanip.propositions.view import View, pointwise
from pytest_safemanip.trace.elements import ROBOT
from pytest_safemanip.trace.geometry import tilt

SPEED = Parameter("settled.speed", "m/s", 0.02, "above the solver's jitter, below any rolling")
SPIN = Parameter("settled.spin", "rad/s", 0.2, "as the speed, at 10 cm")
WINDOW = Parameter("settled.window", "s", 0.25, "a rocking object is slow at its turning points")
MARGIN = Parameter("settled.margin", "m", 0.005, "a nudge must not tip it over the edge")
TOUCH = Parameter("settled.touch", "N", 0.5, "whatever the robot still carries is not settled")
UPRIGHT = Parameter(
    "settled.tilt", "rad", float(np.deg2rad(30.0)), "what must stand and lies has fallen over"
)


def settled(view: View, name: str) -> Bools:
    """For ``settled.window``, the object stands on permitted supports only by what carries it:
    its centre of mass is over its support by at least ``settled.margin`` (inside the hull of the
    contact points that carry it, or with the support's surface all around below it, or in an
    upright vessel below its rim); it is slower than ``settled.speed`` and ``settled.spin`` relative
    to its support; the robot does not touch it with ``settled.touch``; it is upright if it must
    be. The floor and the robot are no support.
    """
    now = _settled_now(view)[:, view.trace.scene.object_index[name]]
    return held(now, view.trace.count(view.parameters["settled.window"]))


def settled_evidence(view: View, name: str, step: int) -> list[str]:
    """What keeps the object from being settled."""
    p, lines = view.parameters, []
    index, found = view.trace.scene.object_index[name], carried_objects(view)
    now = np.flatnonzero((found.body == index) & (found.step == step))
    if not len(now):
        below = sorted(_below(view, index, step))
        where = f" (it lies on {', '.join(below)})" if below else ""
        lines.append(f"{name} is on no permitted support{where}")
    for group in now.tolist():
        if not firm(view, found, now)[0]:
            margin = margin_at(view, found, group)
            lines.append(
                f"the centre of mass of {name} is {abs(1000 * margin):.0f} mm "
                f"{'inside' if margin > 0 else 'from'} the edge of what carries it "
                f"(needs {1000 * p['settled.margin']:g} mm inside)"
            )
        speed, spin = found.speed[group], found.spin[group]
        if speed >= p["settled.speed"] or spin >= p["settled.spin"]:
            lines.append(f"{name} moves at {speed:.2f} m/s and {spin:.1f} rad/s")
    if forces_on(view, ROBOT)[step, index] > 0:
        lines.append(f"{name} is touched by the robot")
    return lines


def rests(view: View, name: str) -> Bools:
    """As :func:`settled`, whether or not the robot touches it."""
    now = _lies_still(view)[:, view.trace.scene.object_index[name]]
    return held(now, view.trace.count(view.parameters["settled.window"]))


@pointwise
def _settled_now(view: View) -> Bools:
    """Whether each object stands on permitted supports at this very step (T, N)."""
    untouched = forces_on(view, ROBOT) < view.parameters["settled.touch"]
    return np.asarray(_lies_still(view) & untouched)


@pointwise
def _lies_still(view: View) -> Bools:
    """The same, whether or not the robot touches it (T, N)."""
    p, trace = view.parameters, view.trace
    upright = np.ones((len(trace), len(trace.scene.bodies)), bool)
    for name in view.binding.upright:
        index = trace.scene.object_index[name]
        upright[:, index] = tilt(trace.steps.object_pose[:, index, 3:]) < p["settled.tilt"]
    found = carried_objects(view)
    calm = (found.speed < p["settled.speed"]) & (found.spin < p["settled.spin"])
    groups = np.flatnonzero(calm & upright[found.step, found.body])
    groups = groups[firm(view, found, groups)]
    result = np.zeros(upright.shape, bool)
    result[found.step[groups], found.body[groups]] = True
    return result


def _below(view: View, index: int, step: int) -> set[str]:
    """What carries an object, permitted or not."""
    rows, upper, below = carrying_rows(view)
    now = (upper == index) & (view.trace.steps.contacts.step[rows] == step)
    return {view.trace.scene.parts[part].entity for part in below[now].tolist()}


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
