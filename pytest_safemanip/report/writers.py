"""The reports that are written beside `summary.json`, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
