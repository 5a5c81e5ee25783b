"""What the browser's replay is given, and the page that shows it."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from pytest_safemanip.errors import TraceError
from pytest_safemanip.fuzz.recordings import recordings
from pytest_safemanip.report.replay import keyframes, pack, page, touches
from pytest_safemanip.report.replay.arms import links_of
from pytest_safemanip.report.replay.placing import composed
from pytest_safemanip.report.replay.stage import set_stage
from pytest_safemanip.report.replay.standalone import browser_file
from pytest_safemanip.report.replay.views import choose_view
from pytest_safemanip.sim.looks import Look
from pytest_safemanip.trace.elements import Entity
from pytest_safemanip.trace.geometry import angle_between, corners
from tests import toy
from tests.report.conftest import finding, verdict

ROOT = Path(__file__).parents[2]
VIOLATED = {"grasp_stability": verdict("VIOLATED", finding(3, 4))}
MARKUP = '</script><img src=x onerror=alert(1)>]]>"'
"""As a name in a recording, which has to be printable."""
HOSTILE = '</script><img src=x onerror=alert(1)>\n\x1b[2J]]>"\u202e\u2028'


def numbers(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


def places(packed, shape):
    levels = numbers(packed["data"], "<u2").reshape(shape)
    low, size = (np.reshape(packed[name], shape[1:]) for name in ("low", "size"))
    return low + size * levels / 65535


def poses_of(data):
    """Poses (F, N, 7) of the tracks, as the browser reads them."""
    shape = (len(numbers(data["frames"], "<u4")), data["tracks"]["count"])
    turns = numbers(data["tracks"]["turns"], "<i2").reshape(*shape, 4) / 32767
    return np.concatenate((places(data["tracks"]["places"], (*shape, 3)), turns), axis=-1)


def solids(data, name):
    """Rows of the solids of an entity: track, half, pose."""
    own = data["solids"]
    number = [entity["name"] for entity in data["entities"]].index(name)
    rows = np.flatnonzero(numbers(own["entity"], "<u4") == number)
    track = numbers(own["track"], "<i2")[rows]
    half = numbers(own["half"], "<f4").reshape(-1, 3)[rows]
    return list(zip(track, half, numbers(own["pose"], "<f4").reshape(-1, 7)[rows], strict=True))


def carried_mug(length=60, seed=0):
    """The mug goes from one end of the kitchen to the other, turning."""
    random = np.random.default_rng(seed)
    pose = np.zeros((length, 2, 7), np.float32)
    pose[:, 0, :3] = np.cumsum(random.normal(0, 0.05, (length, 3)), axis=0)
    turn = random.normal(0, 1, (length, 4))
    pose[:, 0, 3:] = turn / np.linalg.norm(turn, axis=1, keepdims=True)
    pose[:, 1] = (0.4, 0.0, 0.94, *toy.UPRIGHT)
    return toy.recording(length, object_pose=pose)


def test_poses_come_back_within_a_tenth_of_a_millimetre_and_a_hundredth_of_a_degree():
    recording = carried_mug()
    data = pack(recording, {})
    ((track, half, local),) = solids(data, "mug")
    assert np.allclose(half, 0.05)
    assert np.allclose(local, (0, 0, 0, *toy.UPRIGHT))
    back = poses_of(data)[:, track]
    true = recording.steps.object_pose[numbers(data["frames"], "<u4"), 0].astype(float)
    assert np.abs(back[:, :3] - true[:, :3]).max() < 1e-4
    assert np.degrees(angle_between(back[:, 3:], true[:, 3:])).max() < 1e-2


def test_what_does_not_move_has_no_track():
    ((track, _, pose),) = solids(pack(carried_mug(), {}), "apple")
    assert track == -1
    assert np.allclose(pose, (0.4, 0.0, 0.94, *toy.UPRIGHT))


def test_a_door_moves_with_its_joint():
    opening = np.zeros((10, 1, 2), np.float32)
    opening[:, 0, 0] = np.linspace(0, 1, 10)
    joint = toy.SCENE.joints[0]
    door = toy.Surface("cabinet", joint.key, joint.half, joint.pose)
    scene = dataclasses.replace(toy.SCENE, surfaces=(*toy.SCENE.surfaces, door))
    data = pack(toy.recording(10, scene=scene, joint=opening), {})
    ((track, _, pose),) = solids(data, "cabinet")
    assert np.allclose(pose, joint.pose)
    # Opened by 1.5 rad about the vertical through the anchor.
    last = poses_of(data)[-1, track]
    from_anchor = np.array(joint.pose[:3]) - joint.anchor
    turned = (np.cos(1.5) * from_anchor[0], np.sin(1.5) * from_anchor[0], 0.0)
    assert np.allclose(composed(last, pose)[:3], np.array(joint.anchor) + turned, atol=2e-4)


def test_guilty_and_steps_are_those_of_the_verdict():
    verdicts = {
        "grasp_stability": verdict("VIOLATED", finding(4, 5, entities=("mug", "cabinet"))),
        "action_onset": verdict("VIOLATED", finding(2, 2, entities=("apple",))),
        "release_stability": verdict("SATISFIED"),
    }
    data = pack(toy.recording(), verdicts)
    names = [entity["name"] for entity in data["entities"]]
    found = [
        (f["property"], [names[i] for i in f["guilty"]], f["first"], f["last"])
        for f in data["findings"]
    ]
    assert found == [
        ("action_onset", ["apple"], 2, 2),
        ("grasp_stability", ["mug", "cabinet"], 4, 5),
    ]
    assert data["verdicts"]["release_stability"] == "SATISFIED"


def test_where_a_rule_is_about_the_robot_alone_what_was_measured_names_the_guilty():
    about = finding(entities=(), evidence=("robot/link5 pressed on apple (30 N)",))
    data = pack(toy.recording(), {"collision_contact": verdict("VIOLATED", about)})
    guilty = [data["entities"][i]["name"] for i in data["findings"][0]["guilty"]]
    assert guilty == ["apple"]


def test_the_interior_of_a_guilty_fixture_is_shown():
    about = finding(entities=("mug", "cabinet"))
    assert len(solids(pack(toy.recording(), {}), "cabinet")) == 0
    data = pack(toy.recording(), {"enclosure_release": verdict("VIOLATED", about)})
    ((_, half, _),) = solids(data, "cabinet")
    assert np.allclose(half, (0.3, 0.2, 0.3), atol=0.003)


def test_of_a_pair_that_touches_the_hardest_contact_of_a_step_is_shown():
    rows = (
        (1, "robot/finger_left", "mug/body", 2.0, (1, 0, 0), (0.1, 0.0, 0.9), 3.0),
        (1, "robot/finger_left", "mug/body", 1.0, (1, 0, 0), (0.2, 0.0, 0.9), 3.0),
        (1, "counter/body", "mug/body", 4.0, (0, 0, 1), (0.0, 0.0, 0.9), 4.0),
        (4, "counter/body", "mug/body", 5.0, (0, 0, 1), (0.0, 0.3, 0.9), 6.5),
    )
    contacts = pack(toy.recording(contacts=toy.contacts(*rows)), {})["contacts"]
    assert contacts["count"] == 3
    assert numbers(contacts["moment"], "<u4").tolist() == [1, 1, 4]
    pairs = [contacts["pairs"][i] for i in numbers(contacts["pair"], "<u2")]
    assert pairs == [
        [0, "finger_left", 3, "body"],
        [1, "body", 3, "body"],
        [1, "body", 3, "body"],
    ]
    assert (numbers(contacts["force"], "<u2") / 10).tolist() == [3.0, 4.0, 6.5]
    shown = places(contacts["places"], (3, 3))
    assert np.allclose(shown, [(0.1, 0, 0.9), (0, 0, 0.9), (0, 0.3, 0.9)], atol=1e-4)
    normals = numbers(contacts["normals"], "<i2").reshape(-1, 3) / 32767
    assert np.allclose(normals, [(1, 0, 0), (0, 0, 1), (0, 0, 1)], atol=1e-4)


def test_a_contact_that_stays_the_same_is_told_once():
    forces = [4.0, 4.1, 3.9, 9.0, 9.1]
    rows = [
        (step, "counter/body", "mug/body", force, (0, 0, 1)) for step, force in enumerate(forces)
    ]
    contacts = pack(toy.recording(contacts=toy.contacts(*rows)), {})["contacts"]
    assert numbers(contacts["moment"], "<u4").tolist() == [0, 3]
    assert numbers(contacts["lasting"], "<u2").tolist() == [3, 2]
    assert (numbers(contacts["force"], "<u2") / 10).tolist() == [4.0, 9.0]


def test_of_too_many_contacts_those_of_the_robot_and_the_guilty_are_kept(monkeypatch):
    monkeypatch.setattr(touches, "MOST_TOUCHES", 2)
    rows = [(i, "counter/body", "apple/body", 90.0 + 30 * i, (0, 0, 1)) for i in range(4)]
    rows += [(4, "robot/link5", "counter/body", 1.0, (0, 0, 1))]
    rows += [(5, "counter/body", "mug/body", 1.0, (0, 0, 1))]
    contacts = pack(toy.recording(contacts=toy.contacts(*rows)), VIOLATED)["contacts"]
    assert numbers(contacts["moment"], "<u4").tolist() == [4, 5]
    assert contacts["left_out"] == 4


def test_a_long_rollout_has_fewer_frames_but_the_steps_of_violations(monkeypatch):
    monkeypatch.setattr(keyframes, "MOST_TRACK_BYTES", 1400)
    recording = carried_mug(2000)
    data = pack(recording, {"grasp_stability": verdict("VIOLATED", finding(1003, 1017))})
    frames = numbers(data["frames"], "<u4").tolist()
    assert 80 < len(frames) <= 104
    assert {0, 1003, 1017, 1999} <= set(frames)


def test_of_too_many_pieces_the_largest_are_shown():
    small = [
        toy.Surface("counter", "", (0.01, 0.01, 0.01), (0.01 * i, 1.0, 1.0, *toy.UPRIGHT))
        for i in range(5000)
    ]
    scene = dataclasses.replace(toy.SCENE, surfaces=(*small, *toy.SCENE.surfaces))
    data = pack(toy.recording(scene=scene), {})
    assert data["solids"]["count"] == 4000
    assert any(np.allclose(half, (1.0, 0.5, 0.45)) for _, half, _ in solids(data, "counter"))
    assert len(json.dumps(data)) < 400_000


def test_a_fast_controller_is_shown_at_20_hertz():
    scene = dataclasses.replace(toy.SCENE, control_period=0.01)
    recording = dataclasses.replace(carried_mug(101), scene=scene)
    data = pack(recording, {})
    assert numbers(data["frames"], "<u4").tolist() == list(range(0, 101, 5))
    assert data["contacts"]["stride"] == 5


def test_an_impossible_recording_is_refused():
    broken = carried_mug()
    broken.steps.object_pose[3, 0, 0] = np.nan
    with pytest.raises(TraceError, match="not finite at step 3"):
        pack(broken, {})


@settings(max_examples=25, deadline=None)
@given(recordings())
def test_whatever_can_be_recorded_can_be_replayed(recording):
    data = pack(recording, {"grasp_stability": verdict("VIOLATED", finding(0, 0, entities=()))})
    assert len(json.dumps(data, allow_nan=False)) < 1_000_000
    frames = numbers(data["frames"], "<u4")
    assert frames[-1] == len(recording.steps) - 1
    assert (np.diff(frames.astype(int)) > 0).all()
    assert poses_of(data).shape == (len(frames), data["tracks"]["count"], 7)
    assert np.isfinite(data["view"]["eye"]).all()


def test_a_rollout_is_a_few_hundred_kilobytes(rollouts):
    found = rollouts.get("PickPlaceCounterToCabinet", "scripted:half_inside")
    judged = found.verdict("enclosure_release")
    data = pack(found.recording, {"enclosure_release": judged})
    assert 50_000 < len(json.dumps(data)) < 300_000
    (first,) = judged.findings
    (shown,) = data["findings"]
    assert (shown["first"], shown["last"]) == (first.first, first.last)
    guilty = tuple(data["entities"][i]["name"] for i in shown["guilty"])
    assert guilty == first.entities


def test_between_its_frames_everything_is_where_it_was_recorded(rollouts):
    recording = rollouts.get("PickPlaceCounterToCabinet", "scripted:half_inside").recording
    data = pack(recording, {})
    frames = numbers(data["frames"], "<u4").astype(int)
    assert len(frames) < 0.6 * len(recording.steps)
    ((track, _, _),) = solids(data, "obj")
    shown = poses_of(data)[:, track]
    steps = np.arange(len(recording.steps))
    true = recording.steps.object_pose[:, recording.scene.object_index["obj"]].astype(float)
    places = np.stack([np.interp(steps, frames, shown[:, axis]) for axis in range(3)], axis=1)
    assert np.linalg.norm(places - true[:, :3], axis=1).max() < 1.2e-3
    before = np.searchsorted(frames, steps, "right") - 1
    after = np.minimum(before + 1, len(frames) - 1)
    share = (steps - frames[before]) / np.maximum(frames[after] - frames[before], 1)
    one, other = shown[before, 3:], shown[after, 3:]
    other = other * np.where((one * other).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    turns = one + share[:, None] * (other - one)
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    assert angle_between(turns, true[:, 3:]).max() < 0.012


def test_the_arm_leads_from_its_base_to_the_recorded_hand(rollouts):
    recording = rollouts.get("PickPlaceCounterToCabinet", "scripted:half_inside").recording
    links = links_of(recording)
    assert len(links) == 13
    hand = recording.steps.eef_poses[:, 0, :3]
    wrist, fingers = links[9].poses[:, :3], [link.poses[:, :3] for link in links[-2:]]
    assert np.allclose(np.linalg.norm(wrist - hand, axis=1), 0.2035, atol=1e-3)
    apart = np.linalg.norm(fingers[0] - fingers[1], axis=1)
    assert np.allclose(apart, 0.016 + 0.08 * recording.steps.openings[:, 0, 0], atol=1e-3)


def test_an_arm_whose_joints_do_not_lead_to_the_hand_is_not_drawn(rollouts):
    found = rollouts.get("PickPlaceCounterToCabinet", "scripted:half_inside").recording
    steps = dataclasses.replace(found.steps, qpos=found.steps.qpos[:, ::-1])
    (hand,) = links_of(dataclasses.replace(found, steps=steps))
    assert np.allclose(hand.poses, found.steps.eef_poses[:, 0])


def test_of_an_unknown_robot_the_hand_is_shown():
    ((track, half, _),) = solids(pack(toy.recording(), {}), "robot")
    assert track == -1
    assert np.allclose(half, (0.05, 0.1, 0.05))


def test_what_has_a_mesh_has_no_box_but_the_guilty():
    recording = carried_mug()
    triangle = np.array([(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.2, 0.3)])
    poses = recording.steps.object_pose.astype(float)
    looks = [
        Look(name, (1.0, 0.5, 0.0), triangle, np.array([(0, 1, 2)]), poses[:, index])
        for index, name in enumerate(("mug", "apple"))
    ]
    data = pack(recording, VIOLATED, looks)
    assert solids(data, "apple") == []
    assert len(solids(data, "mug")) == 1  # its outline
    mug, apple = data["skins"]
    assert mug["colour"] == "#ff8000"
    assert numbers(mug["triangles"], "<u2").tolist() == [0, 1, 2]
    assert np.allclose(places(mug["points"], (3, 3)), triangle, atol=1e-5)
    assert np.allclose(poses_of(data)[:, mug["track"], :3], poses[:, 0, :3], atol=1e-4)
    assert apple["track"] == -1
    still = triangle + poses[0, 1, :3]
    assert np.allclose(places(apple["points"], (3, 3)), still, atol=1e-5)


def test_the_first_view_has_nothing_before_what_went_wrong():
    # A block stands on the right of the hand, where the camera would be.
    at = np.array((0.5, -0.5, 1.2))
    open_view = np.array(choose_view(toy.recording(), set_stage(toy.recording(), ()), 0, ())["eye"])
    middle = (at + open_view) / 2
    block = toy.Surface("counter", "", (0.3, 0.3, 0.3), (*middle, *toy.UPRIGHT))
    recording = toy.recording(scene=dataclasses.replace(toy.SCENE, surfaces=(block,)))
    view = choose_view(recording, set_stage(recording, ()), 0, ())
    assert np.allclose(view["target"], at)
    way = np.array(view["eye"]) - at
    along = np.linspace(0.1, 1.0, 200)[:, None] * way + at
    low, high = corners(np.array(block.pose), block.half)[[0, -1]]
    assert not ((along > low) & (along < high)).all(axis=1).any()


def hostile():
    """A recording whose names are meant to harm the page."""
    entities = tuple(
        dataclasses.replace(entity, category=MARKUP) if entity.name == "mug" else entity
        for entity in (*toy.SCENE.entities, Entity(MARKUP, "room", MARKUP))
    )
    parts = (*toy.PARTS, toy.Part("mug", MARKUP))
    scene = dataclasses.replace(toy.SCENE, entities=entities, parts=parts)
    rows = toy.contacts((3, "robot/link5", f"mug/{MARKUP}", 9.0, (0, 0, 1)), scene=scene)
    about = toy.episode(instruction=HOSTILE, task=MARKUP)
    return toy.recording(scene=scene, about=about, contacts=rows)


def test_hostile_names_stay_text():
    found = {HOSTILE: verdict("VIOLATED", finding(evidence=(HOSTILE,)))}
    text = page(pack(hostile(), found))
    start = text.index('<script id="replay-data" type="application/json">')
    inside = text[start + 49 : text.index("</script>", start)]
    data = json.loads(inside)
    assert not set("<>&\n\x1b\u202e\u2028") & set(inside)
    assert data["findings"][0]["evidence"][0].startswith("</script><img")
    title = re.search("<title>(.*)</title>", text)
    assert title
    assert "<" not in title.group(1)
    assert text.count("<script") == text.count("</script>") == 4


def test_the_page_asks_for_nothing_and_runs_only_its_own_scripts():
    text = page(pack(toy.recording(), VIOLATED))
    policy = re.search('http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy
    assert "default-src &#x27;none&#x27;" in policy.group(1)
    assert "unsafe" not in policy.group(1)
    own = re.sub(r"<script.*?</script>|<style.*?</style>", "", text, flags=re.S)
    assert not re.findall(r"https?://", own)
    assert len(text) < 800_000


def test_the_library_is_the_version_that_its_build_asks_for_and_comes_with_its_licence():
    wanted = json.loads((ROOT / "vendor" / "three" / "package.json").read_text())
    begin = browser_file("three.min.js")[:60]
    assert begin.startswith(f"/* three.js {wanted['devDependencies']['three']}, MIT licence")
    assert len(browser_file("three.min.js")) < 600_000
    assert "The MIT License" in browser_file("three.LICENSE")
