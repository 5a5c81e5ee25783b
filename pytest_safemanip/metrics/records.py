"""The input of all metrics: one record per rollout, plain data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, NamedTuple

from pytest_safemanip.spec.packs import NO_PACK

OutcomeName = Literal["VIOLATED", "UNRESOLVED", "SATISFIED", "VACUOUS"]


class RolloutKey(NamedTuple):
    """Key of a rollout within a run."""

    policy: str
    task: str
    seed: int


def severity(violation: Mapping[str, Any]) -> float:
    """The severity of a violation, which violations are ranked by, larger is worse; 0 in a summary
    of a version that measured none.

    Args:
        violation: as a summary has it.
    """
    return float(violation.get("severity", 0.0))


@dataclass(frozen=True)
class PropertyRecord:
    """The verdict on one property of a rollout.

    Attributes:
        property: its id.
        category: its category.
        outcome: over all instances.
        triggered: whether some instance was triggered.
        violations: entities, first and last step, duration in seconds, reason and ``severity`` of
            each, what it was ``measured`` by (``margin``, ``force`` in N, ``fall`` in m, ``speed``
            in m/s), its ``cost``, and its ``excess`` (``between``, ``entities``, ``force`` and
            ``limit`` in N, ``step``), if any.
    """

    property: str
    category: str
    outcome: OutcomeName
    triggered: bool
    violations: tuple[Mapping[str, Any], ...]


def cost_of(verdicts: Iterable[PropertyRecord]) -> float | None:
    """What the violations of a rollout cost in all; None where a version that added up no cost has
    written one of them.
    """
    violations = [violation for verdict in verdicts for violation in verdict.violations]
    if not all("cost" in violation for violation in violations):
        return None
    return round(sum(float(violation["cost"]) for violation in violations), 6)


@dataclass
class RolloutRecord:
    """Outcome and verdicts of one rollout.

    Attributes:
        task: name of the task.
        policy: name of the policy.
        seed: of the episode.
        suite: group of the benchmark that the task is in.
        horizon: horizon class of the task.
        success: whether the task's own check held; None if the rollout is not complete.
        acting_steps: control steps before the settle tail.
        truncated: whether its recording ends without a settle tail.
        warned: the violation that was near where a warning ended it; empty if none did.
        failure: why the policy gave up, in its own words; empty if it did not, or did not say.
        error: why it is not complete; empty if it is, or if it was not run.
        infrastructure: whether that was a server's or the simulator's failure.
        restarts: how often it was begun again, since the policy's server had failed.
        recording: path of the recording.
        reused: whether an earlier run made the recording, and this one used it again.
        provenance: index of its origin among those of the run.
        served: of a policy on a server: what was found out about it, and exchanged with it.
        properties: verdicts by property id; only those that were asked for.
        unjudged: categories of the properties that were asked for and have no verdict, by id.
        deselected: likewise of those that were taken out of the run after it was laid out, with
            pytest's ``-k`` for instance. Metrics leave them out; gates and comparisons do not.
        packs: of all of these properties that are rules of packs, the pack, by id.
    """

    task: str
    policy: str
    seed: int
    suite: str
    horizon: str
    success: bool | None = None
    acting_steps: int = 0
    truncated: bool = False
    warned: str = ""
    failure: str = ""
    error: str = ""
    infrastructure: bool = False
    restarts: int = 0
    recording: str = ""
    reused: bool = False
    provenance: int | None = None
    served: Mapping[str, str] = field(default_factory=dict)
    properties: dict[str, PropertyRecord] = field(default_factory=dict)
    unjudged: dict[str, str] = field(default_factory=dict)
    deselected: dict[str, str] = field(default_factory=dict)
    packs: dict[str, str] = field(default_factory=dict)

    @property
    def key(self) -> RolloutKey:
        """Key of the rollout within a run."""
        return RolloutKey(self.policy, self.task, self.seed)

    @property
    def complete(self) -> bool:
        """Whether it ran to its end. Incomplete ones are neither safe nor unsafe."""
        return self.success is not None and not self.error

    @property
    def cost(self) -> float | None:
        """What its violations cost in all; None where that of one is not known."""
        return cost_of(self.properties.values())

    @property
    def asked(self) -> tuple[str, ...]:
        """Ids of the properties with a verdict and of those without one."""
        return (*self.properties, *self.unjudged)

    def pack_of(self, property_id: str) -> str:
        """The pack that a property is a rule of; ``default`` for those of none."""
        return self.packs.get(property_id, NO_PACK)

    @property
    def reason(self) -> str:
        """The reason why some verdict is missing, in one line."""
        if self.error:
            return self.error.splitlines()[0]
        if self.deselected:
            known = {*self.properties, *self.unjudged, *self.deselected}
            return (
                f"{len(self.deselected)} of {len(known)} cases of this rollout were deselected; "
                "choose with --safemanip-tasks, -properties and -seeds instead"
            )
        return "not run to its end"

    def as_planned(self) -> RolloutRecord:
        """The record with the deselected properties among those without a verdict."""
        return replace(self, unjudged={**self.unjudged, **self.deselected})

    def to_json(self) -> dict[str, Any]:
        """Plain builtins."""
        verdicts = [asdict(p) for p in self.properties.values()]
        return {**asdict(self), "cost": self.cost, "properties": verdicts}


def by_policy(records: Iterable[RolloutRecord]) -> dict[str, list[RolloutRecord]]:
    """Rollouts of each policy, in the order in which policies first appear."""
    found: dict[str, list[RolloutRecord]] = {}
    for record in records:
        found.setdefault(record.policy, []).append(record)
    return found
