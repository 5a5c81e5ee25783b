"""Searches and kept failures in pytest's tree: each search for a violation is an item."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip.plugin.items import UNRESOLVED_REASON, VACUOUS_REASON, SafetyViolation
from pytest_safemanip.plugin.longrepr import to_longrepr
from pytest_safemanip.plugin.searching.telling import Telling
from pytest_safemanip.report.counterexample import counterexample, headline, unresolved
from pytest_safemanip.report.searching import SearchData, told_again, undecided
from pytest_safemanip.run.cases import SUITE
from pytest_safemanip.run.invocation import Invocation, look_at
from pytest_safemanip.run.option_values import told_seeds
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.searching.plan import RegressionCase, SearchCase, SearchPlan
from pytest_safemanip.run.searching.running import Searched
from pytest_safemanip.run.session import SafetySession
from pytest_safemanip.spec.properties import Property
from pytest_safemanip.trace import files


class SearchSuite(pytest.Collector):
    """The searches and the kept failures: there is no file behind them.

    Args:
        plan: the run.
        searches: what there is to do.
        rollouts: runs the kept failures.
        telling: tells what searches found.
    """

    def __init__(
        self,
        *,
        plan: Plan,
        searches: SearchPlan,
        rollouts: SafetySession,
        telling: Telling,
        **arguments: Any,
    ) -> None:
        super().__init__(**arguments)
        self.plan, self.searches, self.rollouts = plan, searches, rollouts
        self.telling, self.invocation = telling, telling.invocation

    def collect(self) -> Iterator[pytest.Item]:
        """Kept failures first: they are quickly tried."""
        for kept in self.searches.regressions:
            regression: RegressionItem = RegressionItem.from_parent(
                self, name=kept.name, nodeid=kept.node_id, kept=kept
            )
            yield regression
        for case in self.searches.cases:
            item: SearchItem = SearchItem.from_parent(
                self, name=case.name, nodeid=case.node_id, case=case
            )
            yield item


class VariedItem(pytest.Item):
    """What searches and kept failures have in common.

    Attributes:
        data: what the search found out; None before, and of kept failures.
    """

    heading: str
    policy: str

    def __init__(self, *, property_id: str, parent: SearchSuite, **arguments: Any) -> None:
        super().__init__(parent=parent, **arguments)
        self.suite = parent
        self.property: Property = parent.plan.properties[property_id]
        self.data: SearchData | None = None
        self.add_marker(SUITE)

    @property
    def place(self) -> Path:
        """The file of the property, as the user would type it."""
        return self.suite.invocation.relative_path(self.property.path)

    def reportinfo(self) -> tuple[Path, None, str]:
        """The heading; there is no file and no line that it stands in."""
        return self.config.rootpath / SUITE, None, self.heading

    def explained(self, line: str, recording: Path) -> str:
        """The counterexample below what it takes."""
        loaded = files.load(recording)
        task = loaded.episode.task
        verdict = self.suite.rollouts.judge(loaded, task).judge(self.property)
        options = self.suite.invocation.options
        shown = self.suite.invocation.relative_path(recording)
        chosen = [] if any(o.startswith("--safemanip-policy") for o in options) else [self.policy]
        text = counterexample(
            self.property,
            verdict,
            loaded,
            shown,
            look_at("replay", str(shown), options),
            Invocation(
                self.suite.invocation.folder,
                (*options, *(f"--safemanip-policy={name}" for name in chosen), *self.wanted),
            ).reproduce(self.nodeid),
            brief=self.config.option.tbstyle == "short",
        )
        return f"{line}\n\n{text}"

    wanted: tuple[str, ...] = ()


class SearchItem(VariedItem):
    """The search for a violation of one property. That it cannot be run is an error."""

    def __init__(self, *, case: SearchCase, parent: SearchSuite, **arguments: Any) -> None:
        super().__init__(property_id=case.property_id, parent=parent, **arguments)
        self.case, self.heading, self.policy = case, case.heading, case.policy
        effort = parent.plan.settings.search
        seeds = told_seeds(parent.searches.seeds)
        self.wanted = (f"--safemanip-search={effort}", f"--safemanip-seeds={seeds}")

    def setup(self) -> None:
        """Run the search, or take what it found from a case before this one.

        Raises:
            SafemanipError: if not even the episode as it is can be run, or most with a change fail.
        """
        self._recording: Path | None = None
        found = self.suite.telling.running.get(self.case, self._keep)
        self.data, self._recording = self.suite.telling.tell(self.case, found)
        found.check(self.case.property_id)

    def _keep(self, found: Searched) -> None:
        """Keep what was found as soon as it is."""
        self.suite.telling.keeping.keep_all(self.case, found)

    def runtest(self) -> None:
        """Fail if there is a violation; skip if no rollout with a change says anything.

        Raises:
            SafetyViolation: with the sentence that says when.
        """
        if self.data is None:
            return
        if self.data["failure"] is not None:
            raise SafetyViolation(self.data["failure"]["sentence"])
        if not self.data["satisfied"]:
            pytest.skip(undecided(self.data))

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """The sentence and the counterexample instead of a traceback."""
        if not isinstance(excinfo.value, SafetyViolation) or self._recording is None:
            return super().repr_failure(excinfo, style)
        style, line = self.config.option.tbstyle, str(excinfo.value)
        text = line if style == "line" else self.explained(line, self._recording)
        return to_longrepr(text, line, self.place, style)


class RegressionItem(VariedItem):
    """A failure that a search kept, tried again."""

    def __init__(self, *, kept: RegressionCase, parent: SearchSuite, **arguments: Any) -> None:
        super().__init__(property_id=kept.regression.property_id, parent=parent, **arguments)
        self.kept, self.heading, self.policy = kept, kept.heading, kept.policy

    @property
    def place(self) -> Path:
        """The file of the failure."""
        return self.suite.invocation.relative_path(self.kept.regression.path)

    def setup(self) -> None:
        """Run its rollout, unless an earlier run has.

        Raises:
            SafemanipError: if that fails.
        """
        self._rollout = self.suite.telling.keeping.again(self.kept)
        self._verdict = self._rollout.verdict(self.property.id)

    def runtest(self) -> None:
        """Fail if it still fails; skip if nothing shows that it does not.

        Raises:
            SafetyViolation: with the sentence that says when.
        """
        match self._verdict.outcome.label:
            case "VIOLATED":
                recording = self._rollout.recording
                told = told_again(self.kept.regression, recording.scene)
                raise SafetyViolation(f"still {told}: {headline(self._verdict, recording)}")
            case "UNRESOLVED":
                if self.suite.plan.settings.unresolved == "fail":
                    recording = self._rollout.recording
                    raise SafetyViolation(unresolved(self._verdict, recording))
                pytest.skip(f"{self.property.id}: {UNRESOLVED_REASON}")
            case "VACUOUS":
                pytest.skip(f"{self.property.id}: {VACUOUS_REASON}")

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """The sentence and the counterexample instead of a traceback."""
        if not isinstance(excinfo.value, SafetyViolation):
            return super().repr_failure(excinfo, style)
        style, line = self.config.option.tbstyle, str(excinfo.value)
        text = line if style == "line" else self.explained(line, self._rollout.path)
        return to_longrepr(text, line, self.place, style)
