"""Small recordings on which propositions are looked at."""

from __future__ import annotations

import dataclasses

import numpy as np

from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.elements import Box, Entity, Switch
from pytest_safemanip.trace.geometry import multiply
from tests import toy

CATALOGUE = Catalogue()
BINDING = Binding(
    objects=("mug", "apple"),
    enclosures=("cabinet",),
    mechanisms=("cabinet",),
    placements=(("mug", "cabinet"), ("apple", "cabinet")),
    touch=frozenset({("mug", "body"), ("apple", "body"), ("cabinet", "door")}),
    supports={
        "mug": frozenset({"counter", "cabinet"}),
        "apple": frozenset({"counter", "cabinet"}),
    },
    attributes={"mug": frozenset({"raw"}), "apple": frozenset({"ready_to_eat"})},
)
KITCHEN = dataclasses.replace(
    toy.SCENE,
    entities=(*toy.SCENE.entities, Entity("sink", "fixture", "Sink")),
    boxes=(*toy.SCENE.boxes, Box("sink", "water", "water", (0.02, 0.02, 0.2))),
    switches=(Switch("sink", "water", "water"),),
)
"""The toy's world with a tap above the counter."""
TAP = (0.4, 0.0, 1.0)
UP = (0.0, 0.0, 1.0)


def tap(runs, place=TAP):
    """The tap of the kitchen over time: whether it runs, and where its water falls."""
    boxes = np.repeat(toy.at_rest().box_pose[None], len(runs), axis=0)
    water = np.tile(np.float32((*place, *toy.UPRIGHT)), (len(runs), 1, 1))
    switch = np.asarray(runs, np.float32)[:, None]
    return {"box_pose": np.concatenate((boxes, water), axis=1), "switch": switch}


def touch(steps, a, b, force=2.0, normal=UP, at=toy.PLACE, sustained=None):
    """A contact at some steps.

    Args:
        steps: when.
        a: part, as ``entity/part``.
        b: the other one.
        force: at the end of the step, N.
        normal: from the first to the second part.
        at: its place, or one for each step.
        sustained: the largest mean within the step, N; the same if there is none.
    """
    sustained = force if sustained is None else sustained
    places = np.broadcast_to(at, (len(steps), 3)).tolist()
    return [
        (step, a, b, force, normal, place, sustained)
        for step, place in zip(steps, places, strict=True)
    ]


def grip(steps, name="mug", left=10.0, right=10.0):
    """Both finger groups press on an object."""
    return [
        *touch(steps, "robot/finger_left", f"{name}/body", left, (1, 0, 0)),
        *touch(steps, "robot/finger_right", f"{name}/body", right, (-1, 0, 0)),
    ]


def rest(steps, name="mug", on="counter/body", at=toy.PLACE):
    """An object lies on something."""
    return touch(steps, on, f"{name}/body", 3.0, at=at)


def film(length, *rows, scene=toy.SCENE, dt=toy.DT, tail=0, **changed):
    """A recording with these contacts and arrays; what has a twist or a rate moves by it."""
    changed = in_motion(length, dt, **changed)
    found = sorted((row for group in rows for row in group), key=lambda row: row[0])
    scene = dataclasses.replace(scene, control_period=dt)
    return toy.recording(length, tail, scene, contacts=toy.contacts(*found, scene=scene), **changed)


def in_motion(length, dt, **changed):
    """Arrays in which poses, openness and openings change by the twists and rates given."""
    still = arrays(length)
    if "object_twist" in changed:
        way = np.cumsum(changed["object_twist"], axis=0) * dt
        way -= way[:1]
        poses = np.array(changed.get("object_pose", still.object_pose), float)
        poses[..., :3] += way[..., :3]
        angle = np.linalg.norm(way[..., 3:], axis=-1, keepdims=True)
        axis = way[..., 3:] / np.maximum(angle, 1e-12)
        turn = np.concatenate((np.cos(angle / 2), np.sin(angle / 2) * axis), axis=-1)
        poses[..., 3:] = multiply(turn, poses[..., 3:])
        changed["object_pose"] = poses.astype(np.float32)
    for name in {"joint", "gripper"} & changed.keys():
        changed[name] = np.array(changed[name], np.float32)
        way = np.cumsum(changed[name][..., 1], axis=0) * dt
        changed[name][..., 0] += way - way[:1]
    return changed


def look(recording, parameters=None, **binding):
    """The recording as propositions see it."""
    values = CATALOGUE.parameters(parameters or {})
    return View(recording.trace, dataclasses.replace(BINDING, **binding), values, CATALOGUE)


def true_at(values):
    """The steps at which a proposition is true."""
    return np.flatnonzero(values).tolist()


def moved(name, places, length=None):
    """Object poses: one object at these places (T, 3), the other one where it was."""
    places = np.atleast_2d(np.asarray(places, float))
    if length is not None:
        places = np.repeat(places, length, axis=0)
    poses = np.repeat(toy.at_rest().object_pose[None], len(places), axis=0)
    poses[:, toy.SCENE.object_index[name], :3] = places
    return poses


def along(array, steps, column, value):
    """A copy with one column changed at some steps."""
    changed = array.copy()
    changed[(np.asarray(steps, int), *np.atleast_1d(column))] = value
    return changed


def arrays(length):
    """The steps of a recording in which nothing happens."""
    return toy.recording(length).steps


def turned(radians, axis=(1.0, 0.0, 0.0)):
    """A quaternion."""
    return (np.cos(radians / 2), *(np.sin(radians / 2) * np.asarray(axis)))
