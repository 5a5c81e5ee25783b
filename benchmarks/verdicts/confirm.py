"""Whether the contacts that rollouts were flagged for happened: MuJoCo is asked itself.

    python -m benchmarks.verdicts.confirm DIR

Rollouts of the scripted policy in DIR that violate ``collision_contact`` are run again, which gives
the same bits. While a flagged step is simulated, the force between the two bodies that its
evidence names is read by ``mj_contactForce``, geom by geom, at every physics substep: past the
plugin's own reading of contacts, its recordings and its propositions. What is below the limit here
is a false alarm.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from benchmarks.recordings import below, load
from benchmarks.tables import table
from pytest_safemanip.faults.policy import Scripted
from pytest_safemanip.judge import Judge
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.resources import folder
from pytest_safemanip.rollouts import loop as rollout
from pytest_safemanip.sim.codec import decode_request
from pytest_safemanip.sim.mujoco.contacts import ContactSampler
from pytest_safemanip.sim.robocasa import factory, loading
from pytest_safemanip.sim.robocasa.assets import prepare_assets
from pytest_safemanip.spec.objects import load_attributes
from pytest_safemanip.spec.properties import load_properties
from pytest_safemanip.spec.tasks import load_tasks

PROPERTY = "collision_contact"
EVIDENCE = re.compile(
    r"(?:held )?(\S+)(?: \(\w+\))? touches (\S+)(?: \(\w+\))?: ([\d.]+) N \(.*limit ([\d.]+) N\)"
)
"""``robot/link5 touches obj (mug): 12.3 N (limit 5 N)``."""
HAND = ("finger_left", "finger_right", "palm")


@dataclass
class Claim:
    """What a line of evidence says, and what MuJoCo does.

    Attributes:
        step: when.
        bodies: how the names of both bodies begin.
        text: the line.
        newtons: how hard it says that they touch.
        limit: how hard they may, N.
        measured: how hard MuJoCo says that they did, N.
    """

    step: int
    bodies: tuple[str, str]
    text: str
    newtons: float
    limit: float
    measured: float = 0.0


class Listener:
    """Reads forces between bodies as MuJoCo gives them, substep by substep.

    Args:
        claims: what to read.
    """

    def __init__(self, claims: list[Claim]) -> None:
        self.claims, self.step = claims, 0

    def listen(self, model: Any, data: Any) -> None:
        """Take in a substep."""
        for claim in self.claims:
            if claim.step == self.step:
                claim.measured = max(claim.measured, force(model, data, claim.bodies))


def force(model: Any, data: Any, bodies: tuple[str, str]) -> float:
    """Normal force between bodies whose names begin in two ways, now, N."""
    total, wrench = 0.0, np.zeros(6)
    for index in range(data.ncon):
        names = [model.body(model.geom_bodyid[geom]).name for geom in data.contact[index].geom]
        for one, other in (names, names[::-1]):
            if one.startswith(bodies[0]) and other.startswith(bodies[1]):
                mujoco.mj_contactForce(model, data, index, wrench)
                total += float(wrench[0])
    return total


def body(named: str) -> str:
    """How the names of MuJoCo's bodies begin for what evidence names."""
    entity, _, part = named.partition("/")
    if entity != "robot":
        return f"{entity}_"
    if part in HAND:
        return "gripper0_"
    return "mobilebase0_" if part == "base" else f"robot0_{part}"


def flagged(paths: Sequence[Path]) -> Iterator[tuple[Path, list[Claim]]]:
    """Recordings that violate the property, and what its evidence says."""
    tasks, properties = load_tasks([folder("tasks")]), load_properties([folder("properties")])
    attributes, catalogue = load_attributes(folder("tasks") / "objects.yaml"), Catalogue()
    parameters = catalogue.parameters({})
    for path in paths:
        recording = load(path)
        task = tasks[recording.episode.task]
        if PROPERTY not in task.properties or not recording.episode.policy.startswith("scripted"):
            continue
        judge = Judge(recording, task, attributes, catalogue, parameters)
        claims = [
            Claim(finding.first, (body(m[1]), body(m[2])), m[0], float(m[3]), float(m[4]))
            for finding in judge.judge(properties[PROPERTY]).findings
            for m in map(EVIDENCE.match, finding.evidence)
            if m
        ]
        if claims:
            yield path, claims


def again(path: Path, claims: list[Claim], backend: Any) -> bool:
    """Run a rollout again and listen; whether it is the same, bit for bit."""
    recording, listener = load(path), Listener(claims)
    about = recording.episode
    sample, step = ContactSampler.sample, backend.step

    def heard(sampler: ContactSampler, data: Any) -> None:
        sample(sampler, data)
        listener.listen(backend._env.sim.model._model, data)

    def counted(action: Any) -> Any:
        listener.step += 1
        return step(action)

    setattr(ContactSampler, "sample", heard)  # noqa: B010  (mypy refuses to assign to a method)
    backend.step = counted
    job = rollout.Job(
        about.task, about.policy, decode_request(about.request), rollout.Protocol(), about.hashes
    )
    try:
        found = rollout.run(job, backend, Scripted(about.policy.partition(":")[2]))
    finally:
        setattr(ContactSampler, "sample", sample)  # noqa: B010
        del backend.step
    return np.array_equal(found.steps.qpos, recording.steps.qpos)


def main() -> None:
    """Find, run again, print."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    paths = below([Path(sys.argv[1])])
    assets = prepare_assets(loading.package_assets(), "auto")
    backend = factory.local(str(assets.root), assets.kind, {}, {}, "")
    lines, wrong = [], 0
    for path, claims in flagged(paths):
        same = again(path, claims, backend)
        for claim in claims:
            wrong += claim.measured < claim.limit or not same
            said = claim.text if same else f"{claim.text}: went another way this time"
            lines.append([path.stem, str(claim.step), said, f"{claim.measured:.1f}"])
    print(table(["rollout", "step", "evidence", "MuJoCo says, N"], lines))
    print(f"\n{len(lines)} lines of evidence, {wrong} not confirmed")


if __name__ == "__main__":
    main()
