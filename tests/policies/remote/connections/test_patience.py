"""Servers that are too slow, or away for a while: waited for, as long as was promised."""

from __future__ import annotations

import threading
import time

import msgpack
import pytest

from pytest_safemanip.errors import PolicyConnectionLost, PolicyMismatch, PolicyUnreachable
from pytest_safemanip.policies.remote.endpoint import Deadlines
from tests.policies.remote import servers
from tests.policies.remote.conftest import EPISODE, PATIENT

LOADING = Deadlines(start=0.1, open=0.3, warm_up=5.0, call=0.5, restart=20.0)


def test_a_server_that_is_restarted_is_waited_for_longer_than_a_new_one(connect, observation):
    first = servers.openpi()
    with first:
        policy = connect("pi05", first.port, LOADING)
        policy.reset(EPISODE)
        policy.act(observation, 0)
    with pytest.raises(PolicyConnectionLost):
        policy.act(observation, 5)
    second = []
    delay = threading.Timer(1.5, lambda: second.append(servers.openpi(port=first.port)))
    delay.start()
    began = time.monotonic()
    try:
        policy.prepare("OpenDrawer")
        assert time.monotonic() - began > LOADING.start + LOADING.open
        assert policy.act(observation, 0).shape == (5, 12)
    finally:
        delay.join()
        with second[0]:
            policy.close()


def test_a_server_that_never_comes_back_is_given_up_at_the_deadline(connect, observation):
    deadlines = Deadlines(start=0.1, open=0.3, warm_up=5.0, call=0.5, restart=1.0)
    with servers.openpi() as server:
        policy = connect("pi05", server.port, deadlines)
        policy.reset(EPISODE)
    with pytest.raises(PolicyConnectionLost):
        policy.act(observation, 0)
    began = time.monotonic()
    with pytest.raises(PolicyUnreachable, match="nothing listens"):
        policy.reset(EPISODE)
    assert 1.0 <= time.monotonic() - began < 5


def test_a_groot_server_that_answers_too_late_is_asked_again_once_it_is_free(connect, observation):
    """It computes one request at a time: while it does, nobody can connect."""
    slow = threading.Event()

    def answer(request):
        if msgpack.unpackb(request)["endpoint"] == "get_action" and slow.is_set():
            slow.clear()
            time.sleep(2)
        return servers.groot()(request)

    with servers.Zmq(answer) as server:
        policy = connect("groot", server.port, LOADING)
        policy.prepare("OpenDrawer")
        policy.reset(EPISODE)
        slow.set()
        with pytest.raises(PolicyConnectionLost, match=r"did not answer within 0\.5 s"):
            policy.act(observation, 0)
        policy.prepare("OpenDrawer")
        policy.reset(EPISODE)
        assert policy.act(observation, 0).shape == (16, 12)


def test_a_server_is_tried_once(connect, observation):
    seen = []
    with servers.openpi(seen=seen) as server:
        policy = connect("pi05", server.port)
        for _ in range(3):
            policy.prepare("OpenDrawer")
            policy.reset(EPISODE)
            policy.act(observation, 0)
        policy.close()
        policy.prepare("OpenDrawer")
    assert len(seen) == 1 + 3
    assert policy.counts.calls == 1  # of the episode, without the trial


def test_a_model_that_does_not_fit_is_found_when_it_is_tried(connect):
    with servers.openpi(servers.openpi_actions(rows=4)) as server:
        policy = connect("pi05", server.port, PATIENT)
        with pytest.raises(PolicyMismatch, match="trying the server: 4 actions, but 5 are"):
            policy.prepare("OpenDrawer")
        with pytest.raises(PolicyMismatch):
            policy.prepare("OpenDrawer")


def test_vla_evals_servers_are_tried_within_an_episode(connect):
    seen = []
    with servers.vlaeval(seen=seen) as server:
        connect("vla-eval", server.port).prepare("OpenDrawer")
    assert [found["type"] for found in seen] == ["hello", "episode_start", "observation"]
    assert seen[1]["payload"]["task"]["name"] == "OpenDrawer"
