"""What holds of every proposition, on recordings in which anything may happen."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_safemanip.propositions.catalogue import SHIPPED
from pytest_safemanip.trace import Contacts, Recording, Steps
from pytest_safemanip.trace.geometry import multiply, rotate
from tests import toy
from tests.propositions.stage import BINDING, CATALOGUE, KITCHEN, film, look, tap, turned

LENGTH = 40
QUICK = {
    "mech_hit.memory": 0.6,
    "retract.window": 0.2,
    "recovered.window": 0.15,
    "mech_hit.window": 0.2,
    "pre_safe.pick_window": 0.5,
    "stable_grasp.window": 0.4,
    "sanitized.window": 0.15,
    "contained.window": 0.1,
}
"""Windows short enough that recordings of two seconds are longer than any of them."""
SKILLS = (
    ("pick", "mug"),
    ("place", "mug"),
    ("open", "cabinet"),
    ("close", "cabinet"),
    ("pour", "mug"),
)
ARGUMENTS = {
    (): [()],
    ("object",): [("mug",), ("apple",)],
    ("fixture",): [("cabinet",)],
    ("object", "fixture"): [("mug", "cabinet")],
    ("skill", "entity"): SKILLS,
    ("object", "entity"): [("apple", "cabinet"), ("apple", "mug"), ("mug", "cabinet")],
    ("tool",): [("robot",), ("apple",)],
}
PAIRS = (
    ("robot/finger_left", "mug/body", 4.0, (1, 0, 0)),
    ("robot/finger_right", "mug/body", 4.0, (-1, 0, 0)),
    ("counter/body", "mug/body", 3.0, (0, 0, 1)),
    ("counter/body", "apple/body", 3.0, (0, 0, 1)),
    ("apple/body", "mug/body", 6.0, (0, 1, 0)),
    ("robot/finger_left", "apple/body", 1.0, (1, 0, 0)),
    ("robot/link5", "counter/body", 6.0, (0, 0, 1)),
    ("robot/finger_right", "counter/body", 2.1, (0, 0, 1)),
    ("robot/finger_left", "cabinet/door", 3.0, (0.8, 0.6, 0)),
    ("cabinet/door", "apple/body", 9.0, (0.8, 0.6, 0)),
)
seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=10, deadline=None)


def busy(seed, length=LENGTH, tail=0):
    """Everything comes and goes in stretches of a few steps."""
    random = np.random.default_rng(seed)

    def stretches(chance):
        raw = np.repeat(random.random(length) < chance, random.integers(1, 9, length))
        return np.flatnonzero(raw[:length]).tolist()

    rows = [
        [(step, a, b, force * random.uniform(0.9, 2.0), normal) for step in stretches(0.6)]
        for a, b, force, normal in PAIRS
    ]
    runs = np.repeat(random.random(length) < 0.5, 8)[:length]
    recording = film(length, *rows, tail=tail, scene=KITCHEN, **tap(runs))
    steps = recording.steps
    poses, eef = steps.object_pose.copy(), steps.eef_pose.copy()
    joint, gripper = steps.joint.copy(), steps.gripper.copy()
    walk = np.cumsum(random.normal(0.0, 0.15, (length, 3)) * (random.random((length, 1)) < 0.3), 0)
    poses[:, 0, :3] = np.add(walk, (0.0, 0.41, 1.4))
    eef[:, :3] = np.add(walk[::-1], (0.0, 0.35, 1.4))
    joint[:, 0, 0] = np.clip(0.5 + np.cumsum(random.normal(0.0, 0.1, length)), 0, 1)
    joint[:, 0, 1] = random.choice((-0.5, 0.0, 0.5), length)
    gripper[:, 1] = random.choice((0.0, 0.5), length)
    changed = {"object_pose": poses, "eef_pose": eef, "joint": joint, "gripper": gripper}
    steps = dataclasses.replace(steps, **changed)
    return dataclasses.replace(recording, steps=steps)


def part_of(recording, first, stop):
    return Recording(recording.episode, recording.scene, recording.steps.window(first, stop))


def see(recording, **binding):
    return look(recording, QUICK, **binding)


every = pytest.mark.parametrize("proposition", SHIPPED, ids=lambda p: p.name)


@every
def test_the_recordings_show_every_proposition_true_and_false(proposition):
    values = np.concatenate(
        [
            see(busy(seed))(proposition.name, *arguments)
            for seed in range(30)
            for arguments in ARGUMENTS[proposition.arguments]
        ]
    )
    assert values.any()
    assert not values.all()


@every
@examples
@given(seed=seeds, stop=st.integers(1, LENGTH))
def test_a_value_does_not_depend_on_what_comes_later(proposition, seed, stop):
    recording = busy(seed, tail=seed % 5)
    begun = dataclasses.replace(recording, steps=recording.steps.window(0, stop))
    for arguments in ARGUMENTS[proposition.arguments]:
        whole = see(recording)(proposition.name, *arguments)
        prefix = see(begun)(proposition.name, *arguments)
        assert prefix.tolist() == whole[:stop].tolist()


@every
@settings(max_examples=2, deadline=None)
@given(seed=seeds)
def test_a_value_does_not_depend_on_what_was_before_its_window(proposition, seed):
    recording = busy(seed)
    window = proposition.window(CATALOGUE.parameters(QUICK))
    count = LENGTH if window == math.inf else max(round(window / toy.DT), int(proposition.act))
    recent = [part_of(recording, max(0, t - count), t + 1) for t in range(LENGTH)]
    for arguments in ARGUMENTS[proposition.arguments]:
        whole = see(recording)(proposition.name, *arguments).tolist()
        assert [bool(see(r)(proposition.name, *arguments)[-1]) for r in recent] == whole


def swapped_sides(recording, random):
    contacts = recording.steps.contacts
    swap = random.random(len(contacts)) < 0.5
    return with_contacts(
        recording,
        a=np.where(swap, contacts.b, contacts.a),
        b=np.where(swap, contacts.a, contacts.b),
        normal=np.where(swap[:, None], -contacts.normal, contacts.normal),
    )


def shuffled_within_steps(recording, random):
    contacts = recording.steps.contacts
    order = np.lexsort((random.random(len(contacts)), contacts.step))
    columns = {f.name: getattr(contacts, f.name)[order] for f in dataclasses.fields(contacts)}
    return with_contacts(recording, **columns)


def negated_quaternions(recording, random):
    steps = recording.steps
    changed = {}
    for name in ("eef_pose", "object_pose", "box_pose"):
        poses = getattr(steps, name).copy()
        poses[..., 3:] *= random.choice((-1.0, 1.0), (*poses.shape[:-1], 1))
        changed[name] = poses
    return dataclasses.replace(recording, steps=dataclasses.replace(steps, **changed))


def with_contacts(recording, **columns):
    contacts = dataclasses.replace(recording.steps.contacts, **columns)
    return dataclasses.replace(
        recording, steps=dataclasses.replace(recording.steps, contacts=contacts)
    )


@every
@pytest.mark.parametrize(
    "change", [swapped_sides, shuffled_within_steps, negated_quaternions], ids=lambda f: f.__name__
)
@settings(max_examples=3, deadline=None)
@given(seed=seeds)
def test_another_way_to_write_the_same_recording_changes_nothing(proposition, change, seed):
    recording = busy(seed)
    other = change(recording, np.random.default_rng(seed))
    for arguments in ARGUMENTS[proposition.arguments]:
        values = see(recording)(proposition.name, *arguments)
        assert see(other)(proposition.name, *arguments).tolist() == values.tolist()


def lasting(recording, times, period):
    """The same states, each for so many steps, in a recording of another control period."""
    steps = recording.steps
    arrays = {
        f.name: np.repeat(getattr(steps, f.name), times, axis=0)
        for f in dataclasses.fields(steps)
        if f.name != "contacts"
    }
    columns = {
        f.name: np.repeat(getattr(steps.contacts, f.name), times, axis=0)
        for f in dataclasses.fields(steps.contacts)
    }
    columns["step"] = times * columns["step"] + np.arange(len(columns["step"])) % times
    order = np.argsort(columns["step"], kind="stable")
    contacts = Contacts(**{name: np.asarray(c[order], c.dtype) for name, c in columns.items()})
    contacts = dataclasses.replace(contacts, step=contacts.step.astype(np.int32))
    scene = dataclasses.replace(recording.scene, control_period=period)
    return Recording(recording.episode, scene, Steps(**arrays, contacts=contacts))


def near(values):
    """True where a value is true at the step or at one beside it."""
    padded = np.concatenate(([False], values, [False]))
    return padded[:-2] | padded[1:-1] | padded[2:]


@every
@pytest.mark.parametrize("seed", range(8))
def test_twice_the_rate_says_the_same_within_a_control_period(proposition, seed):
    # States last, and the seeds are chosen: what coincides for exactly as long as a window asks
    # for may do so at one rate only.
    recording = busy(seed)
    coarser, finer = (see(lasting(recording, n, 4 * toy.DT / n)) for n in (4, 8))
    for arguments in ARGUMENTS[proposition.arguments]:
        values = coarser(proposition.name, *arguments)
        pairs = finer(proposition.name, *arguments).reshape(-1, 2)
        assert not (values & ~near(pairs.any(axis=1))).any()
        assert not (pairs.any(axis=1) & ~near(values)).any()
        if not proposition.act:
            assert not (~values & ~near(~pairs.all(axis=1))).any()


NAMES = {"mug": "zebra", "apple": "aa", "cabinet": "counter2", "counter": "worktop"}


def renamed(recording):
    """Other names for everything, and the objects in the other order."""

    def name(item):
        changed = {"entity": NAMES.get(item.entity, item.entity)}
        if getattr(item, "joint", ""):
            owner, joint = item.joint.split("/")
            changed["joint"] = f"{NAMES[owner]}/{joint}"
        return dataclasses.replace(item, **changed)

    scene = recording.scene
    scene = dataclasses.replace(
        scene,
        entities=tuple(
            dataclasses.replace(e, name=NAMES.get(e.name, e.name)) for e in scene.entities
        ),
        bodies=tuple(map(name, reversed(scene.bodies))),
        parts=tuple(map(name, reversed(scene.parts))),
        joints=tuple(map(name, scene.joints)),
        boxes=tuple(map(name, scene.boxes)),
        switches=tuple(map(name, scene.switches)),
        surfaces=tuple(map(name, scene.surfaces)),
        roles={},
    ).checked()
    last, contacts = len(scene.parts) - 1, recording.steps.contacts
    recording = with_contacts(recording, a=last - contacts.a, b=last - contacts.b)
    steps = dataclasses.replace(
        recording.steps,
        object_pose=recording.steps.object_pose[:, ::-1],
        object_twist=recording.steps.object_twist[:, ::-1],
    )
    return dataclasses.replace(recording, scene=scene, steps=steps)


@every
@settings(max_examples=5, deadline=None)
@given(seed=seeds)
def test_names_and_order_of_entities_do_not_matter(proposition, seed):
    recording = busy(seed)
    new = {
        "objects": tuple(NAMES[o] for o in BINDING.objects),
        "attributes": {NAMES[o]: kinds for o, kinds in BINDING.attributes.items()},
        "touch": frozenset((NAMES[e], part) for e, part in BINDING.touch),
        "supports": {
            NAMES[o]: frozenset(NAMES[s] for s in below) for o, below in BINDING.supports.items()
        },
    }
    for arguments in ARGUMENTS[proposition.arguments]:
        values = see(recording)(proposition.name, *arguments)
        other = [NAMES.get(argument, argument) for argument in arguments]
        found = see(renamed(recording), **new)(proposition.name, *other)
        assert found.tolist() == values.tolist()


def spun(recording, angle, shift):
    """The whole scene turned about the vertical axis and put elsewhere."""
    turn = np.array(turned(angle, (0, 0, 1)))

    def place(points):
        return rotate(turn, points) + shift

    def pose(array):
        array = np.asarray(array, float)
        turns = multiply(np.broadcast_to(turn, array[..., 3:].shape), array[..., 3:])
        return np.concatenate((place(array[..., :3]), turns), axis=-1).astype(np.float32)

    def vector(array):
        return rotate(turn, array).astype(np.float32)

    scene, steps = recording.scene, recording.steps
    joints = [
        dataclasses.replace(
            j,
            axis=tuple(rotate(turn, j.axis)),
            anchor=tuple(place(j.anchor)),
            pose=(*pose(j.pose),),
        )
        for j in scene.joints
    ]
    surfaces = [dataclasses.replace(s, pose=tuple(pose(s.pose))) for s in scene.surfaces]
    scene = dataclasses.replace(scene, joints=tuple(joints), surfaces=tuple(surfaces))
    poses = {n: pose(getattr(steps, n)) for n in ("eef_pose", "object_pose", "box_pose")}
    steps = dataclasses.replace(steps, **poses)
    recording = dataclasses.replace(recording, scene=scene, steps=steps)
    contacts = steps.contacts
    position = place(contacts.position).astype(np.float32)
    return with_contacts(recording, position=position, normal=vector(contacts.normal))


@every
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4, np.pi / 2])
def test_where_the_scene_stands_and_how_it_is_turned_does_not_matter(proposition, angle):
    for seed in range(8):
        recording = busy(seed)
        other = spun(recording, angle, (0.3, -1.0, 0.2))
        for arguments in ARGUMENTS[proposition.arguments]:
            values = see(recording)(proposition.name, *arguments)
            assert see(other)(proposition.name, *arguments).tolist() == values.tolist()
