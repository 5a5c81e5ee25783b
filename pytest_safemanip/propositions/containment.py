"""Transfers: what is let go toward a receiver, and whether it ends up in it."""

from __future__ import annotations

import numpy as np

from pytest_safemanip.propositions.contact import object_parts
from pytest_safemanip.propositions.definition import Bools, Parameter, Proposition
from pytest_safemanip.propositions.filters import falling, held, majority, still
from pytest_safemanip.propositions.interiors import centre_within, holding_halves, place_in
from pytest_safemanip.propositions.view import View, pointwise

REACH = Parameter(
    "transfer.reach", "m", 0.1, "a gripper's width: what is let go this near was meant for it"
)
REST_WINDOW = Parameter("contained.window", "s", 0.25, "as for settled")
REST_DRIFT = Parameter(
    "contained.drift", "m", 0.005, "2 cm/s, the speed that settled allows, for 0.25 s"
)


def transfer(view: View, content: str, receiver: str) -> Bools:
    """The content leaves what carried it toward the receiver at this step: the robot's grasp of
    it ends, or it leaves the box of a container that the robot holds, or the robot lets go of that
    container, while the content's centre is above or inside the receiver's box, or beside it by
    less than ``transfer.reach``.
    """
    carried = view("obj_grasped", content)
    for body in view.trace.scene.bodies:
        if body.entity not in (content, receiver):
            within = centre_within(view, content, body.entity)
            if within.any():
                carried = carried | (within & view("obj_grasped", body.entity))
    near = np.zeros(len(view.trace), bool)
    for number, half in enumerate(holding_halves(view, receiver)):
        place = place_in(view, content, receiver, number)
        beside = np.linalg.norm(np.maximum(np.abs(place[:, :2]) - half[:2], 0.0), axis=1)
        near |= (beside < view.parameters["transfer.reach"]) & (place[:, 2] > -half[2])
    return np.asarray(falling(carried) & near)


def contained(view: View, content: str, receiver: str) -> Bools:
    """For ``contained.window``, the content is in the receiver: its centre is inside the receiver's
    box, or above that box while it touches the receiver in the majority of another such window (a
    plate is flat); it moved less than ``contained.drift`` in it from the beginning of the window
    to its end; the robot does not hold it.
    """
    trace, p = view.trace, view.parameters
    count = trace.count(p["contained.window"])
    touches = majority(_touch(view, content, receiver), count)
    rests = np.zeros(len(trace), bool)
    for number, half in enumerate(holding_halves(view, receiver)):
        place = place_in(view, content, receiver, number)
        over = (np.abs(place[:, :2]) <= half[:2]).all(axis=1) & (place[:, 2] >= -half[2])
        within = over & (touches | (place[:, 2] <= half[2]))
        rests |= still(place, count, p["contained.drift"]) & held(within, count)
    return rests & ~view("obj_grasped", content)


def contained_evidence(view: View, content: str, receiver: str, step: int) -> list[str]:
    """Where the content is, seen from the receiver."""
    lines = []
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


@pointwise
def _touch(view: View, content: str, receiver: str) -> Bools:
    parts = object_parts(view, content), object_parts(view, receiver)
    return np.asarray(view.trace.pair_table.force(*parts) > 0)


_PAIR = ("object", "entity")

PROPOSITIONS = (
    Proposition("transfer", _PAIR, lambda p: p["obj_grasped.window"], (REACH,), transfer, act=True),
    Proposition(
        "contained",
        _PAIR,
        lambda p: max(2.0 * p["contained.window"], p["obj_grasped.window"]),
        (REST_WINDOW, REST_DRIFT),
        contained,
        evidence=contained_evidence,
    ),
)
