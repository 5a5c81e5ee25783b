"""The laws in pytest's tree: each (proposition, law) is an item."""

from __future__ import annotations

import inspect
import shlex
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip.cases import SUITE
from pytest_safemanip.errors import ConfigError, SafemanipError, did_you_mean
from pytest_safemanip.fuzz.hunt import Counterexample, hunt
from pytest_safemanip.fuzz.laws import Law, laws_of
from pytest_safemanip.fuzz.showing import table
from pytest_safemanip.fuzz.trial import LawBroken, calls, shortened
from pytest_safemanip.propositions.binding import Binding
from pytest_safemanip.propositions.catalogue import Catalogue
from pytest_safemanip.propositions.definition import Parameters, Proposition
from pytest_safemanip.report import failure
from pytest_safemanip.report.numbers import counted
from pytest_safemanip.run import shown
from pytest_safemanip.settings import Settings
from pytest_safemanip.trace import files


@dataclass(frozen=True)
class Trying:
    """A law to try on a proposition.

    Attributes:
        proposition: what is tried.
        law: what it has to obey.
    """

    proposition: Proposition
    law: Law

    @property
    def name(self) -> str:
        """Name of the test item."""
        return f"fuzz[{self.proposition.name}-{self.law.name}]"

    @property
    def node_id(self) -> str:
        """Node id of the test item."""
        return f"{SUITE}::{self.name}"


@dataclass(frozen=True)
class FuzzPlan:
    """All laws of all propositions, ready to be tried.

    Attributes:
        trials: in the order in which they run.
        catalogue: the propositions.
        parameters: values of their parameters, with short windows.
        examples: recordings for each; None for what Hypothesis's profile says.
        out: folder for recordings that break a law.
        command: the beginning of the command that runs one of them again.
    """

    trials: tuple[Trying, ...]
    catalogue: Catalogue
    parameters: Parameters
    examples: int | None
    out: Path
    command: str

    def header(self) -> str:
        """What is about to be done, in one line."""
        names = {trial.proposition.name for trial in self.trials}
        many = "as many as the profile says" if self.examples is None else str(self.examples)
        laws, owners = counted(len(self.trials), "law"), counted(len(names), "proposition")
        return f"safemanip: {laws} of {owners}, examples of each: {many}"


def make_fuzz_plan(
    settings: Settings, added: Sequence[Proposition], selected: Sequence[str], command: str
) -> FuzzPlan:
    """Lay out the laws.

    Args:
        settings: what was asked for.
        added: the user's propositions.
        selected: node ids on the command line; without any, all.
        command: the beginning of the command that runs one of them again.

    Raises:
        ConfigError: if an id names none, or a proposition cannot be tried.
    """
    catalogue = Catalogue(added)
    for proposition in catalogue.values():
        calls(proposition, Binding())
    every = [Trying(p, law) for p in catalogue.values() for law in laws_of(p)]
    known = {trial.node_id for trial in every}
    for text in selected:
        if text not in known:
            raise ConfigError(f"not found: {text}; {did_you_mean(text, known)}")
    chosen = [trial for trial in every if not selected or trial.node_id in selected]
    return FuzzPlan(
        trials=tuple(chosen),
        catalogue=catalogue,
        parameters=shortened(catalogue, settings.params),
        examples=settings.fuzz_examples,
        out=settings.out / "fuzz",
        command=command,
    )


class FuzzHeader:
    """Says what is about to be done."""

    def __init__(self, plan: FuzzPlan) -> None:
        self._plan = plan

    def pytest_report_header(self) -> str:
        """One line."""
        return self._plan.header()


class LawSuite(pytest.Collector):
    """The laws: there is no file behind them."""

    plan: FuzzPlan

    def collect(self) -> Iterator[LawItem]:
        """One item for each law of each proposition."""
        for trial in self.plan.trials:
            yield LawItem.from_parent(self, name=trial.name, nodeid=trial.node_id, trial=trial)


def make_law_suite(session: pytest.Session, plan: FuzzPlan) -> LawSuite:
    """The suite of a plan."""
    suite: LawSuite = LawSuite.from_parent(session, name=SUITE, nodeid=SUITE)
    suite.plan = plan
    return suite


class LawFailure(SafemanipError):
    """A law is broken; with the counterexample."""

    def __init__(self, line: str, found: Counterexample) -> None:
        super().__init__(line)
        self.found = found


class LawItem(pytest.Item):
    """One law of one proposition."""

    def __init__(self, *, trial: Trying, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._trial = trial
        self._plan: FuzzPlan = self.parent.plan  # type: ignore[union-attr]

    @property
    def _file(self) -> Path:
        """Where a counterexample is kept."""
        return self._plan.out / f"{self._trial.proposition.name}-{self._trial.law.name}.rollout"

    def runtest(self) -> None:
        """Look for a recording that breaks the law.

        Raises:
            LawFailure: if there is one.
        """
        proposition, law, plan = self._trial.proposition, self._trial.law, self._plan
        found = hunt(proposition, law, plan.catalogue, plan.parameters, plan.examples)
        if found is None:
            self._file.unlink(missing_ok=True)
            return
        files.save(found.recording, self._file)
        raise LawFailure(self._headline(found), found)

    def repr_failure(self, excinfo: Any, style: Any = None) -> Any:
        """The law, and the recording that breaks it as a table."""
        if not isinstance(excinfo.value, LawFailure):
            return super().repr_failure(excinfo, style)
        found, line = excinfo.value.found, str(excinfo.value)
        broken = found.error if isinstance(found.error, LawBroken) else None
        values, step = (broken.values, broken.step) if broken else (None, None)
        words = [f"law {self._trial.law.name}: {self._trial.law.says}", line, ""]
        words += table(found.recording, values, step)
        if broken is None:
            trace = traceback.TracebackException.from_exception(found.error)
            trace.__notes__ = None  # Hypothesis prints the recording, whole
            words += ["", "".join(trace.format())[-failure.MAX_TRACEBACK :].rstrip()]
        words += ["", f"recording  {shown(self._file, self.config.invocation_params.dir)}"]
        words += [f"again      {self._plan.command} {shlex.quote(self.nodeid)}"]
        return failure.shown("\n".join(words), line, self._source())

    def reportinfo(self) -> tuple[Path, None, str]:
        """The heading."""
        heading = f"fuzz / {self._trial.proposition.name} / {self._trial.law.name}"
        return self.config.rootpath / SUITE, None, heading

    def _headline(self, found: Counterexample) -> str:
        error, name = found.error, self._trial.proposition.name
        if not isinstance(error, LawBroken):
            return f"{name} raises {type(error).__name__}: {error}"
        when = "" if error.step is None else f" at step {error.step}"
        return f"{name}({', '.join(error.arguments)}){when}: {error}"

    def _source(self) -> Path:
        """The file of the definition."""
        try:
            return Path(inspect.getfile(inspect.unwrap(self._trial.proposition.evaluate)))
        except TypeError:
            return self.config.rootpath
