"""The laws in pytest's tree: each (proposition, law) is an item."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pytest_safemanip.errors import first_line, printable
from pytest_safemanip.fuzz.rendering import table
from pytest_safemanip.fuzz.search import Counterexample, find_counterexample
from pytest_safemanip.fuzz.trial import LawBroken
from pytest_safemanip.plugin.longrepr import to_longrepr
from pytest_safemanip.report.failure import user_traceback
from pytest_safemanip.report.numbers import counted
from pytest_safemanip.run.cases import SUITE
from pytest_safemanip.run.fuzz_plan import FuzzPlan, LawCase
from pytest_safemanip.run.invocation import Invocation
from pytest_safemanip.trace import files


class FuzzHeader:
    """Says what is about to be done."""

    def __init__(self, plan: FuzzPlan) -> None:
        self._plan = plan

    def pytest_report_header(self) -> str:
        """One line."""
        plan = self._plan
        names = {case.proposition.name for case in plan.cases}
        many = "as many as the profile says" if plan.examples is None else str(plan.examples)
        laws, owners = counted(len(plan.cases), "law"), counted(len(names), "proposition")
        return f"safemanip: {laws} of {owners}, examples of each: {many}"


class LawSuite(pytest.Collector):
    """The laws: there is no file behind them.

    Args:
        plan: what there is to do.
        invocation: what paths and commands in messages refer to.
    """

    def __init__(self, *, plan: FuzzPlan, invocation: Invocation, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.plan, self.invocation = plan, invocation

    def collect(self) -> Iterator[LawItem]:
        """One item for each law of each proposition."""
        for case in self.plan.cases:
            item: LawItem = LawItem.from_parent(
                self, name=case.name, nodeid=case.node_id, case=case
            )
            item.add_marker(SUITE)
            yield item


class LawFailure(AssertionError):
    """A law is broken; with the counterexample."""

    def __init__(self, line: str, found: Counterexample) -> None:
        super().__init__(line)
        self.found = found


class LawItem(pytest.Item):
    """One law of one proposition."""

    def __init__(self, *, case: LawCase, parent: LawSuite, **arguments: Any) -> None:
        super().__init__(parent=parent, **arguments)
        self._case, self._plan, self._invocation = case, parent.plan, parent.invocation

    @property
    def _file(self) -> Path:
        """Where a counterexample is kept."""
        return self._plan.out / f"{self._case.proposition.name}-{self._case.law.name}.rollout"

    def runtest(self) -> None:
        """Look for a recording that breaks the law.

        Raises:
            LawFailure: if there is one.
        """
        proposition, law, plan = self._case.proposition, self._case.law, self._plan
        found = find_counterexample(
            proposition, law, plan.catalogue, plan.parameters, plan.examples
        )
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
        words = [f"law {self._case.law.name}: {self._case.law.says}", line, ""]
        words += table(found.recording, values, step)
        if broken is None:
            words += ["", user_traceback(found.error)]
        words += ["", f"recording       {self._invocation.relative_path(self._file)}"]
        words += [f"reproduce with  {self._invocation.reproduce(self.nodeid)}"]
        return to_longrepr("\n".join(words), line, self._source(), self.config.option.tbstyle)

    def reportinfo(self) -> tuple[Path, None, str]:
        """The heading."""
        heading = f"fuzz / {self._case.proposition.name} / {self._case.law.name}"
        return self.config.rootpath / SUITE, None, heading

    def _headline(self, found: Counterexample) -> str:
        error, name = found.error, self._case.proposition.name
        if not isinstance(error, LawBroken):
            return printable(f"{name} raises {first_line(error)}")
        when = "" if error.step is None else f" at step {error.step}"
        return f"{name}({', '.join(error.arguments)}){when}: {error}"

    def _source(self) -> Path:
        """The file of the definition."""
        try:
            path = Path(inspect.getfile(inspect.unwrap(self._case.proposition.evaluate)))
        except TypeError:
            return self.config.rootpath
        return self._invocation.relative_path(path)
