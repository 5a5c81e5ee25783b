"""The metrics of a policy: of all rollouts, and by property, category, task, suite and horizon."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pytest_safemanip.metrics.measures import FIGURES, OUTCOMES, SHARES
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.records import PropertyRecord, RolloutRecord, by_policy
from pytest_safemanip.metrics.selection import RolloutSlice, Severe, select
from pytest_safemanip.spec.tasks import HORIZONS

SEVERITIES = (2.0, 3.0, 5.0)
"""For which a group has violation rates of their own."""


@dataclass(frozen=True)
class Group:
    """Metrics of some rollouts of a policy.

    Attributes:
        rollouts: number of rollouts that were asked for.
        complete: number of those with all verdicts that were asked for.
        errors: number of those that failed for another reason than the policy's doing.
        tasks: number of tasks of the complete ones.
        shares: by name; see :data:`~pytest_safemanip.metrics.measures.SHARES`.
        figures: by name; None where undefined.
        severe: the violation rate that counts violations of so much severity at least, by that.
        vacuous: number of rollouts in which no property was triggered.
    """

    rollouts: int
    complete: int
    errors: int
    tasks: int
    shares: Mapping[str, Rate]
    figures: Mapping[str, float | None]
    severe: Mapping[float, Rate]
    vacuous: int

    @property
    def outcomes(self) -> dict[str, int]:
        """The four combinations of success and safety; they sum to ``complete``."""
        return {name: int(self.shares[name].hits) for name in OUTCOMES}

    @property
    def triggered(self) -> bool:
        """Whether something was put to the test; what was not has no rate."""
        return bool(self.shares["triggered_rate"].hits)

    @property
    def unresolved(self) -> int:
        """Number of rollouts in which a property stayed open."""
        return int(self.shares["unresolved_rate"].hits)

    def to_json(self) -> dict[str, Any]:
        """Plain builtins."""
        return {
            "rollouts": self.rollouts,
            "complete": self.complete,
            "errors": self.errors,
            "tasks": self.tasks,
            "outcomes": self.outcomes,
            **{name: rate.to_json() for name, rate in self.shares.items()},
            **self.figures,
            "violation_rate_by_severity": {
                f"{bound:g}": rate.to_json() for bound, rate in self.severe.items()
            },
            "unresolved": self.unresolved,
            "vacuous": self.vacuous,
        }


@dataclass(frozen=True)
class Metrics:
    """Metrics of one policy.

    Attributes:
        total: over all rollouts.
        properties: by property id, over the rollouts of tasks where it applies; likewise:
        categories: by category.
        tasks: by task.
        suites: by suite.
        horizons: by horizon class, from short to long.
    """

    total: Group
    properties: Mapping[str, Group]
    categories: Mapping[str, Group]
    tasks: Mapping[str, Group]
    suites: Mapping[str, Group]
    horizons: Mapping[str, Group]

    def to_json(self) -> dict[str, Any]:
        """Plain builtins; the total's metrics are at the top."""
        kinds = ("properties", "categories", "tasks", "suites", "horizons")
        groups = {kind: getattr(self, kind) for kind in kinds}
        return {
            **self.total.to_json(),
            "groups": {
                kind: {name: group.to_json() for name, group in found.items()}
                for kind, found in groups.items()
            },
        }


def measure(records: Sequence[RolloutRecord]) -> Metrics:
    """The metrics of some rollouts, those of one policy."""
    cases = select(records)
    horizons = _grouped(cases, lambda record: record.horizon)
    ranks = {name: rank for rank, name in enumerate(HORIZONS)}
    return Metrics(
        total=group(cases),
        properties=_by_verdict(cases, lambda name, category: name),
        categories=_by_verdict(cases, lambda name, category: category),
        tasks=_grouped(cases, lambda record: record.task),
        suites=_grouped(cases, lambda record: record.suite),
        horizons=dict(sorted(horizons.items(), key=lambda item: ranks.get(item[0], len(ranks)))),
    )


def measure_each(records: Sequence[RolloutRecord]) -> dict[str, Metrics]:
    """The metrics of each policy."""
    return {policy: measure(own) for policy, own in by_policy(records).items()}


def group(cases: Iterable[RolloutSlice]) -> Group:
    """The metrics of some rollouts."""
    every = list(cases)
    done = [case for case in every if case.decided]
    return Group(
        rollouts=len(every),
        complete=len(done),
        errors=sum(bool(case.record.error) for case in every),
        tasks=len({case.task for case in done}),
        shares={name: share.of(done) for name, share in SHARES.items()},
        figures={name: figure.of(done) for name, figure in FIGURES.items()},
        severe={
            bound: SHARES["violation_rate"].of([case.of(Severe(bound)) for case in done])
            for bound in SEVERITIES
        },
        vacuous=sum(case.vacuous for case in done),
    )


def _grouped(
    cases: Iterable[RolloutSlice], name: Callable[[RolloutRecord], str]
) -> dict[str, Group]:
    members: dict[str, list[RolloutSlice]] = {}
    for case in cases:
        members.setdefault(name(case.record), []).append(case)
    return {key: group(members[key]) for key in sorted(members)}


def _by_verdict(cases: Iterable[RolloutSlice], name: Callable[[str, str], str]) -> dict[str, Group]:
    """Each rollout counts once in each group that one of its properties is in."""
    members: dict[str, list[RolloutSlice]] = {}
    for case in cases:
        verdicts: dict[str, list[PropertyRecord]] = {}
        for verdict in case.verdicts:
            verdicts.setdefault(name(verdict.property, verdict.category), []).append(verdict)
        open_: dict[str, list[str]] = {}
        for prop, category in case.record.unjudged.items():
            open_.setdefault(name(prop, category), []).append(prop)
        for key in dict.fromkeys([*verdicts, *open_]):
            part = RolloutSlice(
                case.record, tuple(verdicts.get(key, ())), tuple(open_.get(key, ()))
            )
            members.setdefault(key, []).append(part)
    return {key: group(members[key]) for key in sorted(members)}
