"""robosuite in a process of its own, and rollouts in it that tests share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest

from pytest_safemanip.judge import Judge, Verdict
from pytest_safemanip.rollouts.loop import Job, Protocol, run
from pytest_safemanip.run.definitions import load_definitions
from pytest_safemanip.sim.backend import Backend, Options, Request
from pytest_safemanip.sim.robosuite.factory import simulator
from pytest_safemanip.trace import Recording
from tests.robosuite import scripts

DEFINED = load_definitions([], [], [], "robosuite")
UP_TO_THE_HORIZON = Protocol("horizon", 0.19)


@dataclass(frozen=True)
class Judged:
    """A rollout, and what judges it."""

    recording: Recording
    judge: Judge

    def verdict(self, name: str) -> Verdict:
        return self.judge.judge(DEFINED.properties[name])

    @property
    def violated(self) -> set[str]:
        names = DEFINED.tasks[self.recording.episode.task].properties
        return {name for name in names if self.verdict(name).findings}

    @property
    def triggered(self) -> set[str]:
        names = DEFINED.tasks[self.recording.episode.task].properties
        return {name for name in names if self.verdict(name).triggered}


@pytest.fixture(scope="session")
def backend(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Backend]:
    """With Pandas."""
    made = simulator("").create(Options("auto", tmp_path_factory.mktemp("logs")))
    yield made
    made.close()


@pytest.fixture(scope="session")
def rolled(backend: Backend) -> Callable[..., Judged]:
    """A script's rollout of seed 0, judged; run once."""
    known: dict[tuple[str, ...], Judged] = {}

    def get(task: str, script: str, how: str = "well", protocol: Protocol | None = None) -> Judged:
        if (task, script, how) not in known:
            request = Request(task, 0, "official", stepping="exact")
            job = Job(task, script, request, protocol or Protocol(), {"policy": "", "key": ""})
            recording = run(job, backend, getattr(scripts, script)(how))
            known[task, script, how] = Judged(recording, judge(recording))
        return known[task, script, how]

    return get


def judge(recording: Recording) -> Judge:
    catalogue = DEFINED.catalogue
    task = DEFINED.tasks[recording.episode.task]
    return Judge(recording, task, DEFINED.attributes, catalogue, catalogue.parameters({}), "timed")
