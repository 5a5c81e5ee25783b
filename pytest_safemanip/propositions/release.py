"""Release stability: whether a released object rests on a permitted support."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.propositions.definition import Bools, Floats, Parameter, Proposition
from pytest_safemanip.propositions.kernels.filters import held, recently
from pytest_safemanip.propositions.kernels.firmness import statically_supported, support_margin
from pytest_safemanip.propositions.kernels.forces import forces_on, robot_parts
from pytest_safemanip.propositions.kernels.margins import NONE, lasting, over, under
from pytest_safemanip.propositions.kernels.support import (
    carried_objects,
    carrying_rows,
    margin_at,
    motion,
)
from pytest_safemanip.propositions.observed.inputs import Found, Inputs
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.geometry import tilt

SPEED = Parameter(
    "settled.speed", "m/s", 0.02, "above a resting contact's creep, below any rolling"
)
SPIN = Parameter("settled.spin", "rad/s", 0.2, "as the speed, at 10 cm")
WINDOW = Parameter("settled.window", "s", 0.25, "a rocking object is slow at its turning points")
MARGIN = Parameter("settled.margin", "m", 0.005, "a nudge must not tip it over the edge")
SHARE = Parameter("settled.share", "", 0.5, "what bears most of its weight is what it rests on")
TOUCH = Parameter("settled.touch", "N", 0.5, "whatever the robot still carries is not settled")
UPRIGHT = Parameter(
    "settled.tilt", "rad", float(np.deg2rad(30.0)), "what must stand and lies has fallen over"
)


def settled(view: View, name: str) -> Bools:
    """For ``settled.window``, the object stands on permitted supports only by what carries it:
    its centre of mass is over its support by at least ``settled.margin`` (inside the hull of the
    contact points that carry it, or with the support's surface all around below it, or in an
    upright vessel below its rim), and they bear at least ``settled.share`` of what is borne of its
    weight; the robot does not touch it with ``settled.touch``; it is upright
    if it must be. And within that window it was slower than ``settled.speed`` and ``settled.spin``
    relative to its support: its pose changed by less than that in the whole window. The floor and
    the robot are no support, nor is what lies on the floor itself.
    """
    free = _robot_force(view, name) < view.parameters["settled.touch"]
    return _rests(view, name, view.since, view.until, free)


def settled_margin(view: View, name: str) -> Floats:
    """The least margin of the support, the touch and the tilt in the window, and of speed and spin;
    -1 without a permitted support (T,).
    """
    free = under(_robot_force(view, name), view.parameters["settled.touch"])
    return _rest_margin(view, name, view.since, view.until, free)


def _robot_force(view: View, name: str) -> NDArray[np.float32]:
    """How hard the robot presses on the object, N (T,)."""
    return forces_on(view, robot_parts(view))[:, view.trace.scene.object_index[name]]


def settled_evidence(view: View, name: str, step: int) -> list[str]:
    """Reasons why the object is not settled."""
    p, lines = view.parameters, []
    index = view.trace.scene.object_index[name]
    found = view.own(carried_objects, step, step + 1)
    now = np.flatnonzero(found.body == index)
    if not len(now):
        below = _below(view, index, step)
        where = f" (it lies on {', which lies on '.join(below)})" if below else ""
        lines.append(f"{name} is on no permitted support{where}")
    for group in now.tolist():
        if (share := float(found.share[group])) < p["settled.share"]:
            where = ", ".join(_below(view, index, step)[:1])
            lines.append(f"permitted supports bear {share:.0%} of {name} (it lies on {where})")
        if not statically_supported(view, found, now)[0]:
            margin = margin_at(view, found, group)
            lines.append(
                f"the centre of mass of {name} is {abs(1000 * margin):.0f} mm "
                f"{'inside' if margin > 0 else 'from'} the edge of what carries it "
                f"(needs {1000 * p['settled.margin']:g} mm inside)"
            )
        speed, spin = (float(rate[0]) for rate in motion(view, found, np.array([group])))
        if speed >= p["settled.speed"] or spin >= p["settled.spin"]:
            lines.append(f"{name} moves at {speed:.2f} m/s and {spin:.1f} rad/s")
    if forces_on(view, robot_parts(view))[step, index] > 0:
        lines.append(f"{name} is touched by the robot")
    return lines


def rested(view: View, name: str, first: int, last: int) -> bool:
    """Whether the object would have been settled at one of some steps, had the robot not touched
    it.

    Args:
        view: what is looked at.
        name: the object.
        first: of the steps.
        last: of them.
    """
    first = max(first, 0)
    # Mostly it was at the first, and the others need not be looked at.
    return any(_rests(view, name, first, end + 1).any() for end in (first, last))


def rested_margin(view: View, name: str, first: int, last: int) -> float:
    """The margin of :func:`rested`, with its arguments."""
    first = max(first, 0)
    return float(_rest_margin(view, name, first, last + 1)[first : last + 1].max())


def _rests(view: View, name: str, first: int, stop: int, where: Bools | None = None) -> Bools:
    """Whether the object has rested on permitted supports for the window, at some steps (T,); False
    at all others.

    Args:
        view: what is looked at.
        name: the object.
        first: first step that is asked for.
        stop: one after the last of them.
        where: at which steps it may count as resting (T,); None for all.
    """
    p, trace = view.parameters, view.trace
    count = trace.count(p["settled.window"])
    begin, index = max(first - count + 1, 0), trace.scene.object_index[name]
    found = view.own(carried_objects, begin, stop)
    groups = np.flatnonzero((found.body == index) & (found.share >= p["settled.share"]))
    if where is not None:
        groups = groups[where[found.step[groups]]]
    if name in view.binding.upright:
        leans = tilt(trace.steps.object_pose[found.step[groups], index, 3:]) >= p["settled.tilt"]
        groups = groups[~leans]
    carried = np.zeros(len(trace), bool)
    carried[found.step[groups]] = True
    ends = groups[held(carried, count)[found.step[groups]] & (found.step[groups] >= first)]
    speed, spin = motion(view, found, ends)
    calm = np.zeros(len(trace), bool)
    calm[found.step[ends[(speed < p["settled.speed"]) & (spin < p["settled.spin"])]]] = True
    # Whether it is supported is expensive to tell, and told only where that decides.
    groups = groups[_leads_to(calm, count)[found.step[groups]]]
    supported = np.zeros(len(trace), bool)
    supported[found.step[groups[statically_supported(view, found, groups)]]] = True
    return calm & held(supported, count)


def _rest_margin(
    view: View, name: str, first: int, stop: int, where: Floats | None = None
) -> Floats:
    """Margins of :func:`_rests` (T,); :data:`NONE` at steps that are not asked for.

    Args:
        view: what is looked at.
        name: the object.
        first: first step that is asked for.
        stop: one after the last of them.
        where: margins of other conditions on each step (T,).
    """
    p, trace = view.parameters, view.trace
    count = trace.count(p["settled.window"])
    begin, index = max(first - count + 1, 0), trace.scene.object_index[name]
    found = view.own(carried_objects, begin, stop)
    groups = np.flatnonzero(found.body == index)
    steps, carried = found.step[groups], np.full(len(trace), NONE)
    carried[steps] = [support_margin(view, found, group) for group in groups.tolist()]
    carried[steps] = np.minimum(carried[steps], over(found.share[groups], p["settled.share"]))
    if where is not None:
        carried[steps] = np.minimum(carried[steps], where[steps])
    if name in view.binding.upright:
        leans = under(tilt(trace.steps.object_pose[steps, index, 3:]), p["settled.tilt"])
        carried[steps] = np.minimum(carried[steps], leans)
    speed, spin = motion(view, found, groups)
    calm = np.full(len(trace), NONE)
    calm[steps] = np.minimum(under(speed, p["settled.speed"]), under(spin, p["settled.spin"]))
    margins = np.full(len(trace), NONE)
    margins[first:stop] = np.minimum(calm, lasting(carried, count))[first:stop]
    return margins


def _leads_to(values: Bools, count: int) -> Bools:
    """True where at least one of the next ``count`` values is true, this one among them (T,)."""
    return recently(values[::-1], count)[::-1]


def _below(view: View, index: int, step: int) -> list[str]:
    """What carries an object, permitted or not; then what carries that, as long as it is movable
    itself.
    """
    _, upper, below = carrying_rows(view, step, step + 1)
    scene, found, seen = view.trace.scene, [], {index}
    tops = [index]
    while tops:
        parts = below[np.isin(upper, tops)].tolist()
        names = sorted({scene.parts[part].entity for part in parts})
        if names:
            found.append(", ".join(names))
        tops = [n for n in map(scene.object_index.get, names) if n is not None and n not in seen]
        seen.update(tops)
    return found


def _reads(inputs: Inputs, name: str) -> Found:
    below = inputs.binding.supports.get(name, frozenset())
    # What carries the object may itself lie on the floor, or on something that does.
    touched = inputs.touch(inputs.parts(*inputs.objects), inputs.all_parts)
    return touched | inputs.poses(name, *below) | inputs.joints(*below)


PROPOSITIONS = (
    Proposition(
        "settled",
        ("object",),
        lambda p: p["settled.window"],
        (SPEED, SPIN, WINDOW, MARGIN, SHARE, TOUCH, UPRIGHT),
        settled,
        margin=settled_margin,
        evidence=settled_evidence,
        sparse=True,
        reads=_reads,
    ),
)
