"""What pytest's own JUnit file lacks: attachments, and a size that GitLab takes."""

from __future__ import annotations

import os
from collections.abc import Generator
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from _pytest.junitxml import LogXML, xml_key

from pytest_safemanip.plugin.reports.attachments import KEY
from pytest_safemanip.report.ci.places import source_root
from pytest_safemanip.report.junit import MAX_BYTES, attachment_lines, trim
from pytest_safemanip.report.numbers import counted

SHARED = {"system-out": "stdout", "out-err": "stdout", "all": "stdout", "log": "log"}
"""What pytest writes into the one ``system-out`` of a case, by its ini key ``junit_logging``."""


class JUnit:
    """Adds to the file while pytest writes it, and shortens it when it has.

    Attributes:
        lines: what there is to say about it at the end.
    """

    def __init__(self) -> None:
        self._files: dict[str, list[str]] = {}
        self.lines: list[str] = []

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> Generator[None, None, None]:
        """Add the attachments of a case, in its last phase."""
        if found := getattr(report, KEY, None):
            self._files[report.nodeid] = found
        files = self._files.pop(report.nodeid, []) if report.when == "teardown" else []
        lines = attachment_lines(map(Path, files), source_root())
        if not lines or self._xml is None:
            yield
            return
        text = "\n".join(lines)
        kind = SHARED.get(self._xml.logging) if self._xml.log_passing_tests else None
        if kind is None:
            element = ET.Element("system-out")
            element.text = text
            self._xml.node_reporter(report).append(element)
            yield
            return
        # A second element would hide the first from some readers.
        sections = report.sections
        report.sections = [*sections, (f"Captured {kind} call", text)]
        try:
            yield
        finally:
            report.sections = sections

    def pytest_sessionstart(self, session: pytest.Session) -> None:
        """Find pytest's writer."""
        self._xml: LogXML | None = session.config.stash.get(xml_key, None)

    @pytest.hookimpl(wrapper=True, trylast=True)
    def pytest_sessionfinish(self) -> Generator[None, None, None]:
        """Shorten the file, when pytest has written it."""
        yield
        if self._xml is None:
            return
        path = Path(self._xml.logfile)
        if path.is_file() and path.stat().st_size > MAX_BYTES:
            shortened = trim(path, MAX_BYTES)
            self.lines.append(
                f"{os.path.relpath(path)}: over {MAX_BYTES // 10**6} MB, which GitLab refuses: "
                f"{counted(shortened, 'case')} shortened; summary.json has all"
            )
