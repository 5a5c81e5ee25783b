"""The reports that are written beside `summary.json`, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import cast

from pytest_safemanip.errors import ConfigError, did_you_mean
from pytest_safemanip.run.definitions import Definitions

Writer = Callable[..., Path]
"""From the output folder of a run, for some also its definitions, to the file that was written."""
WRITERS: Mapping[str, str] = {
    "html": "pytest_safemanip.report.page.writing:write_page",
    "markdown": "pytest_safemanip.report.ci.markdown:write_markdown",
    "sarif": "pytest_safemanip.report.ci.sarif:write_sarif",
}
"""Where each is, as ``module:function``; imported when it is written."""
FILES: Mapping[str, str] = {
    "html": "report.html",
    "markdown": "summary.md",
    "sarif": "summary.sarif",
}
"""What each writes into the output folder."""
JUDGING = ("html",)
"""Those that judge recordings again, and are given the definitions, the user's among them."""


def parse_reports(text: str) -> tuple[str, ...]:
    """Distinct names of reports from a list with commas.

    Raises:
        ConfigError: if there is no such report.
    """
    names = tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))
    for name in names:
        if name not in WRITERS:
            hint = did_you_mean(name, WRITERS)
            raise ConfigError(f"--safemanip-report: unknown report {name!r}; {hint}")
    return names


def stale_line(folder: Path, wanted: Sequence[str]) -> str:
    """That reports of an earlier run are still beside the summary; empty if there are none.

    Args:
        folder: the output folder of a run.
        wanted: names of the reports that this run was to write.
    """
    stale = [name for name in FILES if name not in wanted and (folder / FILES[name]).exists()]
    if not stale:
        return ""
    found = ", ".join(FILES[name] for name in stale)
    again = "writes it again" if len(stale) == 1 else "writes them again"
    return f"of an earlier run: {found}; --safemanip-report={','.join(stale)} {again}"


def write_report(name: str, folder: Path, definitions: Definitions) -> Path:
    """Write a report and return its file.

    Args:
        name: of the report, see :data:`WRITERS`.
        folder: the output folder of a run, with its `summary.json`.
        definitions: what the run was judged by.
    """
    module, function = WRITERS[name].split(":")
    writer = cast(Writer, getattr(import_module(module), function))
    return writer(folder, definitions) if name in JUDGING else writer(folder)
