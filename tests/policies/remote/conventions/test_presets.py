from __future__ import annotations

from pathlib import Path

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint, parse_endpoint
from pytest_safemanip.policies.remote.presets import PRESETS, TASK_SETS, parse_servers
from pytest_safemanip.sim.libero.robot import SPEC as LIBERO
from pytest_safemanip.sim.robocasa.robot import SPEC


def test_the_public_policies_are_there_with_their_protocols_of_evaluation():
    found = {
        name: (p.transport, p.port, p.split, p.steps, p.task_sets) for name, p in PRESETS.items()
    }
    assert found == {
        "pi0": ("openpi", 8000, "pretrain", 5, ()),
        "pi05": ("openpi", 8000, "pretrain", 5, ()),
        "groot": ("groot", 5555, "pretrain", 16, ()),
        "groot-pt": ("groot", 5555, "target", 16, ()),
        "groot-to": ("groot", 5555, "target", 16, TASK_SETS),
        "groot-tpt": ("groot", 5555, "target", 16, TASK_SETS),
        "openpi": ("openpi", 8000, "", 5, ()),
        "pi0-libero": ("openpi", 8000, "libero", 5, ()),
        "pi05-libero": ("openpi", 8000, "libero", 5, ()),
        "openvla-oft": ("openpi", 8000, "libero", 8, ()),
        "lerobot": ("openpi", 8000, "", 0, ()),
        "vla-eval": ("vla-eval", 8000, "", 1, ()),
    }
    assert {p.name for p in PRESETS.values() if p.inflight > 1} == {"vla-eval"}
    assert {preset.split for preset in PRESETS.values() if preset.split} == {
        *SPEC.official,
        *LIBERO.official,
    }


@pytest.mark.parametrize("name", ["pi0", "pi05", "groot", "groot-pt", "groot-to", "groot-tpt"])
def test_the_command_that_starts_a_server_names_its_checkpoint(name):
    preset = PRESETS[name]
    assert next(iter(preset.checkpoints.values())) in preset.start


@pytest.mark.parametrize(
    ("text", "endpoint"),
    [
        ("wss://host:8001", Endpoint("wss", "host", 8001)),
        ("ws://host:8001", Endpoint("ws", "host", 8001)),
        ("wss://host", Endpoint("wss", "host", 443)),
        ("wss://host/pi/05/", Endpoint("wss", "host", 443, "/pi/05")),
        ("host:81", Endpoint("ws", "host", 81)),
        ("10.0.0.7", Endpoint("ws", "10.0.0.7", 8000)),
        ("ws://[::1]:8000", Endpoint("ws", "::1", 8000)),
    ],
)
def test_an_address_is_read_and_written(text, endpoint):
    found = parse_endpoint(text, ("ws", "wss"), 8000)
    assert found == endpoint
    assert parse_endpoint(str(found), ("ws", "wss"), 1) == endpoint


@pytest.mark.parametrize(
    "text",
    ["", "ws://", "http://host", "tcp://host:1", "ws://host:x", "ws://host:70000", "ws://a@b",
     "ws://host?x=1", "ws://host#x", "ws://[::1", "a b://c"],
)  # fmt: skip
def test_what_is_no_address_is_refused_with_an_example(text):
    with pytest.raises(ConfigError, match=r"expected e\.g\. ws://127\.0\.0\.1:8000"):
        parse_endpoint(text, ("ws", "wss"), 8000)


@pytest.mark.parametrize(
    ("host", "loopback"),
    [("localhost", True), ("127.0.0.1", True), ("127.8.0.1", True), ("::1", True),
     ("10.0.0.1", False), ("localhost.example", False), ("example.org", False)],
)  # fmt: skip
def test_what_is_on_this_machine_is_recognised(host, loopback):
    assert Endpoint("ws", host, 1).loopback is loopback


def test_a_policy_with_three_checkpoints_has_three_servers():
    text = "atomic_seen@a:1+composite_seen@tcp://b:2+composite_unseen@c"
    assert parse_servers(PRESETS["groot-to"], text) == {
        "atomic_seen": (Endpoint("tcp", "a", 1),),
        "composite_seen": (Endpoint("tcp", "b", 2),),
        "composite_unseen": (Endpoint("tcp", "c", 5555),),
    }
    assert list(parse_servers(PRESETS["groot-tpt"], "atomic_seen@a")) == ["atomic_seen"]


def test_a_policy_with_one_checkpoint_has_one_server_by_default_here():
    assert parse_servers(PRESETS["pi05"], "") == {"": (Endpoint("ws", "127.0.0.1", 8000),)}
    assert parse_servers(PRESETS["groot"], "gpu") == {"": (Endpoint("tcp", "gpu", 5555),)}


def test_a_checkpoint_may_have_several_servers():
    two = Endpoint("ws", "a", 8000), Endpoint("ws", "b", 8001)
    assert parse_servers(PRESETS["pi05"], "a+ws://b:8001") == {"": two}
    found = parse_servers(PRESETS["groot-to"], "atomic_seen@a+composite_seen@b+atomic_seen@c:1")
    assert found == {
        "atomic_seen": (Endpoint("tcp", "a", 5555), Endpoint("tcp", "c", 1)),
        "composite_seen": (Endpoint("tcp", "b", 5555),),
    }


@pytest.mark.parametrize(("name", "text"), [("pi05", "a+b+ws://a:8000"), ("pi05", "a+")])
def test_a_server_is_given_once_and_has_an_address(name, text):
    with pytest.raises(ConfigError, match=r"ws://a:8000 is given twice|''"):
        parse_servers(PRESETS[name], text)


@pytest.mark.parametrize("text", ["", "host:1", "atomic@host", "atomic_seen@a+b"])
def test_servers_that_are_not_by_task_set_are_refused_with_the_form(text):
    with pytest.raises(ConfigError) as error:
        parse_servers(PRESETS["groot-to"], text)
    assert "groot-to=atomic_seen@tcp://127.0.0.1:5555+composite_seen@" in str(error.value)


@pytest.mark.parametrize("bad", [-1.0, float("inf"), float("nan")])
def test_a_deadline_is_a_time(bad):
    for name in ("start", "open", "warm_up", "call"):
        with pytest.raises(ConfigError, match=f"deadline '{name}'"):
            Deadlines(**{name: bad})
    with pytest.raises(ConfigError, match="deadline 'call'"):
        Deadlines(call=0.0)
    assert Deadlines(start=0.0).start == 0.0


def test_the_manual_has_every_preset():
    page = (Path(__file__).parents[4] / "docs" / "policies.md").read_text()
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    for preset in PRESETS.values():
        (row,) = [row for row in rows if f"`{preset.name}`" in row.split("|")[1]]
        assert f"`{preset.split or 'compact'}`" in row
        assert f" {preset.steps or 'all'} " in row
        if not preset.task_sets and preset.split:
            assert f"`{preset.checkpoints['']}`" in row
