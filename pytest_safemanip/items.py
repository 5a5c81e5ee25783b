"""The suite's nodes in pytest's tree: each case is an item."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip.cases import SUITE, Case
from pytest_safemanip.errors import SafemanipError
from pytest_safemanip.report import failure
from pytest_safemanip.report.counterexample import counterexample, headline
from pytest_safemanip.report.junit import case_properties, verdict_properties
from pytest_safemanip.report.results import CaseData, error_data, judged_data, saved_data
from pytest_safemanip.run import Run


class SafetyViolation(SafemanipError):
    """A property is violated, or counts as violated by the user's choice. One line."""


class Suite(pytest.Collector):
    """The safety suite: there is no file behind it."""

    run: Run

    def collect(self) -> Iterator[SafetyItem]:
        """One item per case, those of a rollout next to each other."""
        for case in self.run.plan.cases:
            yield SafetyItem.from_parent(self, name=case.name, nodeid=case.node_id, case=case)


def make_suite(session: pytest.Session, run: Run) -> Suite:
    """The suite of a run."""
    suite: Suite = Suite.from_parent(session, name=SUITE, nodeid=SUITE)
    suite.run = run
    return suite


class SafetyItem(pytest.Item):
    """One property of one rollout.

    The rollout and its judgement are the set-up: what goes wrong there is an error, not a failure.
    """

    def __init__(self, *, case: Case, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.case = case
        self.run: Run = self.parent.run  # type: ignore[union-attr]
        self.data: CaseData | None = None
        plan = self.run.plan
        self._property = plan.properties[case.property_id]
        self.user_properties += case_properties(case, plan.tasks[case.task], self._property)

    @property
    def place(self) -> Path:
        """The file of the property."""
        path: Path = self._property.path
        return path

    def setup(self) -> None:
        """Get the rollout and its verdict.

        Raises:
            SafemanipError: if there is none.
        """
        stopping = self.run.stopping
        if stopping is not None and not stopping.needed(self.case):
            self.data = saved_data(self.case)
            pytest.skip("not needed: the gates are decided")
        try:
            self._judged = self.run.session.judged(self.case)
            self._verdict = self.run.session.verdict(self.case)
        except Exception as error:
            self._found(error_data(self.case, f"{type(error).__name__}: {error}"))
            raise
        recording, path = self._judged.recording, self._judged.path
        self._found(judged_data(self.case, self._property, self._verdict, recording, path))
        self.user_properties += verdict_properties(self._verdict, recording, path)

    def runtest(self) -> None:
        """Turn the verdict into what pytest knows.

        Raises:
            SafetyViolation: if the property is violated.
        """
        settings, verdict = self.run.plan.settings, self._verdict
        match verdict.outcome.label:
            case "VIOLATED":
                line = headline(verdict, self._judged.recording)
                if settings.violations == "xfail":
                    self.add_marker(pytest.mark.xfail(raises=SafetyViolation, reason=line))
                raise SafetyViolation(line)
            case "UNRESOLVED":
                reason = self._unresolved()
                if settings.unresolved == "fail":
                    raise SafetyViolation(reason)
                pytest.skip(reason)
            case "VACUOUS" if settings.vacuous == "skip":
                pytest.skip(f"{self.case.property_id}: never triggered")

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """The counterexample instead of a traceback."""
        if not isinstance(excinfo.value, SafetyViolation):
            return super().repr_failure(excinfo, style)
        line = str(excinfo.value)
        text = line
        if self._verdict.findings:
            again = self.run.again(self.case)
            recording, path = self._judged.recording, self.run.shown(self._judged.path)
            text = counterexample(self._property, self._verdict, recording, path, again)
        return failure.shown(text, line, self._property.path)

    def reportinfo(self) -> tuple[Path, None, str]:
        """The heading; there is no file and no line that the case stands in."""
        case = self.case
        heading = f"{case.task} / {case.policy} / {case.property_id} / seed {case.seed}"
        return self.config.rootpath / SUITE, None, heading

    def _found(self, data: CaseData) -> None:
        self.data = data
        if self.run.stopping is not None:
            self.run.stopping.note(data)

    def _unresolved(self) -> str:
        entities, since = self._verdict.open[0]
        about = f" for {', '.join(entities)}" if entities else ""
        return (
            f"{self.case.property_id}: unresolved{about}: owed since step {since}, "
            "the rollout ended before it was due"
        )
