"""What a robot observes of its world decides what is known, and what is not known is not safe."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, TraceError
from pytest_safemanip.live import HandReading, LiveMonitor, Touch
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Proposition
from tests import toy
from tests.propositions.stage import BINDING, film, grip

REACH = ["enclosure_access"]
SHELF = {"cabinet/shelf": (0.0, 0.6, 1.5, *toy.UPRIGHT)}
OUTSIDE, INSIDE = (0.0, 0.0, 1.5, *toy.UPRIGHT), (0.0, 0.6, 1.5, *toy.UPRIGHT)
CLOSED, OPEN = {"cabinet/hinge": 0.0}, {"cabinet/hinge": 1.0}
FINGERS = ("robot/finger_left", "robot/finger_right")


def monitor(properties=REACH, **options):
    return LiveMonitor(toy.SCENE, BINDING, properties, boxes=SHELF, **options)


def reach(at, joints):
    return {"gripper": HandReading(pose=at), "joints": joints}


def squeeze(name="mug", force=10.0):
    return [
        Touch(finger, f"{name}/body", force, toy.PLACE, (way, 0.0, 0.0))
        for finger, way in zip(FINGERS, (1.0, -1.0), strict=True)
    ]


def fed(recording, lack=()):
    """A recording's steps as a robot would tell them, except what it lacks."""
    scene = recording.scene
    names = [f"{part.entity}/{part.name}" for part in scene.parts]
    for step, _, acting in recording.steps:
        rows = step.contacts
        columns = (rows.a, rows.b, rows.force, rows.position, rows.normal, rows.sustained)
        reading = {
            "poses": {b.entity: step.object_pose[k] for k, b in enumerate(scene.bodies)},
            "contacts": [
                Touch(names[a], names[b], float(f), p, n, float(most))
                for a, b, f, p, n, most in zip(*columns, strict=True)
            ],
            "gripper": {
                hand.name: HandReading(
                    step.eef_poses[k], float(step.openings[k, 0]), float(step.commands[k])
                )
                for k, hand in enumerate(scene.grippers)
            },
            "joints": {j.key: float(step.joint[k, 0]) for k, j in enumerate(scene.joints)},
            "boxes": {
                f"{box.entity}/{box.name}": step.box_pose[k] for k, box in enumerate(scene.boxes)
            },
            "switches": {
                f"{s.entity}/{s.name}": bool(step.switch[k]) for k, s in enumerate(scene.switches)
            },
        }
        yield {name: value for name, value in reading.items() if name not in lack}, acting


ROLLOUTS = [
    ("PickPlaceCounterToCabinet", "scripted:half_inside"),
    ("OpenDrawer", "scripted"),
]


@pytest.fixture(scope="module")
def judged(rollouts):
    """A recording with what judges it."""

    def look_up(task, policy):
        plan, found = rollouts.plan(task, policy), rollouts.get(task, policy)
        binding = plan.tasks[task].bind(found.recording.scene, plan.attributes)
        return found, binding, [plan.properties[name] for name in plan.tasks[task].properties]

    return look_up


@pytest.mark.parametrize(("task", "policy"), ROLLOUTS)
def test_with_everything_observed_it_says_what_the_recording_is_told(judged, task, policy):
    found, binding, properties = judged(task, policy)
    recording = found.recording
    live = LiveMonitor(recording.scene, binding, properties)
    for step, action, acting in recording.steps:
        live.take(step, action=action, acting=acting)
    for prop in properties:
        verdict = found.judge.judge(prop)
        assert live.outcomes()[prop.id] == verdict.outcome.label
        unsafe = {
            told.instance: np.flatnonzero(np.array(told.unsafe)).tolist()
            for told in live.verdicts()[prop.id]
        }
        for finding in verdict.findings:
            steps = range(finding.first, finding.last + 1)
            assert set(steps) <= set(unsafe[finding.entities])
        assert sum(map(len, unsafe.values())) == sum(f.last - f.first + 1 for f in verdict.findings)


@pytest.mark.parametrize(("task", "policy"), ROLLOUTS[:1])
def test_a_feed_by_name_says_it_too(judged, task, policy):
    found, binding, properties = judged(task, policy)
    live = LiveMonitor(found.recording.scene, binding, properties)
    for reading, acting in fed(found.recording):
        live.step(**reading, acting=acting)
    assert live.outcomes() == {p.id: found.judge.judge(p).outcome.label for p in properties}


def test_without_contacts_what_needs_none_is_judged_and_the_rest_is_unknown(judged):
    found, binding, properties = judged("PickPlaceCounterToCabinet", "scripted:half_inside")
    live = LiveMonitor(found.recording.scene, binding, properties)
    for reading, acting in fed(found.recording, lack=("contacts",)):
        live.step(**reading, acting=acting)
    told = live.outcomes()
    needless = found.judge.judge(next(p for p in properties if p.id == "enclosure_access"))
    assert told.pop("enclosure_access") == needless.outcome.label
    assert set(told.values()) == {"UNKNOWN"}


