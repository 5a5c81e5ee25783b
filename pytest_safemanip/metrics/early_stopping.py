"""Stopping early: a gate is decided as soon as an anytime-valid interval decides it.

Rollouts are looked at in rounds: a seed for each task that the gate is about. Only complete rounds
from the first one on count, whatever else has ended already: which rollouts end early depends on
how they end, and would tip the scales.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.decisions import Decision, GateVerdict, missing
from pytest_safemanip.metrics.gates import Gate
from pytest_safemanip.metrics.measures import SHARES
from pytest_safemanip.metrics.rates import Rate
from pytest_safemanip.metrics.records import RolloutRecord
from pytest_safemanip.metrics.selection import RolloutSlice, select
from pytest_safemanip.metrics.statistics.intervals import anytime, evidence


@dataclass(frozen=True)
class Watched:
    """State of a gate after some rounds.

    Attributes:
        verdict: INCONCLUSIVE as long as it is not decided.
        rate: over the rounds that it was decided after, or over all complete ones.
        rounds: their number.
    """

    verdict: GateVerdict
    rate: Rate
    rounds: int


def check_gate(gate: Gate) -> None:
    """Refuse a gate that cannot be watched.

    Raises:
        ConfigError: if its metric is over a number of rollouts that depends on how they end.
    """
    if gate.metric in SHARES and SHARES[gate.metric].steady:
        return
    steady = ", ".join(name for name, share in SHARES.items() if share.steady)
    why = "what it is over depends on how rollouts end"
    if gate.metric not in SHARES:
        why = "it is no share of rollouts, and one rollout may change it by any amount"
    raise ConfigError(
        f"{gate.metric} cannot be decided early, since {why}; decide on one of {steady}, or leave "
        "out --safemanip-early-stop"
    )


def watch(gate: Gate, records: Iterable[RolloutRecord], alpha: float) -> Watched:
    """Evaluate a gate after each round.

    Args:
        gate: on a metric over all rollouts that it is about.
        records: of one policy: all rollouts that may be run, in the order of their seeds.
        alpha: probability that a gate is decided wrongly, at most.
    """
    limit, share = -math.log(alpha), SHARES[gate.metric]
    taken: list[RolloutSlice] = []
    hits, rounds = 0.0, 0
    verdict: GateVerdict = "INCONCLUSIVE"
    for cases in _rounds(select(records, gate.where)):
        if not all(case.decided for case in cases):
            break
        counted = [case.of(gate.severe) for case in cases] if gate.severe else cases
        taken += counted
        rounds += 1
        hits += share.of(counted).hits
        if evidence(hits, len(taken), gate.bound) > limit:
            verdict = "PASS" if gate.keeps(hits / len(taken)) else "FAIL"
            break
    return Watched(verdict, share.of(taken), rounds)


def decide_early(
    gate: Gate, policy: str, records: Sequence[RolloutRecord], alpha: float
) -> Decision:
    """The decision of a gate that was watched while rollouts were run.

    Args:
        gate: the gate.
        policy: the policy.
        records: its rollouts, those that were skipped or not run among them.
        alpha: as in :func:`watch`.
    """
    found = watch(gate, records, alpha)
    verdict, why = found.verdict, f"decided after {found.rounds} of its seeds"
    unknown: tuple[RolloutRecord, ...] = ()
    if verdict == "INCONCLUSIVE":
        cases = select(records, gate.where)
        unknown = tuple(case.record for case in cases if not case.decided)
        why = f"not decided after {found.rounds} seeds; give more"
        if unknown or not cases:
            verdict, why = "INCOMPLETE", missing(cases, unknown)
    interval = anytime(found.rate.hits, found.rate.total, alpha)
    basis = f"{(1 - alpha) * 100:g} % anytime-valid CI (these tasks)"
    return Decision(
        gate, policy, verdict, found.rate.value, found.rate, interval, basis, why, unknown
    )


def _rounds(cases: Iterable[RolloutSlice]) -> Iterable[list[RolloutSlice]]:
    """Rollouts by seed, in the order in which seeds appear."""
    found: dict[int, list[RolloutSlice]] = {}
    for case in cases:
        found.setdefault(case.record.seed, []).append(case)
    return found.values()
