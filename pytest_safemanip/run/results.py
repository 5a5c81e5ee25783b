"""What is known about a run so far, collected from its cases in whatever order they end."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pytest_safemanip.judge import Finding, Verdict
from pytest_safemanip.metrics.records import PropertyRecord, RolloutKey, RolloutRecord, severity
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.timeline import timeline
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace.recording import Recording

MAX_SHOWN = 3
"""The worst violations of a case, which are told with what was measured, and with a timeline."""
CaseData = dict[str, Any]
"""What a test report carries: plain builtins, since reports travel between processes."""


def judged_data(
    case: Case,
    prop: Property,
    verdict: Verdict,
    recording: Recording,
    path: Path,
    reused: bool = False,
) -> CaseData:
    """A case with a verdict; ``reused`` says that an earlier run made the recording."""
    episode = recording.episode
    violations = [_violation(finding) for finding in verdict.findings]
    worst = sorted(range(len(violations)), key=lambda n: severity(violations[n]), reverse=True)
    for number in worst[:MAX_SHOWN]:
        violations[number] |= _shown(verdict.findings[number])
    own = ("key", "start", "policy")
    return {
        "case": _case_data(case),
        "success": recording.success,
        "acting_steps": verdict.acting_steps,
        "truncated": recording.truncated,
        "warned": episode.warned,
        "failure": episode.failure,
        "recording": str(path),
        "reused": reused,
        "served": dict(episode.served),
        "category": prop.category,
        "outcome": verdict.outcome.label,
        "triggered": verdict.triggered > 0,
        "violations": violations,
        "provenance": {
            "backend": episode.backend,
            "scenes": episode.scenes,
            "stepping": episode.stepping,
            "assets": episode.assets,
            "versions": dict(episode.versions),
            "hashes": {k: v for k, v in episode.hashes.items() if k not in own},
        },
    }


def error_data(case: Case, error: str, infrastructure: bool = False, restarts: int = 0) -> CaseData:
    """A case whose rollout did not complete.

    Args:
        case: the case.
        error: why.
        infrastructure: whether a server or the simulator is to blame.
        restarts: how often the episode was begun again before that.
    """
    about = {"infrastructure": infrastructure, "restarts": restarts}
    return {"case": _case_data(case), "error": error, **about}


def skipped_data(case: Case) -> CaseData:
    """A case whose rollout was skipped by early stopping."""
    return {"case": _case_data(case), "skipped": True}


def _violation(finding: Finding) -> dict[str, Any]:
    about = {
        "entities": list(finding.entities),
        "first": finding.first,
        "last": finding.last,
        "duration_s": round(finding.duration_s, 6),
        "reason": finding.reason,
        "severity": round(finding.severity.value, 3),
        "measured": finding.severity.measured,
        "cost": round(finding.cost, 6),
    }
    excess = finding.excess
    if excess is None:
        return about
    parts = {"between": list(excess.between), "entities": list(excess.entities)}
    force = {"force": round(excess.force, 3), "limit": excess.limit, "step": excess.step}
    return {**about, "excess": parts | force}


def _shown(finding: Finding) -> dict[str, Any]:
    """What reports show of a violation without judging again."""
    return {"evidence": list(finding.evidence), "timeline": timeline(finding)}


def _case_data(case: Case) -> list[Any]:
    return [case.task, case.policy, case.property_id, case.seed]


@dataclass
class Results:
    """The rollouts of a run.

    Attributes:
        tasks: by name.
        properties: by id.
        planned: all cases; those of them that are not expected were deselected.
        expected: the cases that were to be run.
        errors: cases without a verdict, with the reason.
        skipped: rollouts skipped by early stopping: nothing was left for them to decide.
        provenance: every distinct origin of recordings, in the order of appearance.
    """

    tasks: Mapping[str, Task]
    properties: Mapping[str, Property]
    planned: Sequence[Case] = ()
    expected: list[Case] = field(default_factory=list)
    errors: dict[Case, str] = field(default_factory=dict)
    skipped: set[RolloutKey] = field(default_factory=set)
    provenance: list[Mapping[str, Any]] = field(default_factory=list)
    _records: dict[RolloutKey, RolloutRecord] = field(default_factory=dict)
    _seen: set[Case] = field(default_factory=set)

    def expect(self, cases: Iterable[Case]) -> None:
        """Cases that are going to be run."""
        self.expected = list(dict.fromkeys([*self.expected, *cases]))

    def add(self, data: CaseData) -> None:
        """What a test report says about a case."""
        case = Case(*data["case"])
        self._seen.add(case)
        if "skipped" in data:
            self.skipped.add(case.rollout)
            return
        record = self._records.setdefault(case.rollout, self._new_record(case))
        if "error" in data:
            self.errors[case] = data["error"]
            record.error = record.error or data["error"]
            record.infrastructure = record.infrastructure or data["infrastructure"]
            record.restarts = max(record.restarts, data["restarts"])
            return
        if data["provenance"] not in self.provenance:
            self.provenance.append(data["provenance"])
        record.provenance = self.provenance.index(data["provenance"])
        record.success = data["success"]
        record.acting_steps = data["acting_steps"]
        record.truncated = data["truncated"]
        record.warned = data["warned"]
        record.failure = data["failure"]
        record.recording = data["recording"]
        record.reused = data["reused"]
        record.served = data["served"]
        record.restarts = int(data["served"].get("restarts", 0))
        record.properties[case.property_id] = PropertyRecord(
            property=case.property_id,
            category=data["category"],
            outcome=data["outcome"],
            triggered=data["triggered"],
            violations=tuple(data["violations"]),
        )

    @property
    def records(self) -> list[RolloutRecord]:
        """One record per rollout that was not skipped, in the order of the plan, those without a
        verdict among them.
        """
        found = {key: _ordered(record) for key, record in self._records.items()}
        ordered: dict[RolloutKey, RolloutRecord] = {}
        for case in self.expected:
            record = found.get(case.rollout) or self._new_record(case)
            found[case.rollout] = ordered[case.rollout] = record
            if case.property_id not in record.properties:
                category = self.properties[case.property_id].category
                record.unjudged[case.property_id] = category
        for case in self._deselected:
            if case.rollout in ordered:
                category = self.properties[case.property_id].category
                ordered[case.rollout].deselected[case.property_id] = category
        every = {**ordered, **found}.items()
        return [self._with_packs(record) for key, record in every if key not in self.skipped]

    @property
    def left_out(self) -> list[RolloutRecord]:
        """One record per rollout of which all cases were deselected."""
        begun = {case.rollout for case in self.expected}
        found: dict[RolloutKey, RolloutRecord] = {}
        for case in self._deselected:
            if case.rollout not in begun:
                record = found.setdefault(case.rollout, self._new_record(case))
                record.deselected[case.property_id] = self.properties[case.property_id].category
        return [self._with_packs(record) for record in found.values()]

    @property
    def reused(self) -> int:
        """How many rollouts earlier runs have recorded."""
        return sum(record.reused for record in self._records.values())

    @property
    def begun(self) -> bool:
        """Whether anything is known about any case."""
        return bool(self._records)

    @property
    def missing(self) -> list[Case]:
        """Cases that were to be run and were not."""
        return [case for case in self.expected if case not in self._seen]

    @property
    def narrowed(self) -> bool:
        """Whether planned cases were deselected."""
        return bool(self._deselected)

    @property
    def _deselected(self) -> list[Case]:
        """None as long as nobody has said what is going to be run."""
        expected = set(self.expected)
        return [case for case in self.planned if expected and case not in expected]

    def _new_record(self, case: Case) -> RolloutRecord:
        task = self.tasks[case.task]
        return RolloutRecord(case.task, case.policy, case.seed, task.suite, task.horizon)

    def _with_packs(self, record: RolloutRecord) -> RolloutRecord:
        """A record that says which of its properties are rules of packs."""
        names = sorted({*record.asked, *record.deselected})
        packs = {name: self.properties[name].pack for name in names}
        return replace(record, packs={name: pack for name, pack in packs.items() if pack})


def _ordered(record: RolloutRecord) -> RolloutRecord:
    """A copy whose verdicts are in an order that no process decides."""
    verdicts = {name: record.properties[name] for name in sorted(record.properties)}
    return replace(record, properties=verdicts, unjudged={}, deselected={})
