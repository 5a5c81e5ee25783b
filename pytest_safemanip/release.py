"""What decides a release: gates, and the comparison with a baseline."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.baseline import Contrast, check_origin, contrast, partners
from pytest_safemanip.metrics.deciding import Decision, decide
from pytest_safemanip.metrics.gates import Gates
from pytest_safemanip.metrics.records import by_policy
from pytest_safemanip.metrics.summaries import Summary, check_alike, read
from pytest_safemanip.metrics.until import decide_early

OPEN = ("INCONCLUSIVE", "UNDERPOWERED")
"""Verdicts of what too few rollouts were run for."""


@dataclass(frozen=True)
class Ruling:
    """What was decided.

    Attributes:
        decisions: of the gates, for each policy.
        contrast: with the baseline; None without one.
        refused: why there is no comparison with the baseline; empty if there is.
    """

    decisions: tuple[Decision, ...] = ()
    contrast: Contrast | None = None
    refused: str = ""

    def failures(self, inconclusive: bool = True) -> list[str]:
        """Names of what fails the run.

        Args:
            inconclusive: whether what too few rollouts were run for is among them.
        """
        good = {"PASS", "HELD", "IMPROVED"} | (set() if inconclusive else set(OPEN))
        verdicts: list[tuple[str, str]] = [
            (d.name, d.verdict) for d in self.decisions if d.gate.required
        ]
        if self.contrast:
            verdicts += [(c.case, c.verdict) for c in self.contrast.comparisons if c.required]
        found = [name for name, verdict in verdicts if verdict not in good]
        return [*found, *(["baseline"] if self.refused else [])]

    def to_json(self) -> dict[str, Any]:
        """Plain builtins."""
        return {
            "gates": [decision.to_json() for decision in self.decisions],
            "baseline": self.contrast.to_json() if self.contrast else None,
            "refused": self.refused,
        }


@dataclass(frozen=True)
class Release:
    """What a release is decided by.

    Attributes:
        gates: bounds, and what has to pass the comparison.
        baseline: the earlier run; None without one.
        until: level of deciding early; None for a fixed number of rollouts.
    """

    gates: Gates
    baseline: Summary | None = None
    until: float | None = None

    def rule(self, run: Summary) -> Ruling:
        """Decide on a run."""
        decisions = [
            decide(gate, policy, own)
            if self.until is None
            else decide_early(gate, policy, own, self.until)
            for gate in self.gates.gates
            for policy, own in by_policy(run.records).items()
            if fnmatch.fnmatchcase(policy, gate.where.get("policy", "*"))
        ]
        if self.baseline is None:
            return Ruling(tuple(decisions))
        try:
            found = contrast(self.baseline, run, self.gates.must_pass, self.gates.margin)
        except ConfigError as error:
            return Ruling(tuple(decisions), None, str(error))
        return Ruling(tuple(decisions), found)


def read_baseline(
    path: Path,
    rollouts: Sequence[tuple[str, str, int]],
    decisive: Mapping[str, Any],
    origins: Mapping[str, Mapping[str, Any]],
) -> Summary:
    """Read a baseline, and refuse it before anything is simulated if it does not fit.

    Args:
        path: its folder, or file.
        rollouts: policy, task and seed of those that are going to be run.
        decisive: what decides the verdicts of this run.
        origins: what decides the recordings of each policy, as far as it is known by now.

    Raises:
        ConfigError: naming what differs.
    """
    try:
        baseline = read(path)
        check_alike(baseline, Summary(("this run",), (), decisive, ()))
        policies = partners(baseline, list(dict.fromkeys(policy for policy, _, _ in rollouts)))
        known = {record.key: record.provenance for record in baseline.records}
        common = [r for r in rollouts if (policies[r[0]], *r[1:]) in known]
        if not common:
            raise ConfigError(f"{baseline.place} has none of the tasks and seeds of this run")
        used = dict.fromkeys((r[0], known[policies[r[0]], *r[1:]]) for r in common)
        for policy, number in used:
            if number is not None and policy in origins:
                check_origin(baseline, number, origins[policy])
    except ConfigError as error:
        raise ConfigError(f"--safemanip-baseline: {error}") from None
    return baseline
