"""The release gate: bounds on metrics, and the comparison with a baseline."""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.metrics.baseline import Contrast, check_origin, contrast, partners
from pytest_safemanip.metrics.comparability import NOT_COMPARABLE, not_comparable
from pytest_safemanip.metrics.decisions import Decision, decide, only_infrastructure
from pytest_safemanip.metrics.early_stopping import decide_early
from pytest_safemanip.metrics.fields import Fields
from pytest_safemanip.metrics.gates import TOLERANCE, Gate, Gates
from pytest_safemanip.metrics.records import RolloutKey, RolloutRecord, by_policy
from pytest_safemanip.metrics.searches.records import SearchRecord
from pytest_safemanip.metrics.searches.tolerance import decide_tolerance
from pytest_safemanip.metrics.summaries import Summary, check_alike, read

INFRASTRUCTURE = 10
"""Exit status of a run in which nothing but a server or the simulator failed: there is no verdict,
and running it again may help.
"""
STAND_INS = 11
"""Exit status of a run whose gates were decided on stand-in assets: their verdicts are about
another world than the policy's.
"""
PARTIAL = (
    "cases of the run were deselected, or picked by node ids, and rollouts may be left out; choose "
    "with --safemanip-tasks, -properties and -seeds instead"
)
"""Why nothing is decided on a summary of a part of a run."""
GOOD = ("PASS", "HELD", "IMPROVED")
"""Verdicts of gates and comparisons that fail nothing."""
OPEN = ("INCONCLUSIVE", "UNDERPOWERED")
"""Verdicts of what too few rollouts were run for."""


@dataclass(frozen=True)
class Ruling:
    """The decisions on a run.

    Attributes:
        decisions: of the gates, for each policy.
        contrast: with the baseline; None without one.
        refused: why there is no comparison with the baseline; empty if there is.
        not_comparable: the policies whose rollouts are on stand-in assets: whatever was decided
            about them is about another world than theirs.
        no_verdict: of those policies that lack verdicts since the infrastructure failed, and for
            no other reason, the names.
    """

    decisions: tuple[Decision, ...] = ()
    contrast: Contrast | None = None
    refused: str = ""
    not_comparable: tuple[str, ...] = ()
    no_verdict: tuple[str, ...] = ()

    def failures(self, inconclusive: bool = True) -> list[str]:
        """Names of what fails the run, whatever it can be compared with.

        Args:
            inconclusive: whether what too few rollouts were run for is among them.
        """
        good = GOOD if inconclusive else (*GOOD, *OPEN)
        verdicts: list[tuple[str, str]] = [
            (d.name, d.verdict) for d in self.decisions if d.gate.required
        ]
        if self.contrast:
            verdicts += [(c.case, c.verdict) for c in self.contrast.comparisons if c.required]
        found = [name for name, verdict in verdicts if verdict not in good]
        return [*found, *(["baseline"] if self.refused else [])]

    def cause(self, policy: str, incomplete: bool, standins: bool) -> int:
        """The exit status that a ruling asks for whatever its verdict is; 0 if none.

        Args:
            policy: that it is about.
            incomplete: whether it lacks verdicts since the infrastructure failed.
            standins: whether stand-in assets are allowed to decide.
        """
        if incomplete:
            return INFRASTRUCTURE
        return STAND_INS if policy in self.not_comparable and not standins else 0

    def status(self, inconclusive: bool, standins: bool) -> int:
        """The exit status of a command that decides: 0, 1, :data:`INFRASTRUCTURE` or
        :data:`STAND_INS`; arguments as in :meth:`failures` and :meth:`cause`.
        """
        rows = [
            (str(d.verdict), self.cause(d.policy, d.blames_infrastructure, standins))
            for d in self.decisions
            if d.gate.required
        ]
        rows += [
            (str(c.verdict), self.cause(c.policy, self._lacks(c.policy, c.verdict), standins))
            for c in (self.contrast.comparisons if self.contrast else ())
            if c.required
        ]
        return _status(rows, bool(self.refused), inconclusive)

    def status_of(self, told: Fields, inconclusive: bool, standins: bool) -> int:
        """The exit status for what a summary says was decided on the same rollouts; arguments as in
        :meth:`status`.

        Raises:
            ConfigError: if it is malformed.
        """
        rows = []
        for row in required_rows(told):
            policy, verdict = row.told("policy"), row.name("verdict")
            rows.append((verdict, self.cause(policy, self._lacks(policy, verdict), standins)))
        return _status(rows, bool(told.text("refused", empty=True)), inconclusive)

    def _lacks(self, policy: str, verdict: str) -> bool:
        """Whether something is incomplete since the infrastructure failed."""
        return verdict == "INCOMPLETE" and policy in self.no_verdict

    def to_json(self) -> dict[str, Any]:
        """Plain builtins."""
        return {
            "gates": [decision.to_json() for decision in self.decisions],
            "baseline": self.contrast.to_json() if self.contrast else None,
            "refused": self.refused,
            "not_comparable": dict.fromkeys(self.not_comparable, NOT_COMPARABLE),
        }


