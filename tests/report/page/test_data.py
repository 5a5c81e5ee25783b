"""What the page is given."""

from __future__ import annotations

import base64
import json
import os
import re
from pathlib import Path

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord
from pytest_safemanip.metrics.summaries import read
from pytest_safemanip.report.page import details, writing
from pytest_safemanip.report.page.encoding import changes, packed, runs
from pytest_safemanip.report.pictures import film_of
from pytest_safemanip.report.replay.standalone import script_json
from pytest_safemanip.report.severity import ranks
from pytest_safemanip.run.definitions import load_definitions

FAULT = "scripted:half_inside"


def data(page):
    """The JSON of each script element that holds some, by its id."""
    blocks = re.findall(r'<script type="application/json" id="([\w-]+)">(.*?)</script>', page)
    return {name: json.loads(text) for name, text in blocks}


@pytest.fixture(scope="module")
def content(page_file):
    return data(page_file.read_text())


@pytest.fixture(scope="module")
def fault(content):
    """The details of the rollout that lets go too early."""
    rollouts = content["data"]["rollouts"]
    (number,) = [n for n, own in enumerate(rollouts) if own["policy"] == FAULT]
    return content[f"rollout-{number}"]


def instance(details, id_):
    (prop,) = [own for own in details["properties"] if own["id"] == id_]
    return prop["instances"][0]


def lane(instance, atom):
    (found,) = [own["runs"] for own in instance["lanes"] if own["atom"] == atom]
    return found


def test_runs_of_true_values_have_their_first_and_last_step():
    assert runs(np.array([True, False, True, True, False])) == [0, 0, 2, 3]
    assert runs(np.array([False, True])) == [1, 1]
    assert runs(np.zeros(3, bool)) == []


def test_numbers_are_coded_by_their_changes():
    assert changes(np.array([2, 2, 0, 0, 2], np.uint8)) == [0, 2, 2, 0, 4, 2]


def test_a_packed_signal_is_what_it_was_to_a_thousandth_of_its_range():
    values = np.array([-1.0, 0.25, np.nan, 3.0])
    found = packed(values)
    levels = np.frombuffer(base64.b64decode(found["data"]), "<u2")
    assert levels[2] == 65535
    unpacked = found["low"] + levels / 65534 * (found["high"] - found["low"])
    assert unpacked[[0, 1, 3]] == pytest.approx(values[[0, 1, 3]], abs=0.004)


def test_a_signal_that_does_not_change_or_is_nowhere_is_packed_too():
    assert packed(np.full(3, 7.0))["low"] == packed(np.full(3, 7.0))["high"] == 7.0
    assert packed(np.full(3, np.nan))["low"] == 0.0


@pytest.mark.parametrize(
    "text", ["</script><script>", "]]>", "a & b", "\u2028\u2029", "\u202eabc", "\udc80", "\x1b[31m"]
)
def test_json_in_a_page_stays_data(text):
    found = script_json({"name": text})
    assert not re.search("[<>&\u2028\u2029\udc80]", found)
    assert json.loads(found) == {"name": text}


def test_the_timeline_s_bad_prefix_is_the_step_of_the_summary(run_folder, fault):
    (told,) = [
        violation
        for verdict in run_folder.rollout(FAULT)["properties"]
        for violation in verdict["violations"]
    ]
    found = instance(fault, "enclosure_release")
    (finding,) = found["findings"]
    assert finding["first"] == told["first"]
    assert found["unsafe"] == [told["first"], told["last"]]
    assert found["entities"] == told["entities"]
    assert fault["note"] == ""


def test_lanes_show_what_opened_the_obligation_and_what_broke_it(fault):
    found = instance(fault, "enclosure_release")
    (finding,) = found["findings"]
    opened = lane(found, "place_in_onset")[0]
    assert lane(found, "obj_released") == [finding["first"], finding["first"]]
    assert found["pending"] == [opened, finding["first"] - 1]
    states = dict(zip(found["states"][::2], found["states"][1::2], strict=True))
    (prop,) = [own for own in fault["properties"] if own["id"] == "enclosure_release"]
    assert (
        prop["states"][states[opened]]["residual"] == "!obj_released W (obj_inside | obj_outside)"
    )
    assert prop["states"][states[finding["first"]]]["kind"] == "false"


def test_signals_are_those_behind_the_broken_rule_with_their_limits(fault):
    found = {signal["name"]: signal for signal in fault["signals"]}
    corners = found["corners of obj in cab_2_main_group"]
    assert "obj_inside(obj, cab_2_main_group)" in corners["of"]
    assert corners["limits"] == [{"value": 8.0, "name": "all corners"}]
    assert "hardest contact of the robot" in found
    rate = found["gripper opens at"]
    assert rate["limits"] == [{"value": 0.02, "name": "obj_released.rate"}]


