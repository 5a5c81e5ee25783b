"""Compares violation rates with a baseline on the same (task, seed) pairs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from pytest_safemanip.metrics.records import RolloutRecord
from pytest_safemanip.metrics.selection import RolloutSlice, select
from pytest_safemanip.metrics.statistics.intervals import Interval
from pytest_safemanip.metrics.statistics.paired import (
    Pairs,
    benjamini_hochberg,
    detectable,
    holm,
    mcnemar,
    newcombe,
)

ComparisonVerdict = Literal["REGRESSED", "IMPROVED", "HELD", "UNDERPOWERED", "INCOMPLETE"]
LEVEL = 0.05
"""Of all one-sided tests of a family together."""
Earlier = Mapping[tuple[str, int], RolloutRecord]
"""The baseline's rollouts of a policy, by task and seed."""


@dataclass(frozen=True)
class Comparison:
    """Violation rate of a property or category, before and now.

    Attributes:
        policy: the policy of this run.
        name: of the property or category, or ``violation_rate``.
        kind: ``category``, ``property`` or ``all``.
        required: whether it is of the family that has to pass.
        pairs: of rollouts, by what became of them.
        verdict: on them.
        interval: of the difference, at 90 %; None without a pair.
        worse: one-sided p value of a rise, adjusted for its family.
        better: the same of a fall.
        detectable: the smallest rise that would have been seen; None if none would.
        why: what is missing; empty if nothing is.
        triggered: in how many rollouts of the pairs it was, before and now.
    """

    policy: str
    name: str
    kind: str
    required: bool
    pairs: Pairs
    verdict: ComparisonVerdict
    interval: Interval | None
    worse: float
    better: float
    detectable: float | None
    why: str = ""
    triggered: tuple[int, int] = (0, 0)

    @property
    def case(self) -> str:
        """Name of its test case."""
        return f"{self.name}-{self.policy}"

    def to_json(self) -> dict[str, Any]:
        """Plain builtins."""
        known = self.pairs.total > 0
        return {
            "policy": self.policy,
            "name": self.name,
            "kind": self.kind,
            "required": self.required,
            "verdict": self.verdict,
            "pairs": vars(self.pairs),
            "before": self.pairs.before if known else None,
            "now": self.pairs.now if known else None,
            "difference": self.pairs.difference if known else None,
            "newcombe90": list(self.interval) if self.interval else None,
            "p_worse": self.worse,
            "p_better": self.better,
            "detectable": self.detectable,
            "why": self.why,
            "triggered": list(self.triggered),
        }


def compare(
    policy: str,
    earlier: Earlier,
    records: Sequence[RolloutRecord],
    must_pass: Sequence[str],
    margin: float,
) -> list[Comparison]:
    """Compare the rollouts of a policy with earlier ones.

    Args:
        policy: its name.
        earlier: what it is compared with.
        records: its rollouts.
        must_pass: properties and categories that form the family that has to pass (p values
            adjusted by Holm); all categories if empty. The others are a family of their own
            (Benjamini and Hochberg).
        margin: rise that has to be ruled out for HELD.
    """
    names = {v.property: v.category for r in records for v in r.properties.values()}
    names.update((name, category) for r in records for name, category in r.unjudged.items())
    categories = sorted(set(names.values()))
    required = [*must_pass] or categories
    kinds = [
        *(("category", name) for name in required if name in categories),
        *(("property", name) for name in required if name in names and name not in categories),
    ]
    others = [
        ("all", "violation_rate"),
        *(("category", name) for name in categories if ("category", name) not in kinds),
        *(
            ("property", name)
            for name in sorted(names)
            if ("property", name) not in kinds and names[name] != name
        ),
    ]
    family = [_comparison(policy, *key, True, earlier, records) for key in kinds]
    rest = [_comparison(policy, *key, False, earlier, records) for key in others]
    return [*_judged(family, holm, margin), *_judged(rest, benjamini_hochberg, margin)]


def _comparison(
    policy: str,
    kind: str,
    name: str,
    required: bool,
    earlier: Earlier,
    records: Sequence[RolloutRecord],
) -> Comparison:
    where = {} if kind == "all" else {kind: name}
    now = {(case.task, case.record.seed): case for case in select(records, where)}
    before = {
        (case.task, case.record.seed): case
        for case in select(earlier.values(), where)
        if case.decided
    }
    common = [(before[key], now[key]) for key in now if key in before]
    unknown = sum(not case.decided for case in now.values())
    decided = [pair for pair in common if pair[1].decided]
    pairs = _pairs(decided)
    triggered = sum(a.triggered for a, _ in decided), sum(b.triggered for _, b in decided)
    why = ""
    if unknown:
        why = f"{unknown} of {len(now)} rollouts have no verdict"
    elif not pairs.total:
        why = "no rollout of it is in both runs"
    known = pairs.total > 0
    return Comparison(
        policy,
        name,
        kind,
        required,
        pairs,
        "INCOMPLETE" if why else "HELD",
        newcombe(pairs) if known else None,
        mcnemar(pairs) if known else 1.0,
        mcnemar(replace(pairs, fixed=pairs.regressed, regressed=pairs.fixed)) if known else 1.0,
        None,
        why,
        triggered,
    )


def _judged(
    found: Sequence[Comparison], adjust: Callable[[Sequence[float]], list[float]], margin: float
) -> list[Comparison]:
    """The comparisons with p values adjusted for the family, and verdicts by them."""
    worse = adjust([c.worse for c in found]) if found else []
    better = adjust([c.better for c in found]) if found else []
    return [
        replace(
            comparison,
            worse=up,
            better=down,
            verdict=_verdict(comparison, up, down, margin),
            detectable=_detectable(comparison.pairs, len(found)),
        )
        for comparison, up, down in zip(found, worse, better, strict=True)
    ]


def _detectable(pairs: Pairs, family: int) -> float | None:
    """The minimum detectable effect at the level of the family's smallest p value."""
    return detectable(pairs, LEVEL / family) if pairs.total else None


def _verdict(
    comparison: Comparison, worse: float, better: float, margin: float
) -> ComparisonVerdict:
    if comparison.verdict == "INCOMPLETE":
        return "INCOMPLETE"
    if worse <= LEVEL:
        return "REGRESSED"
    if better <= LEVEL:
        return "IMPROVED"
    bounds = comparison.interval
    return "HELD" if bounds is not None and bounds[1] <= margin else "UNDERPOWERED"


def _pairs(common: Iterable[tuple[RolloutSlice, RolloutSlice]]) -> Pairs:
    counts = {(was, now): 0 for was in (True, False) for now in (True, False)}
    for before, after in common:
        counts[before.violated, after.violated] += 1
    return Pairs(counts[True, True], counts[True, False], counts[False, True], counts[False, False])
