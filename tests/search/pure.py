"""Weaknesses without a simulator: what comes of a trial is a function of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pytest_safemanip.search.kinds.catalogue import Kinds
from pytest_safemanip.search.search import Effort, Search
from pytest_safemanip.search.space import applicable, load_space
from pytest_safemanip.search.trials import Finding, Outcome
from pytest_safemanip.sim.robocasa.robot import SPEC
from pytest_safemanip.spec.task import Task

TASK = Task(
    "Toy",
    Path("toy.yaml"),
    (),
    "toys",
    "short",
    (),
    objects=("obj", "other"),
    enclosures=("cab",),
)
EVERYTHING = frozenset({"images", "instruction", "hand"})
SPACE = """
dimensions:
  left: {move: obj, along: left, limits: [-10 cm, 10 cm], price: 2 cm}
  turn: {turn: obj, limits: [-90 deg, 90 deg], price: 15 deg}
  clutter: {distractor: any, beside: obj, choices: [can, cup], price: 2}
  latency: {latency: actions, limits: [0 ms, 400 ms], price: 50 ms}
  noise: {noise: actions, limits: [0 %, 50 %], price: 5 %}
  push: {push: robot, limits: [0 N s, 20 N s], price: 4 N s, step: 2 N s}
"""


def space_of(folder, text=SPACE, kinds=None):
    path = folder / "space.yaml"
    path.write_text(text)
    return load_space(path, kinds or Kinds())


def dimensions_of(folder, text=SPACE, task=TASK, spec=SPEC, senses=EVERYTHING):
    return applicable(space_of(folder, text), task, spec, "compact", senses).dimensions


def amount(deviation, name):
    """The size of a dimension, 0 if it has none; of a choice 1."""
    setting = deviation.get(name)
    return 0.0 if setting is None else setting.amount


def reaches(**sizes):
    """A weakness to a combination: violated where all of these sizes are reached, of their signs;
    the nearer each is, the less margin there is.
    """

    def margin(trial):
        near = [
            min(max(amount(trial.deviation, name) / size, 0.0), 1.0) for name, size in sizes.items()
        ]
        return -1.0 if min(near) == 1.0 else 1.0 - 0.9 * float(np.mean(near))

    return margin


def outcome_of(trial, exact=True, **margins):
    """What comes of a trial, by properties' margins; of what is random each repeat has its bits."""
    found = {name: own(trial) for name, own in margins.items()}
    findings = {
        name: Finding(value < 0.0, value, 2.0 * (value < 0.0)) for name, value in found.items()
    }
    digest = str(trial.deviation) if exact else f"{trial.deviation} {trial.repeat}"
    return Outcome(findings, digest=digest, recording="a.rollout")


def searched(dimensions, make, seeds=(0,), effort=None, exact=True, order=None, **margins):
    """A search that has come to its end."""
    search = Search(dimensions, list(margins), seeds, effort or Effort(), make)
    while asked := search.ask():
        found = {t: outcome_of(t, exact, **margins) for t in (order or list)(asked)}
        search.tell([found[trial] for trial in asked])
    return search
