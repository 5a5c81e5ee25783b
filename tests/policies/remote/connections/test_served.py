"""One policy on several servers, for several rollouts at a time."""

from __future__ import annotations

import contextlib
import socket
import threading
import time

import msgpack
import pytest

from pytest_safemanip.errors import (
    ConfigError,
    PolicyConnectionLost,
    PolicyMismatch,
    PolicyUnreachable,
)
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.policies.registry import resolve
from pytest_safemanip.policies.remote.claims import announced, name_of
from pytest_safemanip.policies.remote.endpoint import Deadlines, Endpoint
from pytest_safemanip.policies.remote.presets import PRESETS
from pytest_safemanip.policies.remote.served import RemotePolicyPool, RemoteRollout
from tests import toy
from tests.policies.remote import servers

QUICK = Deadlines(start=0.0, open=2.0, warm_up=5.0, call=2.0)
OWN = {"policy": "m:Model", "source": "abc", "fingerprint": "weights 1", "reset": False}


def at(server):
    return Endpoint("ws", "127.0.0.1", server.port)


def pool(folder, *endpoints, **changed):
    arguments = {"deadlines": QUICK, **changed}
    return RemotePolicyPool(PRESETS["openpi"], {"": endpoints}, folder, **arguments)


def episode(seed=0):
    return EpisodeInfo("T", seed, "lift it", 10, toy.SCENE, toy.ROBOT)


def observation():
    world = toy.World()
    start = world.reset(type("Request", (), {"seed": 0}))
    key = toy.SPEC.instruction
    return Observation(0, "lift it", start.step, world.observe, key)


@contextlib.contextmanager
def rollouts(served, number):
    with contextlib.ExitStack() as stack:
        found = [RemoteRollout(served) for _ in range(number)]
        for rollout in found:
            stack.callback(rollout.close)
        stack.callback(served.close)
        yield found


def test_rollouts_are_begun_at_the_server_that_has_the_fewest(tmp_path):
    seen = [], []
    with servers.openpi(seen=seen[0]) as one, servers.openpi(seen=seen[1]) as two:
        served = pool(tmp_path, at(one), at(two))
        with rollouts(served, 5) as found:
            for rollout in found[:4]:
                rollout.reset(episode())
                rollout.act(observation())
            assert [len(requests) for requests in seen] == [2, 2]
            found[1].close()
            found[3].close()  # both of the second server
            found[4].reset(episode())
            found[4].act(observation())
            assert [len(requests) for requests in seen] == [2, 3]
            found[4].act(observation())  # and stays there
            assert [len(requests) for requests in seen] == [2, 4]


def test_another_process_counts_as_load_too(tmp_path):
    seen = [], []
    with servers.openpi(seen=seen[0]) as one, servers.openpi(seen=seen[1]) as two:
        here, there = (pool(tmp_path, at(one), at(two)) for _ in range(2))
        with rollouts(here, 1) as (first,), rollouts(there, 1) as (second,):
            for rollout in (first, second):
                rollout.reset(episode())
                rollout.act(observation())
        assert [len(requests) for requests in seen] == [1, 1]


@pytest.mark.parametrize(("inflight", "together"), [(1, 1), (2, 2)])
def test_waiting_for_a_slot_counts_against_no_deadline(tmp_path, inflight, together):
    now, most, changing = [0], [0], threading.Lock()

    def reply(frames, request):
        with changing:
            now[0] += 1
            most[0] = max(now[0], most[0])
        time.sleep(0.3)
        with changing:
            now[0] -= 1
        frames.send(servers.openpi_actions())

    with servers.openpi(reply) as server:
        patience = Deadlines(start=0.0, open=2.0, warm_up=1.0, call=1.0)
        served = pool(tmp_path, at(server), deadlines=patience, inflight=inflight)
        with rollouts(served, 4) as found:
            failures = []

            def run(rollout):
                try:
                    rollout.reset(episode())
                    rollout.act(observation())
                except Exception as error:
                    failures.append(error)

            threads = [threading.Thread(target=run, args=(rollout,)) for rollout in found]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
    assert failures == []
    assert most == [together]


def test_the_others_take_over_from_a_server_that_is_gone(tmp_path):
    seen = []
    with contextlib.ExitStack() as stack:
        two = stack.enter_context(servers.openpi(seen=seen))
        one = stack.enter_context(servers.openpi())
        served = pool(tmp_path, at(one), at(two))
        served.meet("T", ())
        one.__exit__()
        with rollouts(served, 3) as found:
            for rollout in found:
                with contextlib.suppress(Exception):  # the first notices
                    rollout.reset(episode())
                    rollout.act(observation())
            found[0].reset(episode())
            found[0].act(observation())
            assert len(seen) >= 2


def test_all_connections_to_a_server_that_was_started_anew_are_lost_with_the_first(
    tmp_path,
):
    with servers.openpi() as server:
        served = pool(tmp_path, at(server))
        found = [RemoteRollout(served) for _ in range(3)]
        for rollout in found:
            rollout.reset(episode())
        for rollout in found:
            rollout.close()
    with servers.openpi(port=server.port), rollouts(served, 1) as (rollout,):
        rollout.reset(episode())
        with pytest.raises(PolicyConnectionLost):
            rollout.act(observation())
        rollout.close()
        rollout.reset(episode())
        rollout.act(observation())


