"""A kitchen for hazards: beside the toy's mug and apple a knife and a pan; a stove, an oven, a tap;
water in the pan; a camera in front.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from pytest_safemanip.propositions.binding import Binding, Zone
from pytest_safemanip.propositions.view import View
from pytest_safemanip.trace.elements import (
    Body,
    Box,
    Camera,
    Entity,
    Liquid,
    Part,
    Surface,
    Switch,
)
from tests import toy
from tests.propositions.stage import CATALOGUE, film

UP = toy.UPRIGHT
ADDED = {
    "knife": ((0.1, 0.015, 0.01), (-0.03, 0.0, 0.0), (-0.5, 0.3, 0.91)),
    "pan": ((0.12, 0.12, 0.03), (0.0, 0.0, 0.0), (-0.6, -0.1, 0.93)),
}
"""Half extents, centre of mass and place of what is added."""
DROPS = np.array([(-0.6 + 0.01 * n, -0.1, 0.92) for n in range(10)])
BOXES = ("interior", "left", "inside", "spout")
PLACES = {
    "left": (-0.2, 0.2, 1.0),
    "inside": (0.7, 0.3, 1.05),
    "spout": (-0.9, 0.3, 0.9),
}
"""Of the burner, the oven's interior and where the coffee machine pours."""
SCENE = dataclasses.replace(
    toy.SCENE,
    entities=(
        *toy.SCENE.entities,
        Entity("stove", "fixture", "Stove"),
        Entity("oven", "fixture", "ToasterOven"),
        Entity("coffee", "fixture", "CoffeeMachine"),
        Entity("blender", "fixture", "Blender"),
        Entity("floor", "room", "Floor"),
        Entity("water", "liquid", "water"),
        *(Entity(name, "object", name) for name in ADDED),
    ),
    bodies=(
        *toy.SCENE.bodies,
        *(Body(n, half, (0.0, 0.0, 0.0), com, 0.2) for n, (half, com, _) in ADDED.items()),
    ),
    parts=(
        *toy.SCENE.parts,
        Part("floor", "body"),
        Part("stove", "body"),
        *(Part(name, "body") for name in ADDED),
    ),
    boxes=(
        *toy.SCENE.boxes,
        Box("stove", "left", "burner", (0.08, 0.08, 0.1)),
        Box("oven", "inside", "interior", (0.15, 0.15, 0.1)),
        Box("coffee", "spout", "poured", (0.04, 0.04, 0.0)),
    ),
    switches=(
        Switch("stove", "left", "burner"),
        Switch("oven", "power", "appliance"),
        Switch("coffee", "power", "appliance"),
        Switch("blender", "power", "appliance"),
    ),
    surfaces=(
        *toy.SCENE.surfaces,
        Surface("stove", "", (0.2, 0.2, 0.01), (-0.2, 0.2, 0.89, *UP)),
        Surface("oven", "", (0.2, 0.2, 0.01), (0.7, 0.3, 0.93, *UP)),
        Surface("oven", "", (0.2, 0.2, 0.01), (0.7, 0.3, 1.17, *UP)),
        Surface("cabinet", "cabinet/hinge", (0.3, 0.01, 0.3), (0.0, 0.4, 1.5, *UP)),
    ),
    cameras=(Camera("front", 1.2, 1.5),),
    liquids=(Liquid("water", len(DROPS), 0.005),),
)
STOVE, OVEN, COFFEE, BLENDER = range(4)
"""Places on the switch axis."""
BINDING = Binding(
    objects=("mug", "apple", "knife", "pan"),
    touch=frozenset({("mug", "body")}),
    supports={"mug": frozenset({"counter", "cabinet"})},
    attributes={
        "mug": frozenset({"container", "fragile"}),
        "apple": frozenset(),
        "knife": frozenset({"sharp"}),
        "pan": frozenset({"container", "metal"}),
        "stove": frozenset({"hot_source"}),
        "oven": frozenset({"hot_source", "electrical"}),
        "coffee": frozenset({"hot_source"}),
        "blender": frozenset({"electrical"}),
        "counter": frozenset(),
        "cabinet": frozenset(),
    },
    things=("mug", "apple", "knife", "pan"),
    fixtures=("counter", "cabinet", "stove", "oven", "coffee", "blender"),
    zones={"hob": Zone("stove", 0.1, 0.4), "around": Zone("mug", 0.05)},
)
EYE = (0.0, -2.0, 1.4, np.cos(np.pi / 4), np.sin(np.pi / 4), 0.0, 0.0)
"""A camera in front of the counter that looks along y."""


def poses(length):
    """Of all objects where they stand (T, 4, 7)."""
    added = [(*place, *UP) for _, _, place in ADDED.values()]
    now = np.concatenate((toy.at_rest().object_pose, np.array(added, np.float32)))
    return np.repeat(now[None], length, axis=0)


def kitchen(length, *rows, on=(), places=None, turns=None, scene=SCENE, **changed):
    """A recording in the kitchen.

    Args:
        length: steps.
        rows: contacts.
        on: switches that are on all the time, or (switch, steps).
        places: by object, where it is (3,) or (T, 3).
        turns: by object, its quaternion (4,) or (T, 4).
        scene: another one.
        changed: arrays.
    """
    pose = poses(length)
    for name, place in (places or {}).items():
        pose[:, SCENE.object_index[name], :3] = place
    for name, turn in (turns or {}).items():
        pose[:, SCENE.object_index[name], 3:] = turn
    switch = np.zeros((length, 4), np.float32)
    for one in on:
        which, steps = one if isinstance(one, tuple) else (one, slice(None))
        switch[steps, which] = 1.0
    boxes = [(0.0, 0.6, 1.5, *UP), *((*PLACES[name], *UP) for name in BOXES[1:])]
    still = {
        "object_pose": pose,
        "object_twist": np.zeros((length, 4, 6), np.float32),
        "switch": switch,
        "box_pose": np.tile(np.array(boxes, np.float32), (length, 1, 1)),
        "camera_pose": np.tile(np.float32(EYE), (length, 1, 1)),
        "particles": np.tile(DROPS.astype(np.float32), (length, 1, 1)),
    }
    return film(length, *rows, scene=scene, **{**still, **changed})


def see(recording, parameters=None, **binding):
    """The recording as propositions see it."""
    values = CATALOGUE.parameters(parameters or {})
    return View(recording.trace, dataclasses.replace(BINDING, **binding), values, CATALOGUE)


def hand_at(places):
    """Poses of the one hand at these places (T, 3)."""
    places = np.atleast_2d(np.asarray(places, float))
    return np.concatenate((places, np.tile(UP, (len(places), 1))), axis=1).astype(np.float32)
