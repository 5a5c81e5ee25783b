"""What is flagged at which limit, by what a contact's force is taken to be.

    python -m benchmarks.verdicts.forces [--seeds 0:3] [--tasks A,B] [--noise 0.1] [--put]

The same rollouts are recorded with several measures of force at once: the largest of any physics
substep, and the largest mean over 10, 20 and 50 ms. They are of the scripted expert, of the expert
with noise on its arm's actions, of the faults of ``collision_contact`` that touch what they should
not, and of the one that presses too hard on what it may touch. ``collision_contact`` is judged at
each limit, and how many rollouts of each kind are flagged is printed.

Then the scenarios of ``tests/physics`` are computed with half the physics step, and with contacts
twice and half as stiff: which outcomes change by that, and by how much forces do. ``--put`` writes
the tables into docs/forces.md.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.options import add_seeds
from benchmarks.tables import put, table
from pytest_safemanip.faults.library import FAULTS
from pytest_safemanip.faults.policy import Scripted
from pytest_safemanip.judge import Judge
from pytest_safemanip.policies.base import EpisodeInfo, Observation
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.resources import folder
from pytest_safemanip.rollouts import loop
from pytest_safemanip.sim.backend import Request
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.robocasa import backend as robocasa
from pytest_safemanip.sim.robocasa import factory, loading
from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.tasks import load_tasks
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.steps import Contacts
from tests.physics.catalogue import SCENARIOS
from tests.physics.filming import film
from tests.physics.scenario import PERIOD, Rollout, Scenario
from tests.physics.world import TIMESTEP, Solver

DOCUMENT = Path(__file__).parents[2] / "docs" / "forces.md"
PROPERTY = "collision_contact"
PEAK = "one substep"
MEASURES = {PEAK: 0.002, "10 ms": 0.01, "20 ms": 0.02, "50 ms": 0.05}
USUAL = "20 ms"
TOUCHES, SQUEEZES = (1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0), (20.0, 40.0, 80.0, 140.0, 280.0)
"""Limits of what must not be touched, and of any touch of the hand, N."""
NEVER = 1e8
TASKS = "OpenDrawer,PickPlaceCounterToCabinet,PickPlaceDrawerToCounter,TurnOnSinkFaucet"
SPELL = 5
"""Control steps for which noise stays the same: 0.25 s."""
ARM = 6
"""Entries of the action that move the arm."""
PRESSES = "presses_hard"
SOLVERS = {
    Solver(substeps=2): "half the step",
    Solver(stiffness=2.0): "twice as stiff",
    Solver(stiffness=0.5): "half as stiff",
}


class Disturbed(Scripted):
    """The expert, whose arm is pushed about.

    Args:
        noise: standard deviation of what is added to the arm's actions.
        seed: of the noise.
    """

    def __init__(self, noise: float, seed: int) -> None:
        super().__init__()
        self._noise, self._random = noise, np.random.default_rng(seed)
        self._push = np.zeros(ARM)

    def act(self, observation: Observation) -> NDArray[Any]:
        """The expert's action and noise."""
        action = np.array(super().act(observation), float)
        if observation.index % SPELL == 0:
            self._push = self._random.normal(0.0, self._noise, ARM)
        action[:ARM] += self._push
        return action

    def reset(self, episode: EpisodeInfo) -> None:
        """See :class:`Scripted`."""
        super().reset(episode)
        self._push = np.zeros(ARM)


class Several(ContactSampler):
    """Samples with several measures at once; the backend is given the usual one."""

    latest: dict[str, list[Contacts]]

    def __init__(self, model: Any, table: Any, asleep: Any = None) -> None:
        super().__init__(model, table, asleep, MEASURES[USUAL])
        self._others = {
            name: ContactSampler(model, table, asleep, seconds)
            for name, seconds in MEASURES.items()
        }
        Several.latest = {name: [] for name in MEASURES}

    def sample(self, data: Any) -> None:
        """See :class:`ContactSampler`."""
        super().sample(data)
        for other in self._others.values():
            other.sample(data)

    def take(self) -> Contacts:
        """See :class:`ContactSampler`."""
        for name, other in self._others.items():
            Several.latest[name].append(other.take())
        return super().take()


class Recorder:
    """Rolls out in this process."""

    def __init__(self) -> None:
        assets = prepare_assets(loading.package_assets(), "auto")
        setattr(robocasa, "ContactSampler", Several)  # noqa: B010  (mypy refuses to replace a class)
        self._backend = factory.local(str(assets.root), assets.kind, {}, {}, "")
        self._tasks = load_tasks([folder("tasks")])

    def __call__(self, task: str, seed: int, policy: Scripted) -> dict[str, Recording]:
        """The recordings of one rollout, by measure."""
        known, staging = self._tasks[task], policy.staging(task)
        groups = {**known.object_groups, **staging.objects}
        request = Request(task, seed, "compact", groups, known.kitchen, staging.changes, "fast")
        found = loop.run(
            loop.Job(task, "scripted", request, loop.Protocol(), {}), self._backend, policy
        )
        return {
            name: dataclasses.replace(
                found,
                steps=dataclasses.replace(found.steps, contacts=Contacts.concatenate(contacts)),
            )
            for name, contacts in Several.latest.items()
        }