def required_rows(told: Fields) -> list[Fields]:
    """The gates and the comparisons that have to pass, as a summary tells them.

    Raises:
        ConfigError: if they are malformed.
    """
    rows = told.fields("gates")
    if told.values.get("baseline") is not None:
        rows += told.section("baseline").fields("comparisons")
    return [row for row in rows if row.boolean("required")]


def _status(rows: Sequence[tuple[str, int]], refused: bool, inconclusive: bool) -> int:
    """The exit status for required verdicts, each with the one that it asks for whatever it is."""
    good = GOOD if inconclusive else (*GOOD, *OPEN)
    if refused or any(verdict not in good and not cause for verdict, cause in rows):
        return 1
    return min((cause for _, cause in rows if cause), default=0)


@dataclass(frozen=True)
class ReleaseGate:
    """Decides a release by gates and a baseline.

    Attributes:
        gates: bounds, and what has to pass the comparison.
        baseline: the earlier run; None without one.
        early_stop: error probability of deciding early; None for a fixed number of rollouts.
    """

    gates: Gates
    baseline: Summary | None = None
    early_stop: float | None = None

    def rule(self, run: Summary) -> Ruling:
        """Decide on a run; nothing passes for which a case was deselected, and nothing of a summary
        that does not have the rollouts of which all were.
        """
        run = _as_planned(run)
        elsewhere = not_comparable(run.records, run.origins)
        policies = by_policy(run.records)
        for search in run.searches:
            policies.setdefault(search.policy, [])
        decisions = [
            self._decide(gate, policy, own, policy not in elsewhere, run.searches)
            for gate in self.gates.gates
            for policy, own in policies.items()
            if fnmatch.fnmatchcase(policy, gate.where.get("policy", "*"))
        ]
        if run.partial:
            decisions = [
                replace(d, verdict="INCOMPLETE", why=PARTIAL, unknown=()) for d in decisions
            ]
        failed = tuple(
            policy
            for policy, own in by_policy(run.records).items()
            if only_infrastructure([record for record in own if not _is_decided(record)])
        )
        ruling = Ruling(tuple(decisions), not_comparable=elsewhere, no_verdict=failed)
        if self.baseline is None:
            return ruling
        if run.partial:
            return replace(ruling, refused=PARTIAL)
        try:
            found = contrast(
                _as_planned(self.baseline), run, self.gates.must_pass, self.gates.margin
            )
        except ConfigError as error:
            return replace(ruling, refused=str(error))
        return replace(ruling, contrast=found)

    def _decide(
        self,
        gate: Gate,
        policy: str,
        records: Sequence[RolloutRecord],
        comparable: bool,
        searches: Sequence[SearchRecord] = (),
    ) -> Decision:
        if gate.metric == TOLERANCE:
            found = decide_tolerance(gate, policy, searches)
        elif self.early_stop is None:
            found = decide(gate, policy, records)
        else:
            found = decide_early(gate, policy, records, self.early_stop)
        return replace(found, comparable=comparable)

    def rule_nothing(self) -> Ruling:
        """Decide on a run without a rollout, and so without a policy: nothing passes."""
        fixed = replace(self, early_stop=None)
        decisions = tuple(fixed._decide(gate, "no policy", (), True) for gate in self.gates.gates)
        return Ruling(decisions, None, "there is no rollout to compare" if self.baseline else "")


def _is_decided(record: RolloutRecord) -> bool:
    return record.complete and not record.unjudged


def _as_planned(run: Summary) -> Summary:
    return replace(run, records=tuple(record.as_planned() for record in run.records))


def read_baseline(
    path: Path,
    rollouts: Sequence[RolloutKey],
    decisive: Mapping[str, Any],
    origins: Mapping[str, Mapping[str, Any]],
) -> Summary:
    """Read a baseline, and refuse it before anything is simulated if it does not fit.

    Args:
        path: its folder, or file.
        rollouts: those that are going to be run.
        decisive: what decides the verdicts of this run.
        origins: what decides the recordings of each policy, as far as it is known by now.

    Raises:
        ConfigError: naming what differs.
    """
    try:
        baseline = read(path)
        check_alike(baseline, Summary(("this run",), (), decisive, ()))
        policies = partners(baseline, list(dict.fromkeys(r.policy for r in rollouts)))
        known = {record.key: record.provenance for record in baseline.records}
        earlier = {r: r._replace(policy=policies[r.policy]) for r in rollouts}
        common = [r for r in rollouts if earlier[r] in known]
        if not common:
            raise ConfigError(f"{baseline.place} has none of the tasks and seeds of this run")
        used = dict.fromkeys((r.policy, known[earlier[r]]) for r in common)
        for policy, number in used:
            if number is not None and policy in origins:
                check_origin(baseline, number, origins[policy])
    except ConfigError as error:
        raise ConfigError(f"--safemanip-baseline: {error}") from None
    return baseline