def test_a_hand_in_a_cabinet_that_nobody_saw_open_is_neither_safe_nor_unsafe():
    live = monitor()
    assert live.step(**reach(OUTSIDE, {}))["enclosure_access"].label == "SAFE"
    assert live.step(**reach(INSIDE, {}))["enclosure_access"].label == "UNKNOWN"
    assert live.outcomes() == {"enclosure_access": "UNKNOWN"}


@pytest.mark.parametrize(("joints", "told"), [(CLOSED, "UNSAFE"), (OPEN, "SAFE")])
def test_a_hand_in_a_cabinet_that_was_seen_is_judged(joints, told):
    live = monitor()
    live.step(**reach(OUTSIDE, joints))
    assert live.step(**reach(INSIDE, joints))["enclosure_access"].label == told


def test_a_hand_that_nobody_sees_may_be_anywhere():
    live = monitor()
    live.step(**reach(OUTSIDE, CLOSED))
    assert live.step(joints=CLOSED)["enclosure_access"].label == "UNKNOWN"
    # It may have come in at the step before: it does not enter now.
    told = live.step(**reach(INSIDE, CLOSED))["enclosure_access"]
    assert told.label == "UNKNOWN"
    assert live.step(**reach(OUTSIDE, CLOSED))["enclosure_access"].label == "SAFE"


def test_what_is_out_of_sight_for_a_while_is_unknown_for_as_long_as_it_matters():
    live = monitor(["grasp_stability"])
    held = {"gripper": HandReading(OUTSIDE, 0.5, 1.0), "contacts": squeeze(), "felt": FINGERS}
    poses = {"mug": (0.0, 0.0, 1.5, *toy.UPRIGHT), "apple": (0.4, 0.0, 0.94, *toy.UPRIGHT)}
    labels = [live.step(poses, **held)["grasp_stability"].label for _ in range(10)]
    assert set(labels) == {"SAFE"}
    apple = {"apple": poses["apple"]}
    labels = [live.step(apple, **held)["grasp_stability"].label for _ in range(3)]
    labels += [live.step(poses, **held)["grasp_stability"].label for _ in range(40)]
    count = labels.count("UNKNOWN")
    assert labels == ["UNKNOWN"] * count + ["SAFE"] * (len(labels) - count)
    assert 3 + 20 <= count < 40  # the window of stable_grasp, 1 s, and that of the grasp


def test_fingers_alone_feel_a_grasp_and_not_what_it_stands_on():
    live = monitor(["grasp_stability", "release_stability"])
    poses = {"mug": (0.0, 0.0, 1.5, *toy.UPRIGHT), "apple": (0.4, 0.0, 0.94, *toy.UPRIGHT)}
    for step in range(20):
        touches = squeeze() if 4 < step < 12 else []
        command = -1.0 if step > 10 else 1.0
        told = live.step(poses, touches, HandReading(OUTSIDE, 0.5, command), felt=FINGERS)
    assert told["grasp_stability"].label == "SAFE"
    assert live.outcomes() == {"grasp_stability": "SATISFIED", "release_stability": "UNKNOWN"}


LEANS = [Touch("robot/link5", "counter/body", 9.0, toy.PLACE, (0.0, 0.0, 1.0))]


@pytest.mark.parametrize(
    ("felt", "labels"),
    [
        # What has touched since the start is nobody's doing, until it breaks.
        ("LLL", ["SAFE", "SAFE", "SAFE"]),
        ("L.L", ["SAFE", "SAFE", "UNSAFE"]),
        # Perhaps it broke when nobody felt it.
        ("L?L", ["SAFE", "UNKNOWN", "UNKNOWN"]),
        ("L?.L", ["SAFE", "UNKNOWN", "SAFE", "UNSAFE"]),
        # Perhaps it has touched since the start.
        ("?LL", ["UNKNOWN", "UNKNOWN", "UNKNOWN"]),
        ("?.L", ["UNKNOWN", "SAFE", "UNSAFE"]),
        (".?L", ["SAFE", "UNKNOWN", "UNSAFE"]),
    ],
)
def test_what_touches_since_the_start_has_to_be_felt_since_the_start(felt, labels):
    live = LiveMonitor(toy.SCENE, Binding(), ["collision_contact"])
    contacts = {"L": LEANS, ".": [], "?": None}
    told = [live.step(contacts=contacts[one])["collision_contact"].label for one in felt]
    assert told == labels


def test_one_name_needs_no_list():
    live, listed = monitor("collision_contact"), monitor(["collision_contact"])
    for contacts in ([], LEANS):
        told = live.step(contacts=contacts, felt="robot")
        assert told == listed.step(contacts=contacts, felt=["robot"])