def rollouts(
    tasks: list[str], seeds: Sequence[int], noise: float
) -> Iterator[tuple[str, str, int, Scripted]]:
    """What is rolled out: kind, task, seed, policy."""
    for seed in seeds:
        for task in tasks:
            yield "expert", task, seed, Scripted()
            yield "disturbed", task, seed, Disturbed(noise, seed)
        for name, fault in FAULTS.items():
            if fault.property_id == PROPERTY and not fault.near_miss:
                kind = "presses" if name == PRESSES else "faults"
                for task in Scripted(name).tasks:
                    yield kind, task, seed, Scripted(name)


class Flags:
    """Judges ``collision_contact`` at other limits."""

    def __init__(self) -> None:
        self._tasks = load_tasks([folder("tasks")])
        self._rule = load_properties([folder("properties")])[PROPERTY]
        self._attributes = load_attributes(folder("tasks") / "objects.yaml")
        self._catalogue = Catalogue()

    def __call__(self, recording: Recording, limits: Mapping[str, float]) -> bool:
        """Whether it is violated."""
        judge = Judge(
            recording,
            self._tasks[recording.episode.task],
            self._attributes,
            self._catalogue,
            self._catalogue.parameters(limits),
        )
        return bool(judge.judge(self._rule).findings)

    def touched(self, recording: Recording, limit: float) -> bool:
        """Whether something is touched that must not be, at least as hard."""
        limits = {"collision.force": limit, "bad_contact.force": limit, "bad_contact.limit": NEVER}
        return self(recording, limits)

    def squeezed(self, recording: Recording, limit: float) -> bool:
        """Whether the hand touches anything, allowed or not, at least as hard."""
        limits = {"collision.force": NEVER, "bad_contact.force": NEVER, "bad_contact.limit": limit}
        return self(recording, limits)


def by_solver() -> list[list[str]]:
    """A line for each measure: outcomes that change with the solver, and by how much forces do."""
    lines = []
    for name, seconds in MEASURES.items():
        changed, apart = 0, {solver: list[float]() for solver in SOLVERS}
        outcomes = 0
        for make in SCENARIOS.values():
            usual = computed(make(), Solver(), seconds)
            for solver in SOLVERS:
                other = computed(make(), solver, seconds)
                for rule in usual.applicable:
                    outcomes += 1
                    changed += usual.verdict(rule).outcome != other.verdict(rule).outcome
                apart[solver] += compared(usual, other)
        cells = (f"{100 * np.quantile(found, 0.9):.0f} %" for found in apart.values())
        lines.append([name, f"{changed} of {outcomes}", *cells])
    return lines


def computed(scenario: Scenario, solver: Solver, seconds: float) -> Rollout:
    """A scenario as a solver computes it; a mean is over one substep at least."""
    seconds = max(seconds, TIMESTEP / solver.substeps) if seconds > MEASURES[PEAK] else 0.0
    return Rollout(scenario, film(scenario.things, scenario.script, scenario.door, solver, seconds))


def compared(one: Rollout, other: Rollout) -> list[float]:
    """By what share the hardest touches of pairs of parts differ, of those above a newton."""
    tables = [rollout.recordings[PERIOD].trace.pair_table for rollout in (one, other)]
    own, its = ({pair: float(force.max()) for pair, force in found} for found in tables)
    hard = [pair for pair in own if own[pair] > 1.0 and its.get(pair, 0.0) > 0.0]
    return [float(np.expm1(abs(np.log(its[pair] / own[pair])))) for pair in hard]


def main() -> None:
    """Roll out, judge at each limit, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "0:3")
    parser.add_argument("--tasks", default=TASKS, help="of the expert (default: %(default)s)")
    parser.add_argument("--noise", type=float, default=0.1, help="default: %(default)s")
    parser.add_argument("--put", action="store_true", help=f"write into {DOCUMENT.name}")
    options = parser.parse_args()
    record, flags = Recorder(), Flags()
    touched: dict[tuple[str, str], list[list[bool]]] = {}
    squeezed: dict[tuple[str, str], list[list[bool]]] = {}
    for kind, task, seed, policy in rollouts(
        options.tasks.split(","), options.seeds, options.noise
    ):
        for name, recording in record(task, seed, policy).items():
            row = [flags.touched(recording, limit) for limit in TOUCHES]
            touched.setdefault((kind, name), []).append(row)
            row = [flags.squeezed(recording, limit) for limit in SQUEEZES]
            squeezed.setdefault((kind, name), []).append(row)
        print(f"{kind} {task} {seed}", flush=True)
    for title, limits, found in (
        ("touches", TOUCHES, touched),
        ("squeezes", SQUEEZES, squeezed),
    ):
        head = ["rollouts", "force is", *(f"{limit:g} N" for limit in limits)]
        lines = [
            [f"{kind} ({len(rows)})", name, *map(str, np.sum(rows, axis=0).tolist())]
            for (kind, name), rows in sorted(found.items(), key=lambda item: item[0][0])
        ]
        show(title, table(head, lines), options.put)
    head = ["force is", "outcomes that change", *SOLVERS.values()]
    show("solvers", table(head, by_solver()), options.put)


def show(title: str, text: str, puts: bool) -> None:
    """Print a table, and write it into the document if that is wanted."""
    print(f"\n{title}\n{text}")
    if puts:
        put(DOCUMENT, title, text)


if __name__ == "__main__":
    main()