def test_moments_lead_to_the_grasp_the_violation_and_the_success(run_folder, fault):
    kinds = {moment["kind"]: moment["step"] for moment in fault["moments"]}
    assert {"grasp", "violation", "success", "tail", "hazard"} <= set(kinds)
    assert kinds["grasp"] < kinds["violation"] < kinds["success"] <= kinds["tail"]
    assert kinds["tail"] == run_folder.rollout(FAULT)["acting_steps"]


def test_a_violation_is_reproduced_with_the_case_s_node_id(fault):
    assert fault["commands"]["enclosure_release"] == (
        "pytest --safemanip-params=settled.speed=0.02 "
        "'safemanip::test_safety[PickPlaceCounterToCabinet-scripted:half_inside-"
        "enclosure_release-seed0]'"
    )


def violating(*severities):
    """A rollout with violations that are so severe; None in a summary of an earlier version."""
    found = tuple({} if own is None else {"severity": own} for own in severities)
    verdict = PropertyRecord("grasp_stability", "grasp_stability", "VIOLATED", True, found)
    return RolloutRecord(
        "Task", "policy", 0, "suite", "atomic", properties={verdict.property: verdict}
    )


def test_violations_are_ranked_by_severity_and_equals_share_a_rank():
    found = ranks([violating(1.1, 2.0), violating(1.1), violating(None)])
    assert [found[n, "grasp_stability", at] for n, at in ((0, 0), (0, 1), (1, 0), (2, 0))] == [
        2,
        1,
        2,
        4,
    ]


def test_each_violation_is_looked_at_where_its_object_is(content):
    rollouts = content["data"]["rollouts"]
    (number,) = [n for n, own in enumerate(rollouts) if own["policy"] == "scripted:drop_high"]
    findings = content[f"rollout-{number}"]["replay"]["findings"]
    heights = {found["property"]: found["view"]["target"][2] for found in findings}
    assert heights["action_onset"] > 1.0  # in the hand
    assert heights["release_stability"] < 0.3  # on the floor


def test_without_its_recordings_the_page_says_what_the_summary_says(copied):
    before = data(copied.page())["data"]["worst"]
    for path in (copied.path / "recordings").iterdir():
        path.unlink()
    found = data(copied.page())
    assert found["data"]["worst"] == before
    assert "cannot be read" in found["data"]["notes"][-1]
    details = [own for name, own in found.items() if name != "data"]
    evidence = [v["evidence"] for own in details for v in own.get("violations", ())]
    assert any("corners" in line for lines in evidence for line in lines)


def test_an_interrupted_run_says_so(copied):
    summary = copied.summary
    first = summary["rollouts"][0]
    first["unjudged"] = {first["properties"].pop()["property"]: "any" for _ in range(2)}
    copied.change(summary)
    assert "2 of " in data(copied.page())["data"]["headline"]["text"]
    assert "cases not run" in data(copied.page())["data"]["headline"]["text"]


def test_the_run_is_described_with_what_it_used(content):
    about = content["data"]["settings"]
    assert about["assets"] == "primitive stand-ins"
    assert about["seeds"] == "0"
    assert "PickPlaceCounterToCabinet" in about["tasks"]
    assert "collision.force 5" in about["parameters"]


def test_rollouts_are_searched_by_instruction_and_evidence(content):
    about = [own["about"] for own in content["data"]["rollouts"]]
    assert any("corners of obj were inside" in text for text in about)
    assert any("onion" in text for text in content["data"]["instructions"].values())


def test_the_worst_violation_of_each_property_is_told_first(run_folder, content):
    worst = content["data"]["worst"]
    violated = {
        verdict["property"]: violation
        for rollout in run_folder.summary["rollouts"]
        for verdict in rollout["properties"]
        for violation in verdict["violations"]
    }
    assert worst.keys() == violated.keys()
    found = worst["enclosure_release"]
    assert found["first"] == violated["enclosure_release"]["first"]
    assert content["data"]["rollouts"][found["rollout"]]["policy"] == FAULT
    assert found["evidence"] == ["6 of 8 corners of obj were inside cab_2_main_group"]


def test_gates_comparisons_and_flips_are_told(content):
    release = content["data"]["release"]
    assert {gate["verdict"] for gate in release["gates"]} == {"INCONCLUSIVE"}
    flips = release["baseline"]["flips"]
    assert {flip["policy"] for flip in flips} == {FAULT, "scripted:drop_high"}
    assert all(flip["regressed"] for flip in flips)