def test_an_arm_that_hits_something_is_unsafe_whatever_the_hand_may_hold():
    live = monitor(["collision_contact"])
    live.step(contacts=[], felt=["robot/link5"])
    told = live.step(contacts=LEANS, felt=["robot/link5"])
    assert told["collision_contact"].label == "UNSAFE"
    assert live.step(contacts=[], felt=["robot/link5"])["collision_contact"].label == "UNKNOWN"


def test_a_look_ahead_is_not_taken_in():
    live = monitor()
    live.step(**reach(OUTSIDE, CLOSED))
    for _ in range(2):
        assert live.peek(**reach(INSIDE, CLOSED))["enclosure_access"].label == "UNSAFE"
    assert live.step(**reach(OUTSIDE, CLOSED))["enclosure_access"].label == "SAFE"
    assert live.outcomes() == {"enclosure_access": "VACUOUS"}


@pytest.mark.parametrize(("task", "policy"), ROLLOUTS[:1])
def test_a_look_ahead_says_what_the_step_then_says(judged, task, policy):
    found, binding, properties = judged(task, policy)
    live = LiveMonitor(found.recording.scene, binding, properties)
    for count, (reading, acting) in enumerate(fed(found.recording)):
        ahead = live.peek(**reading, acting=acting) if count % 40 == 7 else None
        told = live.step(**reading, acting=acting)
        assert ahead in (None, told)


def test_a_proposition_that_does_not_say_what_it_reads_needs_everything():
    def mine(view, o):
        return view("obj_grasped", o)

    own = Proposition("obj_inside", (), lambda p: 0.0, (), mine)
    assert own.reads is None
    catalogue = Catalogue([dataclasses.replace(own, name="mine", arguments=("object",))])
    steps = film(3, grip(range(3)))
    live = LiveMonitor(steps.scene, BINDING, ["grasp_stability"], catalogue=catalogue, boxes=SHELF)
    for reading, _ in fed(steps, lack=("joints",)):
        live.step(**reading)
    assert not live._observations.knows(("mine", "mug"))
    assert live._observations.knows(("obj_grasped", "mug"))


@pytest.mark.parametrize(
    ("reading", "message"),
    [
        ({"poses": {"mugg": INSIDE}}, "no 'mugg'; did you mean 'mug'"),
        ({"poses": {"mug": (0.0, 0.0, 1.0)}}, r"'mug' at step 0: a pose is x, y, z"),
        ({"joints": {"cabinet/hinge": "open"}}, "'cabinet/hinge' at step 0: could not convert"),
        ({"joints": {"cabinet/hinge": 57.0}}, "an openness is 0 where it is closed and 1 where"),
        ({"poses": [1]}, "step 0: malformed reading"),
        ({"contacts": ["x"]}, "step 0: malformed reading"),
        ({"poses": {"mug": [np.nan] * 7}}, "object_pose: not finite at step 0 of 'mug'"),
        ({"gripper": {"left": HandReading(pose=INSIDE)}}, "no 'left'; there is: hand|no 'left'"),
        ({"contacts": [Touch("robot/finger", "mug/body", 1.0, (0, 0, 0), (0, 0, 1))]}, "no part"),
        ({"contacts": [], "felt": ["robot/thumb"]}, "no part 'robot/thumb'"),
    ],
)
def test_what_cannot_be_is_refused_by_name(reading, message):
    live = monitor()
    with pytest.raises(TraceError, match=message):
        live.step(**reading)
    live.step(**reach(OUTSIDE, CLOSED))
    # Nobody knows where the hand was in the period of which that was told.
    assert live.outcomes() == {"enclosure_access": "UNKNOWN"}


def test_a_touch_in_a_reading_that_is_refused_is_not_forgotten():
    live = monitor(["collision_contact"])
    calm = {"contacts": [], **reach(OUTSIDE, CLOSED), "poses": {"mug": OUTSIDE}}
    assert live.step(**calm)["collision_contact"].label == "SAFE"
    with pytest.raises(TraceError, match="57"):
        live.step(**{**calm, "contacts": squeeze(force=500.0), "joints": {"cabinet/hinge": 57.0}})
    assert live.outcomes() == {"collision_contact": "UNKNOWN"}


def test_to_watch_nothing_is_refused():
    with pytest.raises(ConfigError, match="nothing would be watched"):
        monitor([])


def test_unknown_properties_and_boxes_are_refused():
    with pytest.raises(ConfigError, match="unknown property 'enclosure_acces'"):
        monitor(["enclosure_acces"])
    with pytest.raises(TraceError, match="the scene has no 'cabinet/drawer'"):
        LiveMonitor(toy.SCENE, BINDING, REACH, boxes={"cabinet/drawer": INSIDE})
