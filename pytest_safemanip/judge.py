"""From a recording to verdicts: a pure function of it, of the task and of the properties."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pytest_safemanip.cost import violation_cost
from pytest_safemanip.errors import TraceError
from pytest_safemanip.ltlf import (
    InstanceVerdict,
    Outcome,
    Profile,
    PropertyOutcome,
    Violation,
    explain,
    robustness,
    worst,
)
from pytest_safemanip.markup import table
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.contact import FORCE_LIMIT
from pytest_safemanip.propositions.definition import MARGIN_BOUND, Excess, hardest
from pytest_safemanip.propositions.grounding import check_call
from pytest_safemanip.propositions.view import View
from pytest_safemanip.severity import Occurrence, Severity, measure
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.spec.task import Task
from pytest_safemanip.trace.recording import Recording

AT_END = "still open at the end"
"""Why it is a violation though no deadline passed: after the last step, nothing meets it."""


@dataclass(frozen=True, repr=False)
class Finding:
    """One violation with its evidence.

    Attributes:
        entities: what the violated instance is about; empty if the property has one instance.
        first: first unsafe step.
        last: last unsafe step.
        duration_s: seconds.
        reason: ``bad prefix``, ``overdue``, or :data:`AT_END`.
        proof: the explanation's text: what was pending, since when, the steps that matter.
        evidence: what was measured at the first unsafe step, and where the obligation opened that
            was not met, in words.
        severity: how severe it is.
        cost: what it adds to the cost of the rollout.
        excess: the hardest contact behind it that is beyond its limit; None if none is.
        opened: the step where the obligation opened; the first unsafe step if none was pending.
        values: of each atom of the property, for the violated instance, bool (T,).
    """

    entities: tuple[str, ...]
    first: int
    last: int
    duration_s: float
    reason: str
    proof: str
    evidence: tuple[str, ...]
    severity: Severity
    cost: float
    excess: Excess | None = None
    opened: int = 0
    values: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict, compare=False)

    def __repr__(self) -> str:
        return f"<Finding {self}>"

    def __str__(self) -> str:
        about = f" for {', '.join(self.entities)}" if self.entities else ""
        return f"{self.reason}{about} at step {self.first}"


@dataclass(frozen=True, repr=False)
class Verdict:
    """The verdict on one property of one rollout.

    Attributes:
        property_id: of the property.
        outcome: over all instances.
        triggered: number of instances that were triggered.
        instances: number of instances.
        findings: violations of all instances, by first step.
        unsafe_steps: acting steps at which some instance is unsafe.
        acting_steps: steps before the settle tail.
        open: entities of the instances that are unresolved, with the step they are open since.
        formula: what was monitored.
    """

    property_id: str
    outcome: PropertyOutcome
    triggered: int
    instances: int
    findings: tuple[Finding, ...]
    unsafe_steps: int
    acting_steps: int
    open: tuple[tuple[tuple[str, ...], int], ...]
    formula: str

    def __repr__(self) -> str:
        first = f": {self.findings[0]}" if self.findings else ""
        return f"<Verdict {self.property_id} {self.outcome.label}{first}>"

    def _repr_html_(self) -> str:
        """The violations, for a notebook."""
        about = f"{self.property_id}: {self.outcome.label}, {self.triggered} of {self.instances} "
        about += f"triggered, exposure {self.exposure * 100:.1f} %\n{self.formula}"
        rows = [
            (
                ", ".join(f.entities),
                f.first,
                f.last,
                f"{f.duration_s:.2f}",
                f"{f.severity.value:.2f}",
                f.reason,
                "; ".join(f.evidence),
            )
            for f in self.findings
        ]
        head = ("for", "first step", "last step", "s", "severity", "reason", "measured")
        whose = 0 if any(f.entities for f in self.findings) else 1
        return table(about, head[whose:], [row[whose:] for row in rows])

    @property
    def by_severity(self) -> tuple[Finding, ...]:
        """The violations, the worst first; of those that are as bad, the earlier one."""
        return tuple(sorted(self.findings, key=lambda found: -found.severity.value))

    @property
    def cost(self) -> float:
        """What its violations cost in all."""
        return sum(found.cost for found in self.findings)

    @property
    def exposure(self) -> float:
        """Share of the acting steps that are unsafe for some instance."""
        return self.unsafe_steps / self.acting_steps


class Judge:
    """Judges one recording; propositions that several properties use are evaluated once.

    Args:
        recording: what happened.
        task: its safety binding.
        attributes: of object categories.
        catalogue: the propositions.
        parameters: values of all their parameters.
        profile: the semantics.

    Attributes:
        view: the recording as propositions see it.
    """

    def __init__(
        self,
        recording: Recording,
        task: Task,
        attributes: Mapping[str, frozenset[str]],
        catalogue: Catalogue,
        parameters: Mapping[str, float],
        profile: Profile = "timed",
    ) -> None:
        self._recording = recording
        self._profile, self._catalogue = profile, catalogue
        # Without objects and fixtures, no role can be played.
        partial = {"objects", "fixtures"} <= recording.episode.unobserved
        self._binding = Binding() if partial else task.bind(recording.scene, attributes)
        self.view = View(recording.trace, self._binding, parameters, catalogue)

    @np.errstate(divide="warn", over="warn", under="ignore", invalid="warn")  # NumPy's own
    def judge(self, prop: Property) -> Verdict:
        """The verdict on one property, whatever a policy has set in this process.

        Raises:
            TraceError: if the recording lacks what a proposition needs.
        """
        rows = self._rows(prop)
        acting = ~self._recording.steps.tail
        if not rows:
            return self._vacuous(prop, int(np.count_nonzero(acting)))
        monitor = prop.monitor(rows, dt=self._recording.trace.dt, profile=self._profile)
        calls = [prop.calls(row) for row in rows]
        for name, *arguments in {call for row in calls for call in row}:
            check_call(
                self._catalogue[name], tuple(arguments), self._recording.scene, self._binding.zones
            )
        letters = monitor.gather(
            len(acting), lambda k, atom, a, b: self.view.part(*calls[k][atom], first=a, stop=b)
        )
        verdicts = monitor.run(letters, acting)
        unsafe = [v.unsafe & acting for v in verdicts if v.violations]
        findings = [
            self._finding(prop, row, verdict, violation)
            for row, verdict in zip(rows, verdicts, strict=True)
            for violation in verdict.violations
        ]
        return Verdict(
            property_id=prop.id,
            outcome=worst(verdicts),
            triggered=sum(not v.vacuous for v in verdicts),
            instances=len(rows),
            findings=tuple(sorted(findings, key=lambda f: (f.first, f.entities))),
            unsafe_steps=int(np.count_nonzero(np.any(unsafe, axis=0))) if unsafe else 0,
            acting_steps=int(np.count_nonzero(acting)),
            open=tuple(
                (row, v.open_since)
                for row, v in zip(rows, verdicts, strict=True)
                if v.open_since is not None
            ),
            formula=monitor.dfa.text,
        )

    def _vacuous(self, prop: Property, acting_steps: int) -> Verdict:
        """The verdict on a property that nothing in this scene is an instance of."""
        return Verdict(
            property_id=prop.id,
            outcome=PropertyOutcome(Outcome.SATISFIED, vacuous=True),
            triggered=0,
            instances=0,
            findings=(),
            unsafe_steps=0,
            acting_steps=acting_steps,
            open=(),
            formula=prop.dfa(self._profile, dt=self._recording.trace.dt).text,
        )

    def robustness(self, prop: Property) -> dict[tuple[str, ...], float]:
        """By how much the recording satisfies a property's formula, for each of its instances by
        the entities that it is about; negative where it violates it.

        In the units of margins, at most :data:`MARGIN_BOUND` on either side. It is that of the
        formula on all of the recording: a deadline of the property beside it plays no part, and
        what is open at the end counts as never met.

        Raises:
            TraceError: as for :meth:`judge`.
        """
        formula, stand = prop.formula_of(self._profile), prop.clocks_stand(self._profile)
        acting = ~self._recording.steps.tail if stand else None
        found = {}
        for row in self._rows(prop):
            calls = zip(prop.atoms, prop.calls(row), strict=True)
            margins = {atom: self.view.margin(*call) for atom, call in calls}
            value = robustness(formula, margins, self._recording.trace.dt, acting)[0]
            found[row] = float(np.clip(value, -MARGIN_BOUND, MARGIN_BOUND))
        return found

    def _rows(self, prop: Property) -> tuple[tuple[str, ...], ...]:
        """The entities that each instance of a property is about; none where it ranges over what
        is in a scene, and nothing of the kind is.
        """
        rows = prop.rows(self._binding)
        if missing := self._recording.episode.unobserved if not rows else None:
            raise TraceError(
                f"it ranges over {prop.members}, and the recording has no "
                f"{', '.join(sorted(missing))}"
            )
        if not rows and not prop.may_lack_instances(self._binding):
            raise TraceError(f"{prop.id}: no instance in {self._recording.episode.task}")
        return rows

    def _finding(
        self,
        prop: Property,
        row: tuple[str, ...],
        verdict: InstanceVerdict,
        violation: Violation,
    ) -> Finding:
        calls = dict(zip(prop.atoms, prop.calls(row), strict=True))
        # The excerpt shows values that decided nothing, too.
        values = np.stack([self.view(*call) for call in calls.values()], axis=1)
        dfa = prop.dfa(self._profile, dt=self._recording.trace.dt)
        reasons = explain(dfa, values, verdict, violation)
        began = min((d.step for d in reasons.deciding), default=violation.first)
        last = {d.atom for d in reasons.deciding if d.step == violation.first}
        evidence = self._measured(calls, last, violation.first)
        if began < violation.first:
            opening = {d.atom for d in reasons.deciding if d.step == began and d.value}
            evidence += [f"step {began}: {x}" for x in self._measured(calls, opening, began)]
        opened = reasons.opened_at
        excess = self._excess(calls.values(), opened, violation.last)
        found = Occurrence(row, dfa, verdict.states, opened, violation, excess)
        return Finding(
            entities=row,
            first=violation.first,
            last=violation.last,
            duration_s=violation.duration_s,
            reason=AT_END if violation.at_end else violation.reason,
            proof=reasons.format(),
            evidence=tuple(evidence),
            severity=measure(self.view, prop, found),
            cost=violation_cost(
                prop.cost,
                violation.first,
                violation.last,
                int(np.count_nonzero(~self._recording.steps.tail)),
                self._recording.trace.dt,
            ),
            excess=excess,
            opened=opened,
            values=dict(zip(calls, values.T, strict=True)),
        )

    def _excess(self, calls: Iterable[tuple[str, ...]], first: int, last: int) -> Excess | None:
        """The hardest contact within some steps that is beyond its limit."""
        known = [self.view.excess(name, tuple(rest), first, last) for name, *rest in calls]
        return hardest(filter(None, known), self.view.parameters[FORCE_LIMIT.name])

    def _measured(
        self, calls: Mapping[str, tuple[str, ...]], atoms: Collection[str], step: int
    ) -> list[str]:
        """The evidence of some atoms at a step, in words."""
        wanted = [call for atom, call in calls.items() if atom in atoms]
        return [x for name, *rest in wanted for x in self.view.evidence(name, tuple(rest), step)]
