"""Runs the trials of a search on the bench, in this process and without pytest."""

from __future__ import annotations

import hashlib
from pathlib import Path

from pytest_safemanip.errors import CannotStage
from pytest_safemanip.judge import Judge
from pytest_safemanip.rollouts import loop
from pytest_safemanip.search.kinds.catalogue import Kinds
from pytest_safemanip.search.space import applicable, load_space
from pytest_safemanip.search.trials import Finding, Outcome
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.spec.task import Task
from tests.physics.scenario import ATTRIBUTES, CATALOGUE, PROPERTIES
from tests.search.bench import SPEC, Bench

SPACE = Path(__file__).parent / "bench.yaml"
PARAMETERS = CATALOGUE.parameters({})
STALL = 3.0


def task_of(name):
    """The safety binding of a task of the bench."""
    cabinet = ("cabinet",) if name == "PutAway" else ()
    return Task(
        name,
        Path("bench.yaml"),
        (),
        "bench",
        "short",
        (),
        objects=("obj",),
        enclosures=cabinet,
        placements=tuple(("obj", role) for role in cabinet),
        skills=(("pick", "obj"), ("place", "obj")),
        touch={"obj": ("body",)},
        supports={"obj": ("counter", "cabinet")},
    )


def dimensions_of(task, path=SPACE):
    """What may be otherwise in it."""
    return applicable(load_space(path, Kinds()), task_of(task), SPEC, "bench", {"hand"}).dimensions


class Tries:
    """Runs trials of a policy in a task of the bench.

    Attributes:
        run: how many rollouts it has run.
    """

    def __init__(self, task, make, properties, dimensions=None):
        self._task, self._make, self._properties = task, make, properties
        self.dimensions = dimensions or dimensions_of(task)
        self._bench, self._binding = Bench(), task_of(task)
        self.run = 0

    def __call__(self, trial):
        """The outcome of a trial."""
        self.run += 1
        try:
            recording = self.record(trial)
        except CannotStage as error:
            return Outcome(refused=str(error))
        judge = Judge(recording, self._binding, ATTRIBUTES, CATALOGUE, PARAMETERS)
        return Outcome(
            {name: finding(judge, PROPERTIES[name]) for name in self._properties},
            digest=hashlib.sha256(recording.steps.qpos.tobytes()).hexdigest()[:16],
        )

    def record(self, trial):
        """Its recording."""
        situation = self.dimensions.situation(trial.deviation)
        request = situation.request(Request(self._task, trial.seed, "bench"))
        job = loop.Job(
            self._task,
            "worker",
            request,
            loop.Protocol(stall_s=STALL),
            {},
            disturbances=situation.disturbances,
            repeat=trial.repeat,
        )
        return loop.run(job, self._bench, self._make())


def finding(judge, prop):
    """What a judge says about a property."""
    verdict = judge.judge(prop)
    worst = max((found.severity.value for found in verdict.findings), default=0.0)
    return Finding(
        verdict.outcome.label == "VIOLATED",
        min(judge.robustness(prop).values()),
        worst,
        verdict.triggered > 0,
    )


def searched(search, tries):
    """Run a search to its end."""
    while trials := search.ask():
        search.tell([tries(trial) for trial in trials])
    return search
