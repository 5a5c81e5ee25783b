"""Other ways to write a recording, none of which changes what happened."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pytest_safemanip.trace.elements import ROBOT, Body, Entity, Part
from pytest_safemanip.trace.geometry import about, multiply, rotate
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.scene import Scene
from pytest_safemanip.trace.steps import ARRAYS, Contacts, Steps

Array = NDArray[Any]
POSES = ("eef_poses", "base_pose", "object_pose", "box_pose", "camera_pose")
TWISTS = ("eef_twists", "object_twist")

HANDS = ("eef_poses", "eef_twists", "openings", "commands")


def with_steps(recording: Recording, **changed: Any) -> Recording:
    """The recording with other arrays."""
    return dataclasses.replace(recording, steps=dataclasses.replace(recording.steps, **changed))


def with_contacts(recording: Recording, **columns: Any) -> Recording:
    """The recording with other columns of contacts."""
    return with_steps(recording, contacts=dataclasses.replace(recording.steps.contacts, **columns))


def swapped_sides(recording: Recording, random: np.random.Generator) -> Recording:
    """The recording with the sides of some contacts swapped."""
    contacts = recording.steps.contacts
    swap = random.random(len(contacts)) < 0.5
    return with_contacts(
        recording,
        a=np.where(swap, contacts.b, contacts.a),
        b=np.where(swap, contacts.a, contacts.b),
        normal=np.where(swap[:, None], -contacts.normal, contacts.normal),
    )


def negated_quaternions(recording: Recording, random: np.random.Generator) -> Recording:
    """The recording with ``-q`` for some quaternions ``q``: the same rotations."""
    changed = {}
    for name in POSES:
        poses = getattr(recording.steps, name).copy()
        poses[..., 3:] *= random.choice((-1.0, 1.0), (*poses.shape[:-1], 1))
        changed[name] = poses
    return with_steps(recording, **changed)


def other_name(entity: str) -> str:
    """The name of an entity in :func:`renamed`, which sorts differently."""
    return entity if entity == ROBOT else "".join(chr(219 - ord(c)) if "a" <= c <= "z" else c
                                                  for c in entity)  # fmt: skip


def renamed(recording: Recording, random: np.random.Generator) -> Recording:
    """Other names for all but the robot; objects, grippers, parts and contacts in another order."""
    scene, steps = recording.scene, recording.steps
    bodies = random.permutation(len(scene.bodies))
    parts = random.permutation(len(scene.parts))
    place = np.argsort(parts).astype(np.int32)
    contacts = steps.contacts
    order = np.lexsort((random.random(len(contacts)), contacts.step))
    rows = {f.name: getattr(contacts, f.name)[order] for f in dataclasses.fields(contacts)}
    rows |= {"a": place[rows["a"]], "b": place[rows["b"]]}
    hands = random.permutation(len(scene.grippers))
    changed = {
        **{name: getattr(steps, name)[:, hands] for name in HANDS},
        "object_pose": steps.object_pose[:, bodies],
        "object_twist": steps.object_twist[:, bodies],
        "contacts": Contacts(**rows),
    }
    named = _renamed_scene(scene, bodies.tolist(), parts.tolist())
    named = dataclasses.replace(named, grippers=tuple(scene.grippers[n] for n in hands))
    return with_steps(dataclasses.replace(recording, scene=named), **changed)


def _renamed_scene(scene: Scene, bodies: list[int], parts: list[int]) -> Scene:
    def name(item: Any) -> Any:
        changed = {"entity": other_name(item.entity)}
        if getattr(item, "joint", ""):
            owner, joint = item.joint.split("/", 1)
            changed["joint"] = f"{other_name(owner)}/{joint}"
        return dataclasses.replace(item, **changed)

    entities = [dataclasses.replace(e, name=other_name(e.name)) for e in reversed(scene.entities)]
    return dataclasses.replace(
        scene,
        entities=tuple(entities),
        bodies=tuple(name(scene.bodies[n]) for n in bodies),
        parts=tuple(name(scene.parts[n]) for n in parts),
        joints=tuple(map(name, scene.joints)),
        boxes=tuple(map(name, scene.boxes)),
        switches=tuple(map(name, scene.switches)),
        surfaces=tuple(map(name, reversed(scene.surfaces))),
        roles={role: other_name(entity) for role, entity in scene.roles.items()},
        liquids=tuple(map(name, scene.liquids)),
    )


def elsewhere(recording: Recording, angle: float, shift: tuple[float, float, float]) -> Recording:
    """The whole scene turned about the vertical axis, rad, and put elsewhere, m."""
    turn = about((0.0, 0.0, 1.0), angle)

    def place(points: ArrayLike) -> Array:
        return rotate(turn, points) + shift

    def pose(poses: ArrayLike) -> Array:
        poses = np.asarray(poses, float)
        turns = multiply(np.broadcast_to(turn, poses[..., 3:].shape), poses[..., 3:])
        return np.concatenate((place(poses[..., :3]), turns), axis=-1).astype(np.float32)

    scene, steps = recording.scene, recording.steps
    joints = [
        dataclasses.replace(
            j,
            axis=tuple(rotate(turn, j.axis).tolist()),
            anchor=tuple(place(j.anchor).tolist()),
            pose=tuple(pose(j.pose).tolist()),
        )
        for j in scene.joints
    ]
    surfaces = [dataclasses.replace(s, pose=tuple(pose(s.pose).tolist())) for s in scene.surfaces]
    changed: dict[str, Array] = {name: pose(getattr(steps, name)) for name in POSES}
    for name in TWISTS:
        twist = getattr(steps, name)
        parts = rotate(turn, twist[..., :3]), rotate(turn, twist[..., 3:])
        changed[name] = np.concatenate(parts, axis=-1).astype(np.float32)
    changed["particles"] = place(steps.particles).astype(np.float32)
    scene = dataclasses.replace(scene, joints=tuple(joints), surfaces=tuple(surfaces))
    moved = with_steps(dataclasses.replace(recording, scene=scene), **changed)
    return with_contacts(
        moved,
        position=place(steps.contacts.position).astype(np.float32),
        normal=rotate(turn, steps.contacts.normal).astype(np.float32),
    )


def with_stranger(recording: Recording) -> Recording:
    """The recording with one more object, on the floor of another room."""
    scene, length = recording.scene, len(recording.steps)
    name = "stranger"
    scene = dataclasses.replace(
        scene,
        entities=(*scene.entities, Entity(name, "object", "apple")),
        bodies=(*scene.bodies, Body(name, (0.04,) * 3, (0.0,) * 3, (0.0,) * 3, 0.2)),
        parts=(*scene.parts, Part(name, "body")),
    )
    place = np.array((97.0, 83.0, 0.04, 1.0, 0.0, 0.0, 0.0), np.float32)
    rest = np.zeros((length, 1, 6), np.float32)
    return with_steps(
        dataclasses.replace(recording, scene=scene),
        object_pose=np.concatenate(
            (recording.steps.object_pose, np.tile(place, (length, 1, 1))), axis=1
        ),
        object_twist=np.concatenate((recording.steps.object_twist, rest), axis=1),
    )


def at_period(recording: Recording, period: float) -> Recording:
    """The same steps at another control period (s)."""
    scene = dataclasses.replace(recording.scene, control_period=period)
    return dataclasses.replace(recording, scene=scene)


def lasting(recording: Recording, times: int, period: float) -> Recording:
    """The recording with each state repeated, at another control period (s)."""
    steps = recording.steps
    names = (*ARRAYS, "action", "success", "tail")
    arrays = {name: np.repeat(getattr(steps, name), times, axis=0) for name in names}
    columns = {
        f.name: np.repeat(getattr(steps.contacts, f.name), times, axis=0)
        for f in dataclasses.fields(Contacts)
    }
    columns["step"] = times * columns["step"] + np.arange(len(columns["step"])) % times
    order = np.argsort(columns["step"], kind="stable")
    contacts = {name: np.asarray(c[order], c.dtype) for name, c in columns.items()}
    contacts["step"] = contacts["step"].astype(np.int32)
    steps = Steps(**arrays, contacts=Contacts(**contacts))
    return at_period(dataclasses.replace(recording, steps=steps), period)
