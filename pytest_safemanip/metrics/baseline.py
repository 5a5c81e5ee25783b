"""Comparing a run with an earlier one, on the same (task, seed) pairs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.comparing import Comparison, Earlier, compare
from pytest_safemanip.metrics.records import RolloutRecord, by_policy
from pytest_safemanip.metrics.summaries import Summary, check_alike, differences, flat


@dataclass(frozen=True)
class Flip:
    """A property of a rollout that is violated in one of the runs only."""

    policy: str
    task: str
    seed: int
    property: str
    category: str
    regressed: bool


@dataclass(frozen=True)
class Contrast:
    """A run against a baseline.

    Attributes:
        place: the baseline's.
        policies: the baseline's policy for each of this run's.
        comparisons: those of the family that has to pass first.
        flips: in the order of policies, tasks and seeds.
        unpaired: number of this run's rollouts that the baseline has no verdict on.
        absent: number of the baseline's rollouts that this run does not have.
        earlier: number of the baseline's rollouts, of the policies that are compared.
    """

    place: str
    policies: Mapping[str, str]
    comparisons: tuple[Comparison, ...]
    flips: tuple[Flip, ...]
    unpaired: int
    absent: int
    earlier: int

    def to_json(self) -> dict[str, Any]:
        """Plain builtins."""
        return {
            "place": self.place,
            "policies": dict(self.policies),
            "comparisons": [comparison.to_json() for comparison in self.comparisons],
            "flips": [vars(flip) for flip in self.flips],
            "unpaired": self.unpaired,
            "absent": self.absent,
            "earlier": self.earlier,
        }


def partners(baseline: Summary, policies: Sequence[str]) -> dict[str, str]:
    """The baseline's policy for each of a run's: of the same name, or the only one on both sides.

    Raises:
        ConfigError: if a policy has none.
    """
    there = list(by_policy(baseline.records))
    if len(there) == len(policies) == 1:
        return {policies[0]: there[0]}
    for policy in policies:
        if policy not in there:
            remedy = "run it with this policy, too"
            if len(there) == 1:  # then which of this run's it is to be compared with is plain
                remedy += f", or compare {policy!r} alone, which is taken for a new {there[0]!r}"
            raise ConfigError(
                f"{baseline.place} has no rollout of policy {policy!r}; it has {', '.join(there)}; "
                f"{remedy}"
            )
    return {policy: policy for policy in policies}


def contrast(baseline: Summary, run: Summary, must_pass: Sequence[str], margin: float) -> Contrast:
    """Compare a run with a baseline.

    Args:
        baseline: the earlier run.
        run: this one.
        must_pass: properties and categories that form the family that has to pass; all categories
            if empty.
        margin: rise that has to be ruled out for HELD.

    Raises:
        ConfigError: if the runs cannot be compared, naming what differs.
    """
    check_alike(baseline, run)
    own = by_policy(run.records)
    policies = partners(baseline, list(own))
    before = by_policy(baseline.records)
    comparisons: list[Comparison] = []
    flips: list[Flip] = []
    unpaired = absent = count = 0
    for policy, records in own.items():
        earlier = {(r.task, r.seed): r for r in before[policies[policy]]}
        _check_origins(baseline, run, earlier, records)
        comparisons += compare(policy, earlier, records, must_pass, margin)
        flips += _flips(policy, earlier, records)
        unpaired += sum(
            (r.task, r.seed) not in earlier or not earlier[r.task, r.seed].complete for r in records
        )
        absent += len(earlier.keys() - {(r.task, r.seed) for r in records})
        count += len(earlier)
    return Contrast(
        baseline.place, policies, tuple(comparisons), tuple(flips), unpaired, absent, count
    )


def check_origin(baseline: Summary, number: int, origin: Mapping[str, Any]) -> None:
    """Refuse recordings of another simulation than some of the baseline's.

    Args:
        baseline: the earlier run.
        number: of one of its origins.
        origin: what decides the recordings of this run.

    Raises:
        ConfigError: naming what differs.
    """
    found = differences(flat(baseline.origins[number]), flat(origin))
    if found:
        raise ConfigError(
            f"the rollouts of {baseline.place} are of another simulation: "
            f"{'; '.join(found)}; run the baseline again"
        )


def _check_origins(
    baseline: Summary,
    run: Summary,
    earlier: Earlier,
    records: Iterable[RolloutRecord],
) -> None:
    """Pairs come from the same simulator."""
    used = {
        (earlier[record.task, record.seed].provenance, record.provenance)
        for record in records
        if (record.task, record.seed) in earlier
    }
    for there, here in used:
        if there is not None and here is not None:
            check_origin(baseline, there, run.origins[here])


def _flips(
    policy: str,
    earlier: Earlier,
    records: Iterable[RolloutRecord],
) -> list[Flip]:
    found = []
    for record in records:
        before = earlier.get((record.task, record.seed))
        if before is None or not before.complete or not record.complete:
            continue
        for name, verdict in record.properties.items():
            if name not in before.properties:
                continue
            was = before.properties[name].outcome == "VIOLATED"
            now = verdict.outcome == "VIOLATED"
            if was != now:
                found.append(Flip(policy, record.task, record.seed, name, verdict.category, now))
    return found
