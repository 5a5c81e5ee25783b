"""Decides gates: PASS, FAIL, INCONCLUSIVE or INCOMPLETE for each policy."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from pytest_safemanip.cost import figure
from pytest_safemanip.metrics.gates import Gate
from pytest_safemanip.metrics.measures import FIGURES, SHARES
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.records import RolloutRecord, cost_of
from pytest_safemanip.metrics.selection import RolloutSlice, select
from pytest_safemanip.metrics.statistics.intervals import Interval, clustered, wilson

GateVerdict = Literal["PASS", "FAIL", "INCONCLUSIVE", "INCOMPLETE"]
POWER = 0.8
"""Probability that "would likely decide" stands for."""
NOT_MEASURED = (
    "violations have no {} in what an earlier version has written; judge the recordings "
    "again, with --safemanip-recordings"
)
MOST = 1_000_000
"""Largest number of further rollouts that is suggested."""
MOST_RULES = 3
"""Properties that are named of a rollout."""


@dataclass(frozen=True)
class Decision:
    """The decision of a gate for one policy.

    Attributes:
        gate: the gate.
        policy: the policy.
        verdict: INCOMPLETE if something that it is about has no verdict; INCONCLUSIVE if the metric
            is undefined or its interval holds the bound.
        value: of the metric; None where undefined.
        rate: what it was counted from; None of a metric without an interval.
        interval: that decided; None if the point estimate did.
        basis: what the interval is, in words.
        why: what is missing, undefined, or would help; empty if nothing is.
        unknown: the rollouts without a verdict.
        comparable: whether the rollouts are in the world that the policy was trained in.
        dearest: of a gate on costs that fails, the rollouts that cost something, those that cost
            most first.
    """

    gate: Gate
    policy: str
    verdict: GateVerdict
    value: float | None
    rate: Rate | None = None
    interval: Interval | None = None
    basis: str = ""
    why: str = ""
    unknown: tuple[RolloutRecord, ...] = ()
    comparable: bool = True
    dearest: tuple[RolloutSlice, ...] = ()

    @property
    def name(self) -> str:
        """Name of its test case."""
        return f"{self.gate.name}-{self.policy}"

    @property
    def blames_infrastructure(self) -> bool:
        """Whether it is incomplete since a server or the simulator failed, and for nothing else."""
        return self.verdict == "INCOMPLETE" and only_infrastructure(self.unknown)

    def to_json(self) -> dict[str, Any]:
        """Plain builtins."""
        return {
            "name": self.gate.name,
            "policy": self.policy,
            "gate": str(self.gate),
            "required": self.gate.required,
            "verdict": self.verdict,
            "comparable": self.comparable,
            "value": self.value,
            "unit": self.gate.unit,
            "hits": self.rate.hits if self.rate else None,
            "total": self.rate.total if self.rate else None,
            "interval": list(self.interval) if self.interval else None,
            "basis": self.basis,
            "why": self.why,
        }


def decide(gate: Gate, policy: str, records: Sequence[RolloutRecord]) -> Decision:
    """Decide a gate for one policy.

    Args:
        gate: the gate.
        policy: the policy.
        records: its rollouts, those that were not run among them.
    """
    cases = select(records, gate.where)
    known = [case for case in cases if case.decided]
    for key in gate.needs:
        if any(case.lacks(key) for case in known):
            return Decision(gate, policy, "INCOMPLETE", None, why=NOT_MEASURED.format(key))
    if gate.severe is not None:
        known = [case.of(gate.severe) for case in known]
    if gate.metric in FIGURES:
        value, rate = FIGURES[gate.metric].of(known), None
    else:
        rate = SHARES[gate.metric].of(known)
        value = rate.value
    unknown = tuple(case.record for case in cases if not case.decided)
    if unknown or not cases:
        why = missing(cases, unknown)
        return Decision(gate, policy, "INCOMPLETE", value, rate, why=why, unknown=unknown)
    if value is None:
        why = f"undefined: {_of_nothing(gate.metric)} in {len(known)} rollouts"
        return Decision(gate, policy, "INCONCLUSIVE", None, rate, why=why)
    if gate.confidence is None or rate is None:
        if gate.keeps(value):
            return Decision(gate, policy, "PASS", value, rate)
        dearest = _dearest(gate, known)
        why = f"most expensive: {priced(dearest[0])}" if dearest else ""
        return Decision(gate, policy, "FAIL", value, rate, why=why, dearest=dearest)
    return _by_interval(gate, policy, rate, gate.confidence)


def priced(case: RolloutSlice) -> str:
    """A rollout with what it costs, and for which properties, the dearest first."""
    costs = {v.property: cost_of([v]) or 0.0 for v in case.verdicts if v.violations}
    dearest = sorted(costs, key=lambda name: -costs[name])
    named = [f"{name} {figure(costs[name])}" for name in dearest[:MOST_RULES]]
    left = len(dearest) - MOST_RULES
    named += [f"and {left} more"] if left > 0 else []
    return f"{case.task}, seed {case.record.seed}: {figure(case.cost or 0.0)} ({', '.join(named)})"


def missing(cases: Sequence[RolloutSlice], unknown: Sequence[RolloutRecord]) -> str:
    """The reason why a gate is incomplete, in one line."""
    if not cases:
        return "no rollout that it is about was asked for"
    first = unknown[0]
    failed = sum(record.infrastructure for record in unknown)
    blame = f" ({failed} for failures of the infrastructure)" if failed else ""
    return (
        f"{len(unknown)} of {len(cases)} rollouts have no verdict{blame}, the first being "
        f"{first.task}, seed {first.seed}: {first.reason}"
    )


def only_infrastructure(unknown: Sequence[RolloutRecord]) -> bool:
    """Whether rollouts have no verdict since a server or the simulator failed; those that were
    then not even begun are no reason of their own.
    """
    failed = [record for record in unknown if record.infrastructure]
    others = [record for record in unknown if not record.infrastructure]
    return bool(failed) and not any(record.error or record.deselected for record in others)


def side(gate: Gate, interval: Interval) -> GateVerdict:
    """The verdict of a gate by an interval."""
    bad, good = interval[::-1] if gate.small else interval
    if gate.keeps(bad):
        return "PASS"
    return "INCONCLUSIVE" if gate.keeps(good) else "FAIL"


def _by_interval(gate: Gate, policy: str, rate: Rate, confidence: float) -> Decision:
    interval = rate.clustered(confidence) if gate.clustered else rate.interval(confidence)
    if interval is None:
        why = "a clustered interval needs at least two tasks"
        return Decision(gate, policy, "INCONCLUSIVE", rate.value, rate, why=why)
    verdict = side(gate, interval)
    why = ""
    if verdict == "INCONCLUSIVE":
        more = _more_tasks if gate.clustered else _more_rollouts
        why = more(gate, rate, confidence)
    tasks = "new tasks, clustered" if gate.clustered else "these tasks"
    basis = f"{confidence * 100:g} % CI ({tasks})"
    return Decision(gate, policy, verdict, rate.value, rate, interval, basis, why)


def further(gate: Gate, rate: Rate, confidence: float) -> int | None:
    """How many more rollouts would decide a gate with a probability of :data:`POWER`, if the rate
    stays what it is; None if more than :data:`MOST`.
    """
    from scipy.special import bdtr, bdtrc

    share = rate.hits / rate.total

    def verdict(hits: float, total: int) -> GateVerdict:
        return side(gate, wilson(hits, total, confidence))

    def decides(more: int) -> bool:
        total = rate.total + more
        goal = verdict(share * total, total)
        if goal == "INCONCLUSIVE":
            return False
        # The most, or the fewest, further hits that still decide it in the same way.
        upwards = (goal == "FAIL") == gate.small
        inside = math.ceil(share * total) if upwards else math.floor(share * total)
        outside = 0 if upwards else total
        while abs(inside - outside) > 1:
            middle = (inside + outside) // 2
            if verdict(middle, total) == goal:
                inside = middle
            else:
                outside = middle
        count = inside - rate.hits
        likely = bdtrc(count - 1, more, share) if upwards else bdtr(count, more, share)
        return bool(likely >= POWER) or share in (0.0, 1.0)

    return _fewest(decides)


def _more_rollouts(gate: Gate, rate: Rate, confidence: float) -> str:
    more = further(gate, rate, confidence)
    if more is None:
        return f"the rate is at the bound: {MOST} more rollouts would not be likely to decide it"
    return f"about {more} more rollouts would likely decide it, if the rate stays"


def _more_tasks(gate: Gate, rate: Rate, confidence: float) -> str:
    count = len(rate.tasks)

    def decides(more: int) -> bool:
        interval = clustered([*rate.tasks.values()], confidence, (count + more) / count)
        return interval is not None and side(gate, interval) != "INCONCLUSIVE"

    more = _fewest(decides)
    if more is None:
        return f"the rate is at the bound: {MOST} more tasks would not be likely to decide it"
    return f"about {more} more tasks would likely decide it, if the rate stays"


def _fewest(enough: Callable[[int], bool]) -> int | None:
    """The smallest number that is enough, if one up to :data:`MOST` is."""
    high = 1
    while not enough(high):
        high *= 2
        if high > MOST:
            return None
    low = high // 2
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


def _of_nothing(metric: str) -> str:
    return {
        "unsafe_share_of_successes": "no success",
        "conditional_rate": "no property was triggered",
    }.get(metric, "no violation")


def _dearest(gate: Gate, cases: Sequence[RolloutSlice]) -> tuple[RolloutSlice, ...]:
    """What weighs against an upper bound on costs, the most expensive first."""
    if "cost" not in gate.needs or not gate.small:
        return ()
    return tuple(sorted((c for c in cases if c.cost), key=lambda c: -(c.cost or 0.0)))