def test_all_servers_must_be_there_when_the_first_is_needed(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with servers.openpi() as server:
        served = pool(tmp_path, at(server), Endpoint("ws", "127.0.0.1", port))
        with pytest.raises(PolicyUnreachable, match=f"127.0.0.1:{port}: nothing listens"):
            served.meet("T", ())
        served.close()


def test_servers_of_one_policy_have_to_say_the_same(tmp_path):
    metadata = [msgpack.packb({"checkpoint": name}) for name in ("run/1", "run/2", "run/1")]
    with contextlib.ExitStack() as stack:
        one, two, three = (stack.enter_context(servers.openpi(metadata=m)) for m in metadata)
        mixed, same = pool(tmp_path, at(one), at(two)), pool(tmp_path, at(one), at(three))
        with pytest.raises(PolicyMismatch) as caught:
            mixed.meet("T", ())
        assert str(caught.value) == (
            "policy openpi: its servers do not have the same checkpoint: "
            f"{at(one)}: run/1; {at(two)}: run/2"
        )
        same.meet("T", ())
        mixed.close()
        same.close()


def test_a_policy_is_known_by_its_claim_or_else_by_what_its_server_says(tmp_path):
    nowhere = Endpoint("ws", "127.0.0.1", 1)
    with contextlib.ExitStack() as stack:

        def known(metadata=None, **changed):
            server = stack.enter_context(servers.openpi(metadata=msgpack.packb(metadata or {})))
            served = pool(tmp_path, at(server), **changed)
            stack.callback(served.close)
            return served.identity("T", ())

        assert known() is None
        assert known({"reset_pose": [1, 2]}) is None
        assert known({"safemanip": {**OWN, "fingerprint": None}}) is None
        said = [
            known({"checkpoint": "run/1"}),
            known({"checkpoint": "run/2"}),
            known({"fingerprint": "run/1"}),
            known({"safemanip": OWN}),
            known({"safemanip": {**OWN, "fingerprint": "weights 2"}}),
            known({"safemanip": {**OWN, "source": "abd"}}),
            known(claimed="run/1"),
            known(claimed="run/3"),
        ]
        assert None not in said
        assert len({*said}) == len(said)
        # The same at another address, and in another version of what serves it.
        assert known({"checkpoint": "run/1", "uptime": 7}) == said[0]
        assert known({"safemanip": {**OWN, "numpy": "3"}}) == said[3]
        # What is claimed need not be asked for.
        assert pool(tmp_path, nowhere, claimed="run/1").identity("T", ()) == said[6]
        with pytest.raises(PolicyUnreachable):
            pool(tmp_path, nowhere).identity("T", ())


def test_what_a_server_says_is_named_in_few_words():
    assert name_of(announced({"safemanip": OWN})) == "m:Model weights 1"
    assert name_of(announced({"checkpoint": "run/1"})) == "run/1"
    assert name_of(announced({"model": "x"})) == ""


def test_the_official_checkpoint_is_claimed_by_a_word_where_there_is_one():
    spec = resolve("pi05", {}, checkpoints={"pi05": "official"})
    official = PRESETS["pi05"].checkpoints[""]
    assert spec.claim["claimed_checkpoints"] == {"all": official}
    assert resolve("pi05", {}).claim["claimed_checkpoints"] == {"all": ""}
    sets = resolve("groot-to", {}, {"groot-to": "atomic_seen@a"}, checkpoints={"groot-to": "mine"})
    assert sets.claim["claimed_checkpoints"] == {"atomic_seen": "mine"}
    with pytest.raises(ConfigError, match="openpi@official: it has no official checkpoint"):
        resolve("openpi", {}, checkpoints={"openpi": "official"})


def test_a_server_that_keeps_the_state_of_one_episode_serves_one_at_a_time(tmp_path):
    metadata = msgpack.packb({"safemanip": {**OWN, "reset": True}})

    def reply(frames, request):
        if "safemanip/reset" in msgpack.unpackb(request):
            frames.send(msgpack.packb({"safemanip/reset": True}))
        else:
            frames.send(servers.openpi_actions())

    with servers.openpi(reply, metadata) as server:
        served = pool(tmp_path, at(server))
        served.meet("T", ())
        with rollouts(served, 2) as (first, second):
            first.reset(episode())
            waiting = threading.Thread(target=second.reset, args=(episode(1),))
            waiting.start()
            first.act(observation())
            time.sleep(0.1)
            assert waiting.is_alive()
            first.close()
            waiting.join(5)
            assert not waiting.is_alive()
            assert second.served_facts()["seeded"] == "yes"


def test_recordings_say_the_same_whichever_server_a_rollout_was_at(tmp_path):
    with servers.openpi() as one, servers.openpi() as two:
        served = pool(tmp_path, at(one), at(two), claimed="run/1")
        with rollouts(served, 2) as found:
            facts = []
            for rollout in found:
                rollout.reset(episode())
                rollout.act(observation())
                facts.append(rollout.served_facts())
        assert facts[0] == facts[1]
        assert facts[0]["endpoint"] == f"{at(one)}+{at(two)}"
        assert facts[0]["checkpoint"] == "run/1"


def test_a_server_that_comes_back_with_another_checkpoint_is_refused(tmp_path):
    names = iter("AAB")

    def converse(frames):
        frames.send(msgpack.packb({"checkpoint": next(names)}))
        while True:
            frames.receive()
            frames.send(servers.openpi_actions())

    with servers.websocket(converse) as server:
        served = pool(tmp_path, at(server))
        with rollouts(served, 3) as (one, two, three):
            before = served.identity("T", ())
            one.reset(episode())
            two.reset(episode())
            with pytest.raises(PolicyMismatch, match="announced A when the run began, and now B"):
                three.reset(episode())
            assert served.identity("T", ()) == before
            one.act(observation())
