"""``safemanip search``: what searches kept, and scenes of it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pytest_safemanip.sim.codec import decode_request
from tests.cli.conftest import Command

KEPT = """
task: PickPlaceCounterToCabinet
property: release_stability
seed: 3
backend: robocasa
scenes: compact
changes:
- {move: obj, along: left, size: -4 cm}
- {distractor: any, beside: obj, choice: can, forward: 3 cm, left: 5 cm}
- {latency: actions, size: 100 ms}
found: scripted fails 9 of 10
"""


@pytest.fixture
def kept(safemanip: Command) -> None:
    """In the folder that the command runs in."""
    path = Path("regressions") / "near.yaml"
    path.parent.mkdir()
    path.write_text(KEPT)


def test_kept_failures_are_listed_in_words(safemanip: Command, kept: None) -> None:
    out = " ".join(safemanip("search").out.split())
    assert "obj stands 4 cm farther right, a can stands 3 cm behind" in out
    assert out.endswith("its actions come 100 ms late, seed 3 (scripted fails 9 of 10)")
    (own,) = json.loads(safemanip("search", "--json").out)
    assert own["changes"][2] == {"latency": "actions", "size": "100 ms"}


def test_scenes_are_around_a_failure(safemanip: Command, kept: None) -> None:
    words = ("search", "--export", "scenes.jsonl", "--count", "40")
    assert safemanip(*words).out == "scenes.jsonl: 40 scenes around 1 failure\n"
    scenes = [json.loads(line) for line in Path("scenes.jsonl").read_text().splitlines()]
    requests = [decode_request(scene["request"]) for scene in scenes]
    assert [request.seed for request in requests] == list(range(3, 43))
    sizes = [-100.0 * request.changes[0].by[1] for request in requests]
    assert 2.0 <= min(sizes) < 2.5 < 5.5 < max(sizes) <= 6.0
    assert {request.changes[1].category for request in requests} == {"can"}
    assert all(0.05 <= scene["disturbances"][0]["seconds"] <= 0.15 for scene in scenes)
    first = Path("scenes.jsonl").read_text()
    safemanip(*words)
    assert Path("scenes.jsonl").read_text() == first


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("nowhere",), "nowhere: no failure is kept there; pytest --safemanip-search finds some"),
        (("--export", "a.jsonl", "--count", "0"), "--count: expected 1 to 100000, found 0"),
    ],
)
def test_what_there_is_not_is_refused(safemanip: Command, kept: None, words, message) -> None:
    assert message in safemanip("search", *words).refusal
