"""Letting go: what opens a hand is known before it opens, and so is what would become of what it
holds.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_safemanip.propositions.definition import Floats
from pytest_safemanip.propositions.forecasts.motion import Told, speed
from pytest_safemanip.propositions.grasp import pressed, pressed_by
from pytest_safemanip.propositions.kernels.solids import solids
from pytest_safemanip.propositions.precondition import conditions
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.geometry import to_world
from pytest_safemanip.trace.planar import hull_margin

GRAVITY = 9.81
SLIDE = 0.2
"""Friction that is counted on where something is let go while it moves."""


def opens(view: View, told: Told, name: str) -> bool:
    """Whether a gripper that holds an object is told to open at the next step."""
    return any(
        told.commands[hand] < 0.0 and pressed_by(view, name, hand)[-1]
        for hand in range(len(view.trace.scene.grippers))
    )


def released_in(view: View, told: Told, name: str) -> float:
    """Seconds until an object is let go: half of the vote over contacts after the hand is told to
    open.
    """
    if not opens(view, told, name):
        return math.inf
    return 0.5 * view.parameters["obj_grasped.window"]


def grasped_in(view: View, told: Told, name: str) -> float:
    """Seconds until an object is grasped or no longer grasped: half of the vote over contacts after
    fingers press on it, or the hand is told to open.
    """
    vote = 0.5 * view.parameters["obj_grasped.window"]
    if view("obj_grasped", name)[-1]:
        return vote if opens(view, told, name) else math.inf
    return vote if pressed(view, name)[-1] else math.inf


def unstable_in(view: View, told: Told, name: str) -> float | None:
    """When a firm grasp begins, as :func:`grasped_in`; when it ends its margin says."""
    if view("obj_grasped", name)[-1]:
        return None
    return grasped_in(view, told, name)


def onset_in(view: View, told: Told, skill: str, entity: str) -> float:
    """Seconds until a skill starts: ``pick`` and ``place`` as the grasp begins and ends."""
    if skill == "place":
        return released_in(view, told, entity)
    if skill == "pick" and not view("obj_grasped", entity)[-1]:
        return grasped_in(view, told, entity)
    return math.inf


def unsafe_in(view: View, told: Told, skill: str, entity: str) -> float:
    """0 where the conditions of a skill that is about to start do not hold now; inf elsewhere."""
    if onset_in(view, told, skill, entity) == math.inf:
        return math.inf
    now = len(view.trace) - 1
    return math.inf if all(c.holds for c in conditions(view, skill, entity, now)) else 0.0


def settled_in(view: View, told: Told, name: str) -> float:
    """Seconds until an object that is let go now will have come to rest: inf if what is below it is
    no permitted support, is farther below than things may be dropped (``pre_safe.drop``), or does
    not reach around its centre of mass and as far as it slides.
    """
    now, p = len(view.trace) - 1, view.parameters
    place = tuple(conditions(view, "place", name, now))
    if not all(check.holds for check in place):
        return math.inf
    index = view.trace.scene.object_index[name]
    pose = np.asarray(view.trace.steps.object_pose[:, index], float)
    com = to_world(pose, view.trace.scene.bodies[index].com)
    velocity = speed(view, com)[:2]
    fall = math.sqrt(2.0 * p["pre_safe.drop"] / GRAVITY)
    rate = float(np.linalg.norm(velocity))
    slides = velocity * rate / (2.0 * SLIDE * GRAVITY)
    end = com[-1, :2] + velocity * fall + slides
    if not _carried(view, name, com[-1, :2]) or not _carried(view, name, end):
        return math.inf
    return fall + rate / (SLIDE * GRAVITY) + p["settled.window"]


def _carried(view: View, name: str, place: Floats) -> bool:
    """Whether permitted supports reach around a place (2,) below an object."""
    p, now = view.parameters, len(view.trace) - 1
    allowed = view.binding.supports.get(name, frozenset())
    turns = np.arange(8) * (np.pi / 4.0)
    rim = p["settled.margin"] * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    below = solids(view, name, now, (place, p["settled.margin"]), allowed).boxes
    return all(
        any(hull_margin(box[:, :2], point) >= 0.0 for box in below)
        for point in np.concatenate((place[None], place + rim))
    )
