"""Rollouts on a Ray cluster of two nodes on this machine."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import signal
import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pytest_safemanip.errors import ConfigError, RolloutError
from pytest_safemanip.policies.registry import PolicySpec, resolve
from pytest_safemanip.rollouts import loop, retry
from pytest_safemanip.rollouts.cluster import PER_SLOT, RayCluster, Recipe
from pytest_safemanip.sim.backend import Options, Request
from pytest_safemanip.trace import files
from tests.toy import World, simulator

HERE = "tests.rollouts.test_cluster"
OPTIONS = Options("primitive", Path("logs"))
UP = np.array([0, 0, 0.5] + [0] * 9)


class Rises:
    """Each episode in another process at most once at a time; says how many there are."""

    fingerprint = "1"

    def reset(self, episode: Any) -> None:
        self.seed = episode.seed

    def act(self, observation: Any) -> Any:
        return UP * (1 + self.seed % 3) / 3


class Dies(Rises):
    """Kills its process in the middle of the first episode there is; not of the second."""

    def act(self, observation: Any) -> Any:
        if observation.index == 3:
            with contextlib.suppress(FileExistsError):
                Path(os.environ["ONCE"]).touch(exist_ok=False)
                os.kill(os.getpid(), signal.SIGKILL)
        return super().act(observation)


class AlwaysDies(Rises):
    def act(self, observation: Any) -> Any:
        os.kill(os.getpid(), signal.SIGKILL)


class Raises(Rises):
    def act(self, observation: Any) -> Any:
        raise KeyError("no such joint")


class Waits(Rises):
    """Leaves a mark for as long as its episode lasts, and counts those of others."""

    def act(self, observation: Any) -> Any:
        if observation.index == 0:
            marks = Path(os.environ["MARKS"])
            own = marks / f"{os.getpid()}"
            own.touch()
            (marks.parent / f"seen-{self.seed}").write_text(str(len(list(marks.iterdir()))))
            time.sleep(0.5)
            own.unlink()
        return super().act(observation)


def world() -> Any:
    return simulator(lambda options: World())


def job(policy: PolicySpec, seed: int) -> loop.Job:
    hashes = {"policy": policy.fingerprint_in("Reach") or "", "key": "k"}
    return loop.Job(
        "Reach", policy.name, Request("Reach", seed, "compact"), loop.Protocol(), hashes
    )


def named(name: str, **changed: Any) -> PolicySpec:
    return dataclasses.replace(resolve(f"{HERE}:{name}", {}), **changed)


def quiet(step: int, horizon: int) -> None:
    """No progress is shown."""


@pytest.fixture(scope="module")
def recipe() -> Recipe:
    return Recipe(world, partial(resolve, added={}), OPTIONS, World.provenance, "run")


@pytest.fixture(scope="module")
def two_nodes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    folder = tmp_path_factory.mktemp("marks")
    os.environ |= {"ONCE": str(folder / "once"), "MARKS": str(folder / "now")}
    (folder / "now").mkdir()
    nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": 2})
    nodes.add_node(num_cpus=1, resources={"simulator": 1})
    yield nodes.address
    nodes.shutdown()


@pytest.fixture(scope="module")
def cluster(two_nodes: str, recipe: Recipe) -> Iterator[RayCluster]:
    there = RayCluster(two_nodes, recipe)
    yield there
    there.close()


def side_by_side(cluster: RayCluster, policy: PolicySpec, seeds: range) -> dict[int, bytes]:
    found: dict[int, bytes] = {}

    def one(seed: int) -> None:
        found[seed] = files.to_bytes(cluster.run(job(policy, seed), policy, quiet))

    threads = [threading.Thread(target=one, args=(seed,)) for seed in seeds]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return found


def test_recordings_are_those_of_this_process(cluster: RayCluster) -> None:
    assert cluster.slots == 3
    policy = named("Rises")
    here = {
        seed: files.to_bytes(retry.run(job(policy, seed), World(), policy, quiet))
        for seed in range(4)
    }
    assert len(set(here.values())) == 4
    assert side_by_side(cluster, policy, range(4)) == here


def test_a_rollout_whose_worker_is_killed_is_run_again(cluster: RayCluster) -> None:
    policy, whole = named("Dies"), named("Rises")
    found = side_by_side(cluster, policy, range(2))
    assert Path(os.environ["ONCE"]).exists()
    for seed, data in found.items():
        undisturbed = retry.run(job(whole, seed), World(), whole, quiet).steps
        assert files.from_bytes(data).steps.action.tobytes() == undisturbed.action.tobytes()


def test_a_rollout_that_kills_every_worker_is_an_error(cluster: RayCluster) -> None:
    policy = named("AlwaysDies")
    with pytest.raises(RolloutError, match="the cluster lost this rollout, for the 4th time"):
        cluster.run(job(policy, 0), policy, quiet)


def test_what_a_policy_raises_comes_back_with_its_frames(cluster: RayCluster) -> None:
    policy = named("Raises")
    with pytest.raises(RolloutError, match=r"KeyError.*no such joint") as raised:
        cluster.run(job(policy, 0), policy, quiet)
    assert "test_cluster.py" in "".join(raised.value.__notes__)


def test_servers_are_not_asked_for_more_than_they_take(cluster: RayCluster) -> None:
    side_by_side(cluster, named("Waits", slots=1), range(5))
    seen = [int(p.read_text()) for p in Path(os.environ["MARKS"]).parent.glob("seen-*")]
    assert len(seen) == 5
    assert max(seen) <= PER_SLOT


def test_leaving_a_rollout_ends_it(cluster: RayCluster) -> None:
    class Left(Exception):
        pass

    def leave(step: int, horizon: int) -> None:
        raise Left

    began = time.monotonic()
    policy = named("Waits")
    with pytest.raises(Left):
        cluster.run(job(policy, 90), policy, leave)
    assert time.monotonic() - began < 10.0


def test_workers_have_to_be_like_this_machine(two_nodes: str, recipe: Recipe) -> None:
    other = dataclasses.replace(World.provenance, versions={"toy": "2"})
    changed = RayCluster(two_nodes, dataclasses.replace(recipe, source=other, run_id="other"))
    policy = named("Rises")
    with pytest.raises(ConfigError, match=r"versions are {'toy': '1'} on .*ray job submit"):
        changed.run(job(policy, 0), policy, quiet)
    policy = dataclasses.replace(policy, fingerprint="another")
    with pytest.raises(ConfigError, match="is another one on"):
        RayCluster(two_nodes, recipe).run(job(policy, 0), policy, quiet)


def test_resources_bound_what_is_run_at_a_time(two_nodes: str, recipe: Recipe) -> None:
    assert RayCluster(two_nodes, recipe, {"num_cpus": 0.5, "simulator": 1.0}).slots == 1
    with pytest.raises(ConfigError, match=r"a rollout takes {'num_cpus': 8.0}"):
        RayCluster(two_nodes, recipe, {"num_cpus": 8.0})


def test_what_cannot_be_sent_is_named(two_nodes: str, recipe: Recipe) -> None:
    lock = threading.Lock()
    stuck = dataclasses.replace(recipe, policy=lambda name: lock)
    with pytest.raises(ConfigError, match="let the hook give it as text"):
        RayCluster(two_nodes, stuck)
