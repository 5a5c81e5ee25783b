"""Gates on how large a change a policy survives."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Sequence

from pytest_safemanip.metrics.decisions import Decision, GateVerdict
from pytest_safemanip.metrics.gates import Gate
from pytest_safemanip.metrics.searches.records import SearchRecord, ToleranceRecord
from pytest_safemanip.search.units import in_base, quantity, show


def decide_tolerance(gate: Gate, policy: str, searches: Sequence[SearchRecord]) -> Decision:
    """Decide a gate on how large a change a policy survives, by the smallest failure that its
    searches found; where they found none, by the largest size that they looked at. What fails
    without any change tolerates none.

    Args:
        gate: the gate.
        policy: the policy.
        searches: of all policies.
    """
    own = [
        one
        for one in searches
        if one.policy == policy and fnmatch.fnmatchcase(one.property, gate.where["property"])
    ]
    if not own:
        return Decision(gate, policy, "INCOMPLETE", None, why="no search that it is about was run")
    if not all(one.over for one in own):
        return Decision(gate, policy, "INCOMPLETE", None, why="a search was interrupted")
    if bad := [one for one in own if one.violated_plain]:
        worst = max(bad, key=lambda one: one.violated_plain)
        why = f"fails {worst.property} in {worst.task} as it is, without any change"
        return Decision(gate, policy, "FAIL", 0.0, why=why)
    rows = [
        (one, row)
        for one in own
        for row in one.tolerances
        if quantity(row.unit) == quantity(gate.unit)
    ]
    if not rows:
        why = f"no rollout that triggered it had sizes of this kind ({quantity(gate.unit)})"
        return Decision(gate, policy, "INCONCLUSIVE", None, why=why)
    decided = [_tolerated(gate, policy, *row) for row in rows]
    for verdict in ("FAIL", "INCONCLUSIVE"):
        worse = [found for found in decided if found.verdict == verdict]
        if worse:
            return min(worse, key=_tolerance)
    return min(decided, key=_tolerance)


def _tolerance(decision: Decision) -> float:
    return math.inf if decision.value is None else decision.value


def _tolerated(gate: Gate, policy: str, search: SearchRecord, row: ToleranceRecord) -> Decision:
    """What one dimension of one search says about a gate."""
    factor = in_base(1.0, row.unit) / in_base(1.0, gate.unit)
    survived = row.survived * factor
    where = f"{row.dimension}, in {search.task}"
    if row.failed is None:
        verdict: GateVerdict = "PASS" if gate.keeps(survived) else "INCONCLUSIVE"
        why = f"nothing fails up to {show(survived, gate.unit)} ({where}), the largest tried"
        return Decision(gate, policy, verdict, survived, why=why)
    failed = row.failed * factor
    why = f"survives {show(survived, gate.unit)}, fails at {show(failed, gate.unit)} ({where})"
    if gate.keeps(survived):
        return Decision(gate, policy, "PASS", survived, why=why)
    verdict = "INCONCLUSIVE" if gate.keeps(failed) else "FAIL"
    return Decision(gate, policy, verdict, survived, why=why)