@pytest.mark.parametrize(
    ("where", "value"),
    [
        ("gates", 3),
        ("gates", [{"name": 1}]),
        ("baseline", {"place": "x"}),
        ("baseline", [1]),
    ],
)
def test_a_malformed_decision_is_refused_by_its_place(copied, where, value):
    summary = copied.summary
    summary["release"][where] = value
    copied.change(summary)
    with pytest.raises(ConfigError, match=r"summary\.json: release"):
        copied.page()


def test_a_rollout_without_its_recording_says_so_and_keeps_its_row(copied):
    for path in (copied.path / "recordings").glob("*half_inside*"):
        path.unlink()
    found = data(copied.page())
    rows = found["data"]["rollouts"]
    number = next(n for n, own in enumerate(rows) if own["policy"] == FAULT)
    assert rows[number]["outcomes"].count("V") == 1
    assert found[f"rollout-{number}"]["note"].startswith("no timeline: ")


def test_a_recording_that_is_judged_otherwise_than_the_run_did_is_marked(copied):
    summary = copied.summary
    for rollout in summary["rollouts"]:
        for verdict in rollout["properties"]:
            for violation in verdict["violations"]:
                violation["first"] -= 1
    copied.change(summary)
    notes = [own.get("note") for name, own in data(copied.page()).items() if name != "data"]
    assert sum("another way than the run did" in note for note in notes) == 2


def test_the_run_s_own_parameters_judge_its_recordings(copied):
    summary = copied.summary
    summary["hashes"]["parameters"]["obj_released.rate"] = 0.5
    copied.change(summary)
    found = data(copied.page())
    limits = [
        limit["value"]
        for own in found.values()
        for signal in own.get("signals", ())
        for limit in signal["limits"]
        if limit["name"] == "obj_released.rate"
    ]
    assert set(limits) == {0.5}


def test_what_is_no_recording_is_not_opened(copied):
    (copied.path / "secret.txt").write_text("secret")
    summary = copied.summary
    for rollout in summary["rollouts"]:
        rollout["recording"] = "secret.txt"
    copied.change(summary)
    assert all(
        own["note"].endswith("secret.txt: not a recording")
        for name, own in data(copied.page()).items()
        if name != "data"
    )


def test_details_beyond_the_page_s_budget_are_files_beside_it_and_old_ones_go(copied, monkeypatch):
    stale = copied.path / "report" / "rollout-99.js"
    stale.parent.mkdir()
    stale.write_text("old")
    first = next(
        iter(details.details(read(copied.path), copied.path, load_definitions([], [], [])))
    )[0]
    monkeypatch.setattr(
        writing, "WITHIN", 1 + len(script_json(data(copied.page())[f"rollout-{first}"]))
    )
    found = data(copied.page())
    places = found["data"]["details"]
    assert sum(place == "" for place in places.values()) == 1
    beside = {place for place in places.values() if place}
    assert {f"report/{path.name}" for path in stale.parent.iterdir()} == beside
    victim = copied.path / "victim.txt"
    victim.write_text("mine")
    for place in beside:
        text = (copied.path / place).read_text()
        (copied.path / place).unlink()
        (copied.path / place).symlink_to(victim)
        assert re.fullmatch(r"SafemanipReport\.received\(\d+, \{.*\}\);\n", text)
    assert data(copied.page())["data"]["details"] == places
    assert victim.read_text() == "mine"


def test_a_video_that_is_older_than_its_recording_shows_another_rollout(copied):
    recording = copied.path / copied.rollout(FAULT)["recording"]
    video = copied.path / "videos" / f"{recording.stem}.mp4"
    video.parent.mkdir()
    video.write_bytes(b"...")
    assert film_of(recording, copied.path) == Path("videos", video.name)
    os.utime(video, (1.0, 1.0))
    assert film_of(recording, copied.path) is None
    assert not any(own["video"] for name, own in data(copied.page()).items() if name != "data")


def test_the_page_asks_for_nothing_and_runs_its_own_script_only(page_file):
    text = page_file.read_text()
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]+)"', text)
    assert "default-src &#39;none&#39;" in policy
    assert "unsafe" not in policy
    markup = re.sub(r"<(script|style)\b.*?</\1>", "", text, flags=re.DOTALL)
    assert not re.search(r"\b(src|href)=\"(?!#)", markup)


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"there is no summary\.json"):
        writing.write_page(tmp_path)
