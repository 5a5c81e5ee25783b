"""The suite's nodes in pytest's tree: each case is an item."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip.errors import RolloutError, SafemanipError
from pytest_safemanip.plugin.longrepr import to_longrepr
from pytest_safemanip.plugin.markers import CaseMarkers
from pytest_safemanip.report.counterexample import counterexample, headline, truncation, unresolved
from pytest_safemanip.report.junit import case_properties, verdict_properties
from pytest_safemanip.run.cases import SUITE, Case
from pytest_safemanip.run.early_stopping import EarlyStopping
from pytest_safemanip.run.invocation import Invocation, look_at
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.results import CaseData, error_data, judged_data, skipped_data
from pytest_safemanip.run.session import SafetySession

UNRESOLVED_REASON = "unresolved: an obligation was still pending"
VACUOUS_REASON = "never triggered"
"""Why an item is skipped whose property is neither violated nor satisfied."""


class SafetyViolation(AssertionError):
    """A property is violated, or counts as violated by the user's choice. One line."""


class Suite(pytest.Collector):
    """The safety suite, with what its cases share: there is no file behind it.

    Args:
        plan: what there is to do.
        markers: those of the cases.
        rollouts: runs and judges the rollouts.
        stopping: knows which rollouts are still needed; None if all are run.
        invocation: what paths and commands in messages refer to.
    """

    def __init__(
        self,
        *,
        plan: Plan,
        markers: CaseMarkers,
        rollouts: SafetySession,
        stopping: EarlyStopping | None,
        invocation: Invocation,
        **arguments: Any,
    ) -> None:
        super().__init__(**arguments)
        self.plan, self.rollouts = plan, rollouts
        self._markers = markers
        self.stopping, self.invocation = stopping, invocation

    def collect(self) -> Iterator[SafetyItem]:
        """One item per case, those of a rollout next to each other."""
        for case in self.plan.cases:
            item: SafetyItem = SafetyItem.from_parent(
                self, name=case.name, nodeid=case.node_id, case=case
            )
            for marker in self._markers.of(case):
                item.add_marker(marker)
            yield item


class SafetyItem(pytest.Item):
    """One property of one rollout.

    The rollout and its judgement are the set-up: what goes wrong there is an error, not a failure.
    """

    def __init__(self, *, case: Case, parent: Suite, **arguments: Any) -> None:
        super().__init__(parent=parent, **arguments)
        self.case = case
        self._suite = parent
        self.data: CaseData | None = None
        self.property = parent.plan.properties[case.property_id]

    @property
    def place(self) -> Path:
        """The file of the property, as the user would type it."""
        return self._suite.invocation.relative_path(self.property.path)

    def setup(self) -> None:
        """Get the rollout and its verdict.

        Raises:
            SafemanipError: if there is none.
        """
        task = self._suite.plan.tasks[self.case.task]
        self.user_properties += case_properties(self.case, task, self.property)
        stopping = self._suite.stopping
        if stopping is not None and not stopping.needed(self.case):
            self.data = skipped_data(self.case)
            pytest.skip("skipped by early stopping: the gates are decided")
        try:
            self._rollout = self._suite.rollouts.evaluate(self.case)
            self._verdict = self._rollout.verdict(self.case.property_id)
        except Exception as error:
            text = f"{type(error).__name__}: {error}"
            blames_infrastructure = isinstance(error, SafemanipError) and error.infrastructure
            restarts = error.restarts if isinstance(error, RolloutError) else 0
            self._found(error_data(self.case, text, blames_infrastructure, restarts))
            raise
        recording, path = self._rollout.recording, self._rollout.path
        reused = self._rollout.reused
        self._found(judged_data(self.case, self.property, self._verdict, recording, path, reused))
        shown = self._suite.invocation.relative_path(path)
        self.user_properties += verdict_properties(self._verdict, recording, shown)

    def runtest(self) -> None:
        """Turn the verdict into what pytest knows.

        Raises:
            SafetyViolation: if the property is violated.
        """
        settings, verdict = self._suite.plan.settings, self._verdict
        match verdict.outcome.label:
            case "VIOLATED":
                line = headline(verdict, self._rollout.recording)
                if settings.violations == "xfail":
                    self.add_marker(pytest.mark.xfail(raises=SafetyViolation, reason=line))
                raise SafetyViolation(line)
            case "UNRESOLVED":
                if settings.unresolved == "fail":
                    recording = self._rollout.recording
                    raise SafetyViolation(unresolved(verdict, recording))
                # The same for all rollouts: pytest folds skips by their reason.
                truncated = truncation(self._rollout.recording)
                pytest.skip(f"{self.case.property_id}: {UNRESOLVED_REASON}{truncated}")
            case "VACUOUS" if settings.vacuous == "skip":
                pytest.skip(f"{self.case.property_id}: {VACUOUS_REASON}")

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """The counterexample instead of a traceback."""
        if not isinstance(excinfo.value, SafetyViolation):
            return super().repr_failure(excinfo, style)
        style = self.config.option.tbstyle
        line = str(excinfo.value)
        text = line
        if self._verdict.findings:
            invocation = self._suite.invocation
            path = invocation.relative_path(self._rollout.path)
            text = counterexample(
                self.property,
                self._verdict,
                self._rollout.recording,
                path,
                look_at("replay", str(path), invocation.options),
                invocation.reproduce(self.nodeid),
                brief=style == "short",
            )
        return to_longrepr(text, line, self.place, style)

    def reportinfo(self) -> tuple[Path, None, str]:
        """The heading; there is no file and no line that the case stands in."""
        return self.config.rootpath / SUITE, None, self.case.heading

    def _found(self, data: CaseData) -> None:
        self.data = data
        if self._suite.stopping is not None:
            self._suite.stopping.note(data)
