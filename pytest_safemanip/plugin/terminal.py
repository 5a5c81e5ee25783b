"""What the main process reports: the header, the summary, `summary.json`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import pytest

from pytest_safemanip.metrics.comparability import not_comparable
from pytest_safemanip.metrics.groups import Metrics, measure_each
from pytest_safemanip.metrics.records import RolloutRecord
from pytest_safemanip.metrics.summaries import NAME, place_for
from pytest_safemanip.plugin.exit_status import explained
from pytest_safemanip.plugin.gate_reports import Gating
from pytest_safemanip.plugin.items import SafetyItem
from pytest_safemanip.plugin.reports.files import ReportFiles
from pytest_safemanip.plugin.reports.junit import JUnit
from pytest_safemanip.plugin.searching.reporting import SearchReporting
from pytest_safemanip.plugin.short_summary import first_words
from pytest_safemanip.report import document
from pytest_safemanip.report.header import header_lines, not_grounded_lines
from pytest_safemanip.report.numbers import counted
from pytest_safemanip.report.rulings import gate_rows, ruling_lines
from pytest_safemanip.report.table import brief_lines, summary_lines
from pytest_safemanip.run.cases import is_case_id, parse_node_id
from pytest_safemanip.run.invocation import Invocation
from pytest_safemanip.run.plan import Plan
from pytest_safemanip.run.results import Results
from pytest_safemanip.run.session import SafetySession
from pytest_safemanip.sim.backend import Provenance

_NO_TESTS = pytest.ExitCode.NO_TESTS_COLLECTED


class Reporting:
    """Collects the data of all test reports, from this process and from workers.

    Args:
        plan: the run.
        source: of the backend; None when recordings are judged or cases only listed.
        rollouts: knows which rollouts are recorded already.
        results: takes in what is found out.
        gating: decides on it; None without gates and without a baseline.
        invocation: what paths in messages refer to.
        files: writes the reports that are asked for, when the summary is there.
        junit: completes pytest's JUnit file; None where none is written.
        floor: the demonstrations that rates are shown beside.
        searching: knows what searches found; None without any.
    """

    def __init__(
        self,
        plan: Plan,
        source: Provenance | None,
        rollouts: SafetySession,
        results: Results,
        gating: Gating | None,
        invocation: Invocation,
        files: ReportFiles,
        junit: JUnit | None,
        floor: Sequence[RolloutRecord],
        searching: SearchReporting | None = None,
    ) -> None:
        self._plan, self._source, self._rollouts = plan, source, rollouts
        self._results, self._gating, self._invocation = results, gating, invocation
        self._path = plan.settings.out / NAME
        self._summarising = self._interrupted = False
        self._unwritten = ""
        self._files, self._junit, self._floor = files, junit, floor
        self._searching = searching

    def pytest_report_header(self) -> list[str]:
        """What is about to be done."""
        if not self._plan.cases and self._plan.settings.select:  # kept failures and searches alone
            return []
        lines = header_lines(self._plan, self._source)
        rollouts = {case.rollout for case in self._plan.cases}
        reused = self._reused(self._rollouts.reusable(), len(rollouts))
        lines += [f"safemanip: {line}" for line in reused]
        # Asked for a list of cases, one wants to know which are not on it.
        return lines + (not_grounded_lines(self._plan) if self._source is None else [])

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """What is left to run after deselection, without xdist."""
        self._results.expect(item.case for item in session.items if isinstance(item, SafetyItem))

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, ids: list[str]) -> None:
        """The same, as workers report it."""
        self._results.expect(parse_node_id(i) for i in ids if is_case_id(i))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take in a case."""
        data = getattr(report, "safemanip", None)
        if data is not None:
            self._results.add(data)

    def pytest_report_teststatus(self, report: pytest.TestReport, config: pytest.Config) -> Any:
        """Violations are failures with a name of their own."""
        data = getattr(report, "safemanip", None)
        if not data or not report.failed or hasattr(report, "wasxfail"):
            return None
        if report.when == "call":
            category, letter, word = "failed", "F", str(data["outcome"])
        else:
            category, letter = "error", "E"
            word = "INFRASTRUCTURE" if data.get("infrastructure") else "ERROR"
        if self._summarising:
            word = first_words(word, report, config)
        return category, letter, (word, {"red": True})

    def pytest_keyboard_interrupt(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        """Know that it was Ctrl-C that left cases out."""
        self._interrupted = excinfo.type is KeyboardInterrupt

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        """Write what is known, also after Ctrl-C."""
        shard = self._plan.settings.shard
        if shard is not None and not self._plan.cases and exitstatus == _NO_TESTS:
            session.exitstatus = pytest.ExitCode.OK  # the other machines have enough to do
        searches = self._searching.found if self._searching is not None else []
        begun = self._results.begun or shard is not None or bool(searches)
        if not session.config.option.collectonly and begun:
            found = document.summary(self._plan, self._results, self._metrics, self._floor)
            if searches:
                found["searches"] = searches
            found["run"] = self._invocation.to_json()
            ruling = self._gating.ruling if self._gating else None
            if ruling is not None:
                found["release"] = ruling.to_json()
            self._path = place_for(self._path.parent, found["cases"]["partial"])
            try:
                document.write(found, self._path)
            except OSError as error:
                self._unwritten = f" cannot be written ({error.strerror}), nor reports on it"
                session.exitstatus = session.exitstatus or pytest.ExitCode.TESTS_FAILED
            else:
                self._files.summary = self._path

    def pytest_terminal_summary(self, terminalreporter: Any, config: pytest.Config) -> None:
        """Show the metrics, and what they decide; in a few lines with ``-q``."""
        self._summarising = True
        verbosity = config.get_verbosity()
        if config.option.no_summary or verbosity < -1:
            return
        writer = config.get_terminal_writer()
        lines = self._brief() if verbosity < 0 else self._lines(config, writer.fullwidth)
        lines += explained(int(terminalreporter._session.exitstatus))
        if lines:
            terminalreporter.write_sep("=", "safety")
            for line in lines:
                terminalreporter.write_line(line)

    @cached_property
    def _metrics(self) -> dict[str, Metrics]:
        """Computed once, when everything has been run."""
        return measure_each(self._results.records)

    @property
    def _elsewhere(self) -> tuple[str, ...]:
        """The policies whose rollouts are on stand-in assets."""
        return not_comparable(self._results.records, self._results.provenance)

    def _reused(self, number: int, among: int) -> list[str]:
        """That verdicts are on rollouts of earlier runs, if some are."""
        place = self._invocation.relative_path(self._plan.settings.out)
        how = f"{number} of {counted(among, 'rollout')} reused from {place}"
        return [f"{how} (--safemanip-fresh runs them again)"] if number else []

    def _missing(self) -> list[str]:
        missing, expected = len(self._results.missing), len(self._results.expected)
        if not missing:
            return []
        goes_on = "; the same command goes on where this one stopped" if self._interrupted else ""
        return [f"{missing} of {expected} cases were not run{goes_on}"]

    def _brief(self) -> list[str]:
        """A line for each policy and each gate."""
        ruling = self._gating.ruling if self._gating else None
        records, elsewhere = self._results.records, self._elsewhere
        own = brief_lines(records, self._metrics, elsewhere) if self._results.begun else []
        decided = gate_rows(ruling, self._plan.settings.allow_standins) if ruling else []
        unwritten = [self._place()] if self._unwritten else []
        missing = self._missing() if own else []
        told = [*self._files.lines, *(self._junit.lines if self._junit else [])]
        return [*own, *missing, *decided, *unwritten, *told]

    def _lines(self, config: pytest.Config, width: int) -> list[str]:
        ruling = self._gating.ruling if self._gating else None
        standins = self._plan.settings.allow_standins
        decided = ["", *ruling_lines(ruling, standins, width)] if ruling else []
        if not self._results.begun:
            return decided[1:]
        missing = self._missing()
        skipped = len(self._results.skipped)
        return [
            *summary_lines(
                self._results.records,
                self._metrics,
                width,
                self._elsewhere,
                self._floor,
            ),
            *(["", *missing] if missing else []),
            *decided,
            *([f"  {counted(skipped, 'rollout')} skipped by early stopping"] if skipped else []),
            *self._undecided(),
            "",
            *self._hidden(config),
            *self._reused(self._results.reused, len(self._results.records)),
            self._place(),
            *self._files.lines,
            *(self._junit.lines if self._junit else []),
        ]

    def _undecided(self) -> list[str]:
        """Why a shard does not decide."""
        settings = self._plan.settings
        if settings.shard is None or not (settings.gates.gates or settings.baseline):
            return []
        return [
            f"shard {settings.shard} decides nothing: give the folders of all shards, and the "
            "gates, to safemanip report",
        ]

    def _place(self) -> str:
        """Where the summary is, and which one is still there."""
        place = f"summary: {self._invocation.relative_path(self._path)}"
        kept = f" ({NAME}, of all cases, is kept)"
        return place + (self._unwritten or (kept if self._path.name != NAME else ""))

    def _hidden(self, config: pytest.Config) -> list[str]:
        """How to see counterexamples that pytest does not show by itself."""
        violated = any(
            verdict.outcome == "VIOLATED"
            for record in self._results.records
            for verdict in record.properties.values()
        )
        if self._plan.settings.violations != "xfail" or config.option.xfail_tb or not violated:
            return []
        return ["violations are shown as xfailed: --xfail-tb prints their counterexamples"]
